"""A compliant drivetrain with inertia beyond it."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import ACCELERATION, Effect, INERTIA, Parameter, TIME, TIME_STEP


@effect_function
def _torque(parameters, state, sample):
    # state: 0 relative displacement e of the inertia beyond, 1 its rate, 2 the last acceleration.
    # With the motor's motion given, e is a damped oscillator driven by the motor's acceleration;
    # solved exactly for an acceleration that runs straight from sample to sample, so that long
    # steps (inverse dynamics) and short ones (simulation) agree.
    fraction = parameters[0]
    locked = 2.0 * math.pi * parameters[1] * math.sqrt(1.0 - fraction)
    damping = parameters[2]
    decay = damping * locked
    turning = locked * math.sqrt(1.0 - damping * damping)
    acceleration = sample[ACCELERATION]
    step = sample[TIME_STEP]
    if sample[TIME] <= 0.0:
        state[0] = -acceleration / locked ** 2
        state[1] = 0.0
    else:
        slope = (acceleration - state[2]) / step
        forced = -state[2] / locked ** 2 + 2.0 * damping * slope / locked ** 3
        free = state[0] - forced
        rate = state[1] + slope / locked ** 2
        fade = math.exp(-decay * step)
        cosine = fade * math.cos(turning * step)
        sine = fade * math.sin(turning * step) / turning
        state[0] = (forced - slope * step / locked ** 2
                    + free * cosine + (rate + decay * free) * sine)
        state[1] = (-slope / locked ** 2
                    + rate * cosine - (decay * rate + locked ** 2 * free) * sine)
    state[2] = acceleration
    relative = -locked ** 2 * state[0] - 2.0 * decay * state[1] - acceleration
    # Rigid, the inertia beyond is part of J; what is added is its relative acceleration.
    return fraction * sample[INERTIA] * relative


EFFECT = Effect(
    id='drivetrain_resonance',
    title='Drivetrain resonance',
    parameters=(
        Parameter('inertia_fraction', '-', 0.0, 0.9, none=0.0, starts=(0.25,)),
        Parameter('frequency', 'Hz', 2.0, 100.0,
                  starts=(8.0, 12.0, 17.0, 24.0, 33.0, 46.0, 64.0, 90.0), logarithmic=True,
                  form=0.04),
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
