# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Load relaxes while the pad is held (visco-elastic pad)."""

import math

from engb_core.effects.base import Effect, LOAD, Parameter, TIME, TIME_STEP
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _load(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # state: 0…2 what three elements of equal weight have relaxed by, 3…5 which part of the way to
    # the load each goes in a step, 6 that step: samples are mostly as far apart.
    load = sample[LOAD]
    relaxed = 0.0
    if sample[TIME_STEP] != state[6]:
        state[6] = sample[TIME_STEP]
        for element in range(3):
            time = parameters[1] * parameters[2] ** (element - 1)
            state[3 + element] = 1.0 - math.exp(-sample[TIME_STEP] / time)
    for element in range(3):
        if sample[TIME] <= 0.0:
            # How long the load had been held before the recording, it does not show.
            state[element] = parameters[3] * load
        state[element] += state[3 + element] * (load - state[element])
        relaxed += state[element] / 3.0
    left = load - parameters[0] * relaxed
    if parameters[4] > 0.0 and left < 0.0:
        # The pad leaves the disc rather than pull.
        left = min(0.0, load)
    return left


EFFECT = Effect(
    id='pad_creep',
    title='Pad creep',
    parameters=(
        Parameter('relaxed_fraction', '-', 0.0, 0.8, none=0.0, starts=(0.05,)),
        Parameter('time_constant', 's', 0.1, 60.0, starts=(0.3, 1.0, 3.0),
                  logarithmic=True),
        Parameter('spread', '-', 1.0, 8.0, starts=(1.5,), default=1.0),
        Parameter('settled', '-', 0.0, 1.0, starts=(0.5,), default=0.0),
    ),
    stages={'load': _load},
    equation='T_L = T_L(θ) − fraction·(q₁ + q₂ + q₃)/3, τ sⁱ⁻² dqᵢ/dt = T_L(θ) − qᵢ, '
             'qᵢ = settled·T_L at the start; T_L ≥ 0 where the pad can leave the disc',
    reference='standard linear solid; Ferry, Viscoelastic Properties of Polymers (1980)',
    statement=lambda p: (
        f"Held at one angle the load relaxes by {p['relaxed_fraction'] * 100:.1f} % with a "
        f"time constant of {p['time_constant']:.2g} s (pad creep)."),
    reveals='time_in_contact',
    picture='load_over_hold',
    seen='While the pad is held the load goes down, and its zero comes late afterwards.',
    confused='load hysteresis, a lag',
    measure='holds of 1, 3 and 10 s at one force',
    constants=(('one_sided', '-'),),
    defaults={'one_sided': 0.0},
    applies=lambda scene: scene.largest_load > 0,
    variants=({'one_sided': 0.0}, {'one_sided': 1.0}),
)
