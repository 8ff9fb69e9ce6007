# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which causes a claim leaves open at a stated level: conformal prediction sets.

A claim, its alternatives and the probability that is left for any other cause are ranked: the
claim first, then what is likelier before what is less likely. The nonconformity of a cause is the
probability of all that is ranked before it (adaptive prediction sets, Romano, Sesia and Candès
2020, without their randomisation): 0 for the claim. A set holds every cause whose nonconformity is
no larger than a threshold, and the threshold is the conformal quantile of what the true causes of
cases with a known truth had (Vovk, Gammerman and Shafer 2005), of the worst group of cases, since
nobody knows of which group a new recording is. The claim that leads in share and those after it
have a threshold each: a second name is wrong far more often than a first one of the same
probability. docs/statistics.md says what is covered.

The nonconformities come from `engb prove --calibrate` and lie in cause_sets.json beside this file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cache
import json
import math
from pathlib import Path

from engb_core.diagnose.constants import SET_LEVEL
from engb_core.diagnose.diagnosis import CauseSet, EffectFinding
from engb_core.effects.catalogue import catalogue
from engb_core.effects.load_curve_shape import EFFECT as LOAD_SHAPE
from engb_core.errors import InputError

__all__ = ['ANOTHER', 'Calibration', 'cause_set', 'checked_level', 'conformal_quantile', 'FILE',
           'FORMAT', 'FURTHER', 'LEADING', 'names_a_cause', 'nonconformity', 'PLACES', 'ranked',
           'shipped_calibration', 'with_cause_sets']

FORMAT = 'engb-cause-sets/1'
# Places of claims: the first in order of share of those that name a cause, and those after it.
LEADING, FURTHER = PLACES = ('leading', 'further')
FILE = Path(__file__).with_name('cause_sets.json')
# In a ranking: any cause that is not listed, or none.
ANOTHER = ''


def names_a_cause(effect: str) -> bool:
    """Return whether an id is one of a cause; what only describes a mismatch is none."""
    known = catalogue().get(effect)
    return effect != LOAD_SHAPE.id and not (known is not None and known.unnamed)


def ranked(effect: str, probability: float, alternatives: Iterable[tuple[str, float]],
           ) -> list[tuple[str, float]]:
    """Return the causes of one claim with their nonconformity [-], in order of it.

    Args:
        effect, probability: the claim and how sure it is [-].
        alternatives: ids and probabilities [-] of what it might be instead.

    What is left of the probability is that of `ANOTHER`; so is that of descriptions.
    """
    named = [(name, value) for name, value in alternatives if names_a_cause(name)]
    rest = max(0.0, 1.0 - probability - sum(value for _, value in named))
    others = sorted([*named, (ANOTHER, rest)], key=lambda entry: -entry[1])
    found, before = [], 0.0
    for name, value in [(effect, probability), *others]:
        found.append((name, min(before, 1.0)))
        before += value
    return found


def nonconformity(ranking: Sequence[tuple[str, float]], right: Set[str]) -> float:
    """Return the nonconformity [-] of the true cause of a claim: of the first that is right, or
    of any other cause, where none that is listed is.

    Args:
        ranking: of `ranked`.
        right: ids that are right for this claim.
    """
    return next((value for name, value in ranking if name in right), dict(ranking)[ANOTHER])


def conformal_quantile(scores: Sequence[float], level: float) -> float:
    """Return the ceil((n + 1)·level)-th smallest of n scores [-], which that of a further case
    does not exceed with a probability of `level` [-]; infinite where n is too few for it."""
    # What (n + 1)·level is off a whole number by rounding must not cost a case.
    place = math.ceil((len(scores) + 1) * level - 1e-9)
    return sorted(scores)[place - 1] if place <= len(scores) else math.inf


@dataclass(frozen=True)
class Calibration:
    """Nonconformities of cases with a known truth.

    Attributes:
        scores: by place of the claim and group of cases, the largest of each case's claims there
            [-], 0 without any.
    """

    scores: Mapping[str, Mapping[str, tuple[float, ...]]]

    def thresholds(self, level: float) -> dict[str, float]:
        """Return up to which nonconformity [-] a cause belongs to a set at `level` [-], by place
        of the claim: the largest conformal quantile of the groups."""
        return {place: max(conformal_quantile(scores, level) for scores in groups.values())
                for place, groups in self.scores.items()}

    @classmethod
    def read(cls, path: Path) -> Calibration:
        """Read a file of `engb prove --calibrate`.

        Raises:
            InputError: it is missing or damaged.
        """
        try:
            held = json.loads(path.read_text('utf8'))
            if held['format'] != FORMAT:
                raise ValueError(f'format {held["format"]!r} is not {FORMAT}')
            scores = {place: {str(group): tuple(float(value) for value in values)
                              for group, values in held['scores'][place].items()}
                      for place in PLACES}
            if not all(groups and all(values and all(0.0 <= value <= 1.0 for value in values)
                                      for values in groups.values())
                       for groups in scores.values()):
                raise ValueError('scores must be numbers within 0 and 1, some for each group')
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError(f'{path}: is no calibration of sets of causes ({error!r}); install '
                             'engb_ros anew, or make it with engb prove --calibrate') from error
        return cls(scores)


@cache
def shipped_calibration() -> Calibration:
    """Return the calibration that belongs to this version.

    Raises:
        InputError: its file is missing or damaged.
    """
    return Calibration.read(FILE)


def cause_set(ranking: Sequence[tuple[str, float]], threshold: float, level: float) -> CauseSet:
    """Return the set of causes of one claim: what `ranking` has within `threshold` [-]."""
    held = [name for name, value in ranking if value <= threshold]
    return CauseSet(level, tuple(name for name in held if name != ANOTHER), ANOTHER in held)


def checked_level(level: float) -> float:
    """Return the level [-].

    Raises:
        InputError: it is none.
    """
    if not 0.0 < level < 1.0:
        raise InputError(f'level {level:g}: must lie within 0 and 1, as 0.9')
    return level


def with_cause_sets(findings: Iterable[EffectFinding], level: float = SET_LEVEL,
                    ) -> tuple[EffectFinding, ...]:
    """Return the findings with the set of causes that each leaves open.

    Args:
        findings: of one diagnosis; what only describes a mismatch gets no set.
        level: part of the cases whose true causes are to lie in their sets, within 0 and 1 [-].

    Raises:
        InputError: the level is none, or the calibration's file is damaged.
    """
    thresholds = shipped_calibration().thresholds(checked_level(level))
    findings = tuple(findings)
    named = [finding for finding in findings if names_a_cause(finding.effect)]
    leading = max(named, key=lambda finding: finding.share, default=None)

    def told(finding: EffectFinding) -> CauseSet | None:
        if not names_a_cause(finding.effect):
            return None
        place = LEADING if finding is leading else FURTHER
        return cause_set(ranked(finding.effect, finding.probability, finding.alternatives),
                         thresholds[place], level)

    return tuple(replace(finding, causes=told(finding)) for finding in findings)
