"""Friction differs between applying and releasing."""

from engb_core.compiled import effect_function
from engb_core.effects.base import DIRECTION, Effect, LEVEL, Parameter


@effect_function
def _level(parameters, state, sample):
    return sample[LEVEL] * (1.0 + parameters[0] * sample[DIRECTION])


EFFECT = Effect(
    id='asymmetric_friction',
    title='Asymmetric friction',
    parameters=(Parameter('asymmetry', '-', -0.95, 0.95, none=0.0, starts=(0.1,)),),
    stages={'level': _level},
    equation='F(ω) = F (1 + asymmetry · sgn ω)',
    reference='Armstrong-Hélouvry et al., Automatica 30 (1994) 1083',
    statement=lambda p: (
        f"Friction is {abs(2 * p['asymmetry'] / (1 - abs(p['asymmetry']))) * 100:.0f} % "
        f"higher while {'applying' if p['asymmetry'] > 0 else 'releasing'} than while "
        f"{'releasing' if p['asymmetry'] > 0 else 'applying'}, at every load."),
    reveals='velocity',
)
