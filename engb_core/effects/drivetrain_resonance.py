"""A compliant drivetrain with inertia beyond it."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import ACCELERATION, Effect, INERTIA, Parameter, TIME, TIME_STEP


@effect_function
def _torque(parameters, state, sample):
    # state: relative displacement of the inertia beyond, its rate; the motion with the
    # motor held is that of a damped oscillator driven by the motor's acceleration.
    if sample[TIME] <= 0.0:
        state[0] = 0.0
        state[1] = 0.0
    fraction = parameters[0]
    locked = 2.0 * math.pi * parameters[1] * math.sqrt(1.0 - fraction)
    damping = parameters[2]
    remaining = sample[TIME_STEP]
    relative = 0.0
    steps = int(remaining * locked * 8.0) + 1
    step = remaining / steps
    for _ in range(steps):
        relative = -locked * locked * state[0] - 2.0 * damping * locked * state[1] \
            - sample[ACCELERATION]
        state[1] += step * relative
        state[0] += step * state[1]
    # Rigid, the inertia beyond is part of J; what is added is its relative acceleration.
    return fraction * sample[INERTIA] * relative


EFFECT = Effect(
    id='drivetrain_resonance',
    title='Drivetrain resonance',
    parameters=(
        Parameter('inertia_fraction', '-', 0.0, 0.9, none=0.0, starts=(0.25,)),
        Parameter('frequency', 'Hz', 2.0, 250.0,
                  starts=(8.0, 12.0, 17.0, 24.0, 33.0, 46.0, 64.0, 90.0), logarithmic=True),
        Parameter('damping_ratio', '-', 0.002, 0.7, starts=(0.03, 0.15), logarithmic=True),
    ),
    stages={'torque': _torque},
    equation='(1 − ρ)J ω̇ + ρJ (ω̇ + ë) = …, ë + 2ζω_a ė + ω_a² e = −ω̇, ω_a = ω_r √(1 − ρ)',
    reference='Ellis and Lorenz, IEEE IAS (2000): resonant load control',
    statement=lambda p: (
        f"A compliant drivetrain resonates at {p['frequency']:.1f} Hz with "
        f"{p['inertia_fraction'] * 100:.0f} % of the inertia beyond it."),
    reveals='frequency',
)
