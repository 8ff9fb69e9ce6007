# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The load changes while the disc turns: pad friction helps or hinders the wedge."""

from dataclasses import replace
import math

from engb_core.effects.base import DISC_SPEED, Effect, LOAD, Parameter, Scene, TIME, TIME_STEP
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _load(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # state: 0 how much of the pad's friction acts, −1 to 1
    speed = sample[DISC_SPEED]
    turning = math.tanh((abs(speed) if parameters[5] > 0.5 else speed) / parameters[1])
    if sample[TIME] <= 0.0:
        state[0] = turning
    state[0] += (turning - state[0]) * (1.0 - math.exp(-sample[TIME_STEP] / parameters[2]))
    # Pad friction falls with pressure, or rises; it does not turn round.
    share = max(1.0 - parameters[3] * (sample[LOAD] / parameters[4] - 1.0), 0.0)
    return sample[LOAD] * (1.0 + (parameters[0] - 1.0) * state[0] * share)


def _constants(scene: Scene, either_way: bool = False) -> dict[str, float]:
    return {'reference_load': max(scene.effective_load, 1e-9),
            # Of a disc that only turned backwards it is turning over standing, too.
            'either_way': float(either_way or scene.disc_turned_only_backwards)}


_BY_DIRECTION = Effect(
    id='self_energizing',
    title='Self-energizing',
    parameters=(
        Parameter('load_ratio', '-', 0.05, 3.0, none=1.0, starts=(0.8,)),
        # From here on the disc turns; and the time in which its friction builds up.
        Parameter('turning_speed', 'rad/s', 0.1, 20.0, starts=(0.5, 3.0), logarithmic=True,
                  default=0.5, kind='disc_speed'),
        Parameter('build_up', 's', 1e-3, 1.0, starts=(0.005, 0.1), logarithmic=True,
                  default=1e-3),
        # By this part pad friction is less at the reference load than at none.
        Parameter('fall_with_load', '-', -0.9, 0.9, starts=(0.0,), default=0.0),
    ),
    stages={'load': _load},
    equation='T_L = (1 + (P − 1) z f) · T_L(θ), z → tanh(ω_disc/turning_speed) within build_up, '
             'P = 1 − μ r/d, f = 1 − fall · (T_L(θ)/T_ref − 1)',
    reference='chapter 5, equations (43), (44) corrected',
    statement=lambda p: (
        f"While the disc turns{', whichever way,' if p['either_way'] > 0.5 else ''} the load "
        f"torque is {p['load_ratio']:.3f} times that with the disc standing (self-energizing)."),
    reveals='load',
    picture='load_over_position',
    seen='The load is higher, or lower, by one factor while the disc turns.',
    confused='a wrong load stiffness, fade',
    measure='the same stroke with the disc standing and turning',
    constants=(('reference_load', 'N·m'), ('either_way', '-')),
    defaults={'reference_load': 0.2, 'either_way': 0.0},
    set_constants=_constants,
    applies=lambda scene: bool(scene.disc_speed_range) and scene.largest_load > 0,
)
# Two wedges back to back, or a pad that is pulled along on either side.
_EITHER_WAY = replace(
    _BY_DIRECTION, set_constants=lambda scene: _constants(scene, either_way=True),
    applies=lambda scene: scene.disc_turned_both_ways and scene.largest_load > 0)

EFFECT = replace(_BY_DIRECTION, forms=(_EITHER_WAY,))
