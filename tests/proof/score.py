"""Scores of a diagnosis tool against sealed truth.

Definitions (all over the cases whose tool run ended; others count as silent and are listed):

- named first: `effects[0].effect` is the hidden effect (single-effect strata).
- both of a pair: the two hidden effects are the first two claimed, in any order.
- false alarm: anything at all is claimed on a clean recording; exact 95 % Clopper-Pearson.
- confident wrong name: a claim above probability 0.5 where the truth lies outside the library.
- calibration: every claim is right if its effect is hidden in that case; ten bins of
  probability; ECE = Σ n_b/N·|share right - mean probability|. `self_energizing` beside
  `pad_friction_fade` counts as right, since such a fade holds it.
- parameters: |value - truth| / |truth| of every contract parameter of rightly claimed effects;
  `deviation` is the same, but for ratios whose neutral value is 1 over |truth - 1|;
  coverage: the share with |value - truth| ≤ 2·std.
- localisation: truth is the smallest set of 20 ms bins holding 90 % of the energy that the
  hidden effects add to the lacking model on `train` (low-passed, standstill masked, smeared
  over 0.1 s, holes up to 0.2 s closed); precision = claimed and true / claimed duration,
  recall = claimed and true / true duration, with the claims on `train`.
- held-out error removed: 1 - e(corrected) / e(nominal), e the rms on `test` of prediction minus
  the noise-free effort (the oracle, 0 error = 100 %), low-passed, standstill masked; over cases
  where e(nominal) exceeds half the noise floor; each clipped to ±1. `energy` uses squares.
- harm: e(corrected) > 1.05·e(nominal) and e(corrected) - e(nominal) > 0.2 noise floors.
"""
from __future__ import annotations

from dataclasses import dataclass
import json
from pathlib import Path

import numpy as np
from scipy.stats import beta

from .nominal import low_pass, moving, rms
from .sealing import BIN, open_truth

__all__ = ['CaseScore', 'clopper_pearson', 'score_case', 'summarise']

_AROUND_ONE = {'scale', 'breakaway_ratio', 'friction_ratio', 'load_ratio'}
_LIBRARY_CONFIDENT = 0.5


@dataclass(frozen=True)
class CaseScore:
    """What one case gave; None where a score has no meaning."""

    name: str
    stratum: str
    motion: str
    refitted: bool
    hidden: tuple[str, ...]
    formulations: tuple[str, ...]
    claims: tuple[tuple[str, float], ...]
    verdict: str | None
    parameters: tuple[tuple[str, str, float, float, float | None], ...]
    precision: float | None
    recall: float | None
    removed: float | None
    removed_energy: float | None
    harm: bool | None
    before: float
    after: float | None
    floor: float
    seconds: float | None
    failure: str | None

    @property
    def named_first(self) -> bool:
        """The first claim is (one of) the hidden."""
        return bool(self.claims) and self.claims[0][0] in self.hidden

    @property
    def both(self) -> bool:
        """The first two claims are the two hidden effects."""
        return {name for name, _ in self.claims[:2]} == set(self.hidden)


