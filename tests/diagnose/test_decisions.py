# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is decided from levels that fits reach: the levels are given here, no fit is made."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from engb_core.diagnose import (
    absent_load,
    effort_scale,
    evidence,
    fit_steps,
    objective,
    selection,
    uncertainty,
    verdict,
)
from engb_core.diagnose.diagnosis import EffectFinding, LawFinding, ParameterEstimate, Unexplained
from engb_core.diagnose.experiment import next_experiment as experiment
from engb_core.diagnose.experiment import room as experiment_room
from engb_core.diagnose.experiment.room import Room
from engb_core.diagnose.experiment.segments import segments_of
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.numbers import wrong_numbers as numbers
from engb_core.diagnose.resonance import wide_band
from engb_core.diagnose.score import probability, ranking
from engb_core.diagnose.search import orders
from engb_core.diagnose.slider import finding_of_slider, unexplained_of_slider
from engb_core.diagnose.unknown import openset
from engb_core.effects.catalogue import get_effect
from engb_core.errors import InputError
from engb_core.model import EffectSetting, LoadTorque, Model


@dataclass(frozen=True)
class Level:
    """A fit of these effects that reaches this level (excess over the noise)."""

    names: tuple[str, ...]
    level: float
    hypothesis: SimpleNamespace = field(compare=False, default=None)

    def __post_init__(self) -> None:
        variants = tuple(SimpleNamespace(effect=get_effect(name),
                                         number_only=get_effect(name).number_only)
                         for name in self.names)
        object.__setattr__(self, 'hypothesis', SimpleNamespace(
            variants=variants, ids=self.names, numbers=(), size=len(self.names),
            has_unnamed=any(variant.effect.unnamed for variant in variants)))


@pytest.fixture
def levels(monkeypatch):
    """Have every module read a fit's level instead of reckoning it."""
    for module in (ranking, openset, probability, selection, wide_band, numbers):
        for name, value in (('excess', lambda fit, fitter: fit.level),
                            ('reduced_chi_square', lambda fit, fitter: 1.0 + fit.level)):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, value)


# ---- a linear axis

def test_what_is_found_on_a_linear_axis_is_told_in_metres_and_newtons():
    finding = EffectFinding('cogging_torque', 0.9, {
        'amplitude': ParameterEstimate(0.01, 0.001, 'N·m'),
        'phase': ParameterEstimate(0.3, 0.1, 'rad')}, 0.5, (), 'A torque of 2 N·m within 3 rad.')
    told = finding_of_slider(finding)
    assert told.parameters['amplitude'].unit == 'N' and told.parameters['phase'].unit == 'rad'
    assert told.statement == 'A force of 2 N within 3 m.'
    unknown = finding_of_slider(replace(finding, effect='of_somebody_else'))
    assert unknown.parameters['phase'].unit == 'm'


def test_a_law_on_a_linear_axis_has_its_units_and_nothing_stays_nothing():
    assert unexplained_of_slider(None) is None
    law = LawFinding('a', 'a * load', 'torque', {'a': ParameterEstimate(1.0, None, 'N·m/rad')},
                     'T = 1 N·m', 'Torque rises by 1 N·m.', (), True, 0.9, None)
    left = Unexplained(0.5, (), 'none', False, (), '2 N·m are left.')
    assert unexplained_of_slider(left).law is None
    told = unexplained_of_slider(replace(left, law=law))
    assert told.statement == '2 N are left.' and told.law.line == 'T = 1 N'
    assert told.law.parameters['a'].unit == 'N/m'
    assert told.law.statement == 'Force rises by 1 N.'


# ---- which of several is chosen

BACKLASH, RESONANCE = Level(('backlash',), 1.0), Level(('drivetrain_resonance',), 1.0)


def containing():
    """Return an effect of the library that contains other physics, and that."""
    from engb_core.effects.catalogue import catalogue
    library = catalogue()
    return next((effect.id, effect.contains[0]) for effect in library.values()
                if effect.contains and effect.contains[0] in library
                and not library[effect.contains[0]].number_only)


@pytest.mark.parametrize(('simple', 'chosen'), [(1.01, 'contained'), (3.0, 'containing')])
def test_an_effect_within_another_is_chosen_where_it_leaves_little_more(levels, simple, chosen):
    rich, poor = containing()
    candidates = [Level((rich,), 1.0), Level((poor,), simple)]
    best = ranking.simplest(candidates, None)
    assert best is candidates[1 if chosen == 'contained' else 0]


