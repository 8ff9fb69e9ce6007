# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How sure a name is: by what it leaves of what no fit has seen."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.diagnose.constants import PHYSICS_FOR_NUMBER, SURE, WORTH_PART
from engb_core.diagnose.formula import further_odds, something_known, sure_part
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score import probability
from engb_core.diagnose.score.probability import (
    closer_odds,
    further_known,
    part_left,
    rival_weights,
)
from engb_core.diagnose.score.ranking import worth_having
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square_of
from engb_core.effects.catalogue import get_effect
from engb_core.model import LoadTorque

from .simulated_brake import brake_with, lively, NOMINAL


def test_a_cause_that_nobody_wrote_down_stays_possible():
    assert 0.9 < something_known(0.0) < 0.95


def test_what_is_left_unexplained_speaks_against_a_name():
    known = [something_known(left) for left in (0.0, 0.05, 0.2, 0.5, 1.0)]
    assert known == sorted(known, reverse=True)
    # A name that leaves half of the torque is as likely a makeshift as right, if something else
    # may be missing beside it; a makeshift, if it leaves as much of what is its own.
    assert 0.45 < something_known(0.5 ** 2) < 0.65
    assert something_known(0.5 ** 2, 0.5) < 0.5


def test_what_leaves_little_is_surely_what_it_says():
    assert something_known(sure_part()) == pytest.approx(SURE)
    assert something_known(0.5 * sure_part()) > SURE > something_known(2.0 * sure_part())


def test_each_further_parameter_has_to_take_a_part_away():
    assert worth_having(1.0 - 1.1 * WORTH_PART, 1.0)
    assert not worth_having(1.0 - 0.9 * WORTH_PART, 1.0)
    assert not worth_having(1.0 - 1.1 * WORTH_PART, 1.0, parameters=2)
    assert worth_having(1.0 - 2.0 * WORTH_PART, 1.0, parameters=2)


@pytest.fixture(scope='module')
def fitter() -> Fitter:
    return Fitter(problem_of([lively(brake_with('asymmetric_friction', asymmetry=0.4))], NOMINAL))


def scaled(fit: Fit, rows: np.ndarray, factor: float) -> Fit:
    return replace(fit, residual=np.where(rows, factor, 1.0) * fit.residual)


def test_what_is_left_is_asked_where_no_fit_has_looked(fitter):
    """An effect that fits what it was fitted to, and nothing else, explains nothing."""
    base = scaled(fitter.base(), np.array(True), 20.0)
    assert part_left(fitter, base, scaled(base, fitter.fitted, 0.0)) > 0.9
    assert part_left(fitter, base, scaled(base, ~fitter.fitted, 0.5)) == pytest.approx(
        0.25, abs=0.05)
    assert part_left(fitter, base, scaled(base, ~fitter.fitted, 0.0)) == 0.0


def test_what_takes_away_next_to_nothing_of_a_little_leaves_it(fitter):
    """Of an excess that is not much more than the noise may be off, a tenth is not most."""
    base = fitter.base()
    level = np.sqrt(1.5 / reduced_chi_square_of(base, fitter, ~fitter.fitted))
    base = scaled(base, np.array(True), float(level))
    assert part_left(fitter, base, scaled(base, np.array(True), np.sqrt(1.45 / 1.5))) > 0.7
    assert part_left(fitter, base, scaled(base, np.array(True), np.sqrt(1.2 / 1.5))) == 0.0


def test_what_lies_in_no_stretch_left_out_is_asked_of_all(fitter):
    once = scaled(fitter.base(), np.array(True), 20.0)
    once = scaled(once, ~fitter.fitted, 0.0)
    assert part_left(fitter, once, scaled(once, fitter.fitted, 0.5)) == pytest.approx(
        0.25, abs=0.05)


def test_an_effect_beside_others_is_held_against_what_their_formulas_miss():
    # Half of all, gone with it; a part as small as formulas miss, half gone; such a part, gone.
    assert further_odds(0.5, 0.0) > 30.0
    assert further_odds(0.04, 0.5) < 0.5
    assert further_odds(0.04, 0.5, 0.5) < 0.2
    assert 1.0 < further_odds(0.0, 0.0) < 5.0
    for rest in (0.01, 0.1, 0.5):
        odds = [further_odds(rest, left) for left in (0.0, 0.1, 0.3, 1.0)]
        assert odds == sorted(odds, reverse=True)


