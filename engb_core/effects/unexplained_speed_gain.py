# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Torque per effort that changes with speed; no cause is claimed."""

from engb_core.effects.base import Effect, EFFORT, Parameter, VELOCITY
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    speed = abs(sample[VELOCITY]) / parameters[2]
    change: float = parameters[0] * speed ** parameters[1]
    return sample[EFFORT] * (1.0 + change)


EFFECT = Effect(
    id='unexplained_speed_gain',
    title='Unexplained change of torque per effort with speed',
    parameters=(
        Parameter('relative_change', '-', -0.8, 2.0, none=0.0, starts=(-0.05,)),
        Parameter('power', '-', 0.3, 4.0, starts=(1.0, 2.0), logarithmic=True, kind='exponent'),
    ),
    stages={'actuation': _actuation},
    of_motion=True,
    proportional=lambda p: True,
    equation='T_M = effort · (1 + change · (|ω|/ω_max)^power)',
    reference='none: what is left; such are a field angle that lags, and a supply that sags',
    statement=lambda p: (
        f"The torque for a given effort changes by {p['relative_change'] * 100:+.1f} % up to the "
        'highest speed; no effect of the library does that.'),
    reveals='velocity',
    tells=lambda p: ('velocity', 'effort'),
    constants=(('highest_speed', 'rad/s'),),
    defaults={'highest_speed': 30.0},
    set_constants=lambda scene: {'highest_speed': scene.speed},
    unnamed=True,
)