def test_another_effect_or_more_of_them_are_not_contained(levels):
    rich, poor = containing()
    first = Level((rich,), 1.0)
    for other in (Level(('torque_offset',), 1.0), Level((poor, 'torque_offset'), 1.0), first):
        assert ranking.simplest([first, other], None) is first


def test_what_has_no_name_gives_way_to_physics_that_leaves_noise(levels):
    nameless, named = Level(('unexplained_spot',), 0.0), Level(('backlash',), 0.001)
    assert ranking.simplest([nameless, named], None) is named
    assert ranking.simplest([nameless, Level(('backlash',), 5.0)], None) is nameless


def test_physics_beside_one_wrong_number_and_what_contains_the_chosen_are_rarer():
    number, physics = Level(('inertia_error',), 0.0), Level(('backlash',), 0.0)
    assert number.hypothesis.variants[0].number_only
    assert probability._prior(physics, number) == probability.PHYSICS_FOR_NUMBER
    assert probability._prior(number, number) == probability._prior(number, physics) == 1.0
    rich, poor = (Level((name,), 0.0) for name in containing())
    assert probability._prior(rich, poor) == probability.CONTAINING
    assert probability._prior(poor, rich) == 1.0


@pytest.mark.parametrize(('said', 'left', 'part'), [
    ([0.0, 0.0], [1.0, -1.0], 1.0), ([1.0, -1.0], [0.0, 0.0], 0.0),
    ([1.0, -1.0], [-0.5, 0.5], 1.0)])
def test_how_much_of_an_effect_is_not_there(monkeypatch, said, left, part):
    fit = SimpleNamespace(predicted=np.array(said), residual=np.array(left))
    fitter = SimpleNamespace(fitted=np.zeros(2, bool), sigma=np.ones(2),
                             predict=lambda *_: np.zeros(2))
    monkeypatch.setattr(objective, 'without_effects', lambda fit, which: (None, None))
    assert probability.own_part_left(fitter, fit, 0) == pytest.approx(part)


# ---- what is named beside a flexible model

def test_what_was_chosen_stays_where_all_of_its_size_stand_for_something_else(levels, monkeypatch):
    """A wave at the end of what can be seen, once fitted anew: a recording ended the program."""
    base, chosen = Level((), 9.0), Level(('actuation_lag', 'friction_drift'), 0.5)
    monkeypatch.setattr(selection, 'extend', lambda *_: None)
    monkeypatch.setattr(selection, '_candidates', lambda *_: [])
    result = SimpleNamespace(fitter=fitter_of(base, base))
    assert selection._of_all_in_place(result, chosen) is chosen


def fitter_of(file, base):
    return SimpleNamespace(
        nominal=lambda: file, base=lambda *_: base, finished_base=base, finish=lambda fit: fit,
        refine=lambda fit: fit, without=lambda fit, index: Level(
            fit.names[:index] + fit.names[index + 1:], base.level))


@pytest.mark.parametrize(('own', 'kept'), [
    (None, ()), ({'load': 1.0, 'velocity': 1.0}, ()),
    ({'load': 1.0, 'velocity': 0.0}, ('asymmetric_friction',)),
    ({'load': 0.0, 'velocity': 0.0}, ('asymmetric_friction', 'self_energizing'))])
def test_a_name_whose_own_form_is_right_stays_whatever_else_is_missing(levels, monkeypatch, own,
                                                                       kept):
    chosen, base = Level(('asymmetric_friction', 'self_energizing'), 6.0), Level((), 9.0)
    monkeypatch.setattr(openset, 'form_left', lambda fitter, without, fit, coordinate:
                        None if own is None else own[coordinate])
    monkeypatch.setattr(openset, '_described', lambda fitter, fit: (
        fit, SimpleNamespace(level=1.0), 1.1))
    found = openset.explain(fitter_of(Level((), 10.0), base), chosen)
    assert found.fit.names == kept
    assert set(found.dropped) == set(chosen.names) - set(kept)


@pytest.mark.parametrize(('after', 'with_table', 'alone', 'kept', 'table'), [
    (0.001, 0.001, 0.001, ('backlash',), False),    # noise is all that is left
    (1.0, 0.98, 3.0, ('backlash',), False),         # a table helps next to nothing
    (1.0, 0.1, 3.0, ('backlash',), True),           # the effect and a table beside it
    (6.0, 0.1, 5.0, ('backlash',), True),           # the table needs the effect
    (6.0, 0.1, 0.2, (), True),                      # the table does as well without it
])
def test_a_name_is_kept_where_a_flexible_model_needs_it(levels, monkeypatch, after, with_table,
                                                        alone, kept, table):
    chosen, base = Level(('backlash',), after), Level((), 9.0)
    made = SimpleNamespace(level=1.0)
    monkeypatch.setattr(openset, 'form_left', lambda *_: None)
    monkeypatch.setattr(openset, '_described', lambda fitter, fit: (
        fit, made, 1.0 + (with_table if fit is chosen else alone)))
    found = openset.explain(fitter_of(Level((), 10.0), base), chosen)
    assert found.fit.names == kept and (found.table is made) == table
    assert found.dropped == (() if kept else ('backlash',))


