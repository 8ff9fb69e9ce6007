# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The caliper's load differs between loading and unloading and remembers turning points."""

from dataclasses import replace
import math

import numpy as np

from engb_core.effects.base import (
    Effect,
    LOAD,
    Parameter,
    TIME_STEP,
    VELOCITY,
)
from engb_core.physics.compiled import compiled, effect_function, Numbers
from engb_core.physics.stop_elements import ELEMENTS, moved_elements, start_elements

# Places in the parameters, and of the first slipping element in the state.
(_RATIO, _DISTANCE, _EXPONENT, _SHARPNESS, _PEAK, _SENSE, _REACH, _ELEMENTS, _POWER, _OVER_LOAD,
 _SPAN) = range(11)
_FIRST = 2
# Where the state holds the load of the sample before, and whether there is one.
_BEFORE, _BEGUN = _FIRST + 2 * ELEMENTS, _FIRST + 2 * ELEMENTS + 1
# Steps of the slow loop that tells how wide the loop opens.
_STEPS = 120


@compiled
def _moved(parameters: Numbers, state: Numbers, distances: float) -> float:
    """Move the memory by so many memory distances and return it, −1 … 1."""
    if parameters[_ELEMENTS] > 0.5:
        return moved_elements(state, _FIRST, distances, 1.0, 1.0)
    direction = 1.0 if distances > 0.0 else -1.0
    ahead = state[0] * direction
    for _ in range(2):
        # dz/ds = 1 ∓ |z|^n is (1 − z) times what hardly changes over half a step.
        left = max(1.0 - ahead, 1e-9)
        rate = (1.0 - math.copysign(abs(ahead) ** parameters[_SHARPNESS], ahead)) / left
        ahead = 1.0 - left * math.exp(-0.5 * abs(distances) * rate)
    state[0] = ahead * direction
    return state[0]


@compiled
def _forget(state: Numbers) -> None:
    start_elements(state, _FIRST, 0.0)
    state[0] = 0.0


@compiled
def _widest(parameters: Numbers, state: Numbers) -> float:
    """Return half the widest opening of the slow loop to the top and back, over what the whole
    memory does at the top; from rest, if there is no load at the bottom. The load goes with
    travel^load_power. Leaves no memory."""
    power = 1.0 if parameters[_OVER_LOAD] > 0.5 else parameters[_POWER]
    way = parameters[_REACH] / parameters[_DISTANCE] / _STEPS
    if parameters[_OVER_LOAD] > 0.5 and abs(parameters[_SPAN] - parameters[_PEAK]) \
            > 1e-3 * parameters[_PEAK]:
        # A load that is not none at its smallest finds the memory as the last loop left it.
        for step in range(2 * _STEPS):
            _moved(parameters, state, way if step < _STEPS else -way)
    applying = np.empty(_STEPS)
    for step in range(_STEPS):
        applying[step] = _moved(parameters, state, way)
    widest = 0.0
    for step in range(_STEPS - 2, -1, -1):
        part = (step + 1.0) / _STEPS
        if parameters[_SENSE] < 0.0:
            weight = power * part ** (power - 1.0)
        else:
            weight = part ** (power * parameters[_EXPONENT])
        opening = applying[step] - _moved(parameters, state, -way)
        widest = max(widest, 0.5 * weight * opening)
    _forget(state)
    return max(widest, 0.05)


@compiled
def _remembered(parameters: Numbers, state: Numbers, distances: float) -> float:
    """Move the memory by so many memory distances; return it, at most ±ratio/c of the peak load.

    The peak is that of the loop: above the curve's where applying is the harder way, else below.
    """
    if state[1] == 0.0:
        state[1] = _widest(parameters, state)
    most = parameters[_RATIO] / state[1]
    if parameters[_SENSE] < 0.0:
        most /= 1.0 + parameters[_POWER] * most
    else:
        most /= max(1.0 - most, 0.1)
    return _moved(parameters, state, distances) * most


