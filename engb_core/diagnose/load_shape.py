"""Does the load curve have another form than the model file can give it?

A polynomial or a sinusoid need not follow a real load. What it leaves lies along the angle,
whatever else is missing, and hides it: so the question is put beside the best effects found with
the file's form, and where a table is worth having, all effects are asked for again beside it.
"""

from __future__ import annotations

import numpy as np

from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.nominal import SHAPE_NUMBERS
from engb_core.diagnose.numbers import INSISTED, level, NumberFinding
from engb_core.diagnose.selection import Selection, worth_a_further_effect
from engb_core.effects.load_curve_shape import EFFECT

__all__ = ['LOAD_SHAPE', 'load_shape_finding', 'with_free_load_curve']

LOAD_SHAPE = EFFECT.id


def with_free_load_curve(fitter: Fitter, selection: Selection) -> Fitter | None:
    """Return what fits with a table beside the file's load curve, where that is worth as much
    beside the chosen effects as a further effect would have to be; None where it is not."""
    scene = fitter.problem.scene
    if fitter.load_shape or EFFECT.applies is None or not EFFECT.applies(scene):
        return None
    free = Fitter(fitter.problem, fitter.threads, fitter.earlier or fitter, load_shape=True)
    chosen = selection.chosen
    kept = dict(zip((number.name for number in chosen.hypothesis.numbers), chosen.vector,
                    strict=False))
    hypothesis = free.hypothesis(chosen.hypothesis.variants)
    start = hypothesis.start_of_numbers()
    for place, number in enumerate(hypothesis.numbers):
        start[place] = kept.get(number.name, start[place])
    vector = [*start, *chosen.vector[len(chosen.hypothesis.numbers):]]
    fit = free.refine(free.evaluate(hypothesis, np.array(vector)))
    # By the one measure of noise for both.
    if worth_a_further_effect(level(chosen, fitter) - 1.0, level(fit, fitter) - 1.0,
                              selection.excess_before):
        return free
    return None


def load_shape_finding(fitter: Fitter, explained: Fit) -> NumberFinding | None:
    """Return the table beside the load curve as a finding, where the data insist on it."""
    if not fitter.load_shape:
        return None
    numbers = explained.hypothesis.numbers
    held = fitter.refit(explained, tuple(number for number in numbers
                                         if number.name not in SHAPE_NUMBERS))
    rise = level(held, fitter) - level(explained, fitter)
    if rise < INSISTED:
        return None
    values = [value for number, value in zip(numbers, explained.vector, strict=False)
              if number.name in SHAPE_NUMBERS]
    return NumberFinding(LOAD_SHAPE, explained, rise, float(max(values, key=abs)))
