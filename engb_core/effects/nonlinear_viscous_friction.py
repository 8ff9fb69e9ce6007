# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Drag that is not proportional to speed."""

from collections.abc import Mapping
import math

from engb_core.effects.base import Effect, Parameter, VELOCITY
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[2] < 0.5:
        return parameters[0] * sample[VELOCITY] * abs(sample[VELOCITY])
    # The model's viscous friction is that at high speed, so that it hardly moves beside this.
    # Only what rises first levels off: friction that falls from rest on is Stribeck's.
    drag = min(parameters[0], 0.0) * parameters[3] ** 2 * math.expm1(
        -abs(sample[VELOCITY]) / parameters[1])
    return drag if sample[VELOCITY] > 0.0 else -drag


def _statement(p: Mapping[str, float]) -> str:
    quadratic = p['quadratic_viscous_friction']
    if p.get('levels_off', 0.0) < 0.5:
        return (f"Drag {'grows faster' if quadratic > 0 else 'grows slower'} than in proportion "
                f'to speed: an additional {quadratic:.3g}·ω·|ω| N·m, ω in rad/s.')
    most, speed = abs(quadratic) * p['mean_speed'] ** 2, p['transition_speed']
    return ('Drag grows more steeply at low speed than in proportion to speed and levels off: '
            f'{most:.3g} N·m more at high speed, 63 % of it at {speed:.3g} rad/s.')


EFFECT = Effect(
    id='nonlinear_viscous_friction',
    title='Nonlinear viscous friction',
    parameters=(Parameter('quadratic_viscous_friction', 'N·m·s²/rad²', -1e12, 1e12, none=0.0,
                          starts=(1e-5,)),
                Parameter('transition_speed', 'rad/s', 1e-3, 60.0, starts=(0.5, 2.0, 8.0),
                          logarithmic=True)),
    stages={'torque': _torque},
    of_motion=True,
    equation='T = B₂ ω |ω|, or, where B₂ < 0 and it levels off, '
             'T = −B₂ ω_mean² (1 − exp(−|ω|/ω_t)) sgn ω',
    reference='Armstrong-Hélouvry et al., Automatica 30 (1994) 1083 (churning, thinning); Cross, '
              'J. Colloid Sci. 20 (1965) 417 (a lubricant that thins between two viscosities)',
    statement=_statement,
    reveals='velocity',
    picture='friction_over_speed',
    seen='Drag bends upwards, or flattens, over speed.',
    confused='Stribeck friction at the low end',
    # Levelling off at once.
    contains=('coulomb_friction_error',),
    measure='constant speeds on a ladder, up to the highest',
    constants=(('levels_off', '-'), ('mean_speed', 'rad/s')),
    defaults={'levels_off': 0.0, 'mean_speed': 10.0},
    set_constants=lambda scene: {'mean_speed': max(scene.middle_speed, 1e-9)},
    # All the way, or between two slopes.
    variants=({'levels_off': 0.0}, {'levels_off': 1.0}),
)
