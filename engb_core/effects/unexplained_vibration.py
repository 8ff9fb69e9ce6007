# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A torque of fixed frequency in time, or one that goes with the effort: something outside shakes
the brake, or its supply pulsates."""

from collections.abc import Mapping
import math

from engb_core.effects.base import Effect, EFFORT, Parameter, TIME
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[4] > 0.5:
        return 0.0
    return parameters[0] * math.sin(2.0 * math.pi * parameters[1] * sample[TIME] + parameters[2])


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[4] < 0.5:
        return sample[EFFORT]
    wave = math.sin(2.0 * math.pi * parameters[1] * sample[TIME] + parameters[2])
    return sample[EFFORT] * (1.0 - parameters[0] / parameters[3] * wave)


def _said(p: Mapping[str, float]) -> str:
    if p['by_effort'] > 0.5:
        return (f"The torque for a given effort pulsates by "
                f"±{100.0 * p['amplitude'] / p['largest_effort']:.3g} % at a fixed "
                f"{p['frequency']:.3g} Hz; no effect of the library does that.")
    return (f"A torque of ±{p['amplitude'] * 1e3:.3g} mN·m at a fixed "
            f"{p['frequency']:.3g} Hz that no known effect accounts for.")


EFFECT = Effect(
    id='unexplained_vibration',
    title='Unexplained vibration',
    parameters=(
        Parameter('amplitude', 'N·m', 0.0, 1e12, none=0.0, starts=(0.003,)),
        Parameter('frequency', 'Hz', 0.01, 400.0, starts=(1.0,), logarithmic=True,
                  kind='frequency'),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,), per_recording=True, kind='phase'),
    ),
    stages={'torque': _torque, 'actuation': _actuation},
    of_motion=True,
    proportional=lambda p: True,
    equation='T = amplitude · sin(2π f t + phase), or so much at the largest effort',
    reference='none: what is left',
    statement=_said,
    reveals='time',
    tells=lambda p: ('time', 'effort') if p['by_effort'] > 0.5 else ('time',),
    constants=(('largest_effort', 'N·m'), ('by_effort', '-')),
    defaults={'largest_effort': 1.0, 'by_effort': 0.0},
    set_constants=lambda scene: {'largest_effort': max(scene.largest_effort, 1e-9)},
    variants=({'by_effort': 0.0}, {'by_effort': 1.0}),
    unnamed=True,
)
