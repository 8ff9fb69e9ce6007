# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Drag that is not proportional to speed."""

from engb_core.effects.base import Effect, Parameter, VELOCITY
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return parameters[0] * sample[VELOCITY] * abs(sample[VELOCITY])


EFFECT = Effect(
    id='nonlinear_viscous_friction',
    title='Nonlinear viscous friction',
    parameters=(Parameter('quadratic_viscous_friction', 'N·m·s²/rad²', -1e12, 1e12, none=0.0,
                          starts=(1e-5,), form=0.014),),
    stages={'torque': _torque},
    equation='T = B₂ ω |ω|',
    reference='Armstrong-Hélouvry et al., Automatica 30 (1994) 1083 (churning, thinning)',
    statement=lambda p: (
        f"Drag {'grows faster' if p['quadratic_viscous_friction'] > 0 else 'grows slower'} "
        'than in proportion to speed: an additional '
        f"{p['quadratic_viscous_friction']:.3g}·ω·|ω| N·m, ω in rad/s."),
    reveals='velocity',
    picture='friction_over_speed',
    seen='Drag bends upwards, or flattens, over speed.',
    confused='Stribeck friction at the low end',
    measure='constant speeds on a ladder, up to the highest',
)
