# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The current sensor has an offset: measured effort is not zero at zero torque."""

from engb_core.effects.base import Effect, EFFORT, Parameter
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return sample[EFFORT] - parameters[0]


EFFECT = Effect(
    id='torque_offset',
    title='Torque (current) offset',
    parameters=(Parameter('offset', 'N·m', -1e12, 1e12, none=0.0, starts=(0.005,)),),
    stages={'actuation': _actuation},
    equation='T_M = effort − offset',
    reference='contract, table 4; current sensor offset',
    statement=lambda p: ('The measured effort is '
                         f"{abs(p['offset']) * 1e3:.3g} mN·m too "
                         f"{'high' if p['offset'] > 0 else 'low'} everywhere, whatever the "
                         'motion (current sensor offset).'),
    reveals='position',
    picture='load_over_position',
    seen='Effort is off by one number, always.',
    confused='asymmetric friction',
    measure='stand still without load, then slow strokes both ways',
    number_only=True,
    not_in_file=True,
)
