"""Torque per ampere that is periodic in the shaft angle."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, EFFORT, Parameter, POSITION


@effect_function
def _actuation(parameters, state, sample):
    return sample[EFFORT] * (
        1.0 + parameters[0] * math.sin(parameters[1] * sample[POSITION] + parameters[2]))


EFFECT = Effect(
    id='torque_ripple',
    title='Torque ripple',
    parameters=(
        Parameter('relative_amplitude', '-', 0.0, 0.9, none=0.0, starts=(0.02,)),
        Parameter('order', '1/rev', 0.05, 400.0, logarithmic=True),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0, 1.5708)),
    ),
    stages={'actuation': _actuation},
    equation='T_M = effort · (1 + a · sin(order · θ + phase))',
    reference='Mattavelli et al., IEEE Trans. Ind. Appl. 41 (2005) 1634',
    statement=lambda p: (
        f"The torque per ampere varies by ±{p['relative_amplitude'] * 100:.2g} % "
        f"{p['order']:.4g} times per motor revolution (torque ripple)."),
    reveals='motor_angle',
    applies=lambda scene: scene.joint_type == 'revolute',
)
