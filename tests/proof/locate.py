# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Scores of where the mismatch lies: in time, and in the coordinates.

In time, truth is the smallest set of samples that holds 80 % of the energy which the hidden
effects add to the model on the training recordings (low-passed at 20 Hz, standstill masked), over
all recordings together; precision = named and true / named, recall = named and true / true, and
chance = true / all samples in motion: what precision naming everything would have.

In the coordinates, a named zone of position or velocity truly holds the share of that energy that
was added while the shaft was in the zone; beside it stands the share of the time in motion.

Of an effect that begins in mid-recording: whether a rightly claimed effect tells an onset, and how
far off its time is; of effects that act throughout, whether one is told that does not exist.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from .nominal import moving

__all__ = ['in_time', 'in_zones', 'onset_told', 'OnsetScore', 'Stretch', 'TimeScore',
           'true_samples']

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


@dataclass(frozen=True)
class OnsetScore:
    """Whether the effect begins in mid-recording, whether an onset is told, its error [s].

    The error is None where no onset is told, none is true, or it is told in another recording.
    """

    begins: bool
    told: bool
    error: float | None


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


def onset_told(claims: Sequence[dict], onset: tuple[str, float] | None, recordings: int
               ) -> OnsetScore | None:
    """Score the onset told by `claims`, which are right; `onset`: recording and time [s].

    None where nothing was rightly claimed and nothing begins in mid-recording.
    """
    if onset is None and not claims:
        return None
    told = [one['onset'] for one in claims if isinstance(one.get('onset'), dict)]
    if onset is None or not told:
        return OnsetScore(onset is not None, bool(told), None)
    errors = []
    for one in told:
        where = str(one.get('recording', '')).partition('.')[0]
        time = one.get('time')
        if (recordings == 1 or where == onset[0]) and isinstance(time, int | float) \
                and math.isfinite(time):
            errors.append(abs(float(time) - onset[1]))
    return OnsetScore(True, True, min(errors) if errors else None)


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
