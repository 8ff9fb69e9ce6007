# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Does what is not surely named carry over to another recording? Else it is not in the model.

Refitted numbers and tables follow the motion that they were fitted to, whatever is missing: on the
next recording, which moves in other ways, they may be worse than the file. So each must explain
more than half of what the file misses of stretches that it was not fitted to, tables and
descriptions also of kinds of motion: right more often than wrong where nothing else says that it
is right at all. What grows over the recordings' time passes but once, and nothing that was left
out tells how it goes on: it is in the model if it is likelier right than wrong. What begins within
them acts from then on as anything else, and must be worth having there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from engb_core.diagnose.constants import LARGER_PART
from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.full_bandwidth import CorrectedModels, explained_problem
from engb_core.diagnose.hypothesis import Variant
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.ranking import worth_having
from engb_core.diagnose.unknown.flexible import left_out
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.laws.blocks import (
    Blocks,
    kinds_of_motion,
    numbers_and_sizes,
    stretches_of_time,
)

__all__ = ['that_carries', 'without_what_passes_once']


def without_what_passes_once(fitter: Fitter, told: CorrectedModels,
                             findings: Sequence[EffectFinding]) -> CorrectedModels:
    """Return what is told without effects that are likelier wrong than right and grow over the
    recordings' time, or begin within them and are not worth having after that, on what no fit has
    seen; the rest fitted anew.

    Args:
        fitter: of the problem.
        told: effects and numbers, with or without a name.
        findings: what is claimed of them.
    """
    likely = {entry.effect for entry in findings if entry.probability >= LARGER_PART}

    def doubtful(variant: Variant) -> bool:
        return variant.effect.id not in likely

    told = _without(fitter, told, lambda variant: doubtful(variant) and _grows(variant))
    fewer = _without(fitter, told, lambda variant: doubtful(variant)
                     and variant.onset is not None)
    if fewer is told or worth_having(min(told.unseen), min(fewer.unseen)):
        return told
    return fewer


def _grows(variant: Variant) -> bool:
    """Whether an effect grows over the recordings' time; one that is there at once does not."""
    return any(entry.name in variant.effect.at_once for entry in variant.effect.parameters)


def _without(fitter: Fitter, told: CorrectedModels, gone: Callable[[Variant], bool],
             ) -> CorrectedModels:
    """Return what is told without some of its effects, the rest fitted anew."""
    fit = told.explanation.fit
    places = {place for place, variant in enumerate(fit.hypothesis.variants) if gone(variant)}
    if not places:
        return told
    fewer = fitter.finished_without(fit, places)
    explanation = Explanation(fewer, None, told.explanation.dropped)
    return CorrectedModels(explanation, explanation.models(), explained_problem(fitter, fewer),
                           fewer)


def that_carries(fitter: Fitter, nominal: Fit, told: CorrectedModels) -> CorrectedModels:
    """Return what is told without the models that do not carry over.

    Args:
        fitter: of the problem.
        nominal: the file as it stands.
        told: descriptions and refitted numbers, the fullest model first.
    """
    fit, table = told.explanation.fit, told.explanation.table
    # Effects that describe the rest are asked for their size on every kind of motion. Numbers
    # are asked on stretches alone: slow motion tells no inertia, but gives no reason to doubt it.
    count = len(fit.hypothesis.numbers)
    stretches = stretches_of_time(fitter)
    several = [labels for labels in (stretches, *kinds_of_motion(fitter))
               if np.unique(labels[fitter.fitted]).size > 1]
    if fit.hypothesis.variants:
        kinds, free = several, numbers_and_sizes(fit)[count:]
    else:
        # A free load curve is a table, though it stands among the numbers.
        kinds, free = several if fitter.load_shape else [stretches], list(range(count))
    weighted = (nominal.residual * fitter.weight) ** 2
    missed = float(np.sum(weighted) / np.sum((fitter.sigma * fitter.weight) ** 2))

    def enough(left: float) -> bool:
        return left - 1.0 < LARGER_PART * (missed - 1.0)

    kept = told.models
    if not all(enough(Blocks(fitter, fit, labels, free).without().level) for labels in kinds):
        kept = kept[:-1]
    if table is not None and not all(
            enough(left_out(fitter, fit, table.table, labels)) for labels in several):
        kept = kept[1:]
    return replace(told, models=kept)
