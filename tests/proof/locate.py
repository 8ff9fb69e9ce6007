"""Scores of where the mismatch lies: in time, and in the coordinates.

In time, truth is the smallest set of 20 ms bins holding 90 % of the energy that the hidden
effects add to the lacking model on `train` (low-passed, standstill masked, smeared over 0.1 s,
holes up to 0.2 s closed); precision = named and true / named duration, recall = named and true /
true duration.

In the coordinates, a named zone of position or velocity truly holds the share of that energy that
was added while the shaft was in the zone; beside it stands the share of the time in motion.
"""
from __future__ import annotations

import numpy as np

from .nominal import moving
from .sealing import BIN

__all__ = ['in_time', 'in_zones', 'true_bins']


def true_bins(energy: np.ndarray, share: float = 0.9) -> np.ndarray:
    """Which bins hold the mismatch (see the module's text)."""
    if energy.sum() <= 0.0:
        return np.zeros(energy.size, bool)
    wide = np.convolve(energy, np.ones(5) / 5.0, mode='same')
    order = np.argsort(wide)[::-1]
    count = int(np.searchsorted(np.cumsum(wide[order]), share * wide.sum())) + 1
    chosen = np.zeros(energy.size, bool)
    chosen[order[:count]] = True
    spots = np.flatnonzero(chosen)
    for a, b in zip(spots[:-1], spots[1:], strict=True):
        if 1 < b - a <= 10:
            chosen[a:b] = True
    return chosen


def in_time(diagnosis: dict, energy: np.ndarray) -> tuple[float | None, float | None]:
    """Precision and recall of the stretches of time that were named."""
    true = true_bins(energy)
    middle = (np.arange(energy.size) + 0.5) * BIN
    claimed = np.zeros(energy.size, bool)
    for one in diagnosis.get('mismatch', {}).get('time', []):
        claimed |= (middle >= one['from']) & (middle <= one['to'])
    hit = float((claimed & true).sum())
    precision = hit / claimed.sum() if claimed.any() else None
    recall = hit / true.sum() if true.any() else None
    return precision, recall


def in_zones(diagnosis: dict, arrays: dict[str, np.ndarray]
             ) -> tuple[tuple[str, float, float, float], ...]:
    """(variable, share said, share of the true energy, share of the time in motion) of each zone.

    Only of zones in position and velocity; a truth sealed without positions has none.
    """
    energy = arrays['train_energy'].astype(float)
    if 'train_position' not in arrays or energy.sum() <= 0.0:
        return ()
    along = {name: arrays[f'train_{name}'][1::2][:energy.size].astype(float)
             for name in ('position', 'velocity')}
    count = along['velocity'].size
    energy, moves = energy[:count], moving(along['velocity'])
    rows = []
    for zone in diagnosis.get('mismatch', {}).get('where', []):
        if zone['variable'] in along:
            place = along[zone['variable']]
            inside = (place >= zone['from']) & (place <= zone['to'])
            rows.append((zone['variable'], float(zone['share']),
                         float(energy[inside].sum() / energy.sum()),
                         float((inside & moves).sum() / max(moves.sum(), 1))))
    return tuple(rows)
