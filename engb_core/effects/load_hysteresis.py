"""The caliper's load differs between loading and unloading and remembers turning points."""

import math

from engb_core.compiled import compiled, effect_function
from engb_core.effects.base import (
    Effect,
    LOAD,
    Parameter,
    TIME_STEP,
    VELOCITY,
)
from engb_core.stop_elements import built_up, ELEMENTS, moved_elements

# Place of the first slipping element in the state; slip distance of the last one over the
# memory's (63 % of a turn-round).
_FIRST, _WIDEST = 2, 1.8


@compiled
def _opening(parameters, ahead, back):
    """Return half the difference of the memory between applying, `ahead` [rad] from rest, and
    releasing, `back` [rad] from the top."""
    if parameters[6] > 0.5:
        widest = _WIDEST * parameters[1]
        return (built_up(2.0 * ahead, widest, 1.0) + 2.0 * built_up(back, widest, 1.0) - 1.0) / 2.0
    top = 2.0 - math.exp(-(ahead + back) / parameters[1])
    return 1.0 - 0.5 * (math.exp(-ahead / parameters[1]) + top * math.exp(-back / parameters[1]))


@compiled
def _widest(parameters):
    """Return half the widest opening of the slow loop from rest to the top and back, over what the
    whole memory does at the top; the load goes with travel^load_power."""
    power = parameters[7]
    widest = 0.0
    for step in range(1, 60):
        part = step / 60.0
        opening = _opening(parameters, part * parameters[5], (1.0 - part) * parameters[5])
        if parameters[4] < 0.0:
            weight = power * part ** (power - 1.0)
        else:
            weight = part ** (power * parameters[2])
        widest = max(widest, weight * opening)
    return max(widest, 0.05)


@compiled
def _remembered(parameters, state, distances):
    """Move the memory by so many memory distances; return it, at most ±ratio/c."""
    if parameters[6] > 0.5:
        state[0] = moved_elements(state, _FIRST, distances, 1.0, 1.0)
    else:
        target = 1.0 if distances > 0.0 else -1.0
        state[0] = target + (state[0] - target) * math.exp(-abs(distances))
    if state[1] == 0.0:
        state[1] = _widest(parameters)
    return state[0] * parameters[0] / state[1]


@effect_function
def _shift(parameters, state, sample):
    if parameters[4] > 0.0:
        return 0.0
    # Play in the way to the pad: what presses it comes after the shaft, in contact or not.
    return -parameters[5] * _remembered(
        parameters, state, sample[VELOCITY] * sample[TIME_STEP] / parameters[1])


@effect_function
def _load(parameters, state, sample):
    load = sample[LOAD]
    if parameters[4] < 0.0:
        return load
    if load <= 0.0:
        # Out of contact the pad has no memory.
        for index in range(ELEMENTS):
            state[_FIRST + index] = 0.0
        state[0] = 0.0
        return load
    peak = parameters[3]
    weight = (min(load, peak) / peak) ** parameters[2]
    return load + peak * weight * _remembered(
        parameters, state, sample[VELOCITY] * sample[TIME_STEP] / parameters[1])


EFFECT = Effect(
    id='load_hysteresis',
    title='Load hysteresis',
    parameters=(
        Parameter('hysteresis_ratio', '-', 0.0, 0.8, none=0.0, starts=(0.03,), form=0.15),
        Parameter('memory_distance', 'rad', 0.05, 60.0, starts=(0.5, 1.5, 4.0, 10.0),
                  logarithmic=True),
        Parameter('load_exponent', '-', 0.0, 2.0, starts=(0.3, 1.0)),
    ),
    stages={'shift': _shift, 'load': _load},
    equation='T_L = T_L(θ) + ratio/c·T_peak·(T_L/T_peak)^γ·z, or T_L(θ − ratio/c′·reach·z); '
             'dz/dθ = (1 − z sgn ω)/distance',
    reference='Bouc (1967), Wen (1976); Coleman and Hodgdon, Int. J. Eng. Sci. 24 (1986) 897',
    statement=lambda p: (
        "The caliper's load lies on a loop: half its width is "
        f"{p['hysteresis_ratio'] * 100:.1f} % of the peak load, with memory of the turning "
        f"points over about {p['memory_distance']:.2g} rad."
        + (' It is higher while releasing: the load follows late.' if p['sense'] < 0 else '')),
    reveals='since_reversal',
    constants=(('peak_load', 'N·m'), ('sense', '-'), ('reach', 'rad'),
               ('elements', '-'), ('load_power', '-')),
    defaults={'peak_load': 0.35, 'sense': 1.0, 'reach': 30.0, 'elements': 0.0, 'load_power': 2.0},
    set_constants=lambda scene: {
        'peak_load': max(scene.largest_load, 1e-9),
        'reach': max(scene.position_range[1] - scene.position_range[0], 1e-9),
        'load_power': scene.load_power},
    applies=lambda scene: scene.largest_load > 0,
    # A caliper's friction makes applying the harder way; play in the load path the easier one.
    # The memory forgets, or consists of elements that each keep their turning point.
    variants=tuple({'sense': sense, 'elements': elements}
                   for sense in (1.0, -1.0) for elements in (0.0, 1.0)),
    # A loop of the second sense gives energy; a friction that ages at rest can look like it.
    credence=lambda p: 1.0 if p['sense'] > 0 else 0.95,
)
