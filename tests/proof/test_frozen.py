"""The frozen list fails when a rate falls, and not when one case does."""
from __future__ import annotations

import numpy as np
import pytest

from tests.proof.frozen import FROZEN, least_hits, LEVEL, MEASURED
from tests.proof.generate import parse_strata, plan


@pytest.mark.parametrize(('hits', 'of'), [(12, 12), (24, 26), (10, 10), (20, 40), (48, 48)])
def test_one_more_miss_passes_and_a_fallen_rate_does_not(hits: int, of: int) -> None:
    least = least_hits(hits, of, of)
    assert least <= hits - 1
    assert least > 0.25 * hits
    # The same true rate falls below the bound no oftener than the level says.
    rng = np.random.default_rng(1)
    drawn = rng.binomial(of, (hits + 0.5) / (of + 1.0), 20000)
    assert np.mean(drawn < least) <= LEVEL * 1.2


def test_names_falling_to_nothing_is_seen() -> None:
    for hits, of in MEASURED.values():
        assert least_hits(hits, of, of) > 0


def test_the_list_is_short_cases_of_every_stratum() -> None:
    requests = plan(FROZEN['cases'], parse_strata(FROZEN['strata']),
                    np.random.default_rng(1), brief=True)
    assert 40 <= len(requests) <= 60
    assert {one.motion for one in requests} == {'brief'}
    assert {one.stratum for one in requests} == {
        'clean', 'strong', 'subtle', 'pair', 'triple', 'described', 'undescribed'}
