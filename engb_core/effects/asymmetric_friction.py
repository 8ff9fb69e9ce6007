# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction differs between applying and releasing."""

from collections.abc import Mapping

from engb_core.effects.base import (
    COULOMB,
    DIRECTION,
    Effect,
    LEVEL,
    LOAD,
    LOAD_GAIN,
    Parameter,
    VELOCITY,
    VISCOUS,
)
from engb_core.physics.compiled import effect_function, Numbers

# Growth with speed that the statement mentions.
TOLD = 0.2


@effect_function
def _level(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[3] == 1.0:
        return sample[LEVEL]
    loaded = sample[LOAD_GAIN] * abs(sample[LOAD])
    whole = sample[COULOMB] + loaded
    share = loaded / whole if whole > 0.0 else 0.0
    # Asymmetry is that of both parts together, at the share that the load's has on average, and
    # at the speed for which it is that of all speeds on average.
    more = parameters[1] - 1.0
    uneven = parameters[0] * (1.0 + more * share) / (1.0 + more * parameters[5])
    speed = abs(sample[VELOCITY])
    uneven *= 1.0 + parameters[2] * (speed - parameters[4]) / (speed + parameters[4])
    return sample[LEVEL] * (1.0 + uneven * sample[DIRECTION])


@effect_function
def _drag(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[3] == 0.0:
        return 0.0
    return parameters[0] * sample[VISCOUS] * abs(sample[VELOCITY])


def _statement(p: Mapping[str, float]) -> str:
    what = {0.0: 'Friction', 1.0: 'Viscous drag'}.get(
        p.get('of_drag', 0.0), 'Friction, viscous drag included,')
    more, less = ('applying', 'releasing') if p['asymmetry'] > 0 else ('releasing', 'applying')
    excess = abs(2 * p['asymmetry'] / (1 - abs(p['asymmetry']))) * 100
    growth = p.get('growth', 0.0) if p.get('of_drag', 0.0) != 1.0 else 0.0
    with_speed = '' if abs(growth) < TOLD else (
        f", the {'more' if growth > 0 else 'less'} the faster it turns")
    return (f'{what} is {excess:.0f} % higher while {more} than while {less}, at every '
            f'load{with_speed}.')


EFFECT = Effect(
    id='asymmetric_friction',
    title='Asymmetric friction',
    parameters=(Parameter('asymmetry', '-', -0.95, 0.95, none=0.0, starts=(0.1,)),
                Parameter('of_load_friction', '-', 0.5, 2.0, starts=(1.0,), logarithmic=True),
                Parameter('growth', '-', -1.0, 1.0, starts=(0.0, 0.8), default=0.0)),
    stages={'level': _level, 'torque': _drag},
    memoryless=True,
    equation='F(ω) = F (1 + asymmetry · sgn ω), of the dry part, the drag, or both; '
             'the part ∝ load by of_load_friction times as much; of the dry part by '
             '1 + growth · (|ω| − ω_mean)/(|ω| + ω_mean)',
    reference='Armstrong-Hélouvry et al., Automatica 30 (1994) 1083',
    statement=_statement,
    reveals='velocity',
    picture='friction_over_speed',
    seen='Two friction branches of different height, the same at every load.',
    confused='a torque offset, which adds the same at every speed and load',
    measure='slow strokes both ways, with and without load',
    constants=(('of_drag', '-'), ('mean_speed', 'rad/s'), ('loaded_share', '-')),
    defaults={'of_drag': 0.0, 'mean_speed': 10.0, 'loaded_share': 0.5},
    set_constants=lambda scene: {'mean_speed': max(scene.middle_speed, 1e-9),
                                 'loaded_share': scene.loaded_share},
    variants=({'of_drag': 0.0}, {'of_drag': 1.0}),
)
