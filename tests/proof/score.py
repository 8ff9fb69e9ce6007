# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Scores of a diagnosis against its truth, case by case; totals.py sums them up.

One scorer for all cases, whoever made them: `CaseTruth` is what it needs to know of a case, read
from a sealed truth (own_truth.py) or from a folder of another hand (other_hand.py).

Definitions (all over the cases whose tool run ended; others count as silent and are listed):

- named first: `effects[0].effect` is one of the names that are right (`accepted`).
- both of a pair, all of three: every hidden effect is claimed.
- extra: a claim that is not accepted. Where the true load curve has a form that the model cannot
  follow, a name of the tool's own for that (one that the contract does not list) is no extra.
- false alarm: anything at all is said on a clean recording: a claim, or a verdict other than
  `consistent`; exact 95 % Clopper-Pearson.
- confident wrong name: outside the library, a name of the contract with a probability of 0.5 or
  more that is not a fair name of the mechanism.
- right variables (outside): of the variables that the mismatch truly depends on, the share that
  `unexplained.depends_on` names; how many it names beside them; whether `memory` is told right.
- calibration: every claim is right if its effect is accepted; ten bins of probability;
  ECE = Σ n_b/N·|share right - mean probability|; and five bands that look closely above 0.9.
- sets of causes: whether those of a case's claims hold the truth, how large (cause_sets.py).
- parameters: |value - truth| / |truth| of every contract parameter of rightly claimed effects;
  `deviation` is the same, but for ratios whose neutral value is 1 over |truth - 1|;
  coverage: the share with |value - truth| ≤ 2·std.
- localisation: precision and recall in time, beside the precision that chance would have; in the
  coordinates what share of the mismatch the named zones truly hold; the time of an onset in
  mid-recording (locate.py).
- held-out error removed: e the error on `test` of prediction minus the noise-free effort,
  low-passed, where the motion determines it: (e²(nominal) - e²(corrected)) / (e²(nominal) -
  e²(oracle)), clipped to ±1; the oracle is the true torque of the recorded motion. Over cases
  where e(nominal) > 1.2·e(oracle).
