# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Survey results as rows: one per recording, and one per number that a diagnosis gave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

__all__ = ['CLAIMED', 'Entry', 'Measure', 'effect_rows', 'measures_of', 'recording_rows']

# An effect counts as found on a unit from this probability on.
CLAIMED = 0.5
DAY = 86400.0


@dataclass(frozen=True)
class Entry:
    """One brake in one recording.

    Attributes:
        key: the recording's; several brakes in one recording share it.
        unit: which brake.
        mileage: [km] or None.
        result: plain data as a worker gave it; `status` is 'ok', 'refused', 'fault' or 'lost'.
    """

    key: str
    unit: str
    mileage: float | None
    result: Mapping[str, Any]

    @property
    def good(self) -> bool:
        """Whether there is a diagnosis."""
        return bool(self.result['status'] == 'ok')

    @property
    def start(self) -> float | None:
        """When it was recorded, in seconds of the Unix epoch, or None."""
        return self.result.get('start') if self.good else None

    @property
    def effects(self) -> list[Mapping[str, Any]]:
        """The diagnosis's effects as in diagnosis.json."""
        return list(self.result['document']['effects']) if self.good else []

    @property
    def claimed(self) -> dict[str, Mapping[str, Any]]:
        """The effects that count as found, by name."""
        return {effect['effect']: effect for effect in self.effects
                if effect['probability'] >= CLAIMED}

    def held_out(self, quantity: str = 'effort') -> Mapping[str, Any] | None:
        """Return the first held-out figure of a quantity."""
        if not self.good:
            return None
        return next((fit for fit in self.result['document']['fit']['held_out']
                     if fit['quantity'] == quantity), None)


@dataclass(frozen=True)
class Measure:
    """One number of one recording: a nominal number, or a parameter of an effect.

    `quantity` names it ('inertia', 'stribeck_friction.breakaway_ratio'); `std` may be None.
    """

    quantity: str
    unit_of_measure: str
    key: str
    unit: str
    value: float
    std: float | None
    days: float | None
    mileage: float | None


def measures_of(entries: Sequence[Entry]) -> list[Measure]:
    """Return all numbers of all diagnoses; `days` counts from the first recording."""
    starts = [entry.start for entry in entries if entry.start is not None]
    origin = min(starts, default=0.0)
    found = []
    for entry in entries:
        if not entry.good:
            continue
        days = None if entry.start is None else (entry.start - origin) / DAY
        numbers = [(change['name'], change['after'], change['std'], change['unit'])
                   for change in entry.result.get('nominal', ())]
        for name, effect in entry.claimed.items():
            numbers += [(f'{name}.{parameter}', value['value'], value['std'], value['unit'])
                        for parameter, value in effect['parameters'].items()]
        for quantity, value, std, unit in numbers:
            if value is not None and math.isfinite(value):
                found.append(Measure(quantity, unit, entry.key, entry.unit, float(value),
                                     std if std is not None and std > 0 else None, days,
                                     entry.mileage))
    return found


def recording_rows(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Return one row per brake and recording, for a table file."""
    rows = []
    for entry in entries:
        first = max(entry.effects, key=lambda effect: effect['probability'], default={})
        fit = entry.held_out() or {}
        rows.append({
            'recording': entry.key, 'namespace': entry.result.get('namespace'),
            'unit': entry.unit, 'mileage_km': entry.mileage, 'start_s': entry.start,
            'duration_s': entry.result.get('duration'), 'samples': entry.result.get('samples'),
            'status': entry.result['status'], 'message': entry.result['message'],
            'verdict': entry.result['document']['verdict'] if entry.good else None,
            'effects': ' '.join(entry.claimed) if entry.good else None,
            'first_effect': first.get('effect'), 'first_probability': first.get('probability'),
            'first_share': first.get('share'), 'rms_before': fit.get('rms_before'),
            'rms_after': fit.get('rms_after'), 'noise_floor': fit.get('noise_floor'),
            'rms_unit': fit.get('unit'), 'seconds': entry.result.get('seconds'),
            'report': entry.result.get('report'),
        })
    return rows


def effect_rows(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Return one row per number: nominal numbers, and parameters of every effect named."""
    rows = []
    for entry in entries:
        if not entry.good:
            continue
        common = {'recording': entry.key, 'namespace': entry.result.get('namespace'),
                  'unit': entry.unit, 'mileage_km': entry.mileage, 'start_s': entry.start}
        for change in entry.result.get('nominal', ()):
            rows.append(common | {
                'effect': None, 'probability': None, 'share': None, 'parameter': change['name'],
                'value': change['after'], 'std': change['std'],
                'unit_of_measure': change['unit'], 'nominal': change['before']})
        for effect in entry.effects:
            for parameter, value in (effect['parameters'] or {'': {
                    'value': None, 'std': None, 'unit': None}}).items():
                rows.append(common | {
                    'effect': effect['effect'], 'probability': effect['probability'],
                    'share': effect['share'], 'parameter': parameter or None,
                    'value': value['value'], 'std': value['std'],
                    'unit_of_measure': value['unit'], 'nominal': None})
    return rows
