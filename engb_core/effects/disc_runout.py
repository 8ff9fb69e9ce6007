"""Load modulated once per disc revolution."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import DISC_ANGLE, DISC_SPEED, Effect, LOAD, Parameter

TURNING = 0.2  # rad/s from which a disc turns: above the noise of its speed


@effect_function
def _load(parameters, state, sample):
    load = sample[LOAD]
    if load <= 0.0:
        return load
    contact = (load / parameters[5]) ** parameters[4]
    turn = sample[DISC_ANGLE] + parameters[1]
    wave = (math.sin(turn) + parameters[2] * math.sin(2.0 * turn)
            + parameters[3] * math.cos(2.0 * turn))
    if parameters[6] > 0.5:
        wave *= abs(math.tanh(sample[DISC_SPEED] / TURNING))
    return load + parameters[0] * contact * wave


EFFECT = Effect(
    id='disc_runout',
    title='Disc runout',
    parameters=(
        Parameter('amplitude', 'N·m', 0.0, 1e6, none=0.0, starts=(0.003,), form=0.06),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,), per_recording=True),
        Parameter('second_sine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('second_cosine', '-', -2.0, 2.0, starts=(0.0,)),
    ),
    stages={'load': _load},
    equation='T_L = T_L(θ) + amplitude · (T_L / reference)^exponent · sin(φ_disc + phase)',
    reference='Jacobsson, Proc. IMechE D 217 (2003): disc brake judder',
    statement=lambda p: (f"In contact the load is modulated by ±{p['amplitude'] * 1e3:.3g} "
                         'mN·m once per disc revolution (runout).'),
    reveals='disc_angle',
    constants=(('load_exponent', '-'), ('reference_load', 'N·m'), ('only_turning', '-')),
    set_constants=lambda scene: {'reference_load': max(0.5 * scene.largest_load, 1e-9)},
    # A force does not care how hard the pad presses, a displacement acts through the stiffness;
    # either may be averaged away where the disc stands.
    variants=tuple({'load_exponent': exponent, 'only_turning': only}
                   for exponent in (0.0, 0.3, 0.6, 1.0) for only in (0.0, 1.0)),
    applies=lambda scene: bool(scene.disc_speed_range) and scene.largest_load > 0,
)
