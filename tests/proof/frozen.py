# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The frozen list of continuous integration: short cases by their seed, and the rates they keep.

One case that fails breaks nothing; a rate that falls does. Each of the four rates was measured on
this very list (MEASURED, by `engb prove --frozen --jobs 2 --out DIR`). With p its estimate
(hits + 1/2) / (n + 1), after Jeffreys, so that not even a full score makes p = 1, the least number
of hits that passes is the 1 % quantile of the binomial distribution of n and p: a change that
leaves the true rate as it was fails one time in a hundred or less. After a change that raises the
rates the numbers of MEASURED are raised by hand, to what the command prints.
"""
from __future__ import annotations

from collections.abc import Sequence

from scipy.stats import binom

from .score import CaseScore

__all__ = ['FROZEN', 'frozen_rates', 'least_hits', 'LEVEL', 'MEASURED']

FROZEN = {'cases': 48, 'seed': 20261123,
          'strata': 'clean=12,strong=12,subtle=7,pair=5,triple=2,described=4,undescribed=6'}
LEVEL = 0.01
# At d83d342.
MEASURED = {
    'named first (of several: all)': (20, 26),
    'no harm': (48, 48),
    'silent on clean recordings': (12, 12),
    'no confident wrong name outside the library': (9, 10)}


def least_hits(hits: int, of: int, count: int, level: float = LEVEL) -> int:
    """The fewest hits of `count` that a rate measured as `hits` of `of` lets expect."""
    return int(binom.ppf(level, count, (hits + 0.5) / (of + 1.0)))


def frozen_rates(scores: Sequence[CaseScore]) -> dict[str, dict[str, object]]:
    """Of each of the four rates: hits, number, what was measured, the least that passes."""
    outside = [c for c in scores if c.outside]
    inside = [c for c in scores if c.hidden and not c.outside]
    clean = [c for c in scores if not c.hidden]
    rates = {
        'named first (of several: all)': [
            c.named_first if len(c.hidden) == 1 else c.all_named for c in inside],
        'no harm': [not c.harm and c.failure is None for c in scores],
        'silent on clean recordings': [not c.alarm for c in clean],
        'no confident wrong name outside the library': [
            not c.confident_wrong and c.failure is None for c in outside]}
    found: dict[str, dict[str, object]] = {}
    for name, right in rates.items():
        hits, of = MEASURED[name]
        found[name] = {'hits': sum(map(bool, right)), 'of': len(right),
                       'measured': f'{hits} of {of}',
                       'least': least_hits(hits, of, len(right))}
    return found
