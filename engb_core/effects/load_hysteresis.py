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
def _widest(parameters):
    """Return the half width of a full loop over ratio·T_peak: it closes at its turning points,
    and tapers with the load (here ∝ angle²)."""
    widest = 0.0
    for step in range(1, 60):
        back = step / 60.0
        way = back * parameters[5]
        if parameters[6] > 0.5:
            done = built_up(way, _WIDEST * parameters[1], 1.0)
        else:
            done = 1.0 - math.exp(-way / parameters[1])
        widest = max(widest, (1.0 - back) ** (2.0 * parameters[2]) * done)
    return max(widest, 0.05)


@effect_function
def _load(parameters, state, sample):
    load = sample[LOAD]
    peak = parameters[3]
    way = sample[VELOCITY] * sample[TIME_STEP]
    if load <= 0.0:
        # Out of contact the pad has no memory.
        for index in range(ELEMENTS):
            state[_FIRST + index] = 0.0
        state[0] = 0.0
        return load
    if parameters[6] > 0.5:
        state[0] = moved_elements(state, _FIRST, way, parameters[1], 1.0)
    else:
        target = 1.0 if way > 0.0 else -1.0
        state[0] = target + (state[0] - target) * math.exp(-abs(way) / parameters[1])
    if state[1] == 0.0:
        state[1] = _widest(parameters)
    weight = (min(load, peak) / peak) ** parameters[2]
    return load + parameters[4] * parameters[0] / state[1] * peak * weight * state[0]


EFFECT = Effect(
    id='load_hysteresis',
    title='Load hysteresis',
    parameters=(
        Parameter('hysteresis_ratio', '-', 0.0, 0.8, none=0.0, starts=(0.03,), form=0.15),
        Parameter('memory_distance', 'rad', 0.05, 60.0, starts=(0.5, 1.5, 4.0, 10.0),
                  logarithmic=True),
        Parameter('load_exponent', '-', 0.0, 2.0, starts=(0.3, 1.0)),
    ),
    stages={'load': _load},
    equation='T_L = T_L(θ) ± ratio/c·T_peak·(T_L/T_peak)^γ·z, dz/dθ = (1 − z sgn ω)/distance',
    reference='Bouc (1967), Wen (1976); Coleman and Hodgdon, Int. J. Eng. Sci. 24 (1986) 897',
    statement=lambda p: (
        "The caliper's load lies on a loop: half its width is "
        f"{p['hysteresis_ratio'] * 100:.1f} % of the peak load, with memory of the turning "
        f"points over about {p['memory_distance']:.2g} rad."
        + (' It is higher while releasing: the load follows late.' if p['sense'] < 0 else '')),
    reveals='since_reversal',
    constants=(('peak_load', 'N·m'), ('sense', '-'), ('reach', 'rad'),
               ('elements', '-')),
    set_constants=lambda scene: {
        'peak_load': max(scene.largest_load, 1e-9),
        'reach': max(scene.position_range[1] - scene.position_range[0], 1e-9)},
    applies=lambda scene: scene.largest_load > 0,
    # A caliper's friction makes applying the harder way; play in the load path the easier one.
    # The memory forgets, or consists of elements that each keep their turning point.
    variants=tuple({'sense': sense, 'elements': elements}
                   for sense in (1.0, -1.0) for elements in (0.0, 1.0)),
    # A loop of the second sense gives energy; a friction that ages at rest can look like it.
    credence=lambda p: 1.0 if p['sense'] > 0 else 0.95,
)
