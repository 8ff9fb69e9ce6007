"""How far the load twists a drivetrain that resonates.

The resonance tells how stiff the drivetrain is in small motion; the load's curve, as the model
file has it, tells how far the load twists it. Both are one thing where the shaft is linear.
"""

from __future__ import annotations

from dataclasses import replace

from engb_core.diagnose.fit import Fitter
from engb_core.diagnose.held_load import numbers_without_load
from engb_core.diagnose.numbers import level
from engb_core.diagnose.problem import Problem
from engb_core.diagnose.side_by_side import side_by_side
from engb_core.diagnose.wide_band import RESONANCE, RIVAL
from engb_core.model import EffectSetting

__all__ = ['with_resonance']

LINEAR = 1.0
# Twists by the load that are tried, in parts of what a linear drivetrain would give.
TRIED = (0.0, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, LINEAR, 1.2)
# Mean square that refitted numbers may leave, as a multiple of the least, for a twist to be one
# that the motion allows.
ALLOWED = 1.1
# A linear drivetrain is preferred up to this multiple of what the file's load curve leaves.
PREFERRED = 1.6


def with_resonance(problem: Problem, resonance: EffectSetting, threads: int) -> Problem:
    """Return the problem with a resonance in its model, twisted by the load as the motion allows
    and as the file's load curve fits best. Its rival is settled with it."""
    def tried(part: float) -> tuple[Problem, float, float]:
        setting = replace(resonance, parameters={**resonance.parameters, 'load_beyond': part})
        beyond = replace(problem, settled=(*problem.settled, RESONANCE, RIVAL), model=replace(
            problem.model, effects=(*problem.model.effects, setting)))
        fitter = Fitter(beyond)
        return (beyond, level(fitter.base(), fitter),
                level(fitter.base(numbers_without_load(fitter)), fitter))

    found = dict(zip(TRIED, side_by_side(tried, TRIED, threads), strict=True))
    least = min(free for _, free, _ in found.values())
    allowed = [part for part in TRIED if found[part][1] <= ALLOWED * least]
    best = min(allowed, key=lambda part: found[part][2])
    if LINEAR in allowed and found[LINEAR][2] <= PREFERRED * found[best][2]:
        best = LINEAR
    return found[best][0]