def clopper_pearson(hits: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Exact interval of a share."""
    if count == 0:
        return 0.0, 1.0
    tail = (1.0 - level) / 2.0
    low = 0.0 if hits == 0 else float(beta.ppf(tail, hits, count - hits + 1))
    high = 1.0 if hits == count else float(beta.ppf(1.0 - tail, hits + 1, count - hits))
    return low, high


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


def _localised(diagnosis: dict, energy: np.ndarray) -> tuple[float | None, float | None]:
    true = true_bins(energy)
    middle = (np.arange(energy.size) + 0.5) * BIN
    claimed = np.zeros(energy.size, bool)
    for one in diagnosis.get('mismatch', {}).get('time', []):
        claimed |= (middle >= one['from']) & (middle <= one['to'])
    hit = float((claimed & true).sum())
    precision = hit / claimed.sum() if claimed.any() else None
    recall = hit / true.sum() if true.any() else None
    return precision, recall


def _errors(predicted: tuple[np.ndarray, np.ndarray] | None, arrays: dict[str, np.ndarray],
            cutoff: float) -> tuple[float, float | None]:
    truth = arrays['test_effort'].astype(float)
    move = moving(arrays['test_velocity'])

    def size(effort: np.ndarray) -> float:
        return rms(low_pass(move * (effort - truth), cutoff=cutoff)[move])

    before = size(arrays['test_nominal'].astype(float))
    if predicted is None:
        return before, None
    time, effort = predicted
    good = np.isfinite(time) & np.isfinite(effort)
    if good.sum() < 100:
        return before, None
    time, index = np.unique(time[good], return_index=True)
    grid = np.arange(truth.size) * 1e-3
    return before, size(np.interp(grid, time, effort[good][index]))


def _parameters(diagnosis: dict, facts: dict) -> tuple:
    rows = []
    for hidden in facts['effects']:
        claim = next((c for c in diagnosis['effects'] if c['effect'] == hidden['effect']), None)
        if claim is None:
            continue
        for name, truth in hidden['parameters'].items():
            got = claim['parameters'].get(name)
            if got is not None:
                rows.append((hidden['effect'], name, truth, got['value'], got['std']))
    return tuple(rows)


def score_case(name: str, truth: Path, results: Path) -> CaseScore:
    """Score one case from `results` (diagnosis.json, corrected.npz, run.json)."""
    facts, arrays = open_truth(truth)
    run = json.loads((results / 'run.json').read_text('utf8'))
    silent = {'effects': [], 'mismatch': {'time': []}, 'verdict': None}
    path = results / 'diagnosis.json'
    diagnosis = json.loads(path.read_text('utf8')) if path.exists() else silent
    predicted = None
    if (results / 'corrected.npz').exists():
        with np.load(results / 'corrected.npz') as data:
            predicted = data['time'].astype(float), data['effort'].astype(float)
    floor = facts['test_floor']
    before, after = _errors(predicted, arrays, facts.get('cutoff', 20.0))
    known = before > 0.5 * floor and after is not None and facts['effects']
    removed = energy = None
    if known:
        removed = float(np.clip(1.0 - after / before, -1.0, 1.0))
        energy = float(np.clip(1.0 - (after / before) ** 2, -1.0, 1.0))
    harm = None if after is None else bool(after > 1.05 * before and after - before > 0.2 * floor)
    where = _localised(diagnosis, arrays['train_energy']) if facts['effects'] else (None, None)
    return CaseScore(
        name, facts['stratum'], facts['motion'], facts['refitted'],
        tuple(e['effect'] for e in facts['effects']),
        tuple(e['formulation'] for e in facts['effects']),
        tuple((c['effect'], float(c['probability'])) for c in diagnosis['effects']),
        diagnosis.get('verdict'), _parameters(diagnosis, facts), where[0], where[1], removed,
        energy, harm, before, after, floor, run.get('seconds'), run.get('failure'))


def _mean(values: list) -> float | None:
    kept = [float(v) for v in values if v is not None]
    return float(np.mean(kept)) if kept else None


def _share(cases: list[CaseScore], test) -> dict[str, object] | None:
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
            for s in ('strong', 'subtle') for m in ('', ' rich', ' routine')},
        'named_first_by_effect': by_effect,
        'pairs_both': _share(of.get('pair', []), lambda c: c.both),
        'pairs_first': _share(of.get('pair', []), lambda c: c.named_first),
        'false_alarms': _share(of.get('clean', []), lambda c: bool(c.claims)),
        'confident_wrong_outside': _share(
            of.get('outside', []),
            lambda c: any(p > _LIBRARY_CONFIDENT for _, p in c.claims)),
        'singles_with_false_extra': _share(
            singles, lambda c: any(not _right(c, e) for e, p in c.claims if p > 0.5)),
        'calibration': calibration(cases),
        'parameters': parameter_table(cases),
        'localisation': {
            'precision': _mean([c.precision for c in hidden]),
            'recall': _mean([0.0 if c.recall is None else c.recall for c in hidden])},
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
    }
