# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction grows with the load on screw and gears."""

from collections.abc import Mapping

from engb_core.effects.base import Effect, LEVEL, LOAD, LOAD_GAIN, Parameter
from engb_core.physics.compiled import effect_function, Numbers
from engb_core.physics.dry_friction import friction_gain

# Curvature that the statement mentions.
TOLD = 0.15


@effect_function
def _level(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    gain = friction_gain(parameters[0], parameters[1], parameters[2], sample[LOAD])
    return sample[LEVEL] + (gain - sample[LOAD_GAIN]) * abs(sample[LOAD])


def _statement(p: Mapping[str, float]) -> str:
    curvature = p.get('load_curvature', 0.0)
    curved = '' if abs(curvature) < TOLD else (
        f", the {'more' if curvature > 0 else 'less'} the higher the load")
    return (f"Friction grows with the load: by {p['load_gain']:.3f} N·m for every N·m of load "
            f'torque{curved}, on both strokes.')


EFFECT = Effect(
    id='load_dependent_friction',
    title='Load-dependent friction',
    parameters=(Parameter('load_gain', '-', 0.0, 3.0),
                # How the curve over load departs from a straight line (nominal_torque.py).
                Parameter('load_curvature', '-', -0.9, 0.9, default=0.0)),
    stages={'level': _level},
    equation='T_C = (C₀ + C₁ |T_L|) sat(ω), or C₁ (1 + curvature (|T_L|/T_ref − 1)) for C₁',
    reference='equations (13), (42)',
    statement=_statement,
    reveals='load',
    picture='friction_over_load',
    seen='The two branches part as the load grows.',
    confused='load hysteresis, which remembers turning points',
    measure='slow strokes to several loads',
    constants=(('reference_load', 'N·m'),),
    defaults={'reference_load': 0.2},
    set_constants=lambda scene: {'reference_load': max(scene.reference_load, 1e-9)},
    applies=lambda scene: scene.largest_load > 0,
)
