# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which numbers a refit held: the file is the minimum over all others, whatever else it misses."""

from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.diagnose.held_parameters import held_odds, likeliest

NAMES = ('inertia', 'viscous_friction', 'coulomb', 'load_gain')
COUNT = 4000


def misses(wrong, refitted, missing=0.0):
    """Return what a model file misses whose wrong numbers are off by so much, all others but
    these refitted or not, and physics of this rms missing; and what refits of all are asked by."""
    draw = np.random.default_rng(3)
    columns = draw.standard_normal((COUNT, len(NAMES)))
    # Numbers are never told apart altogether.
    columns = columns @ (np.eye(len(NAMES)) + 0.4)
    residual = columns @ [wrong.get(name, 0.0) for name in NAMES] \
        + missing * draw.standard_normal(COUNT) + 0.1 * draw.standard_normal(COUNT)
    if refitted:
        others = columns[:, [name not in wrong for name in NAMES]]
        residual = residual - others @ np.linalg.lstsq(others, residual, rcond=None)[0]
    bound = np.full(len(NAMES), 1e6)
    base = SimpleNamespace(jacobian=columns, hypothesis=SimpleNamespace(
        numbers=[SimpleNamespace(name=name) for name in NAMES], bounds=(-bound, bound),
        start_of_numbers=lambda: np.zeros(len(NAMES))))
    return base, SimpleNamespace(residual=residual), np.full(COUNT, 0.1)


@pytest.mark.parametrize('held', [('inertia',), ('coulomb',), ('inertia', 'load_gain')],
                         ids='+'.join)
@pytest.mark.parametrize('missing', [0.0, 0.5])
def test_numbers_that_a_refit_held_are_found_also_beside_missing_physics(held, missing):
    found = likeliest(held_odds(*misses(dict.fromkeys(held, 1.0), True, missing)))
    assert sorted(found) == sorted(held)


@pytest.mark.parametrize(('wrong', 'refitted', 'missing'), [
    ({'inertia': 1.0}, False, 0.0),                             # the others can make up for it
    ({'inertia': 1.0, 'coulomb': 0.8, 'load_gain': -0.7}, False, 0.0),
    ({'inertia': 0.01}, True, 0.0),                             # it may be the noise's level
    ({'inertia': 0.2}, True, 5.0),                              # or another formula's miss
    ({}, False, 1.0)])
def test_none_is_found_where_no_refit_is_seen(wrong, refitted, missing):
    assert likeliest(held_odds(*misses(wrong, refitted, missing))) == ()


def test_none_was_held_that_another_number_makes_up_for():
    base, file, sigma = misses({'coulomb': 1.0}, True)
    base.jacobian[:, 1] = base.jacobian[:, 2] * (1.0 + 1e-4) + 1e-3 * base.jacobian[:, 0]
    odds = held_odds(base, file, sigma)
    assert odds[('coulomb',)] < 1.0 and odds[('viscous_friction',)] < 1.0
