# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The frozen list fails when a rate falls, and not when one case does."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.proof.frozen import FROZEN, frozen_rates, least_hits, LEVEL, MEASURED
from tests.proof.generate import parse_strata, plan
from tests.proof.score import CaseScore
from tests.proof.test_score import HIDDEN, scored, write_answer, write_truth


@pytest.mark.parametrize(('hits', 'of'), [(12, 12), (24, 26), (10, 10), (20, 40), (48, 48)])
def test_one_more_miss_passes_and_a_fallen_rate_does_not(hits: int, of: int) -> None:
    least = least_hits(hits, of, of)
    assert least <= hits - 1
    assert least > 0.25 * hits
    # The same true rate falls below the bound no oftener than the level says.
    rng = np.random.default_rng(1)
    drawn = rng.binomial(of, (hits + 0.5) / (of + 1.0), 20000)
    assert np.mean(drawn < least) <= LEVEL * 1.2


def scores_of(tmp_path: Path, **changes: object) -> list[CaseScore]:
    """Scores of as many cases of each stratum as the list holds, all alike but for `changes`."""
    names = write_truth(tmp_path)
    found = []
    for stratum, count in parse_strata(FROZEN['strata']).items():
        like = {'described': 'undescribed', 'triple': 'pair'}.get(stratum, stratum)
        out = tmp_path / 'out' / stratum
        write_answer(out, like, perfect=True)
        one = scored(names[list(HIDDEN).index(like)], tmp_path, out)
        if one.stratum == 'clean':
            one = replace(one, verdict='consistent')
        found += [replace(one, **changes)] * int(count)
    return found


def fallen(scores: list[CaseScore]) -> set[str]:
    return {name for name, rate in frozen_rates(scores).items()
            if int(str(rate['hits'])) < int(str(rate['least']))}


def test_the_measured_rates_are_of_this_list(tmp_path: Path) -> None:
    rates = frozen_rates(scores_of(tmp_path))
    assert {name: rate['of'] for name, rate in rates.items()} == {
        name: of for name, (_, of) in MEASURED.items()}
    assert not fallen(scores_of(tmp_path / 'again'))


@pytest.mark.parametrize(('changes', 'expected'), [
    ({'claims': ()}, 'named first (of several: all)'),
    ({'claims': (('backlash', 0.9),)}, 'no confident wrong name outside the library'),
    ({'claims': (('backlash', 0.9),)}, 'silent on clean recordings'),
    ({'verdict': 'unexplained'}, 'silent on clean recordings'),
    ({'harm': True}, 'no harm'),
    ({'failure': 'exit 70'}, 'no harm'),
])
def test_what_falls_to_nothing_is_seen(changes: dict, expected: str, tmp_path: Path) -> None:
    assert expected in fallen(scores_of(tmp_path, **changes))


def test_the_list_is_short_cases_of_every_stratum() -> None:
    requests = plan(FROZEN['cases'], parse_strata(FROZEN['strata']),
                    np.random.default_rng(1), brief=True)
    assert 40 <= len(requests) <= 60
    assert {one.motion for one in requests} == {'brief'}
    assert {one.stratum for one in requests} == {
        'clean', 'strong', 'subtle', 'pair', 'triple', 'described', 'undescribed'}
