"""Less torque per ampere at high current (iron saturation)."""

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, EFFORT, Parameter


@effect_function
def _actuation(parameters, state, sample):
    onset = parameters[2]
    largest = parameters[3]
    relative = max(abs(sample[EFFORT]) / largest - onset, 0.0) / (1.0 - onset)
    loss = parameters[0] * largest * relative ** parameters[1]
    return sample[EFFORT] - loss if sample[EFFORT] > 0.0 else sample[EFFORT] + loss


EFFECT = Effect(
    id='torque_saturation',
    title='Torque saturation',
    parameters=(
        Parameter('torque_loss', '-', 0.0, 0.6, none=0.0, starts=(0.08,), form=0.03),
        Parameter('shape', '-', 1.0, 8.0, starts=(1.2, 3.0), logarithmic=True),
        Parameter('onset', '-', 0.0, 0.8, starts=(0.0, 0.4)),
    ),
    stages={'actuation': _actuation},
    equation='T_M = e − loss · e_max · ((|e/e_max| − onset)/(1 − onset))₊^shape, e the effort',
    reference='Jahns, in: Design of PM motors; iron saturation of the q axis',
    statement=lambda p: (
        f"At the largest recorded effort the motor gives {p['torque_loss'] * 100:.1f} % less "
        'torque per ampere than at small effort (saturation).'),
    reveals='effort',
    constants=(('largest_effort', 'N·m'),),
    defaults={'largest_effort': 0.5},
    set_constants=lambda scene: {'largest_effort': scene.largest_effort},
)