- made worse: less than -0.02 of it removed. Harm, over all cases, the clean ones too:
  e(corrected) > 1.05·e(nominal) and e(corrected) - e(nominal) > 0.2 noise floors, both as the
  tool itself predicts (`nominal.npz`; without it, as the truth's side does).
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import json
import math
from pathlib import Path

import numpy as np

from .cause_sets import CauseSetScore, set_scores
from .locate import in_time, in_zones, onset_told, OnsetScore, Stretch
from .vocabulary import TABLE_4

__all__ = ['CaseScore', 'CaseTruth', 'OUTSIDE', 'read_prediction', 'score']

OUTSIDE = ('described', 'undescribed', 'outside')
CONFIDENT = 0.5
_SCORED = 1.2       # times the oracle's error: below it there is nothing to remove
_WORSE = -0.02


@dataclass(frozen=True)
class CaseTruth:
    """What the scorer needs to know of a case.

    Attributes:
        stratum: clean, strong, subtle, pair, triple, or one of OUTSIDE.
        tags: conditions by which scores are broken down.
        hidden, formulations: effects (or mechanisms outside the library) and their forms.
        accepted: names that are right; fair: names of the contract that a mechanism outside the
            library may physically bear.
        parameters: (effect, name, value, other right values) of the contract's parameters.
        depends_on: for each variable that the mismatch truly depends on, the names that mean it.
        other_load_shape: the load curve has a form that the model cannot follow.
        before, oracle: errors [N·m] of the nominal model and of the true torque on `test`.
        error: (time [s], effort [N·m]) → error [N·m] of a prediction on `test`.
        floor: noise floor [N·m]; band: in which the effects are judged [Hz].
        stretches: energy of the mismatch over time, a `Stretch` per training recording.
        zones: energy, position and velocity for the scores of zones (None: not known).
        onset: recording and time [s] in which the effect begins (None: it acts throughout).
    """

    name: str
    stratum: str
    hidden: tuple[str, ...]
    formulations: tuple[str, ...]
    accepted: tuple[str, ...]
    before: float
    oracle: float
    floor: float
    error: Callable[[np.ndarray, np.ndarray], float]
    stretches: tuple[Stretch, ...]
    fair: tuple[str, ...] = ()
    parameters: tuple[tuple[str, str, float, tuple[float, ...]], ...] = ()
    tags: tuple[str, ...] = ()
    motion: str = ''
    refitted: bool = False
    depends_on: tuple[tuple[str, ...], ...] = ()
    memory: bool = False
    other_load_shape: bool = False
    held_out_scored: bool = True
    band: float = 20.0
    zones: dict[str, np.ndarray] = field(default_factory=dict)
    onset: tuple[str, float] | None = None


@dataclass(frozen=True)
class CaseScore:
    """What one case gave; None where a score has no meaning."""

    name: str
    stratum: str
    motion: str
    refitted: bool
    tags: tuple[str, ...]
    hidden: tuple[str, ...]
    formulations: tuple[str, ...]
    accepted: tuple[str, ...]
    fair: tuple[str, ...]
    claims: tuple[tuple[str, float], ...]
    own_names: tuple[str, ...]
    verdict: str | None
    parameters: tuple[tuple[str, str, float, float, float | None], ...]
    precision: float | None
    recall: float | None
    chance: float | None
    zones: tuple[tuple[str, float, float, float], ...]
    onset: OnsetScore | None
    variables: tuple[float, int, bool] | None
    removed: float | None
    harm: bool | None
    before: float
    oracle: float
    own_before: float | None
    after: float | None
    floor: float
    band: float
    seconds: float | None
    failure: str | None
    sets: tuple[CauseSetScore, ...] | None = None

    @property
    def outside(self) -> bool:
        """What is hidden is no effect of the contract."""
        return self.stratum in OUTSIDE

    @property
    def named_first(self) -> bool:
        """The first claim is right; or nothing was said where that is accepted."""
        if self.claims:
            return self.claims[0][0] in self.accepted
        return 'consistent' in self.accepted and self.verdict == 'consistent'

    @property
    def all_named(self) -> bool:
        """Every hidden effect is claimed."""
        return set(self.hidden) <= {name for name, _ in self.claims}

    @property
    def alarm(self) -> bool:
        """Something is said."""
        return bool(self.claims) or self.verdict != 'consistent'

    @property
    def confident_wrong(self) -> bool:
        """A name of the contract is given with confidence that is no fair one."""
        return any(p >= CONFIDENT and name in TABLE_4 and name not in self.fair
                   for name, p in self.claims)

    @property
    def worse(self) -> bool | None:
        """The held-out prediction was made worse; None where there was nothing to remove."""
        return None if self.removed is None else self.removed < _WORSE


def read_prediction(path: Path) -> tuple[np.ndarray, np.ndarray] | None:
    """Times [s] and efforts [N·m] of a prediction; None where it is none."""
    if not path.exists():
        return None
    with np.load(path, allow_pickle=False) as data:
        time, effort = (np.asarray(data[key], float).ravel() for key in ('time', 'effort'))
    if time.size != effort.size:
        return None
    good = np.isfinite(time) & np.isfinite(effort)
    if good.sum() < 100:
        return None
    time, index = np.unique(time[good], return_index=True)
    return time, effort[good][index]


def _claims(diagnosis: dict) -> list[dict]:
    return [one for one in diagnosis.get('effects') or [] if isinstance(one, dict)
            and isinstance(one.get('effect'), str)]


def _number(value: object) -> float | None:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def _parameters(claims: list[dict], truth: CaseTruth) -> tuple:
    rows = []
    for effect, name, value, others in truth.parameters:
        claim = next((one for one in claims if one['effect'] == effect), None)
        got = (claim or {}).get('parameters', {}).get(name)
        said = _number(got.get('value') if isinstance(got, dict) else got)
        if said is None:
            continue
        nearest = min((value, *others), key=lambda one: abs(said - one))
        rows.append((effect, name, nearest, said,
                     _number(got.get('std')) if isinstance(got, dict) else None))
    return tuple(rows)


def _variables(diagnosis: dict, truth: CaseTruth) -> tuple[float, int, bool] | None:
    if truth.stratum not in OUTSIDE or not truth.depends_on:
        return None
    told = diagnosis.get('unexplained') or {}
    names = set(told.get('depends_on') or [])
    groups = [set(group) for group in truth.depends_on]
    return (float(np.mean([bool(group & names) for group in groups])),
            len(names - set().union(*groups)), bool(told.get('memory')) == truth.memory)


def score(truth: CaseTruth, results: Path) -> CaseScore:
    """Score one case from `results` (diagnosis.json, corrected.npz, nominal.npz, run.json)."""
    run = json.loads((results / 'run.json').read_text('utf8'))
    path = results / 'diagnosis.json'
    diagnosis = json.loads(path.read_text('utf8')) if path.exists() else {}
    claims = _claims(diagnosis)
    named = tuple((one['effect'], min(max(_number(one.get('probability')) or 0.0, 0.0), 1.0))
                  for one in claims)
    own_names: tuple[str, ...] = ()
    if truth.other_load_shape and truth.stratum not in OUTSIDE:
        own_names = tuple(name for name, _ in named if name not in TABLE_4)
        named = tuple(claim for claim in named if claim[0] in TABLE_4)
    predicted = read_prediction(results / 'corrected.npz')
    after = None if predicted is None else truth.error(*predicted)
    predicted = read_prediction(results / 'nominal.npz')
    own_before = None if predicted is None else truth.error(*predicted)
    removed = harm = None
    if truth.held_out_scored and truth.before > _SCORED * truth.oracle:
        removed = 0.0 if after is None else float(np.clip(
            (truth.before ** 2 - after ** 2) / (truth.before ** 2 - truth.oracle ** 2), -1, 1))
    if after is not None:
        own = truth.before if own_before is None else own_before
        harm = bool(after > 1.05 * own and after - own > 0.2 * truth.floor)
    where = in_time(diagnosis, truth.stretches) if truth.hidden else None
    return CaseScore(
        truth.name, truth.stratum, truth.motion, truth.refitted, truth.tags, truth.hidden,
        truth.formulations, truth.accepted, truth.fair, named, own_names,
        diagnosis.get('verdict'), _parameters(claims, truth),
        where and where.precision, where and where.recall, where and where.chance,
        in_zones(diagnosis, truth.zones) if truth.hidden else (),
        onset_told([one for one in claims if one['effect'] in truth.hidden], truth.onset,
                   len(truth.stretches)), _variables(diagnosis, truth),
        removed, harm, truth.before, truth.oracle, own_before, after, truth.floor, truth.band,
        run.get('seconds'), run.get('failure'),
        set_scores(claims, truth.accepted))
