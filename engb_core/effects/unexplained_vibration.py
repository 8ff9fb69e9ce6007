# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A torque of fixed frequency in time, whatever the brake does: something outside shakes it."""

import math

from engb_core.effects.base import Effect, Parameter, TIME
from engb_core.physics.compiled import effect_function


@effect_function
def _torque(parameters, state, sample):
    return parameters[0] * math.sin(2.0 * math.pi * parameters[1] * sample[TIME] + parameters[2])


EFFECT = Effect(
    id='unexplained_vibration',
    title='Unexplained vibration',
    parameters=(
        Parameter('amplitude', 'N·m', 0.0, 1e6, none=0.0, starts=(0.003,)),
        Parameter('frequency', 'Hz', 0.01, 400.0, starts=(1.0,), logarithmic=True),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,), per_recording=True),
    ),
    stages={'torque': _torque},
    equation='T = amplitude · sin(2π f t + phase)',
    reference='none: what is left',
    statement=lambda p: (f"A torque of ±{p['amplitude'] * 1e3:.3g} mN·m at a fixed "
                         f"{p['frequency']:.3g} Hz that no known effect accounts for."),
    reveals='time',
    unnamed=True,
)