@effect_function
def _shift(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[_SENSE] > 0.0:
        return 0.0
    # Play in the way to the pad: what presses it comes after the shaft, in contact or not.
    return -parameters[_REACH] * _remembered(
        parameters, state, sample[VELOCITY] * sample[TIME_STEP] / parameters[_DISTANCE])


@effect_function
def _load(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    load = sample[LOAD]
    if parameters[_SENSE] < 0.0:
        return load
    if parameters[_OVER_LOAD] > 0.5:
        # The way that the load has gone, of either sign.
        before = load if state[_BEGUN] == 0.0 else state[_BEFORE]
        state[_BEFORE], state[_BEGUN] = load, 1.0
        distances = ((load - before) / parameters[_SPAN] * parameters[_REACH]
                     / parameters[_DISTANCE])
        contact = load != 0.0
    else:
        distances = sample[VELOCITY] * sample[TIME_STEP] / parameters[_DISTANCE]
        contact = load > 0.0
    if not contact and not (parameters[_OVER_LOAD] > 0.5 and parameters[_EXPONENT] == 0.0):
        # Out of contact the pad has no memory; what rubs alike everywhere keeps its own.
        _forget(state)
        return load
    peak = parameters[_PEAK]
    weight: float = (min(abs(load), peak) / peak) ** parameters[_EXPONENT]
    return load + peak * weight * _remembered(parameters, state, distances)


_PAD = Effect(
    id='load_hysteresis',
    title='Load hysteresis',
    parameters=(
        Parameter('hysteresis_ratio', '-', 0.0, 0.8, none=0.0, starts=(0.03,)),
        Parameter('memory_distance', 'rad', 0.05, 60.0, starts=(0.5, 1.5, 4.0, 10.0),
                  logarithmic=True),
        # Friction in a contact grows with the 2/3 power of its load at least (Hertz): a loop that
        # hardly goes with the load is presliding friction.
        Parameter('load_exponent', '-', 0.5, 2.0, starts=(0.6, 1.0)),
        Parameter('sharpness', '-', 1.0, 3.0, starts=(1.5,), default=1.0),
    ),
    stages={'shift': _shift, 'load': _load},
    equation='T_L = T_L(θ) + ratio/c·T_peak·(T_L/T_peak)^γ·z, or T_L(θ − ratio/c′·reach·z); '
             'dz/dθ = (1 − |z|^n sgn(ω z))/distance',
    reference='Bouc (1967), Wen (1976); Coleman and Hodgdon, Int. J. Eng. Sci. 24 (1986) 897',
    statement=lambda p: (
        "The caliper's load lies on a loop: half its width is "
        f"{p['hysteresis_ratio'] * 100:.1f} % of the peak load, with memory of the turning "
        f"points over about {p['memory_distance']:.2g} rad."
        + (' It is higher while releasing: the load follows late.' if p['sense'] < 0 else '')),
    reveals='since_reversal',
    picture='load_over_position',
    seen='Loading and unloading lie on a loop; partial strokes make small loops within.',
    confused='load-dependent friction, which turns at once with direction',
    measure='full and partial strokes at one slow speed',
    constants=(('peak_load', 'N·m'), ('sense', '-'), ('reach', 'rad'),
               ('elements', '-'), ('load_power', '-'), ('over_load', '-'), ('load_span', 'N·m')),
    defaults={'peak_load': 0.35, 'sense': 1.0, 'reach': 30.0, 'elements': 0.0, 'load_power': 2.0,
              'over_load': 0.0, 'load_span': 0.35},
    set_constants=lambda scene: {
        'peak_load': max(scene.largest_load, 1e-9),
        'reach': max(scene.position_range[1] - scene.position_range[0], 1e-9),
        'load_power': scene.load_power,
        'load_span': max(scene.load_span, 1e-9)},
    applies=lambda scene: scene.largest_load > 0,
    # A caliper's friction makes applying the harder way; play in the load path the easier one.
    # The memory forgets, or consists of elements that each keep their turning point; it goes with
    # the angle, or with the load itself, as of a spring that rubs in its guide.
    variants=(*({'sense': sense, 'elements': elements, 'over_load': 0.0}
                for sense in (1.0, -1.0) for elements in (0.0, 1.0)),
              {'sense': 1.0, 'elements': 1.0, 'over_load': 1.0}),
    # A loop of the second sense gives energy; a friction that ages at rest can look like it.
    credence=lambda p: 1.0 if p['sense'] > 0 else 0.95,
)
# What is dragged along with the load rubs alike everywhere: a guide, a seal of the linkage.
_GUIDE = replace(
    _PAD, parameters=_PAD.parameters[:2],
    constants=(('load_exponent', '-'), ('sharpness', '-'), *_PAD.constants),
    defaults={**_PAD.defaults, 'load_exponent': 0.0, 'sharpness': 1.0},
    variants=({'sense': 1.0, 'elements': 1.0, 'over_load': 1.0},))

EFFECT = replace(_PAD, forms=(_GUIDE,))