def test_without_any_effect_a_table_describes_what_is_left(levels, monkeypatch):
    base = Level((), 5.0)
    made = SimpleNamespace(level=1.0)
    monkeypatch.setattr(openset, '_described', lambda fitter, fit: (fit, made, 1.2))
    found = openset.explain(fitter_of(base, base), base)
    assert found.table is made and found.dropped == ()


# ---- how sure a number is

def test_a_residual_of_nothing_costs_nothing_and_one_that_stays_costs_its_colour():
    assert uncertainty.inflation(np.zeros(50)) == 1.0
    white = np.random.default_rng(0).standard_normal(4000)
    slow = np.convolve(white, np.ones(60) / np.sqrt(60.0), 'same')
    assert uncertainty.inflation(white) == pytest.approx(1.0, rel=0.2)
    assert uncertainty.inflation(slow) == pytest.approx(60.0, rel=0.25)


def test_a_residual_that_goes_by_for_long_costs_all_of_its_colour():
    """Of the first order, with a correlation of 0.985 from sample to sample: 1 + 2 Σ ρ^k = 132."""
    white = np.random.default_rng(3).standard_normal(60000)
    slow = lfilter([np.sqrt(1.0 - 0.985 ** 2)], [1.0, -0.985], white)
    assert uncertainty.inflation(slow) == pytest.approx(132.0, rel=0.25)


@pytest.mark.parametrize(('value', 'deviation', 'logarithmic', 'sure'), [
    (1.0, 0.01, False, True), (1.0, 2.0, False, False), (np.log(3.0), 0.01, True, True),
    (np.log(1.01), 0.5, True, False)])
def test_a_size_stands_out_of_none_by_its_deviation(monkeypatch, value, deviation, logarithmic,
                                                    sure):
    parameter = SimpleNamespace(name='size', none=1.0 if logarithmic else 0.0,
                                logarithmic=logarithmic)
    fit = SimpleNamespace(vector=np.array([value]), hypothesis=SimpleNamespace(
        variants=[SimpleNamespace(effect=SimpleNamespace(multimodal=False))], numbers=(),
        places=[(0, 0, -1)], parameter=lambda entry: parameter))
    monkeypatch.setattr(uncertainty, 'vector_deviations',
                        lambda *_, **__: np.array([deviation]))
    assert uncertainty.stands_out(fit, None, 0) == sure
    fit.hypothesis.variants[0].effect.multimodal = True
    assert uncertainty.stands_out(fit, None, 0)


# ---- numbers of the file

def told(name, matters, **more):
    return numbers.NumberFinding(name, None, matters, **more)


@pytest.mark.parametrize(('alone', 'pair', 'found'), [
    (0.0, 0.0, ['inertia_error']), (50.0, 0.0, ['inertia_error', 'coulomb_friction_error']),
    (50.0, 50.0, [])])
def test_the_fewest_numbers_that_make_a_file_fit_are_told(levels, monkeypatch, alone, pair, found):
    insisted = [told('inertia_error', 9.0), told('coulomb_friction_error', 8.9)]
    monkeypatch.setattr(numbers, '_refitted_only', lambda fitter, explained, names: Level(
        (), alone if len(names) == 1 else pair))
    numbers_found = numbers._fewest(None, Level((), 0.0), insisted, 2)
    assert [finding.effect for finding in numbers_found] == found


@pytest.mark.parametrize(('before', 'named', 'nominal', 'missed'), [
    (0.9, 0.9, 600.0, True), (0.9, 0.5, 600.0, True), (0.9, 0.01, 600.0, False),
    (0.9, 0.9, 3.0, False), (5.0, 5.0, 600.0, False)],
    ids=['nothing helps', 'little helps', 'physics', 'more of the whole', 'more than noise'])
def test_what_refitted_numbers_leave_may_be_a_miss_of_their_formulas(before, named, nominal,
                                                                     missed):
    assert selection._a_miss_of_numbers(before, named, nominal) == missed


