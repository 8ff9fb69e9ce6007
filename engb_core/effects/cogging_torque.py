"""Torque that is periodic in the shaft angle, whatever the motor torque."""

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, Parameter, POSITION
from engb_core.harmonics import toothed_wave


@effect_function
def _torque(parameters, state, sample):
    return toothed_wave(parameters, sample[POSITION])


EFFECT = Effect(
    id='cogging_torque',
    title='Cogging torque',
    parameters=(
        Parameter('amplitude', 'N·m', 0.0, 1e6, none=0.0, starts=(0.003,), form=0.01),
        Parameter('order', '1/rev', 0.05, 400.0, logarithmic=True, form=0.002),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,)),
        Parameter('second_sine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('second_cosine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('third_sine', '-', -1.0, 1.0, starts=(0.0,), default=0.0),
        Parameter('third_cosine', '-', -1.0, 1.0, starts=(0.0,), default=0.0),
    ),
    stages={'torque': _torque},
    equation='T_cog = amplitude · sin(order · θ + phase)',
    reference='equation (1); Hanselman, Brushless Permanent Magnet Motor Design (2003)',
    statement=lambda p: (
        f"A torque of {p['amplitude'] * 1e3:.3g} mN·m repeats {p['order']:.4g} times per "
        'motor revolution, whatever the motor torque (cogging).'),
    reveals='motor_angle',
    picture='one_turn orders',
    seen='A torque that repeats with the motor angle and does not grow with current.',
    confused='torque ripple, disc runout, an eccentric encoder',
    measure='slow constant speed without load, both ways',
    applies=lambda scene: scene.joint_type == 'revolute',
)
