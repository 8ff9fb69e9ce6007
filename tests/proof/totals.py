"""Sums of case scores: shares with intervals, calibration, parameters, confusion.

What each score means stands in score.py.
"""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.stats import beta

from .score import CaseScore

__all__ = ['calibration', 'clopper_pearson', 'parameter_table', 'summarise']

_AROUND_ONE = {'scale', 'breakaway_ratio', 'friction_ratio', 'load_ratio'}
_CONFIDENT = 0.5
_BAND = 20.0    # Hz: in which all effects are sized but those that lie above it


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


def _share(cases: list[CaseScore], test: Callable[[CaseScore], bool]) -> dict[str, object] | None:
    if not cases:
        return None
    hits = sum(bool(test(c)) for c in cases)
    return {'share': hits / len(cases), 'hits': hits, 'of': len(cases),
            'interval': clopper_pearson(hits, len(cases))}


def _right(case: CaseScore, effect: str) -> bool:
    return effect in case.hidden or (effect == 'self_energizing'
                                     and 'pad_friction_fade' in case.hidden)


def calibration(cases: list[CaseScore]) -> dict[str, object]:
    """Reliability bins and the expected calibration error of all claims."""
    claims = [(p, _right(c, e)) for c in cases for e, p in c.claims]
    bins, error = [], 0.0
    for k in range(10):
        inside = [(p, r) for p, r in claims if k / 10 <= p < (k + 1) / 10 or (k == 9 and p == 1)]
        if inside:
            said, right = np.mean([p for p, _ in inside]), np.mean([r for _, r in inside])
            error += len(inside) / len(claims) * abs(said - right)
            bins.append({'said': float(said), 'right': float(right), 'claims': len(inside)})
    return {'expected_error': float(error) if claims else None, 'bins': bins,
            'claims': len(claims)}


def parameter_table(cases: list[CaseScore]) -> dict[str, object]:
    """Median errors by effect and parameter, and the coverage of 2·std."""
    rows: dict[str, list[tuple[float, float, bool | None]]] = {}
    for case in cases:
        if case.stratum == 'pair':
            continue
        for effect, name, truth, value, std in case.parameters:
            off = abs(value - truth)
            scale = abs(truth - 1.0) if name in _AROUND_ONE else abs(truth)
            held = None if std is None else off <= 2.0 * std
            rows.setdefault(f'{effect}.{name}', []).append(
                (off / max(abs(truth), 1e-12), off / max(scale, 1e-12), held))
    table = {key: {'cases': len(v), 'median_error': float(np.median([r[0] for r in v])),
                   'median_deviation': float(np.median([r[1] for r in v])),
                   'coverage': _mean([r[2] for r in v])} for key, v in sorted(rows.items())}
    every = [r for v in rows.values() for r in v]
    return {'by_parameter': table,
            'median_error': float(np.median([r[0] for r in every])) if every else None,
            'median_deviation': float(np.median([r[1] for r in every])) if every else None,
            'coverage': _mean([r[2] for r in every])}


def _zones(cases: list[CaseScore]) -> dict[str, object]:
    """What the named zones hold, averaged; `said_error` is the mean of |said - true|."""
    rows = [row for case in cases for row in case.zones]
    return {'count': len(rows), 'energy': _mean([true for _, _, true, _ in rows]),
            'time': _mean([time for *_, time in rows]),
            'said_error': _mean([abs(said - true) for _, said, true, _ in rows])}


def _well(case: CaseScore) -> bool:
    if case.stratum == 'pair':
        return case.both
    if case.stratum in ('clean', 'outside'):
        return not any(p > (_CONFIDENT if case.hidden else 0.0) for _, p in case.claims)
    return case.named_first


def _miss(case: CaseScore) -> dict[str, object]:
    return {'case': case.name, 'stratum': case.stratum, 'motion': case.motion,
            'refitted': case.refitted, 'hidden': case.hidden, 'as': case.formulations,
            'claims': case.claims}


def summarise(cases: list[CaseScore]) -> dict[str, object]:
    """All scores of a set, ready for JSON."""
    strata = sorted({c.stratum for c in cases})
    of = {s: [c for c in cases if c.stratum == s] for s in strata}
    singles = of.get('strong', []) + of.get('subtle', [])
    confusion: dict[str, dict[str, int]] = {}
    by_effect: dict[str, dict[str, object] | None] = {}
    for case in cases:
        if len(case.hidden) < 2:
            row = confusion.setdefault(case.hidden[0] if case.hidden else 'clean', {})
            said = case.claims[0][0] if case.claims else 'nothing'
            row[said] = row.get(said, 0) + 1
    for effect in sorted({c.hidden[0] for c in singles}):
        by_effect[effect] = _share([c for c in singles if c.hidden[0] == effect],
                                   lambda c: c.named_first)
    seconds = [c.seconds for c in cases if c.seconds is not None]
    hidden = [c for c in cases if c.hidden]
    return {
        'cases': len(cases),
        'named_first': {
            f'{s}{m}': _share([c for c in of.get(s, []) if not m or c.motion == m.strip()],
                              lambda c: c.named_first)
            for s in ('strong', 'subtle') for m in ('', ' rich', ' routine')} | {
            f'{s}, judged above {_BAND:.0f} Hz': _share(
                [c for c in of.get(s, []) if c.band > _BAND], lambda c: c.named_first)
            for s in ('strong', 'subtle')},
        'named_first_by_effect': by_effect,
        'pairs_both': _share(of.get('pair', []), lambda c: c.both),
        'pairs_first': _share(of.get('pair', []), lambda c: c.named_first),
        'false_alarms': _share(of.get('clean', []), lambda c: bool(c.claims)),
        'confident_wrong_outside': _share(
            of.get('outside', []),
            lambda c: any(p > _CONFIDENT for _, p in c.claims)),
        'singles_with_false_extra': _share(
            singles, lambda c: any(not _right(c, e) for e, p in c.claims if p > 0.5)),
        'calibration': calibration(cases),
        'parameters': parameter_table(cases),
        'localisation': {
            'precision': _mean([c.precision for c in hidden]),
            'recall': _mean([0.0 if c.recall is None else c.recall for c in hidden]),
            'zones': _zones(hidden)},
        'held_out_removed': {
            **{s: _mean([c.removed for c in of[s]]) for s in strata if s != 'clean'},
            'named_singles': _mean([c.removed for c in singles if c.named_first])},
        'held_out_energy_removed': {
            **{s: _mean([c.removed_energy for c in of[s]]) for s in strata if s != 'clean'},
            'named_singles': _mean([c.removed_energy for c in singles if c.named_first])},
        'harm': _share([c for c in cases if c.harm is not None], lambda c: c.harm),
        'seconds': {'mean': _mean(seconds), 'max': max(seconds, default=None)},
        'failures': [{'case': c.name, 'failure': c.failure} for c in cases if c.failure],
        'confusion': confusion,
        'misses': [_miss(c) for c in cases if not _well(c)],
    }
