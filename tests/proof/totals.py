# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sums of case scores: shares with intervals, calibration, parameters, confusion.

What each score means stands in score.py.
"""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.stats import beta

from .cause_sets import totals_of
from .score import CaseScore, CONFIDENT, OUTSIDE

__all__ = ['calibration', 'clopper_pearson', 'parameter_table', 'summarise']

_AROUND_ONE = {'scale', 'breakaway_ratio', 'friction_ratio', 'load_ratio'}
_BAND = 20.0    # Hz: in which all effects are sized but those that lie above it
_BANDS = ((0.0, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 0.97), (0.97, 1.001))
_ORDER = ('clean', 'strong', 'subtle', 'pair', 'triple', *OUTSIDE)


def clopper_pearson(hits: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Exact interval of a share."""
    if count == 0:
        return 0.0, 1.0
    tail = (1.0 - level) / 2.0
    low = 0.0 if hits == 0 else float(beta.ppf(tail, hits, count - hits + 1))
    high = 1.0 if hits == count else float(beta.ppf(1.0 - tail, hits + 1, count - hits))
    return low, high


def _mean(values: list) -> float | None:
    kept = [float(v) for v in values if v is not None]
    return float(np.mean(kept)) if kept else None


def _share(cases: list[CaseScore], test: Callable[[CaseScore], object]
           ) -> dict[str, object] | None:
    if not cases:
        return None
    hits = sum(bool(test(c)) for c in cases)
    return {'share': hits / len(cases), 'hits': hits, 'of': len(cases),
            'interval': clopper_pearson(hits, len(cases))}


def calibration(cases: list[CaseScore]) -> dict[str, object]:
    """Reliability bins and bands, the Brier score, and the expected calibration error: as it is,
    and as it would be on average, `by_chance`, if all claims were right as often as they say."""
    claims = [(p, name in c.accepted) for c in cases for name, p in c.claims]
    bins, error, by_chance = [], 0.0, 0.0
    for k in range(10):
        inside = [(p, r) for p, r in claims if k / 10 <= p < (k + 1) / 10 or (k == 9 and p == 1)]
        if inside:
            said, right = np.mean([p for p, _ in inside]), np.mean([r for _, r in inside])
            error += len(inside) / len(claims) * abs(said - right)
            by_chance += len(inside) / len(claims) * _scatter(np.array([p for p, _ in inside]))
            bins.append({'said': float(said), 'right': float(right), 'claims': len(inside)})
    bands = []
    for low, high in _BANDS:
        inside = [(p, r) for p, r in claims if low <= p < high]
        if inside:
            bands.append({'from': low, 'to': min(high, 1.0), 'claims': len(inside),
                          'said': float(np.mean([p for p, _ in inside])),
                          'right': sum(r for _, r in inside)})
    return {'expected_error': float(error) if claims else None,
            'by_chance': float(by_chance) if claims else None, 'bins': bins, 'bands': bands,
            'brier': _mean([(p - r) ** 2 for p, r in claims]), 'claims': len(claims)}


def _scatter(said: np.ndarray) -> float:
    """How far, on average, the share of right claims lies from the mean of the probabilities said
    (n,), where these are right and the claims independent."""
    chance = np.zeros(said.size + 1)     # of so many that are right
    chance[0] = 1.0
    for p in said:
        chance[1:] = chance[1:] * (1.0 - p) + chance[:-1] * p
        chance[0] *= 1.0 - p
    return float(chance @ np.abs(np.arange(chance.size) / said.size - said.mean()))


def parameter_table(cases: list[CaseScore]) -> dict[str, object]:
    """Median errors by effect and parameter, and the coverage of 2·std."""
    rows: dict[str, list[tuple[float, float, bool | None]]] = {}
    for case in cases:
        for effect, name, truth, value, std in case.parameters:
            off = abs(value - truth)
            scale = abs(truth - 1.0) if name in _AROUND_ONE else abs(truth)
            held = None if not std else off <= 2.0 * std
            rows.setdefault(f'{effect}.{name}', []).append(
                (off / max(abs(truth), 1e-12), off / max(scale, 1e-12), held))
    table = {key: {'cases': len(v), 'median_error': float(np.median([r[0] for r in v])),
                   'median_deviation': float(np.median([r[1] for r in v])),
                   'coverage': _mean([r[2] for r in v])} for key, v in sorted(rows.items())}
    every = [r for v in rows.values() for r in v]
    return {'by_parameter': table, 'numbers': len(every),
            'median_error': float(np.median([r[0] for r in every])) if every else None,
            'median_deviation': float(np.median([r[1] for r in every])) if every else None,
            'coverage': _mean([r[2] for r in every])}


def _zones(cases: list[CaseScore]) -> dict[str, object]:
    """What the named zones hold, averaged; `said_error` is the mean of |said - true|."""
    rows = [row for case in cases for row in case.zones]
    return {'count': len(rows), 'energy': _mean([true for _, _, true, _ in rows]),
            'time': _mean([time for *_, time in rows]),
            'said_error': _mean([abs(said - true) for _, said, true, _ in rows])}


def _right(case: CaseScore) -> bool:
    """The one question that each stratum asks, answered."""
    if case.outside:
        return not case.confident_wrong and case.failure is None
    if case.stratum == 'clean':
        return not case.alarm
    return case.all_named if case.stratum in ('pair', 'triple') else case.named_first


def _miss(case: CaseScore) -> dict[str, object]:
    return {'case': case.name, 'stratum': case.stratum, 'motion': case.motion,
            'refitted': case.refitted, 'hidden': case.hidden, 'as': case.formulations,
            'claims': case.claims, 'verdict': case.verdict, 'tags': case.tags}