def test_an_effect_beside_others_is_no_surer_than_it_is_needed_there(fitter):
    base = scaled(fitter.base(), np.array(True), 20.0)
    beside = scaled(base, np.array(True), 0.3)
    known = [further_known(fitter, base, beside, scaled(beside, np.array(True), factor))
             for factor in (0.1, 0.5, 0.8)]
    assert known[0] > 0.85 and known[1] < 0.75 and known[2] < 0.5
    assert further_known(fitter, base, beside, scaled(beside, np.array(True), 0.8), 0.8) < 0.2
    assert something_known(part_left(fitter, base, scaled(beside, np.array(True), 0.8))) > 0.6


class Rival:
    """A fit of one effect with this residual."""

    def __init__(self, residual: np.ndarray) -> None:
        self.residual = residual


def test_a_rival_weighs_by_how_surely_it_leaves_less(monkeypatch):
    """What counts is how the ratio scatters over stretches of time, not how many values there
    are: of the same excess in one stretch a rival may be right, in all of them it is not."""
    fitter = SimpleNamespace(sigma=np.ones(400), spread=np.ones(400))
    monkeypatch.setattr(probability, 'stretches', lambda _: np.repeat(np.arange(20), 20))
    chosen = Rival(np.sqrt(2.0) * np.ones(400))
    everywhere = Rival(np.sqrt(4.0) * np.linspace(0.9, 1.1, 400))
    once = Rival(np.where(np.arange(400) < 20, np.sqrt(42.0), np.sqrt(2.0)))
    odds = [closer_odds(rival, chosen, fitter, 0.1) for rival in (chosen, once, everywhere)]
    assert odds[0] == 1.0 and 0.03 < odds[1] < 0.4 and odds[2] < 1e-3


def test_noise_is_no_more_than_what_the_better_fit_leaves(monkeypatch):
    """Held against a noise that is thought twice too large, all fits had left none, and a rival
    that leaves half as much again weighed as much as the chosen one."""
    monkeypatch.setattr(probability, 'stretches', lambda _: np.repeat(np.arange(20), 20))
    chosen = Rival(np.linspace(0.9, 1.1, 400))
    rival = Rival(np.sqrt(1.5) * np.linspace(1.1, 0.9, 400))
    told, true = (closer_odds(rival, chosen, SimpleNamespace(
        sigma=size * np.ones(400), spread=np.ones(400)), 0.1) for size in (2.0, 1.0))
    assert true < 0.01 and told < 0.01


def test_a_number_that_no_file_holds_is_no_likelier_than_physics_that_acts_like_it():
    """An offset of the current sensor, and friction that differs by direction."""
    fitter = Fitter(problem_of([lively(brake_with('torque_offset', offset=0.01))], NOMINAL))
    rival, offset, scale = (fitter.fit(variants_of(get_effect(name), fitter.problem.scene)[0])
                            for name in ('asymmetric_friction', 'torque_offset',
                                         'load_stiffness_error'))
    assert probability._prior(rival, offset) == 1.0
    assert probability._prior(rival, scale) == PHYSICS_FOR_NUMBER


def test_a_rival_that_stands_on_fewer_numbers_is_held_against_the_chosen_on_the_same():
    """Free numbers take up noise, which is nothing that speaks for an effect."""
    fitter = Fitter(problem_of([lively(brake_with('torque_offset', offset=0.01))], NOMINAL))
    variant, = variants_of(get_effect('torque_offset'), fitter.problem.scene)
    chosen = fitter.refine(fitter.fit(variant))
    standing = fitter.refine(fitter.with_file(chosen))
    assert len(standing.hypothesis.numbers) < len(chosen.hypothesis.numbers)
    assert rival_weights(chosen, [standing], fitter, 10.0) == pytest.approx([0.5, 0.5])


def test_a_straight_load_has_no_contact_that_could_have_shifted():
    contact = get_effect('contact_shift')
    straight = replace(NOMINAL, load_torque=LoadTorque(coefficients=(0.1, 0.004, 0.0, 0.0)))
    for model, applies in ((NOMINAL, True), (straight, False)):
        scene = problem_of([lively(NOMINAL)], model).scene
        assert contact.applies is not None and contact.applies(scene) == applies
