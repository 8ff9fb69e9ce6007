# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is said where nothing is named."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.hypothesis import Variant
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.diagnose.verdict import (
    parity_in_velocity,
    unless_nothing_helps,
    verdict_of,
    with_nearest,
)
from engb_core.effects.catalogue import get_effect
from tests.laws.test_find_law import MODEL, recorded

FINDING = EffectFinding('backlash', 0.9, {}, 1.0, (), '')


@pytest.mark.parametrize(('verdict', 'findings', 'helps', 'said'), [
    ('explained', [], False, 'consistent'),
    ('explained', [], True, 'explained'),
    ('explained', [FINDING], False, 'explained'),
    ('unexplained', [], False, 'unexplained'),
    ('consistent', [], False, 'consistent'),
])
def test_numbers_that_fit_nothing_new_are_no_mismatch(verdict, findings, helps, said):
    assert unless_nothing_helps(verdict, findings, helps) == said


@pytest.mark.parametrize(('effect', 'values', 'depends_on', 'memory'), [
    ('unexplained_loss', (0.3, 1.0, 12.0), ('load', 'velocity'), False),
    ('unexplained_rest', (1.0, 0.1, 0.6, 0.1), ('since_reversal', 'time_at_rest', 'direction'),
     True),
    ('unexplained_gain_drift', (-0.3, 0.5, 30.0, 0.5, 1.0), ('heat', 'effort'), True),
    ('unexplained_gain_drift', (-0.3, 0.5, 30.0, 0.5, 0.0), ('time', 'effort'), False),
    ('unexplained_speed_gain', (-0.3, 2.0, 12.0), ('velocity', 'effort'), False),
    ('unexplained_crossover', (0.1, 0.02, 0.5), ('effort',), False),
    ('unexplained_spot', (0.05, 8.0, 1.0, 2.0, 1.0), ('position', 'direction'), False),
    ('unexplained_episode', (0.5, 5.0, 9.0, 2.0), ('time', 'load'), False),
])
def test_a_description_tells_all_that_it_depends_on(effect, values, depends_on, memory):
    fitter = Fitter(problem_of([recorded()], MODEL))
    hypothesis = fitter.hypothesis((Variant(get_effect(effect), values[
        len(get_effect(effect).parameters):]),))
    vector = np.concatenate([hypothesis.start_of_numbers(), [
        np.log(value) if parameter.logarithmic else value for value, parameter in zip(
            values, get_effect(effect).parameters, strict=False)]])
    fit = fitter.evaluate(hypothesis, vector)
    nominal = fitter.nominal()
    nominal = replace(nominal, residual=nominal.residual + 1.0)
    _, told = verdict_of(fitter, nominal, Explanation(fit, None), [])
    assert told.depends_on == depends_on
    assert told.memory == memory


@pytest.mark.parametrize(('share', 'said'), [(0.998, 'Less than 1 %'), (0.7, '30 %')])
def test_a_remainder_that_rounds_to_nothing_is_not_called_nothing(share, said):
    fitter = Fitter(problem_of([recorded()], MODEL))
    nominal = fitter.nominal()
    left = replace(nominal, residual=nominal.residual + 1.0)
    _, told = verdict_of(fitter, left, Explanation(left, None),
                         [replace(FINDING, share=share)])
    assert told.statement.startswith(f'{said} of the mismatch is not explained')


def test_known_effects_nearest_to_the_rest_are_told_beside_a_name():
    fitter = Fitter(problem_of([recorded()], MODEL))
    nominal = fitter.nominal()
    left = replace(nominal, residual=nominal.residual + 1.0)
    further = (('nonlinear_viscous_friction', 0.29), ('cogging_torque', 0.16))
    told, none = (verdict_of(fitter, left, Explanation(left, None), findings,
                             further)[1]
                  for findings in ([replace(FINDING, share=0.9)], []))
    assert told.nearest == further
    assert with_nearest(told).statement.endswith(
        'Of the known effects these would take away a part of it: nonlinear_viscous_friction '
        '29 %, cogging_torque 16 %; another formula of what is named may miss as much, so none '
        'of them is named.')
    # They were asked beside all chosen effects, of which a dropped one is no longer there.
    _, without = verdict_of(fitter, left, Explanation(left, None, ('backlash',)),
                            [replace(FINDING, share=0.9)], further)
    assert without.nearest == ()
    # With nothing named there is nothing beside which they would be.
    assert none.nearest == ()
    assert with_nearest(none) is none and with_nearest(None) is None


@pytest.mark.parametrize(('torque', 'parity'), [
    (lambda position, way: np.sin(4.0 * position), 'even'),
    (lambda position, way: way * np.sin(4.0 * position), 'odd'),
    (lambda position, way: 0.0 * position, 'none')])
def test_parity_is_told_at_each_place_of_the_stroke(torque, parity):
    """Also of a torque that averages out over the stroke."""
    random = np.random.default_rng(2)
    position = random.uniform(0.0, 12.0, 4000)
    way = random.choice([-1.0, 1.0], position.size)
    told = [parity_in_velocity(torque(position, way) + 0.05 * random.normal(size=position.size),
                               position, 3.0 * way) for _ in range(4)]
    assert told == [parity] * 4
