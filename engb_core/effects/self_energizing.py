"""The load changes while the disc turns: pad friction helps or hinders the wedge."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import DISC_SPEED, Effect, LOAD, Parameter


@effect_function
def _load(parameters, state, sample):
    turning = math.tanh(sample[DISC_SPEED] / 0.5)
    return sample[LOAD] * (1.0 + (parameters[0] - 1.0) * turning)


EFFECT = Effect(
    id='self_energizing',
    title='Self-energizing',
    parameters=(Parameter('load_ratio', '-', 0.05, 3.0, none=1.0, starts=(0.8,), form=0.04),),
    stages={'load': _load},
    equation='T_L = P · T_L(θ) while the disc turns, P = 1 − μ r/d',
    reference='chapter 5, equations (43), (44) corrected',
    statement=lambda p: ('While the disc turns the load torque is '
                         f"{p['load_ratio']:.3f} times that with the disc standing "
                         '(self-energizing).'),
    reveals='load',
    applies=lambda scene: bool(scene.disc_speed_range) and scene.largest_load > 0,
)
