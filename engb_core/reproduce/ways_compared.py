# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How far each way of identifying is off, in words made from the numbers of many noise seeds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engb_core.report.wording import MINUS
from engb_core.reproduce.results import BrakeResults
from engb_core.reproduce.ways import COARSE_COUNTS, COARSE_INTERVAL, CUTOFFS, Spread

__all__ = ['judgement', 'told']

JOINT = 'joint regression, J, B and cogging known from the free motor'

# How each number is told: factor, unit, digits.
SHOWN = {'load': (1e3, ' mN·m', 2), 'coulomb': (1e3, ' mN·m', 2), 'load_gain': (1.0, '', 4),
         'mismatch': (1e3, ' mrad', 0)}


def judgement(brake: BrakeResults) -> list[str]:
    """Return paragraphs on how far each way is off on one brake.

    What is told of one number is its mean over the seeds, with the standard deviation over them.
    """
    good, poor, coarse = (_by_way(brake.strokes.spreads, name) for name in _recordings(brake))
    mirrored = poor['no phase shift, paired by the reference’s time']
    nearest, few = poor['no phase shift'], poor['no phase shift, 40 grid points']
    bare, cured = (f'causal observer, {CUTOFFS[0]:g} Hz',
                   f'causal observer, {CUTOFFS[0]:g} Hz, position through q too')
    slow = f'causal observer, {CUTOFFS[-1]:g} Hz'
    slow_cured = f'{slow}, position through q too'
    known = 'no phase shift, J and B of the joint regression'
    true = brake.truth.model.friction
    seeds = len(nearest.each)
    count = f'{seeds} noise seeds' if seeds > 1 else 'one noise seed only'
    found = [
        f'The {brake.label}: true C₀ {1e3 * true.coulomb:.2f} mN·m, C₁ {true.load_gain:.4f}. '
        f'Each number here is the mean over {count}, with the standard deviation over them.',
        'The observer. The paper’s is causal: its torque lags behind the position that it is '
        f'drawn over, and C₁ comes out {told(good[bare], "load_gain")} off at {CUTOFFS[0]:g} Hz, '
        f'{told(good[slow], "load_gain")} at {CUTOFFS[-1]:g} Hz. With the position through q as '
        f'well it is {told(good[cured], "load_gain")} and '
        f'{told(good[slow_cured], "load_gain")}; without any phase shift, as one may offline, '
        f'{told(good["no phase shift"], "load_gain")}.',
        'Step 3. Under poor tracking, samples paired by the reference’s time lie '
        f'{told(mirrored, "mismatch")} apart (rms), the load is off by {told(mirrored, "load")} '
        f'and C₁ by {told(mirrored, "load_gain")}. Nearest neighbours lie '
        f'{told(nearest, "mismatch")} apart; the load is off by {told(nearest, "load")}, C₁ by '
        f'{told(nearest, "load_gain")}, with a tenth of the grid points by '
        f'{told(few, "load_gain")}, interpolated by '
        f'{told(poor["no phase shift, interpolated"], "load_gain")}.',
        'The classical step test. What it puts too much into B is missing from C₀: '
        f'{told(good["no phase shift"], "coulomb")}; with J and B of the joint regression in its '
        f'place {told(good[known], "coulomb")}.',
        'Joint regression, which pairs nothing, with J, B and cogging from the free motor: load '
        f'{told(good[JOINT], "load")}, C₀ {told(good[JOINT], "coulomb")}, C₁ '
        f'{told(good[JOINT], "load_gain")}; on the poorly tracked strokes '
        f'{told(poor[JOINT], "load")}, {told(poor[JOINT], "coulomb")} and '
        f'{told(poor[JOINT], "load_gain")}.',
    ]
    if seeds > 1:
        found.append(
            f'At {1.0 / COARSE_INTERVAL:.0f} Hz and {COARSE_COUNTS} counts a revolution, the low '
            f'precision that the paper complains of: load {_nearest(coarse, "load")}; C₀ '
            f'{_nearest(coarse, "coulomb")}; C₁ {_nearest(coarse, "load_gain")}.')
    return found


def told(spread: Spread, name: str) -> str:
    """Return one of Bias' numbers as text: its mean, and its deviation over the seeds."""
    factor, unit, digits = SHOWN[name]
    sign = '+' if name in ('coulomb', 'load_gain') else ''
    text = f'{factor * spread.mean(name):{sign}.{digits}f}'
    if len(spread.each) > 1:
        text += f' ± {factor * spread.deviation(name):.{digits}f}'
    return text.replace('-', MINUS) + unit


def _recordings(brake: BrakeResults) -> list[str]:
    return list(dict.fromkeys(entry.recording for entry in brake.strokes.spreads))


def _by_way(spreads: Sequence[Spread], recording: str) -> dict[str, Spread]:
    return {entry.way: entry for entry in spreads if entry.recording == recording}


def _nearest(ways: dict[str, Spread], name: str) -> str:
    """Return which ways come nearest: the best, and those that the seeds do not tell from it."""
    def size(entry: Spread) -> np.ndarray:
        return np.abs([getattr(bias, name) for bias in entry.each])

    best = min(ways.values(), key=lambda entry: float(size(entry).mean()))
    alike = []
    for way, entry in ways.items():
        # The same noise fed both: seed by seed, is the difference told from none at two sigma?
        apart = size(entry) - size(best)
        if entry is best or apart.mean() <= 2.0 * apart.std(ddof=1) / np.sqrt(apart.size):
            alike.append(f'“{way}” ({told(entry, name)})')
    return 'nearest by ' + ', or as well by '.join(alike)