@pytest.mark.parametrize(('old', 'new', 'whole', 'worth'), [
    (50.0, 10.0, 100.0, True), (4.0, 2.0, 100.0, False), (4.0, 0.1, 100.0, True),
    (50.0, 40.0, 100.0, False), (0.09, 0.0, 100.0, False)],
    ids=['half of all', 'a miss', 'all of little', 'little more', 'noise'])
def test_a_further_effect_is_worth_more_than_what_formulas_miss(old, new, whole, worth):
    assert ranking.worth_a_further_effect(old, new, whole) == worth


def test_two_causes_that_fit_alike_are_together_as_sure_as_one():
    one = EffectFinding('torque_offset', 0.46, {}, 1.0, (('asymmetric_friction', 0.44),), '')
    assert one.any_cause == pytest.approx(0.9)
    assert replace(one, alternatives=()).any_cause == 0.46


def test_what_a_refit_may_have_held_instead_is_told_with_its_odds():
    fitter = SimpleNamespace(held_odds={('inertia',): 3.0, ('coulomb',): 1.0, ('load_gain',): 0.1,
                                        ('inertia', 'coulomb'): 9.0})
    insisted = [told('inertia_error', 9.0), told('coulomb_friction_error', 8.9),
                told('load_dependent_friction', 7.0), told('viscous_friction_error', 6.0)]
    found = numbers._or_another(fitter, insisted[0], insisted)
    assert found.rivals == (('coulomb_friction_error', pytest.approx(1.0 / 4.1)),)


def test_what_no_motion_tells_from_a_number_shares_its_part_with_it():
    fitter = SimpleNamespace(held_odds={('viscous_friction',): 1.3, ('coulomb',): 1.2,
                                        ('inertia',): 1.1})
    insisted = [told('viscous_friction_error', 9.0, rivals=(('back_emf', 0.5),)),
                told('coulomb_friction_error', 8.9), told('inertia_error', 7.0)]
    found = dict(numbers._or_another(fitter, insisted[0], insisted).rivals)
    assert found['back_emf'] == pytest.approx(0.5 * 1.3 / 3.6)
    assert 1.0 - sum(found.values()) == pytest.approx(found['back_emf'])


def test_what_has_no_name_is_taken_off_before_numbers_are_asked():
    taken = []

    def without(fit, index):
        taken.append(index)
        return Level(tuple(name for place, name in enumerate(fit.names) if place != index), 0.0)

    fit = Level(('unexplained_spot', 'backlash', 'unexplained_rest'), 0.0)
    assert numbers._named_only(SimpleNamespace(without=without), fit).names == ('backlash',)
    assert taken == [2, 0]


def test_a_gain_that_falls_below_the_file_s_is_no_finding():
    explained = SimpleNamespace(vector=np.array([0.05]), hypothesis=SimpleNamespace(
        numbers=(SimpleNamespace(name='load_gain', logarithmic=False),),
        start_of_numbers=lambda: np.array([0.11])))
    fitter = SimpleNamespace(problem=SimpleNamespace(model=Model()))
    fitter.problem.model = replace(Model(), friction=replace(Model().friction, load_gain=0.11))
    assert numbers._named(fitter, explained, 'load_gain', 1.0) is None
    explained.vector = np.array([0.2])
    assert numbers._named(fitter, explained, 'load_gain', 1.0).effect == 'load_dependent_friction'


def test_what_a_scale_may_stand_in_place_of_is_taken_off_before_one_is_asked():
    names = (*effort_scale.SCALE_LIKE, 'backlash')[-2:]
    left = effort_scale._without_scale_like(SimpleNamespace(without=lambda fit, place: Level(
        tuple(name for index, name in enumerate(fit.names) if index != place), 0.0)),
        Level(names, 0.0))
    assert left.names == ('backlash',)
    fitter = SimpleNamespace(numbers=(SimpleNamespace(name='coulomb'),))
    assert effort_scale._factors(fitter, None) is None      # no inertia to hold a load against


def test_without_candidates_the_base_stays(monkeypatch):
    base = Level((), 5.0)
    monkeypatch.setattr(selection, '_candidates', lambda *_: [])
    result = SimpleNamespace(fitter=None, base=base)
    assert selection._forward(result, 5.0) is base
    assert selection._of_best_pair(result, base, 5.0) is base


# ---- shafts that ring

