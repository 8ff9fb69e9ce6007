# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Is the best named physics good enough to be named? Tried against a flexible model.

Where tables over the recorded coordinates explain so much of what the best effects leave that an
effect is likelier a makeshift than physics, its name is not given, and the table (or a line of
fixed frequency) is what the corrected model gets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import (
    FORMULA_ERROR,
    LARGER_PART,
    WORTH_PART,
)
from engb_core.diagnose.formula import chance_part, something_known
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.unknown.flexible import best_table, Flexible, form_left
from engb_core.model import EffectSetting, Model

__all__ = ['Explanation', 'explain']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Explanation:
    """What is kept: a finished fit (named effects, perhaps an unnamed line), perhaps a table.

    Attributes:
        fit: named effects and numbers, finished.
        table: what describes the rest, or None.
        dropped: effects that fitted best but were not good enough to be named.
        carried_over: whether those were better than the file on what no fit has seen.
    """

    fit: Fit
    table: Flexible | None
    dropped: tuple[str, ...] = ()
    carried_over: bool = True

    def model(self) -> Model:
        """Return the corrected model file."""
        vector = self.fit.vector
        settings: tuple[EffectSetting, ...] = ()
        if self.table is not None:
            vector = np.clip(vector + self.table.numbers, *self.fit.hypothesis.bounds)
            settings = (self.table.table.setting(self.table.values),)
        model = self.fit.hypothesis.corrected(vector)
        if not settings:
            return model
        return replace(model, effects=(*model.effects, *settings))

    def models(self) -> tuple[Model, ...]:
        """Return the corrected model and, where it has a table, the one without it."""
        if self.table is None:
            return (self.model(),)
        return self.model(), replace(self, table=None).model()


def explain(fitter: Fitter, chosen: Fit) -> Explanation:
    """Hold the chosen effects against flexible models, and decide what is named."""
    after = reduced_chi_square(chosen, fitter)
    if after - 1.0 < FORMULA_ERROR:
        return Explanation(chosen, None)
    before = max(reduced_chi_square(fit, fitter) for fit in (fitter.nominal(), fitter.base()))
    rest = _described(fitter, chosen)
    if not chosen.hypothesis.variants:
        return _kept(rest, chosen, after, ())
    gain = before - after
    further = max(after - rest[2], 0.0)
    adequacy = gain / max(gain + further, 1e-9)
    if something_known(1.0 - adequacy, 1.0) >= LARGER_PART:
        # Whatever the form of each over its own coordinate is.
        return _kept(rest, chosen, after, ())
    # What more could be explained is not theirs where their own form is right.
    likely = [index for index, variant in enumerate(chosen.hypothesis.variants)
              if something_known(1.0 - adequacy, form_left(
                  fitter, fitter.without(chosen, index), chosen, variant.effect.reveals))
              >= LARGER_PART]
    if len(likely) == len(chosen.hypothesis.variants):
        return _kept(rest, chosen, after, ())
    base = fitter.finished_base
    alone = _described(fitter, base)
    if alone[2] > rest[2] + chance_part() * (after - rest[2]):
        # The table needs the effects: they are part of the truth, if not all of it.
        return _kept(rest, chosen, after, ())
    dropped = tuple(variant.effect.id for index, variant in enumerate(chosen.hypothesis.variants)
                    if index not in likely)
    if likely:
        for index in reversed(range(len(chosen.hypothesis.variants))):
            if index not in likely:
                chosen = fitter.without(chosen, index)
        base = fitter.finish(fitter.refine(chosen))
        alone = _described(fitter, base)
    return _kept(alone, base, reduced_chi_square(base, fitter), dropped)


def _kept(rest: tuple[Fit, Flexible | None, float], fit: Fit, after: float,
          dropped: tuple[str, ...]) -> Explanation:
    described, table, reached = rest
    if after - reached < max(FORMULA_ERROR, WORTH_PART * (after - 1.0)):
        return Explanation(fit, None, dropped)
    return Explanation(described, table, dropped)


def _described(fitter: Fitter, fit: Fit) -> tuple[Fit, Flexible | None, float]:
    """Return the fit, the table that describes most of its rest, and the level they reach."""
    table = best_table(fitter, fit)
    return fit, table, reduced_chi_square(fit, fitter) if table is None else table.level
