# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effort and position are not sampled at the same instant: within a sample or so, no physics."""

from engb_core.effects.base import Effect, Parameter

EFFECT = Effect(
    id='sampling_delay',
    title='Sampling delay',
    parameters=(Parameter('delay', 's', -0.02, 0.02, none=0.0, starts=(0.0005,)),),
    stages={},
    equation='effort(t) ↔ position(t + delay)',
    reference='zero-order hold and read-out order of the drive',
    statement=lambda p: (f"Effort and position are stamped {p['delay'] * 1e3:.2f} ms apart."),
    reveals='acceleration',
    picture='lag',
    seen='As a lag of less than a sample; no physics is missing.',
    confused='actuation lag',
    measure='look up the order of read-out in the drive',
    time_shift=lambda p: (p['delay'], 0.0),
    number_only=True,
)
