# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Load modulated once per disc revolution."""

import math

from engb_core.effects.base import DISC_ANGLE, DISC_SPEED, Effect, LOAD, Parameter
from engb_core.physics.compiled import compiled, effect_function, Numbers
from engb_core.physics.harmonics import wave

TURNING = 0.2  # rad/s from which a disc turns: above the noise of its speed


@compiled
def _modulation(parameters: Numbers, sample: Numbers) -> float:
    modulation = wave(sample[DISC_ANGLE] + parameters[1], parameters[2], parameters[3])
    if parameters[6] > 0.5:
        modulation *= abs(math.tanh(sample[DISC_SPEED] / TURNING))
    return parameters[0] * modulation


@effect_function
def _shift(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[5] < 0.5:
        return 0.0
    return _modulation(parameters, sample) / parameters[8]


@effect_function
def _load(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    load = sample[LOAD]
    if parameters[5] > 0.5 or load <= 0.0:
        return load
    half = parameters[4] * parameters[7]
    contact = load / (load + half) * (parameters[7] + half) / parameters[7]
    return load + contact * _modulation(parameters, sample)


EFFECT = Effect(
    id='disc_runout',
    title='Disc runout',
    parameters=(
        Parameter('amplitude', 'N·m', 0.0, 1e12, none=0.0, starts=(0.003,)),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,), per_recording=True, kind='phase'),
        Parameter('second_sine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('second_cosine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('half_load', '-', 1e-3, 10.0, starts=(0.1, 1.0), logarithmic=True,
                  default=0.1),
    ),
    stages={'shift': _shift, 'load': _load},
    equation='T_L = T_L(θ) + amplitude · T_L/(T_L + half) · sin(φ_disc + phase), a force; or '
             'T_L(θ + amplitude/slope · sin(φ_disc + phase)), a displacement',
    reference='Jacobsson, Proc. IMechE D 217 (2003): disc brake judder',
    statement=lambda p: (f"In contact the load is modulated by ±{p['amplitude'] * 1e3:.3g} "
                         'mN·m once per disc revolution (runout).'),
    reveals='disc_angle',
    picture='load_over_disc_angle',
    seen='The load swings once per turn of the disc.',
    confused='cogging, vibration from outside',
    measure='hold a force while the disc turns at two speeds',
    constants=(('displacement', '-'), ('only_turning', '-'), ('reference_load', 'N·m'),
               ('reference_slope', 'N·m/rad')),
    defaults={'displacement': 0.0, 'only_turning': 0.0, 'reference_load': 0.17,
              'reference_slope': 0.02},
    # The amplitude is that of a force at the highest load, and the root mean square over the
    # contact where a displacement acts through the load's slope.
    set_constants=lambda scene: {'reference_load': max(scene.largest_load, 1e-9),
                                 'reference_slope': max(scene.load_slope, 1e-9)},
    # Either may be averaged away where the disc stands.
    variants=tuple({'displacement': kind, 'only_turning': only}
                   for kind in (0.0, 1.0) for only in (0.0, 1.0)),
    applies=lambda scene: bool(scene.disc_speed_range) and scene.largest_load > 0,
)
