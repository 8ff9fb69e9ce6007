# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A loss that grows with load times speed; no cause is claimed."""

from engb_core.effects.base import Effect, LOAD, Parameter, VELOCITY
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    speed = abs(sample[VELOCITY]) / parameters[2]
    share: float = parameters[0] * speed ** parameters[1] * abs(sample[LOAD])
    return share if sample[VELOCITY] > 0.0 else -share


EFFECT = Effect(
    id='unexplained_loss',
    title='Unexplained loss with load and speed',
    parameters=(
        Parameter('share', '-', -2.0, 2.0, none=0.0, starts=(0.05,)),
        Parameter('power', '-', 0.3, 3.0, starts=(0.5, 1.0), logarithmic=True),
    ),
    stages={'torque': _torque},
    equation='T = share · (|ω|/ω_max)^power · |T_L| · sgn ω',
    reference='none: what is left',
    statement=lambda p: (f"A loss of {p['share'] * 100:+.1f} % of the load torque at the "
                         'highest speed grows with load and speed together; no effect of the '
                         'library does that.'),
    reveals='velocity',
    tells=lambda p: ('load', 'velocity'),
    constants=(('highest_speed', 'rad/s'),),
    set_constants=lambda scene: {'highest_speed': scene.speed},
    applies=lambda scene: scene.largest_load > 0,
    unnamed=True,
)
