# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Torque that is periodic in the shaft angle, whatever the motor torque."""

from collections.abc import Mapping
from dataclasses import replace
import math

from engb_core.effects.base import Effect, Parameter, POSITION
from engb_core.physics.compiled import effect_function, Numbers
from engb_core.physics.harmonics import toothed_wave

# A motor's slots, its poles and the teeth of a gear repeat at orders that have nothing to do with
# one another: so many more than one, each with a size, an order and a phase of its own.
MORE_ORDERS = 3
_FURTHER = tuple((f'{name}_{number}', unit) for number in range(2, 2 + MORE_ORDERS)
                 for name, unit in (('amplitude', 'N·m'), ('order', '1/rev'), ('phase', 'rad')))
_FIRST = 7      # parameters of the first order, with its harmonics
_NONE = {name: 1.0 if name.startswith('order') else 0.0 for name, _ in _FURTHER}


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    torque = toothed_wave(parameters, sample[POSITION])
    for further in range(MORE_ORDERS):
        place = _FIRST + 3 * further
        if parameters[place] != 0.0:
            torque += parameters[place] * math.sin(parameters[place + 1] * sample[POSITION]
                                                   + parameters[place + 2])
    return torque


def _statement(p: Mapping[str, float]) -> str:
    waves = [(p['amplitude'], p['order']), *(
        (p[f'amplitude_{number}'], p[f'order_{number}']) for number in range(2, 2 + MORE_ORDERS)
        if p.get(f'amplitude_{number}'))]
    said = ', '.join(f'{size * 1e3:.3g} mN·m repeats {order:.4g} times' for size, order in waves)
    return f'A torque of {said} per motor revolution, whatever the motor torque (cogging).'


EFFECT = Effect(
    id='cogging_torque',
    title='Cogging torque',
    parameters=(
        Parameter('amplitude', 'N·m', 0.0, 1e12, none=0.0, starts=(0.003,)),
        Parameter('order', '1/rev', 0.05, 2000.0, logarithmic=True, kind='order'),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,), kind='phase'),
        Parameter('second_sine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('second_cosine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('third_sine', '-', -1.0, 1.0, starts=(0.0,), default=0.0),
        Parameter('third_cosine', '-', -1.0, 1.0, starts=(0.0,), default=0.0),
    ),
    stages={'torque': _torque},
    of_motion=True,
    equation='T_cog = amplitude · sin(order · θ + phase) + amplitude_2 · sin(order_2 · θ + '
             'phase_2) + …',
    reference='equation (1); Hanselman, Brushless Permanent Magnet Motor Design (2003)',
    statement=_statement,
    reveals='motor_angle',
    picture='one_turn orders',
    seen='A torque that repeats with the motor angle and does not grow with current.',
    confused='torque ripple, disc runout, an eccentric encoder',
    measure='slow constant speed without load, both ways',
    constants=_FURTHER,
    defaults=_NONE,
    set_constants=lambda scene: _NONE,
)


def with_orders(count: int) -> Effect:
    """Return the effect with so many orders to be fitted, 1 to 1 + MORE_ORDERS."""
    further = tuple(
        Parameter(name, unit, 0.0, 1e12, none=0.0, default=0.0)
        if name.startswith('amplitude') else
        Parameter(name, unit, 0.05, 2000.0, logarithmic=True, starts=(1.0,),
                  default=1.0, kind='order')
        if name.startswith('order') else
        Parameter(name, unit, -20.0, 20.0, starts=(0.0,), default=0.0, kind='phase')
        for name, unit in _FURTHER[:3 * (count - 1)])
    return replace(EFFECT, parameters=(*EFFECT.parameters, *further),
                   constants=_FURTHER[len(further):])
