# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which fits of a multimodal effect are looked around."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from engb_core.diagnose.optimise import multistart


@pytest.mark.parametrize(('costs', 'around'), [
    ([8.0, 12.0, 9.0, 11.0], [8.0, 9.0]), ([13.0, 12.0, 14.0], [12.0])])
def test_what_costs_more_than_without_the_effect_is_no_basin(monkeypatch, costs, around):
    """Without it the cost is 10; where all cost more the best of them is looked around all the
    same."""
    looked: list[float] = []

    def search_around(objective, fit, moves):
        looked.append(fit.cost)
        return fit

    monkeypatch.setattr(multistart, 'search_around', search_around)
    objective = SimpleNamespace(evaluate=lambda hypothesis, vector: vector)
    promised = [SimpleNamespace(hypothesis=None, vector=SimpleNamespace(cost=cost), cost=1.0)
                for cost in costs]
    found = multistart.best_promised(objective, SimpleNamespace(cost=10.0), promised, 6,
                                     lambda begin, rounds: begin)
    assert found.cost == min(costs)
    assert looked[:len(around)] == around
    assert set(looked) == set(around)