@pytest.fixture
def wide(levels, monkeypatch):
    """Return what looks for a resonance among these shafts, beside these rivals."""
    def look(file, base, shafts, rivals, known=0.9, ring=True, play=None, corrected=None):
        monkeypatch.setattr(wide_band, 'with_play', lambda fitter, shaft: play)
        monkeypatch.setattr(wide_band, 'judged_wide', lambda problem: True)
        monkeypatch.setattr(wide_band, '_band', lambda problem: 100.0)
        monkeypatch.setattr(wide_band, 'problem_of', lambda *_, **__: problem)
        monkeypatch.setattr(wide_band, 'replace', lambda entry, **_: entry)
        monkeypatch.setattr(wide_band, '_as_it_stands', lambda problem: 1.0 + file)
        monkeypatch.setattr(wide_band, 'Fitter', lambda *_: SimpleNamespace(
            base=lambda: Level((), base), problem=SimpleNamespace(
                model=SimpleNamespace(effects=()))))
        monkeypatch.setattr(wide_band, '_shafts', lambda fitter, tried: iter(shafts))
        monkeypatch.setattr(wide_band, '_rivals', lambda *_: iter(rivals))
        monkeypatch.setattr(wide_band, 'part_left', lambda *_: 0.0)
        monkeypatch.setattr(wide_band, 'something_known', lambda left: known)
        monkeypatch.setattr(wide_band, '_rings', lambda fit, fitter: ring)
        monkeypatch.setattr(wide_band, '_resonance',
                            lambda fitter, base, fit, apart: SimpleNamespace(
                                fit=fit, excess=fit.level))
        monkeypatch.setattr(wide_band, '_over_formulations', lambda *_: {})
        problem = SimpleNamespace(runs=(), onsets=(), before_stop=0.0, noise_part=1.0,
                                  model=Model())
        found = wide_band.resonance_beside(problem, corrected or Model())
        return found and found.fit
    return look


def test_a_shaft_that_rings_and_explains_more_than_a_gap_is_named(wide):
    shaft = Level(('drivetrain_resonance',), 0.5)
    assert wide(9.0, 5.0, [shaft], [Level(('backlash',), 2.0)]) is shaft


def test_play_that_explains_more_than_the_shaft_is_named_unless_it_is_already(wide):
    shaft, play = Level(('drivetrain_resonance',), 1.0), Level(('backlash',), 0.5)
    assert wide(9.0, 5.0, [shaft], [], play=play) is play
    told = Model(effects=(EffectSetting('backlash', {'gap': 0.1}),))
    assert wide(9.0, 5.0, [shaft], [], play=play, corrected=told) is None


@pytest.mark.parametrize(('beside', 'alone', 'found'), [
    (None, 0.5, 0.5), (None, 4.9, None), (None, None, None), (2.0, 0.5, 0.5), (2.0, 1.9, 2.0),
    (0.2, 0.0, 0.2)])
def test_a_shaft_stands_instead_of_names_where_it_leaves_clearly_less(
        wide, monkeypatch, beside, alone, found):
    """Bristles and loops bend as a soft shaft does, and beside them none was heard."""
    name = EffectSetting('presliding_friction', {})
    wide(9.0, 5.0, [], [])   # All of the module is a stand-in from here on.

    def fitter(problem, model, bandwidth, threads):
        return SimpleNamespace(base=lambda: Level((), 5.0), problem=SimpleNamespace(model=model))

    def shown(fitter, corrected, onsets, named=()):
        left = beside if fitter.problem.model.effects else alone
        return None if left is None else SimpleNamespace(excess=left, instead=False)

    monkeypatch.setattr(wide_band, '_wide', fitter)
    monkeypatch.setattr(wide_band, '_shown', shown)
    monkeypatch.setattr(wide_band, 'replace', lambda entry, **more: SimpleNamespace(
        **{**vars(entry), **more}))
    heard = wide_band.resonance_beside(SimpleNamespace(model=Model(), onsets=()),
                                       Model(effects=(name,)))
    assert (heard and heard.excess) == found
    assert heard is None or heard.instead == (found == alone)


@pytest.mark.parametrize(('file', 'base', 'shafts', 'rivals', 'known', 'ring'), [
    (0.0, 5.0, [RESONANCE], [], 0.9, True),             # the file fits
    (9.0, 0.0, [RESONANCE], [], 0.9, True),             # numbers alone fit
    (9.0, 5.0, [RESONANCE], [], 0.3, True),             # it may be something else
    (9.0, 5.0, [RESONANCE], [], 0.9, False),            # it smooths noise only
    (9.0, 5.0, [RESONANCE], [Level(('backlash',), 0.5)], 0.9, True),   # a gap does better
    (9.0, 5.0, [], [], 0.9, True)])
