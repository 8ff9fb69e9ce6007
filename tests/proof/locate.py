"""Scores of where the mismatch lies: in time, and in the coordinates.

In time, truth is the smallest set of samples that holds 80 % of the energy which the hidden
effects add to the model on the training recordings (low-passed at 20 Hz, standstill masked), over
all recordings together; precision = named and true / named, recall = named and true / true, and
chance = true / all samples in motion: what precision naming everything would have.

In the coordinates, a named zone of position or velocity truly holds the share of that energy that
was added while the shaft was in the zone; beside it stands the share of the time in motion.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .nominal import moving

__all__ = ['in_time', 'in_zones', 'Stretch', 'TimeScore', 'true_samples']

BIN = 0.02  # s: the grain of a sealed truth's energy over time
_SHARE = 0.8


@dataclass(frozen=True)
class Stretch:
    """One recording: its name without suffix, times [s], the mismatch's energy, whether judged."""

    recording: str
    time: np.ndarray
    energy: np.ndarray
    judged: np.ndarray


@dataclass(frozen=True)
class TimeScore:
    """Precision and recall of the named stretches of time, and what chance would have."""

    precision: float
    recall: float
    chance: float


def true_samples(energy: np.ndarray, share: float = _SHARE) -> np.ndarray:
    """Which samples hold `share` of the energy: the fewest that do."""
    chosen = np.zeros(energy.size, bool)
    if energy.sum() <= 0.0:
        return chosen
    order = np.argsort(energy)[::-1]
    count = int(np.searchsorted(np.cumsum(energy[order]), share * energy.sum())) + 1
    chosen[order[:count]] = True
    return chosen


def in_time(diagnosis: dict, stretches: Sequence[Stretch]) -> TimeScore | None:
    """Precision, recall and chance of the stretches of time that were named."""
    if not stretches:
        return None
    judged = np.concatenate([one.judged for one in stretches])
    energy = np.where(judged, np.concatenate([one.energy for one in stretches]), 0.0)
    if energy.sum() <= 0.0 or not judged.any():
        return None
    true = true_samples(energy)
    names = [one.recording for one in stretches]
    parts = []
    for one in stretches:
        named = np.zeros(one.time.size, bool)
        for span in (diagnosis.get('mismatch') or {}).get('time') or []:
            # Without a recording that is known, a span is taken for all of them.
            of = str(span.get('recording', '')).partition('.')[0]
            if len(names) == 1 or of not in names or of == one.recording:
                named |= (one.time >= span['from']) & (one.time <= span['to'])
        parts.append(named)
    named = np.concatenate(parts) & judged
    return TimeScore(float((named & true).sum() / named.sum()) if named.any() else 0.0,
                     float((named & true).sum() / true.sum()),
                     float(true.sum() / judged.sum()))


def in_zones(diagnosis: dict, arrays: dict[str, np.ndarray]
             ) -> tuple[tuple[str, float, float, float], ...]:
    """(variable, share said, share of the true energy, share of the time in motion) of each zone.

    Only of zones in position and velocity; a truth sealed without positions has none. `arrays`
    holds train_energy per BIN and train_position, train_velocity every 10 ms, and the speed
    below which the shaft counts as standing.
    """
    energy = np.asarray(arrays.get('train_energy', ()), float)
    if 'train_position' not in arrays or energy.sum() <= 0.0:
        return ()
    along = {name: arrays[f'train_{name}'][1::2][:energy.size].astype(float)
             for name in ('position', 'velocity')}
    count = along['velocity'].size
    energy, moves = energy[:count], moving(along['velocity'] / arrays.get('unit', 1.0))
    rows = []
    for zone in (diagnosis.get('mismatch') or {}).get('where') or []:
        if zone['variable'] in along:
            place = along[zone['variable']]
            inside = (place >= zone['from']) & (place <= zone['to'])
            rows.append((zone['variable'], float(zone['share']),
                         float(energy[inside].sum() / energy.sum()),
                         float((inside & moves).sum() / max(moves.sum(), 1))))
    return tuple(rows)