def _seconds(cases: list[CaseScore]) -> dict[str, float | None]:
    took = [c.seconds for c in cases if c.seconds is not None]
    if not took:
        return {'mean': None, 'median': None, 'p95': None, 'max': None}
    return {'mean': float(np.mean(took)), 'median': float(np.median(took)),
            'p95': float(np.percentile(took, 95)), 'max': max(took)}


def _variables(cases: list[CaseScore]) -> dict[str, object] | None:
    rows = [c.variables for c in cases if c.variables is not None]
    if not rows:
        return None
    return {'cases': len(rows), 'told': _mean([told for told, _, _ in rows]),
            'beside': _mean([beside for _, beside, _ in rows]),
            'memory': _mean([memory for _, _, memory in rows])}


def _onset(cases: list[CaseScore]) -> dict[str, object]:
    """Onsets in mid-recording: of how many one is told, its error [s]; and told where none is."""
    rows = [c.onset for c in cases if c.onset is not None]
    begins = [one for one in rows if one.begins]
    errors = [one.error for one in begins if one.error is not None]
    through = [one for one in rows if not one.begins]
    return {'begins': len(begins), 'told': sum(one.told for one in begins),
            'median_error': float(np.median(errors)) if errors else None,
            'most_error': max(errors, default=None),
            'throughout': len(through), 'invented': sum(one.told for one in through)}


def _confusion(cases: list[CaseScore]) -> dict[str, dict[str, int]]:
    confusion: dict[str, dict[str, int]] = {}
    for case in cases:
        if len(case.hidden) < 2:
            row = confusion.setdefault(case.hidden[0] if case.hidden else 'clean', {})
            said = case.claims[0][0] if case.claims else 'nothing'
            row[said] = row.get(said, 0) + 1
    return confusion


def summarise(cases: list[CaseScore]) -> dict[str, object]:
    """All scores of a set, ready for JSON."""
    strata = [s for s in _ORDER if any(c.stratum == s for c in cases)]
    of = {s: [c for c in cases if c.stratum == s] for s in strata}
    singles = of.get('strong', []) + of.get('subtle', [])
    outside = [c for c in cases if c.outside]
    inside = [c for c in cases if c.hidden and not c.outside]
    hidden = [c for c in cases if c.hidden]
    by_effect = {effect: _share([c for c in singles if c.hidden[0] == effect],
                                lambda c: c.named_first)
                 for effect in sorted({c.hidden[0] for c in singles})}
    tags = sorted({tag for c in cases for tag in c.tags})
    kinds = {'single': singles, 'pair': of.get('pair', []), 'triple': of.get('triple', []),
             **{s: of[s] for s in OUTSIDE if s in of}}
    return {
        'cases': len(cases),
        'strata_of': {s: len(of[s]) for s in strata},
        'named_first': {
            f'{s}{m}': _share([c for c in of.get(s, []) if not m or c.motion == m.strip()],
                              lambda c: c.named_first)
            for s in ('strong', 'subtle') for m in ('', ' rich', ' routine')} | {
            f'{s}, judged above {_BAND:.0f} Hz': _share(
                [c for c in of.get(s, []) if c.band > _BAND], lambda c: c.named_first)
            for s in ('strong', 'subtle')},
        'named_first_by_effect': by_effect,
        'pairs_both': _share(of.get('pair', []), lambda c: c.all_named),
        'pairs_first': _share(of.get('pair', []), lambda c: c.named_first),
        'triples_all': _share(of.get('triple', []), lambda c: c.all_named),
        'triples_first': _share(of.get('triple', []), lambda c: c.named_first),
        'false_alarms': _share(of.get('clean', []), lambda c: c.alarm),
        'claims_on_clean': _share(of.get('clean', []), lambda c: c.claims),
        'confident_wrong': {s: _share(of[s], lambda c: c.confident_wrong)
                            for s in OUTSIDE if s in of},
        'confident_wrong_outside': _share(outside, lambda c: c.confident_wrong),
        'variables': {s: _variables(of[s]) for s in OUTSIDE if s in of},
        'singles_with_false_extra': _share(
            singles, lambda c: any(name not in c.accepted
                                   for name, p in c.claims if p >= CONFIDENT)),
        'extra_claims': _mean([sum(name not in c.accepted for name, _ in c.claims)
                               for c in inside]),
        'calibration': calibration(cases),
        'cause_sets': totals_of((c.stratum, c.sets) for c in cases),
        'parameters': parameter_table(cases),
        'localisation': {
            'precision': _mean([c.precision for c in hidden]),
            'recall': _mean([c.recall for c in hidden]),
            'chance': _mean([c.chance for c in hidden]),
            'zones': _zones(hidden)},
        'onset': _onset(hidden),
        'held_out_removed': {
            **{s: _mean([c.removed for c in kind]) for s, kind in kinds.items() if kind},
            'all': _mean([c.removed for c in cases]),
            'named_singles': _mean([c.removed for c in singles if c.named_first])},
        'worse': _share([c for c in cases if c.worse is not None], lambda c: c.worse),
        'harm': _share([c for c in cases if c.harm is not None], lambda c: c.harm),
        'seconds': _seconds(cases),
        'by_tag': {tag: _share([c for c in cases if tag in c.tags], _right) for tag in tags},
        'right': _share(cases, _right),
        'failures': [{'case': c.name, 'failure': c.failure} for c in cases if c.failure],
        'confusion': _confusion(cases),
        'misses': [_miss(c) for c in cases if not _right(c)],
    }