def test_no_shaft_is_named_where(wide, file, base, shafts, rivals, known, ring):
    assert wide(file, base, shafts, rivals, known, ring) is None


def test_the_straight_shaft_stands_where_the_bent_one_leads_astray(levels, monkeypatch):
    straight, bent = RESONANCE, Level(('drivetrain_resonance',), 0.2)
    fitter = SimpleNamespace(finish=lambda fit: fit)
    monkeypatch.setattr(wide_band, '_rings', lambda fit, fitter: True)
    for linear, made, found in ((straight, bent, [bent, straight]),
                                (straight, straight, [straight]),
                                (Level(('drivetrain_resonance',), 0.0), bent, None)):
        monkeypatch.setattr(wide_band, 'linear_shaft', lambda fitter, linear=linear: linear)
        monkeypatch.setattr(wide_band, '_bent', lambda fitter, fit, tried, made=made: made)
        assert list(wide_band._shafts(fitter, [])) == (found or [linear])


def test_formulations_of_a_shaft_that_explain_as_well_say_how_sure_its_numbers_are(monkeypatch):
    shafts = {name: SimpleNamespace(frequency=frequency, left=left) for name, frequency, left in (
        ('hardens', 35.0, 0.0), ('linear', 41.0, 0.0), ('astray', 900.0, 0.9))}
    monkeypatch.setattr(wide_band, 'part_left', lambda fitter, base, fit: fit.left)
    monkeypatch.setattr(wide_band, '_values', lambda fit: dict.fromkeys(
        get_effect('drivetrain_resonance').names, 0.1)
        | {'frequency': fit.frequency})

    def apart(*names: str) -> float:
        return wide_band._over_formulations(
            None, None, shafts['hardens'], [shafts[name] for name in names])['frequency']

    assert apart('hardens') == 0.0
    assert apart('linear', 'hardens') == pytest.approx(6.0 / np.sqrt(2.0))
    # What is likelier a makeshift says nothing.
    assert apart('astray', 'hardens') == 0.0


@pytest.mark.parametrize(('fraction', 'damping', 'frequency', 'rings'), [
    (0.4, 0.05, 50.0, True), (0.9, 0.05, 50.0, False),
    (0.4, 1.0, 30.0, True), (0.4, 1.0, 90.0, False),
    # However little is beyond it rings if it is lightly damped and within the band, only then.
    (0.05, 0.05, 50.0, True), (0.05, 0.6, 50.0, False), (0.05, 0.05, 90.0, False),
    # Much inertia beyond it smooths noise, unless it is lightly damped and within the band.
    (0.75, 0.1, 30.0, True), (0.75, 0.6, 30.0, False), (0.75, 0.1, 90.0, False)])
def test_a_shaft_rings_by_its_inertia_and_damping(fraction, damping, frequency, rings):
    most = next(entry.high for entry in get_effect('drivetrain_resonance').parameters
                if entry.name == 'damping_ratio')
    assert wide_band.rings({'inertia_fraction': fraction, 'damping_ratio': damping * most,
                            'frequency': frequency}, 100.0) == rings


# ---- the next experiment

def room(load, low=0.0, high=40.0, finest=1e-3):
    angle = np.linspace(low, high, 400)
    return Room(low, high, 50.0, 400.0, 0.05, finest, low, angle, load(angle), 'rad')


def names(found):
    return [segment.name for segment in found]


def test_segments_are_of_what_a_range_allows():
    free = names(segments_of(room(np.zeros_like)))
    assert 'slow strokes over the range' in free and not any('under load' in name for name in free)
    loaded = names(segments_of(room(lambda angle: np.clip((angle - 10.0) / 30.0, 0.0, 1.0))))
    assert 'slow strokes without load' in loaded and 'holds under load' in loaded
    at_once = names(segments_of(room(lambda angle: 0.1 + 0.9 * angle / 40.0)))
    assert not any('without load' in name for name in at_once)
    coarse = names(segments_of(room(np.zeros_like, finest=20.0)))
    assert coarse and not any('reversals' in name or 'quick' in name for name in coarse)


def test_an_experiment_needs_rivals_and_a_segment_that_does_no_harm(monkeypatch):
    with pytest.raises(InputError, match='no fit of a rival is at hand'):
        experiment._proposal(None, None, [], (), False)
    time = np.linspace(0.0, 1.0, 11)
    recorded = SimpleNamespace(motion=SimpleNamespace(effort=np.ones(11)))
    fitter = SimpleNamespace(problem=SimpleNamespace(
        runs=(recorded,), held_out=(), scene=SimpleNamespace(position_range=(0.0, 1.0))))

    def trial(effort):
        return SimpleNamespace(runs=(SimpleNamespace(motion=SimpleNamespace(
            time=time, effort=np.full(11, effort), position=time)),))

    course = SimpleNamespace(spans=((0.0, 0.5), (0.5, 1.0)))
    range_ = SimpleNamespace(width=1.0)
    assert experiment._harmless(fitter, trial(0.9), course, range_).all()
    with pytest.raises(InputError, match='every segment asks for more than was recorded'):
        experiment._harmless(fitter, trial(2.0), course, range_)


