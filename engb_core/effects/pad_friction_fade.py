# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""While the disc turns the load ratio changes with disc speed or pad temperature."""

from dataclasses import replace
import math

from engb_core.effects.base import (
    DISC_SPEED,
    Effect,
    LOAD,
    PAD_TEMPERATURE,
    Parameter,
    Part,
    Scene,
    TURNING,
)
from engb_core.physics.compiled import compiled, effect_function, Numbers


@compiled
def _step(way: float, steepness: float) -> float:
    """Return a step from 0 to 1 at 0; far from it an exponential."""
    return 1.0 / (1.0 + math.exp(min(max(-steepness * way, -50.0), 50.0)))


@compiled
def _progress(parameters: Numbers, sample: Numbers) -> float:
    steepness, middle = parameters[2], parameters[3]
    if parameters[5] > 0.5:
        way = (sample[PAD_TEMPERATURE] - parameters[8]) / (parameters[9] - parameters[8])
        first = _step(-middle, steepness)
        last = _step(1.0 - middle, steepness)
        return (_step(way - middle, steepness) - first) / (last - first)
    # Friction that falls with speed levels off; it has no speed at which that sets in.
    way = (abs(sample[DISC_SPEED]) - parameters[6]) / (parameters[7] - parameters[6])
    return (1.0 - math.exp(-steepness * way)) / (1.0 - math.exp(-steepness))


@effect_function
def _load(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    speed = sample[DISC_SPEED]
    turning = math.tanh((abs(speed) if parameters[10] > 0.5 else speed) / parameters[4])
    progress = _progress(parameters, sample)
    return sample[LOAD] * (
        1.0 + turning * (parameters[1] - 1.0 + parameters[0] * (progress - 0.5)))


def _constants(scene: Scene, either_way: bool = False) -> dict[str, float]:
    low, high = scene.disc_speed_range or (0.0, 1.0)
    fast = max(abs(low), abs(high))
    # A disc that turned both ways also stood.
    slow = max(0.0 if low < 0.0 < high else min(abs(low), abs(high)), TURNING * fast)
    cold, hot = scene.temperature_range or (0.0, 1.0)
    return {'speed_from': slow, 'speed_to': max(fast, slow + 1e-3),
            'temperature_from': cold, 'temperature_to': max(hot, cold + 1e-3),
            # Of a disc that only turned backwards the change is told with the sign it has there.
            'either_way': float(either_way or scene.disc_turned_only_backwards)}


_BY_DIRECTION = Effect(
    id='pad_friction_fade',
    title='Pad friction fade',
    parameters=(
        Parameter('ratio_change', '-', -3.0, 3.0, none=0.0, starts=(-0.1,)),
        Parameter('load_ratio', '-', 0.05, 3.0, starts=(0.9,)),
        # How steep the change is, and where in the range of temperature its middle lies.
        Parameter('steepness', '-', 0.1, 20.0, starts=(2.5, 7.0), logarithmic=True, default=0.1),
        Parameter('middle', '-', -1.0, 2.0, starts=(-0.5, 0.5, 1.5), default=0.5),
        # From here on the disc turns.
        Parameter('turning_speed', 'rad/s', 0.1, 20.0, starts=(0.5,), logarithmic=True,
                  default=0.5, kind='disc_speed'),
    ),
    stages={'load': _load},
    of_motion=True,
    equation='T_L = (1 + (P − 1 + change·(p − ½)) tanh(ω_disc/turning_speed)) · T_L(θ), '
             'x from 0 to 1 over its range, p ∝ 1/(1 + e^(−steepness·(x − middle))) with '
             'temperature, 1 − e^(−steepness·x) with speed',
    reference='chapter 5; Limpert, Brake Design and Safety (2011), fade',
    statement=lambda p: (
        'While the disc turns the load ratio changes by '
        f"{p['ratio_change']:+.3f} over the recorded range of "
        f"{'pad temperature' if p['by_temperature'] > 0.5 else 'disc speed'} (fade)."),
    reveals='disc_speed',
    picture='load_ratio',
    seen='The ratio of load to its curve moves with disc speed or temperature.',
    confused='self-energizing, of one speed only',
    measure='the same stroke at several disc speeds and temperatures',
    constants=(('by_temperature', '-'), ('speed_from', 'rad/s'), ('speed_to', 'rad/s'),
               ('temperature_from', '°C'), ('temperature_to', '°C'), ('either_way', '-')),
    defaults={'by_temperature': 0.0, 'speed_from': 0.0, 'speed_to': 90.0,
              'temperature_from': 20.0, 'temperature_to': 400.0, 'either_way': 0.0},
    set_constants=_constants,
    applies=lambda scene: bool(scene.disc_speed_range) and scene.largest_load > 0,
    variants=({'by_temperature': 0.0}, {'by_temperature': 1.0}),
    contains=('self_energizing',),
    # What is there before anything fades.
    part=Part('self_energizing', {'load_ratio': 1.0, 'ratio_change': -0.5}),
)
_EITHER_WAY = replace(
    _BY_DIRECTION, set_constants=lambda scene: _constants(scene, either_way=True),
    applies=lambda scene: scene.disc_turned_both_ways and scene.largest_load > 0)

EFFECT = replace(_BY_DIRECTION, forms=(_EITHER_WAY,))
