# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How far the load winds up a drivetrain that resonates.

The resonance tells how stiff the drivetrain is in small motion; the load's curve, as the model
file has it, tells how far the load twists it. Both are one thing where the shaft is linear.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.numbers.held_load_curve import numbers_without_load
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.problem import Problem
from engb_core.diagnose.resonance.wide_band import RESONANCE, RIVAL
from engb_core.diagnose.score.ranking import little_more
from engb_core.diagnose.score.reduced_chi_square import excess
from engb_core.effects.catalogue import get_effect
from engb_core.model import EffectSetting

__all__ = ['with_resonance']

LINEAR = 1.0
# Twists by the load that are tried, in parts of what a linear drivetrain would give.
TRIED = (0.0, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, LINEAR, 1.2)


def with_resonance(problem: Problem, resonance: EffectSetting, threads: int) -> Problem:
    """Return the problem with a resonance in its model, twisted by the load as the motion allows
    and as the file's load curve fits best; or with play as it is. Its rival is settled with it."""
    settled = replace(problem, settled=(*problem.settled, RESONANCE, RIVAL))

    def beyond_of(setting: EffectSetting) -> Problem:
        return replace(settled, model=replace(
            problem.model, effects=(*problem.model.effects, setting)))

    if resonance.effect == RIVAL:
        return beyond_of(resonance)

    def tried(part: float) -> _Tried:
        setting = replace(resonance, parameters={**resonance.parameters, 'load_beyond': part})
        beyond = beyond_of(setting)
        fitter = Fitter(beyond)
        held = fitter.base(numbers_without_load(fitter))
        return _Tried(beyond, excess(fitter.base(), fitter), excess(held, fitter),
                      _scaled(fitter, held) if part == LINEAR else np.inf)

    found: dict[float, _Tried] = dict(zip(TRIED, parallel_map(tried, TRIED, threads),
                                          strict=True))
    least = min(entry.free for entry in found.values())
    # The motion allows a twist beside which refitted numbers leave little more than beside any.
    allowed = [part for part in TRIED if little_more(found[part].free, least)]
    best = min((found[part] for part in allowed), key=lambda entry: entry.held)
    linear = found[LINEAR]
    # A linear drivetrain is the simpler one; the file's load curve may be scaled beside it.
    if LINEAR in allowed and (little_more(linear.held, best.held) or (
            linear.scaled <= best.held and little_more(linear.scaled, linear.free))):
        best = linear
    return best.problem


@dataclass(frozen=True)
class _Tried:
    """A problem with the drivetrain twisted so far, and the excess that a free load curve leaves,
    the file's, and the file's when it is scaled."""

    problem: Problem
    free: float
    held: float
    scaled: float


def _scaled(fitter: Fitter, held: Fit) -> float:
    """Return the excess that the file's load curve leaves when it is scaled."""
    (variant,) = variants_of(get_effect('load_stiffness_error'), fitter.problem.scene)
    return excess(fitter.refine(fitter.fit(variant, held)), fitter)