@pytest.mark.parametrize(('apart', 'little'), [(9.0, False), (0.01, True)])
def test_a_small_difference_is_told_as_one(apart, little):
    text = experiment._reason([experiment._Rivalry('backlash', 'pad_creep', None)], [apart])
    assert ('which is little' in text) == little and text.endswith('.')


@pytest.mark.parametrize(('change', 'loaded'), [
    ({}, True), ({'largest_effort': 1e6}, False), ({'speed': 0.0}, None),
    ({'position_range': (3.0, 3.0)}, None)])
def test_a_room_is_of_the_motion_that_was_recorded(monkeypatch, change, loaded):
    time = np.linspace(0.0, 2.0, 400)
    motion = SimpleNamespace(quantum=1e-3, position=20.0 + 20.0 * np.sin(3.0 * time), time=time,
                             velocity=60.0 * np.cos(3.0 * time),
                             acceleration=-180.0 * np.sin(3.0 * time), step=5e-3)
    run = SimpleNamespace(motion=motion, recording=SimpleNamespace(reference=None))
    scene = {'position_range': (0.0, 40.0), 'largest_effort': 0.3, 'speed': 60.0, **change}
    problem = SimpleNamespace(runs=(run,), held_out=(), scene=SimpleNamespace(**scene),
                              model=Model(load_torque=LoadTorque(coefficients=(0.0, 0.0, 2e-4))))
    if loaded is None:
        with pytest.raises(InputError, match='no motion that a reference could keep within'):
            experiment_room.room_of(problem, problem.model, 0.1)
        return
    made = experiment_room.room_of(problem, problem.model, 0.1)
    assert made.loaded == loaded
    assert 0.0 < made.low < made.high < 40.0 and made.angle[-1] == pytest.approx(made.high)
    assert made.speed <= 60.0 and 0.0 < made.acceleration <= 360.0


# ---- what is left

def test_what_a_table_describes_is_told_with_what_it_depends_on_and_what_was_dropped(monkeypatch):
    zone = SimpleNamespace(variable='position', begin=2.0, end=5.0, unit='rad')
    run = SimpleNamespace(motion=SimpleNamespace(velocity=np.array([1.0, -1.0]),
                                                 position=np.array([3.0, 3.0])),
                          comparison=SimpleNamespace(grid=np.arange(2)))
    fitter = SimpleNamespace(problem=SimpleNamespace(
        runs=(run,), model=None, split=lambda values: [values]))
    table = SimpleNamespace(predicted=np.array([1.0, -1.0]),
                            table=SimpleNamespace(names=('position', 'load')))
    fit = SimpleNamespace(residual=np.array([0.5, 0.5]), hypothesis=SimpleNamespace(variants=()))
    for where, made, carried in (((zone,), table, True), ((), None, False)):
        monkeypatch.setattr(verdict, 'zones', lambda *_, where=where: list(where))
        left = verdict._unexplained(fitter, SimpleNamespace(
            fit=fit, table=made, dropped=('backlash',), carried_over=carried), 0.4)
        assert left.statement.startswith('40 % of the mismatch is not explained')
        assert ('it depends on position and load' in left.statement) == (made is not None)
        assert ('from 2 to 5 rad' in left.statement) == bool(where)
        assert ('clearly more can be explained' in left.statement) == carried
        assert left.parity_in_velocity == ('odd' if made else 'even')
        assert left.depends_on == (('position', 'load') if made else ())


def test_a_load_is_of_as_many_values_as_were_fitted():
    for load, count in ((LoadTorque('sinusoid', amplitude=0.1), 2), (LoadTorque(), 0),
                        (LoadTorque(coefficients=(0.0, 1e-3, 2e-4), contact_angle=2.0), 3)):
        plain = Model(load_torque=load, friction=replace(Model().friction, load_gain=0.0))
        rubbing = replace(plain, friction=replace(plain.friction, load_gain=0.1))
        assert (absent_load._values(plain), absent_load._values(rubbing)) == (count, count + 1)


