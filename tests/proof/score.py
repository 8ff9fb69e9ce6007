"""Scores of a diagnosis tool against sealed truth, case by case; totals.py sums them up.

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
- localisation: in time, precision and recall; in the coordinates, what share of the mismatch the
  named zones truly hold, beside what the tool says (locate.py).
- held-out error removed: (e(nominal) - e(corrected)) / (e(nominal) - e(oracle)), e the rms on
  `test` of prediction minus the noise-free effort, low-passed, standstill masked; the oracle
  knows the true equations and all but the recording's noise (sealing.py); over cases where
  e(nominal) exceeds e(oracle) by half a noise floor; each clipped to ±1. `energy` uses squares.
- harm: e(corrected) > 1.05·e(nominal) and e(corrected) - e(nominal) > 0.2 noise floors, both as
  the tool itself predicts (`nominal.npz`; without it, as the truth's side does).
"""
from __future__ import annotations

from dataclasses import dataclass
import json
from pathlib import Path

import numpy as np

from .locate import in_time, in_zones
from .nominal import low_pass, moving, rms
from .sealing import open_truth

__all__ = ['CaseScore', 'score_case']


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
    zones: tuple[tuple[str, float, float, float], ...]
    removed: float | None
    removed_energy: float | None
    harm: bool | None
    before: float
    oracle: float
    own_before: float | None
    after: float | None
    floor: float
    band: float
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


@dataclass(frozen=True)
class _Errors:
    """Rms errors [N·m] on the test recording; None where there is no prediction."""

    nominal: float
    oracle: float
    corrected: float | None
    own_nominal: float | None


def _errors(results: Path, arrays: dict[str, np.ndarray], cutoff: float) -> _Errors:
    truth = arrays['test_effort'].astype(float)
    move = moving(arrays['test_velocity'])

    def size(effort: np.ndarray) -> float:
        return rms(low_pass(move * (effort - truth), cutoff=cutoff)[move])

    def predicted(path: Path) -> float | None:
        if not path.exists():
            return None
        with np.load(path) as data:
            time, effort = data['time'].astype(float), data['effort'].astype(float)
        good = np.isfinite(time) & np.isfinite(effort)
        if good.sum() < 100:
            return None
        time, index = np.unique(time[good], return_index=True)
        return size(np.interp(np.arange(truth.size) * 1e-3, time, effort[good][index]))

    return _Errors(size(arrays['test_nominal'].astype(float)),
                   size(arrays['test_oracle'].astype(float)),
                   predicted(results / 'corrected.npz'), predicted(results / 'nominal.npz'))


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
    floor = facts['test_floor']
    e = _errors(results, arrays, facts['cutoff'])
    removed = energy = harm = None
    if e.corrected is not None:
        if facts['effects'] and e.nominal > e.oracle + 0.5 * floor:
            removed = float(np.clip((e.nominal - e.corrected) / (e.nominal - e.oracle), -1, 1))
            energy = float(np.clip((e.nominal ** 2 - e.corrected ** 2)
                                   / (e.nominal ** 2 - e.oracle ** 2), -1, 1))
        own = e.nominal if e.own_nominal is None else e.own_nominal
        harm = bool(e.corrected > 1.05 * own and e.corrected - own > 0.2 * floor)
    where = in_time(diagnosis, arrays['train_energy']) if facts['effects'] else (None, None)
    zones = in_zones(diagnosis, arrays) if facts['effects'] else ()
    return CaseScore(
        name, facts['stratum'], facts['motion'], facts['refitted'],
        tuple(e['effect'] for e in facts['effects']),
        tuple(e['formulation'] for e in facts['effects']),
        tuple((c['effect'], float(c['probability'])) for c in diagnosis['effects']),
        diagnosis.get('verdict'), _parameters(diagnosis, facts), where[0], where[1], zones,
        removed, energy, harm, e.nominal, e.oracle, e.own_nominal, e.corrected, floor,
        facts['cutoff'], run.get('seconds'), run.get('failure'))
