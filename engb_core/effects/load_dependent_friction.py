"""Friction grows with the load on screw and gears."""

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, LEVEL, LOAD, LOAD_GAIN, Parameter

# Curvature over load (load_friction.py) that the statement mentions.
TOLD = 0.15


@effect_function
def _level(parameters, state, sample):
    return sample[LEVEL] + (parameters[0] - sample[LOAD_GAIN]) * abs(sample[LOAD])


def _statement(p):
    curvature = p.get('load_curvature', 0.0)
    curved = '' if abs(curvature) < TOLD else (
        f", the {'more' if curvature > 0 else 'less'} the higher the load")
    return (f"Friction grows with the load: by {p['load_gain']:.3f} N·m for every N·m of load "
            f'torque{curved}, on both strokes.')


EFFECT = Effect(
    id='load_dependent_friction',
    title='Load-dependent friction',
    parameters=(Parameter('load_gain', '-', 0.0, 3.0, form=0.02),),
    stages={'level': _level},
    equation='T_C = (C₀ + C₁ |T_L|) sat(ω)',
    reference='equations (13), (42)',
    statement=_statement,
    reveals='load',
    applies=lambda scene: scene.largest_load > 0,
)
