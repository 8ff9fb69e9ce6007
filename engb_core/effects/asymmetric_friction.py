"""Friction differs between applying and releasing."""

from engb_core.compiled import effect_function
from engb_core.effects.base import DIRECTION, Effect, LEVEL, Parameter, VELOCITY, VISCOUS


@effect_function
def _level(parameters, state, sample):
    if parameters[1] == 1.0:
        return sample[LEVEL]
    return sample[LEVEL] * (1.0 + parameters[0] * sample[DIRECTION])


@effect_function
def _drag(parameters, state, sample):
    if parameters[1] == 0.0:
        return 0.0
    return parameters[0] * sample[VISCOUS] * abs(sample[VELOCITY])


def _statement(p):
    what = {0.0: 'Friction', 1.0: 'Viscous drag'}.get(
        p.get('of_drag', 0.0), 'Friction, viscous drag included,')
    more, less = ('applying', 'releasing') if p['asymmetry'] > 0 else ('releasing', 'applying')
    excess = abs(2 * p['asymmetry'] / (1 - abs(p['asymmetry']))) * 100
    return f'{what} is {excess:.0f} % higher while {more} than while {less}, at every load.'


EFFECT = Effect(
    id='asymmetric_friction',
    title='Asymmetric friction',
    parameters=(Parameter('asymmetry', '-', -0.95, 0.95, none=0.0, starts=(0.1,)),),
    stages={'level': _level, 'torque': _drag},
    equation='F(ω) = F (1 + asymmetry · sgn ω), of the dry part, the drag, or both',
    reference='Armstrong-Hélouvry et al., Automatica 30 (1994) 1083',
    statement=_statement,
    reveals='velocity',
    constants=(('of_drag', '-'),),
    variants=({'of_drag': 0.0}, {'of_drag': 1.0}, {'of_drag': 2.0}),
)
