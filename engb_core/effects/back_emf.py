# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A drive that is told a voltage gives less torque the faster it turns."""

from engb_core.effects.base import Effect, Parameter, VELOCITY
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return parameters[0] * sample[VELOCITY]


EFFECT = Effect(
    id='back_emf',
    title='Back-EMF of a voltage drive',
    parameters=(Parameter('back_emf', 'N·m·s/rad', 0.0, 1e12, none=0.0, starts=(0.01,)),),
    stages={'torque': _torque},
    equation='T_M = K_T · (V − K_e ω)/R = effort − back_emf · ω, back_emf = K_T K_e / R',
    reference='contract, additions; Krause, Wasynczuk and Sudhoff, Analysis of Electric '
              'Machinery (2002), section 2.3',
    statement=lambda p: (f"The torque falls by {p['back_emf']:.4g} N·m for each rad/s: the drive "
                         'gives a voltage, not a current (back-EMF).'),
    reveals='velocity',
    picture='friction_over_speed',
    seen='As viscous friction: what is asked for exceeds the model in proportion to speed.',
    confused='viscous friction, from which no motion tells it',
    measure='the current beside the voltage; or turn the shaft by hand with the drive off, where '
            'viscous friction stays and back-EMF is gone',
    applies=lambda scene: scene.commanded,
)
