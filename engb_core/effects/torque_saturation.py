# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Less torque per ampere at high current (iron saturation)."""

from engb_core.effects.base import Effect, EFFORT, Parameter
from engb_core.physics.compiled import compiled, effect_function, Numbers

# So much of a further ampere's torque may be lost: more current never gives less torque.
STEEPEST = 0.9


@compiled
def _lost(loss: float, shape: float, onset: float, effort: float) -> float:
    """Return the torque that is lost, both it and `effort` over the largest effort."""
    if effort <= onset:
        return 0.0
    room = 1.0 - onset
    relative = (effort - onset) / room
    rise: float = loss * relative ** (shape - 1.0)
    slope, lost = shape * rise / room, rise * relative
    if slope > STEEPEST:
        # From where it is steepest it goes on straight.
        steepest = 0.0 if shape <= 1.0 else relative * (STEEPEST / slope) ** (1.0 / (shape - 1.0))
        lost = loss * steepest ** shape + STEEPEST * room * (relative - steepest)
    return lost


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    largest = parameters[3]
    loss = largest * _lost(parameters[0], parameters[1], parameters[2],
                           abs(sample[EFFORT]) / largest)
    return sample[EFFORT] - loss if sample[EFFORT] > 0.0 else sample[EFFORT] + loss


EFFECT = Effect(
    id='torque_saturation',
    title='Torque saturation',
    parameters=(
        Parameter('torque_loss', '-', 0.0, 0.9, none=0.0, starts=(0.08, 0.4)),
        Parameter('shape', '-', 1.0, 8.0, starts=(1.2, 3.0), logarithmic=True, kind='exponent'),
        Parameter('onset', '-', 0.0, 0.8, starts=(0.0, 0.4)),
    ),
    stages={'actuation': _actuation},
    equation='T_M = e − loss · e_max · ((|e/e_max| − onset)/(1 − onset))₊^shape, e the effort; '
             'never less torque for more effort',
    reference='Jahns, in: Design of PM motors; iron saturation of the q axis',
    statement=lambda p: (
        f"At the largest recorded effort the motor gives {p['torque_loss'] * 100:.1f} % less "
        'torque per ampere than at small effort (saturation).'),
    reveals='effort',
    picture='torque_over_effort',
    seen='At high current more current than torque is added.',
    confused='a load that is stiffer at its top',
    measure='strokes to the highest force',
    constants=(('largest_effort', 'N·m'),),
    defaults={'largest_effort': 0.5},
    set_constants=lambda scene: {'largest_effort': scene.largest_effort},
    # In proportion from the smallest effort on.
    contains=('effort_scale_error',),
)
