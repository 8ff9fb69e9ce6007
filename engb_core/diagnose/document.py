# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""diagnosis.json (contract, section 5): a Diagnosis as plain, finite data.

The form is fixed by diagnosis.schema.json beside this file.
"""

from __future__ import annotations

from collections.abc import Iterable
import json
import math
from typing import Any

from engb_core.diagnose.diagnosis import (
    Diagnosis,
    EffectFinding,
    LawFinding,
    QualityOfFit,
    Unexplained,
    Zone,
)

__all__ = ['FORMAT', 'to_document', 'to_json']

FORMAT = 'engb-diagnosis/1'


def to_document(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the mapping of diagnosis.json.

    Numbers that aren't finite are left out with the entry they belong to (a standard deviation
    and a noise floor become null); shares and probabilities are held within 0 and 1.
    """
    document: dict[str, Any] = {
        'format': FORMAT,
        'verdict': diagnosis.verdict,
        'effects': [_effect(finding) for finding in sorted(
            diagnosis.effects, key=lambda finding: -_fraction(finding.share))],
        'mismatch': {
            'time': [{'recording': entry.recording, 'from': float(entry.begin),
                      'to': float(entry.end), 'share': _fraction(entry.share)}
                     for entry in diagnosis.time if _finite(entry.begin, entry.end)],
            'where': _zones(diagnosis.where),
        },
    }
    if diagnosis.unexplained is not None:
        document['unexplained'] = _unexplained(diagnosis.unexplained)
    document['fit'] = {'held_out': [_fit(entry) for entry in diagnosis.held_out
                                    if _finite(entry.rms_before, entry.rms_after)]}
    document['data_faults'] = [
        {'fault': entry.fault, 'recording': entry.recording, 'from': float(entry.begin),
         'to': float(entry.end), 'statement': entry.statement}
        for entry in diagnosis.data_faults if _finite(entry.begin, entry.end)]
    timing = diagnosis.timing
    if timing is not None and _finite(timing.delay.value):
        document['timing'] = {
            'delay': {'value': float(timing.delay.value), 'std': _deviation(timing.delay.std),
                      'unit': timing.delay.unit},
            'causes': list(timing.causes), 'at_least': bool(timing.at_bound),
            'statement': timing.statement}
    proposal = diagnosis.next_experiment
    document['next_experiment'] = None if proposal is None else {
        'reason': proposal.reason,
        'discriminates': list(proposal.discriminates),
        'reference': proposal.reference,
    }
    return document


def to_json(diagnosis: Diagnosis) -> str:
    """Return the text of diagnosis.json."""
    return json.dumps(to_document(diagnosis), indent=2, ensure_ascii=False,
                      allow_nan=False) + '\n'


def _effect(finding: EffectFinding) -> dict[str, Any]:
    entry: dict[str, Any] = {
        'effect': finding.effect,
        'probability': _fraction(finding.probability),
        'parameters': {name: {'value': float(entry.value), 'std': _deviation(entry.std),
                              'unit': entry.unit}
                       for name, entry in finding.parameters.items() if _finite(entry.value)},
        'share': _fraction(finding.share),
        'alternatives': [{'effect': name, 'probability': _fraction(probability)}
                         for name, probability in finding.alternatives],
        'statement': finding.statement,
    }
    if finding.onset is not None and _finite(finding.onset[1]):
        recording, time = finding.onset
        entry['onset'] = {'recording': recording, 'time': float(time)}
    if finding.causes is not None:
        entry['causes'] = {'level': _fraction(finding.causes.level),
                           'effects': list(finding.causes.effects),
                           'another': bool(finding.causes.another)}
    return entry


def _unexplained(rest: Unexplained) -> dict[str, Any]:
    found = {
        'share': _fraction(rest.share),
        'depends_on': list(rest.depends_on),
        'parity_in_velocity': rest.parity_in_velocity,
        'memory': bool(rest.memory),
        'where': _zones(rest.where),
        'statement': rest.statement,
    }
    if rest.law is not None:
        found['law'] = _law(rest.law)
    if rest.nearest:
        found['nearest'] = [{'effect': name, 'share': _fraction(part)}
                            for name, part in rest.nearest]
    return found


def _law(law: LawFinding) -> dict[str, Any]:
    return {
        'formula': law.formula,
        'acts_as': law.acts_as,
        'pattern': law.pattern,
        'parameters': {name: {'value': float(entry.value), 'std': _deviation(entry.std),
                              'unit': entry.unit}
                       for name, entry in law.parameters.items() if _finite(entry.value)},
        'statement': law.statement,
        'alternatives': list(law.alternatives),
        'settled': law.settled,
        'explained': _fraction(law.explained),
    }


def _zones(zones: Iterable[Zone]) -> list[dict[str, Any]]:
    return [{'variable': zone.variable, 'from': float(zone.begin), 'to': float(zone.end),
             'unit': zone.unit, 'share': _fraction(zone.share)}
            for zone in zones if _finite(zone.begin, zone.end)]


def _fit(entry: QualityOfFit) -> dict[str, Any]:
    return {
        'recording': entry.recording,
        'quantity': entry.quantity,
        'rms_before': float(entry.rms_before),
        'rms_after': float(entry.rms_after),
        'noise_floor': _deviation(entry.noise_floor),
        'unit': entry.unit,
    }


def _deviation(value: float | None) -> float | None:
    return float(value) if value is not None and _finite(value) and value >= 0 else None


def _fraction(value: float) -> float:
    return min(1.0, max(0.0, float(value))) if _finite(value) else 0.0


def _finite(*values: float) -> bool:
    return all(math.isfinite(value) for value in values)