def test_a_shaft_at_one_angle_shows_no_order():
    values = np.ones(4000)
    none = orders.leading_orders(2.0 * values, values, values, 50.0 * values, 1.0, 20.0, 3)
    assert none == []
    angle = np.linspace(0.0, 60.0, 4000)
    wave = np.sin(7.0 * angle)
    found = orders.leading_orders(angle, wave, values, 50.0 * values, 1.0, 20.0, 1)
    assert found == [pytest.approx(7.0, rel=0.01)]


@pytest.mark.parametrize(('least', 'most', 'expected'), [
    ([-9.0, -9.0], [9.0, 9.0], [1.0, 2.0]), ([-9.0, -9.0], [0.5, 9.0], [0.5, 2.25]),
    ([-9.0, -9.0], [0.5, 0.5], [0.5, 0.5])])
def test_a_step_that_meets_a_bound_is_solved_anew_beside_it(least, most, expected):
    gram, right = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([4.0, 5.0])
    step = fit_steps.bounded_step(gram, right, np.array(least), np.array(most))
    assert step == pytest.approx(expected)


@pytest.mark.parametrize(('gram', 'right', 'step'), [
    (np.ones((2, 2)), [1.0, 1.0], [0.5, 0.5]), (np.diag([1.0, 0.0]), [1.0, 0.0], [1.0, 0.0])])
def test_a_step_that_the_data_do_not_tell_is_the_shortest(gram, right, step):
    """Two entries that act alike, one that acts on nothing: a diagnosis is not to end in them."""
    free = np.full(2, np.inf)
    assert fit_steps.bounded_step(gram, np.array(right), -free, free) == pytest.approx(step)


def test_a_number_of_the_file_is_found_by_its_name():
    model = Model()
    assert fit_steps.nominal_value(model, 'inertia') == model.motor.inertia
    assert fit_steps.nominal_value(model, 'coulomb') == model.friction.coulomb
    with pytest.raises(KeyError):
        fit_steps.nominal_value(model, 'colour')


# ---- figures

def test_a_loop_that_runs_away_or_cannot_be_run_has_no_figure(monkeypatch):
    run = SimpleNamespace(recording=SimpleNamespace(
        name='a', time=np.arange(9.0), position=np.arange(9.0)))
    monkeypatch.setattr(evidence, 'simulate_closed_loop',
                        lambda recording, model: (np.full(9, np.nan), None))
    assert evidence._loop(run, None, None) is None

    def refuses(recording, model):
        raise InputError('no controller')

    monkeypatch.setattr(evidence, 'simulate_closed_loop', refuses)
    assert evidence._loop(run, None, None) is None
    monkeypatch.setattr(evidence, 'simulate_closed_loop',
                        lambda recording, model: (np.zeros(9), None))
    assert evidence._loop(run, None, None).simulated_after.tolist() == [0.0] * 9


def test_of_what_was_fitted_whole_there_is_no_figure(monkeypatch):
    def run(name, fitted):
        return SimpleNamespace(
            recording=SimpleNamespace(name=name), fitted=fitted, measured=np.array([1.0, 2.0]),
            noise=np.array([0.1, 0.1]))

    monkeypatch.setattr(evidence, '_predicted', lambda problem, run, model: np.array([0.0, 2.0]))
    problem = SimpleNamespace(runs=(run('a', np.ones(2, bool)),
                                    run('b', np.array([False, True]))), held_out=(), model=Model())
    found, = evidence.quality_of_fit(problem, Model(), {})
    assert (found.recording, found.rms_before, found.noise_floor) == ('b', 1.0, pytest.approx(0.1))
    held = replace_problem(problem, held_out=(run('c', np.ones(2, bool)),))
    assert [entry.recording for entry in evidence.quality_of_fit(held, Model(), {})] == ['c']


def replace_problem(problem, **more):
    return SimpleNamespace(**{**vars(problem), **more})


def test_a_variant_by_temperature_needs_one(monkeypatch):
    fade = get_effect('pad_friction_fade')
    scene = {'joint_type': 'revolute', 'stroke': 30.0, 'speed': 50.0, 'largest_load': 0.1,
             'disc_speed_range': (0.0, 9.0), 'position_range': (0.0, 30.0),
             'disc_turned_both_ways': False, 'disc_turned_only_backwards': False}
    monkeypatch.setattr('engb_core.diagnose.hypothesis.scaled', lambda effect, scene: effect)
    cold, warm = (variants_of(fade, SimpleNamespace(temperature_range=span, **scene))
                  for span in (None, (20.0, 300.0)))
    assert len(cold) < len(warm)
