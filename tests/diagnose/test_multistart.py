# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How a multimodal effect finds a low one of many minima."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.diagnose.optimise import multistart

TWO = SimpleNamespace(bounds=(np.full(2, -5.0), np.full(2, 5.0)))


def rugged(place: np.ndarray) -> float:
    """Many narrow minima in a wide basin (Rastrigin): the least is at 1.3, where it is 1."""
    away = place - 1.3
    return float(1.0 + np.sum(away ** 2 + 5.0 * (1.0 - np.cos(2.0 * np.pi * away))))


@pytest.fixture
def objective(monkeypatch):
    """What evaluates such a cost; no numbers are beside its two entries."""
    monkeypatch.setattr(multistart, 'moved_places', lambda fit: ([0, 1], np.ones(2)))
    monkeypatch.setattr(multistart, 'Settling', lambda objective, fit: (
        lambda hypothesis, place: (rugged(place), place)))
    return SimpleNamespace(evaluate=lambda hypothesis, vector: SimpleNamespace(
        hypothesis=hypothesis, vector=vector, cost=rugged(vector)))


def promised(hypothesis, *places):
    """Return what is promised at minima far from the least."""
    vectors = [np.array(place) for place in places]
    return sorted((multistart.Promise(hypothesis, rugged(vector), vector) for vector in vectors),
                  key=lambda promise: promise.cost)


def found(objective, promises):
    """Return the best that evolves, where without the effect the cost is 100."""
    return multistart.best_promised(objective, SimpleNamespace(cost=100.0), promises, 6,
                                    lambda begin, rounds: begin)


FAR = ([-3.7, -2.7], [4.3, -3.7], [-2.7, 4.3], [3.3, 4.3])


def test_what_is_promised_evolves_to_a_lower_minimum_than_random_moves_find(objective):
    best = found(objective, promised(TWO, *FAR))
    alone = multistart.search_around(objective, objective.evaluate(TWO, promised(
        TWO, *FAR)[0].vector), 900)   # As many as an evolution takes.
    assert best.cost < 2.0 < alone.cost
    assert found(objective, promised(TWO, *FAR)).cost == best.cost   # It is the same each time.


def test_each_of_the_most_promising_hypotheses_evolves_by_itself(objective):
    """Those of onsets: values at one of them are no neighbours of values at another."""
    others = [SimpleNamespace(bounds=TWO.bounds) for _ in range(multistart.EVOLVED)]
    promises = sorted((promise for index, other in enumerate([TWO, *others])
                       for promise in promised(other, *(np.array(FAR) + 0.01 * index))),
                      key=lambda promise: promise.cost)
    evolved = []
    begin = multistart._evolved

    def noted(objective, own):
        assert len({id(promise.hypothesis) for promise in own}) == 1
        evolved.append(own[0].hypothesis)
        return begin(objective, own)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(multistart, '_evolved', noted)
        assert found(objective, promises).cost < 2.0
    assert len(evolved) == multistart.EVOLVED
    assert evolved[0] is promises[0].hypothesis


@pytest.mark.parametrize(('without', 'further'), [(0.5, False), (100.0, True)])
def test_where_next_to_nothing_is_taken_away_no_further_moves_follow(
        objective, monkeypatch, without, further):
    moves = []
    monkeypatch.setattr(multistart, 'search_around', lambda objective, fit, count: (
        moves.append(count) or fit))
    multistart.best_promised(objective, SimpleNamespace(cost=without), promised(TWO, *FAR), 6,
                             lambda begin, rounds: begin)
    assert len(moves) == multistart.BASINS + further
