# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The search, begun again where its first round shows that the recordings are not as they were
taken to be: noise that can be predicted is none, and effort that comes later than samples can be
apart was not sampled late."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from engb_core.diagnose.formula import no_more
from engb_core.diagnose.noise_level import predicted_of_noise
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import Problem, with_less_noise
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.search.every_effect import Search, search
from engb_core.diagnose.selection import select, Selection
from engb_core.diagnose.timing import LAG, later_than_sampled

__all__ = ['searched']


def searched(problem: Problem, tell: Callable[[str], None], threads: int,
             earlier: Fitter | None = None, found: Fit | None = None,
             ) -> tuple[Search, Selection]:
    """Return the fits that the search finds, and what is chosen of them.

    Args:
        problem: recordings and model.
        tell: is told what is being done.
        threads: that fit side by side.
        earlier: fits of an earlier round, of which a refit of the file can be told.
        found: what an earlier round has chosen.
    """
    if earlier is not None and earlier.problem.sampled_together:
        # It was found so before.
        problem = replace(problem, sampled_together=True)
    fitter = Fitter(problem, threads, earlier)
    tell('refitting the nominal numbers')
    by_form = search(fitter, tell, found)
    selection = select(by_form)
    noise_part = predicted_of_noise(by_form) if selection.consistent else None
    if noise_part is not None:
        tell('beginning again: most of what passed for noise can be predicted')
        problem, earlier, found = with_less_noise(problem, noise_part), None, None
        by_form = search(Fitter(problem, threads), tell)
        selection = select(by_form)
    if later_than_sampled(by_form.fitter, selection.chosen):
        tell('beginning again: torque comes later than samples are apart')
        prompt = Fitter(replace(problem, sampled_together=True), threads, earlier)
        again = search(prompt, tell, found)
        late = select(again)
        if LAG in late.chosen.hypothesis.ids and no_more(*(
                reduced_chi_square(entry.chosen, by_form.fitter) for entry in (late, selection))):
            by_form, selection = again, late
    return by_form, selection
