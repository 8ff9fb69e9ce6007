# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the search by derivatives below 20 Hz can't see: resonances, gaps, and refitted files."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import butter, sosfilt

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.held_parameters import LOAD
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.nominal import CURVATURE
from engb_core.diagnose.numbers.wrong_numbers import wrong_numbers
from engb_core.diagnose.optimise.cross_entropy import DEARER, middle_of_basin
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.multistart import is_multimodal, search_around
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.resonance import wide_band
from engb_core.diagnose.resonance.wide_band import RESONANCE, resonance_beside
from engb_core.diagnose.score.ranking import worth_a_further_effect
from engb_core.diagnose.score.reduced_chi_square import excess
from engb_core.diagnose.search.every_effect import _came_to_more, search
from engb_core.diagnose.selection import select
from engb_core.effects.catalogue import get_effect
from engb_core.effects.drivetrain_resonance import HARDENS, LINEAR, SOFT_CENTRE
from engb_core.model import EffectSetting, LoadTorque, Model
from engb_core.recording import Recording

from .simulated_brake import brake_with, lively, NOMINAL, recorded, strokes_and_waves


@pytest.fixture(scope='module')
def clean() -> Recording:
    return lively(NOMINAL)


@pytest.fixture(scope='module')
def ringing() -> Recording:
    return lively(brake_with(RESONANCE, inertia_fraction=0.4, frequency=24.0, damping_ratio=0.05))


@pytest.fixture(scope='module')
def loose() -> Recording:
    return lively(brake_with('backlash', gap=0.8, inertia_fraction=0.3, friction_fraction=0.6))


def test_a_resonance_above_the_band_is_heard(ringing):
    found = resonance_beside(problem_of([ringing], NOMINAL), NOMINAL)
    assert found is not None
    assert found.finding.parameters['frequency'].value == pytest.approx(24.0, rel=0.1)
    assert found.setting.parameters['inertia_fraction'] == pytest.approx(0.4, abs=0.1)
    assert 0.0 < found.finding.share <= 1.0
    assert [part.shape for part in found.parts] == [run.measured.shape for run in found.runs]


def test_a_bent_shaft_that_was_led_astray_leaves_the_linear_one(monkeypatch, ringing):
    def astray(fitter: Fitter, linear: Fit, tried: list[Fit]) -> Fit:
        vector = linear.vector.copy()
        names = [entry.name for entry in get_effect(RESONANCE).parameters]
        vector[len(linear.hypothesis.numbers) + names.index('frequency')] = np.log(900.0)
        return replace(linear, vector=vector)

    monkeypatch.setattr(wide_band, '_bent', astray)
    found = resonance_beside(problem_of([ringing], NOMINAL), NOMINAL)
    assert found is not None
    assert found.finding.parameters['frequency'].value == pytest.approx(24.0, rel=0.1)


@pytest.mark.parametrize(('frequency', 'every'), [(85.0, 1), (70.0, 2)])
def test_a_resonance_above_60_hz_is_heard(frequency, every):
    # Sampled at 1 kHz in a wider band; at 500 Hz there is none, and its flank must do.
    recording = lively(brake_with(RESONANCE, inertia_fraction=0.4, frequency=frequency,
                                  damping_ratio=0.05))
    slower = Recording.from_samples('slower', *(values[::every] for values in (
        recording.time, recording.position, recording.effort, recording.velocity)))
    found = resonance_beside(problem_of([slower], NOMINAL), NOMINAL)
    assert found is not None
    assert found.finding.parameters['frequency'].value == pytest.approx(frequency, rel=0.1)


def test_late_torque_is_no_resonance():
    found = diagnose([lively(brake_with('actuation_lag', lag=0.004))], NOMINAL)
    assert [finding.effect for finding in found.effects] == ['actuation_lag']
    # The strokes end with a turn back by a count before the shaft stands.
    assert found.effects[0].probability > 0.5


@pytest.mark.parametrize(('frequency', 'damping'), [(64.0, 0.15), (9.0, 0.03)])
def test_a_shaft_with_nothing_beyond_it_does_not_ring(clean, frequency, damping):
    """Its twist has no derivatives there: a whole diagnosis had ended in an error."""
    fitter = Fitter(problem_of([clean], NOMINAL))
    (variant, *_) = variants_of(get_effect(RESONANCE), fitter.problem.scene)
    hypothesis = fitter.hypothesis((variant,))
    vector = hypothesis.start_of_numbers()
    own = [0.0, np.log(frequency), np.log(damping), 0.15, 0.0, 0.0]
    fit = fitter.evaluate(hypothesis, np.concatenate([vector, own]))
    nowhere = np.full((fit.predicted.size, fit.vector.size), np.nan)
    assert not wide_band._rings(replace(fit, jacobian=nowhere), fitter)


def test_a_shaft_that_does_not_ring_once_all_is_fitted_is_no_effect(clean):
    """Alone it may have rung; what it comes to beside the others is what would be told."""
    fitter = Fitter(problem_of([clean], NOMINAL))
    (variant, *_) = variants_of(get_effect(RESONANCE), fitter.problem.scene)
    (offset,) = variants_of(get_effect('torque_offset'), fitter.problem.scene)
    hypothesis = fitter.hypothesis((variant, offset))
    silent = fitter.finish(fitter.evaluate(hypothesis, np.concatenate([
        hypothesis.start_of_numbers(),
        [0.05, np.log(64.0), np.log(0.25), 0.5, 0.0, 0.0], [0.001]])))
    assert wide_band.silent_shafts(fitter, silent) == {0}
    assert fitter.finished_without(silent, {0}).hypothesis.ids == ('torque_offset',)
    assert wide_band.silent_shafts(fitter, fitter.finish(fitter.base())) == set()


@pytest.mark.parametrize(('came_to', 'again'), [(100.0, True), (55.0, False), (None, False)])
def test_a_set_is_fitted_again_where_it_promises_clearly_less_than_it_came_to(came_to, again):
    """It may have been fitted with one of its effects in a form that led nowhere."""
    fits = {} if came_to is None else {('one', 'other'): SimpleNamespace(cost=came_to)}
    entry = SimpleNamespace(key=('one', 'other'), cost=50.0)
    assert _came_to_more(SimpleNamespace(fits=fits), entry) is again


NAMED = replace(NOMINAL, effects=(EffectSetting('cogging_torque', {
    'amplitude': 0.05, 'order': 3.0, 'phase': 0.0}),))


def with_wave(recording: Recording, beside: np.ndarray | float = 0.0) -> Recording:
    """Return a recording with the wave of `NAMED`, and some effort beside it."""
    wave = 0.05 * np.sin(3.0 * recording.position)
    return Recording.from_samples('run', recording.time, recording.position,
                                  recording.effort + wave + beside, recording.velocity)


def test_what_the_formula_of_a_name_misses_is_no_resonance(clean):
    """A shaft takes away most of a drag that comes and goes at 15 to 40 Hz, but that is little of
    what the wave explains, and another formula of the wave would miss as much."""
    band = butter(2, (15.0, 40.0), 'band', fs=1.0 / clean.interval, output='sos')
    missed = sosfilt(band, 6e-5 * clean.velocity * np.abs(clean.velocity))
    assert resonance_beside(problem_of([with_wave(clean, missed)], NOMINAL), NAMED) is None


def test_a_shaft_that_rings_is_heard_beside_a_name():
    """It leaves nothing of the little that the name leaves."""
    weak = lively(brake_with(RESONANCE, inertia_fraction=0.19, frequency=30.0, damping_ratio=0.2))
    found = resonance_beside(problem_of([with_wave(weak)], NOMINAL), NAMED)
    assert found is not None
    assert found.finding.parameters['frequency'].value == pytest.approx(30.0, rel=0.1)


def test_nothing_rings_on_a_clean_recording(clean):
    assert resonance_beside(problem_of([clean], NOMINAL), NOMINAL) is None


def test_a_gap_is_no_resonance(loose):
    assert resonance_beside(problem_of([loose], NOMINAL), NOMINAL) is None


def test_the_files_own_resonance_is_not_found_again(ringing):
    model = replace(NOMINAL, effects=(EffectSetting(RESONANCE, {
        'inertia_fraction': 0.4, 'frequency': 24.0, 'damping_ratio': 0.05}),))
    assert resonance_beside(problem_of([ringing], model), model) is None


def refitted(recording: Recording, model: Model, held: str | tuple[str, ...]) -> Model:
    """Return the model file refitted on the recording in all numbers but those that begin so."""
    fitter = Fitter(problem_of([recording], model))
    fit = fitter.base(tuple(number for number in fitter.numbers if not number.name.startswith(
        held) and number.name != CURVATURE))
    return replace(fit.hypothesis.corrected(fit.vector), effects=())


@pytest.mark.parametrize(('model', 'held', 'kept'), [
    (replace(NOMINAL, motor=replace(NOMINAL.motor, inertia=1.3 * NOMINAL.motor.inertia)),
     'inertia', ('inertia',)),
    (replace(NOMINAL, motor=replace(NOMINAL.motor, viscous_friction=2e-3)),
     'viscous_friction', ('viscous_friction',)),
    (replace(NOMINAL, load_torque=replace(NOMINAL.load_torque,
                                          coefficients=(0.004, 1e-3, 2e-4, 5e-6))), 'p', (LOAD,)),
    (replace(NOMINAL, motor=replace(NOMINAL.motor, viscous_friction=1.6e-3),
             load_torque=replace(NOMINAL.load_torque,
                                 coefficients=(0.003, 1.5e-3, 1.5e-4, 4e-6))),
     ('p', 'viscous_friction'), ('viscous_friction', LOAD))])
def test_the_numbers_that_a_refit_held(loose, model, held, kept):
    """Beside physics that no number explains."""
    file = refitted(loose, model, held)
    assert Fitter(problem_of([loose], file)).held == kept


def test_a_file_refitted_in_all_its_numbers_kept_none(loose):
    file = refitted(loose, NOMINAL, 'nothing')
    assert Fitter(problem_of([loose], file)).held == ()


def gap_at(fitter: Fitter, gap: float, inertia: float, friction: float) -> Fit:
    variant = variants_of(get_effect('backlash'), fitter.problem.scene)[0]
    return fitter.evaluate(fitter.hypothesis((variant,)), np.concatenate(
        [fitter.base().vector, [np.log(gap), inertia, friction, 0.3, 0.0]]))


def test_random_moves_lead_out_of_a_narrow_minimum(loose):
    """To about what the true gap costs: the start costs 1.6 times that, and of twelve chains of
    random moves the worst ended at 1.25 times. Rounding decides between them."""
    fitter = Fitter(problem_of([loose], NOMINAL))
    start = gap_at(fitter, 0.7, 0.25, 0.5)
    assert is_multimodal(start)
    assert not is_multimodal(fitter.base())
    found = search_around(fitter, start, 80)
    truth = fitter.refine(gap_at(fitter, 0.8, 0.3, 0.6))
    assert start.cost > 1.5 * truth.cost
    assert found.cost < 1.3 * truth.cost
    assert search_around(fitter, start, 80).cost == found.cost
    assert search_around(fitter, found, 5).cost <= found.cost


def test_the_middle_of_a_basin_is_good_and_the_same_each_time(loose):
    """Where chance has found a very deep point, that itself is returned; from one on the slope the
    middle is far better."""
    fitter = Fitter(problem_of([loose], NOMINAL))
    found = search_around(fitter, gap_at(fitter, 0.7, 0.25, 0.5), 80)
    middle = middle_of_basin(fitter, found)
    assert middle.vector == pytest.approx(middle_of_basin(fitter, found).vector)
    assert middle.cost < DEARER * found.cost
    slope = gap_at(fitter, 0.9, 0.35, 0.7)
    assert middle_of_basin(fitter, slope).cost < 0.5 * slope.cost   # a sixth, on one machine


def test_a_gap_that_is_never_crossed_to_its_end_is_named_at_a_rate():
    """How wide it is can't be known: no deviation, and most often a name all the same.

    Of these ten brakes eight got `backlash` first (commit 841e3b8; one of them with others
    behind it), one got it behind another name, one got none. A tool that names eight of ten first
    names fewer than two of five in 0.7 % of such draws: two of the first five are asked for.
    """
    generator = np.random.default_rng(20261123)
    first = seed = 0
    while first < 2 and seed < 5:
        inertia, friction = generator.uniform(0.2, 0.3), generator.uniform(0.6, 0.8)
        wide = lively(brake_with('backlash', gap=12.0, inertia_fraction=inertia,
                                 friction_fraction=friction), seed=seed)
        found = diagnose([wide], NOMINAL)
        if found.effects and found.effects[0].effect == 'backlash':
            # A width that is told with a deviation is no better than another name.
            first += found.effects[0].parameters['gap'].std is None
        seed += 1
    assert first == 2


def on_a_shaft(inertia: float, frequency: float, friction: float, spring: float, change: float,
               twist: float) -> Recording:
    brake = brake_with(RESONANCE, inertia_fraction=inertia, frequency=frequency,
                       damping_ratio=0.04, friction_fraction=friction, load_beyond=1.0,
                       spring=spring, stiffness_change=change, stiffness_twist=twist)
    way = strokes_and_waves(1)
    return recorded(brake, lambda time, _: way.at(time), way.duration, seed=2, noise=0.002)


@pytest.mark.parametrize(('frequency', 'more', 'drag'), [(9.0, 0.0, 0.0), (9.0, 0.45, 0.4)])
def test_a_soft_shaft_is_told_with_what_rubs_beyond_it(frequency, more, drag):
    """It winds up as bristles and loops do: they were named, and no shaft was heard beside them.
    The friction that load adds, of which the file has half, and drag need not be shared out as
    the constant friction is."""
    brake = brake_with(RESONANCE, inertia_fraction=0.45, frequency=frequency, damping_ratio=0.08,
                       friction_fraction=0.5, loaded_friction_difference=more,
                       viscous_fraction=drag, load_beyond=1.0)
    brake = replace(brake, friction=replace(NOMINAL.friction, load_gain=0.2))
    way = strokes_and_waves(1)
    found = diagnose([recorded(brake, lambda time, _: way.at(time), way.duration, seed=2,
                               noise=0.002)], NOMINAL)
    named = {entry.effect: entry for entry in found.effects if entry.probability >= 0.5}
    assert set(named) == {RESONANCE, 'load_dependent_friction'}
    told = {name: entry.value for name, entry in named[RESONANCE].parameters.items()}
    assert told['frequency'] == pytest.approx(frequency, rel=0.03)
    assert told['inertia_fraction'] == pytest.approx(0.45, abs=0.05)
    assert told['loaded_friction_difference'] == pytest.approx(more, abs=0.1)
    assert told['viscous_fraction'] == pytest.approx(drag, abs=0.1)
    gain = named['load_dependent_friction'].parameters['load_gain']
    assert gain.value == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize(('spring', 'change', 'twist', 'words'), [
    (LINEAR, 0.0, 1.0, 'beyond it.'), (HARDENS, 3.0, 0.08, 'hardens'),
    (SOFT_CENTRE, 0.6, 0.06, 'softer')])
def test_a_shaft_is_called_linear_if_it_is(spring, change, twist, words):
    """One frequency stands for another shaft nowhere: a linear one's lies between."""
    recording = on_a_shaft(0.35, 22.0, 0.15, spring, change, twist)
    found = resonance_beside(problem_of([recording], NOMINAL), NOMINAL)
    values = found.setting.parameters
    assert values['spring'] == spring
    assert values['frequency'] == pytest.approx(22.0, rel=0.04)
    assert values['inertia_fraction'] == pytest.approx(0.35, abs=0.04)
    assert values['stiffness_change'] == pytest.approx(change, rel=0.3)
    assert values['stiffness_twist'] == pytest.approx(twist, rel=0.3)
    assert words in found.finding.statement


@pytest.mark.parametrize(('inertia', 'change', 'twist'), [
    (0.25, 70.0, 0.4), (0.2, 600.0, 1.1), (0.2, 1000.0, 0.8), (0.35, 300.0, 0.8)])
def test_a_shaft_that_hardens_much_rings_slower_than_a_linear_one_would(inertia, change, twist):
    recording = on_a_shaft(inertia, 10.0, 0.1, HARDENS, change, twist)
    values = resonance_beside(problem_of([recording], NOMINAL), NOMINAL).setting.parameters
    # The best linear shaft rings at 25 to 40 Hz and takes away less than half as much.
    assert values['spring'] == HARDENS
    assert 8.0 < values['frequency'] < 15.0
    assert values['inertia_fraction'] == pytest.approx(inertia, abs=0.05)


def test_a_shaft_that_hardens_much_is_found_where_no_linear_one_rings(monkeypatch, clean, loose):
    rings, linear = wide_band._rings, get_effect(RESONANCE)
    monkeypatch.setattr(wide_band, '_rings', lambda fit, fitter: (
        fit.hypothesis.variants[0].effect is not linear and rings(fit, fitter)))
    problem = problem_of([on_a_shaft(0.2, 10.0, 0.1, HARDENS, 600.0, 1.1)], NOMINAL)
    assert resonance_beside(problem, NOMINAL).setting.parameters['spring'] == HARDENS
    for other in (clean, loose):
        assert resonance_beside(problem_of([other], NOMINAL), NOMINAL) is None


def gap_beside_an_offset(seed: int, offset: float, gap: float) -> Fitter:
    """A file that was refitted around both: alone the gap takes in what it can of the offset."""
    model = replace(NOMINAL, load_torque=LoadTorque(
        coefficients=(0.0, 2.5e-3, 2e-4, 3e-6), contact_angle=5.0))
    brake = replace(model, effects=(
        EffectSetting('backlash', {'gap': gap, 'inertia_fraction': 0.43,
                                   'friction_fraction': 0.66}),
        EffectSetting('torque_offset', {'offset': offset})))
    way = strokes_and_waves(seed)
    recording = recorded(brake, lambda time, _: way.at(time), way.duration, seed=seed, noise=0.002)
    return Fitter(problem_of([recording], refitted(recording, model, ('p', 'contact_angle'))), 2)


def test_a_gap_is_told_from_the_offset_beside_it():
    """Both are found, with their sizes.

    Where the random moves end beside the minimum, which rounding decides, the gap comes out too
    small, a third effect is added, or the offset is taken for friction that differs by direction:
    in one of the four recordings on one machine.
    """
    both = sizes = 0
    for seed, offset, gap in ((1, 0.0036, 0.21), (2, 0.0036, 0.21), (3, -0.003, 0.3),
                              (4, 0.004, 0.15)):
        chosen = select(search(gap_beside_an_offset(seed, offset, gap))).chosen
        ids = chosen.hypothesis.ids
        assert 'backlash' in ids
        values = {name: value for index in range(len(ids))
                  for name, value in chosen.hypothesis.named(chosen.vector, index).items()}
        both += values.get('offset') == pytest.approx(offset, rel=0.3)
        sizes += values['gap'] == pytest.approx(gap, rel=0.25)
    assert both >= 3 and sizes >= 2


def test_the_number_that_a_refit_held_is_named_before_those_that_moved():
    brake = brake_with('load_hysteresis', hysteresis_ratio=0.05, memory_distance=1.0)
    way = strokes_and_waves(1)
    recording = recorded(brake, lambda time, _: way.at(time), way.duration, seed=2, noise=0.002)
    wrong = replace(NOMINAL, friction=replace(NOMINAL.friction, load_gain=0.05))
    fitter = Fitter(problem_of([recording], refitted(recording, wrong, 'load_gain')))
    variant = variants_of(get_effect('load_hysteresis'), fitter.problem.scene)[0]
    fit = fitter.finish(fitter.refine(fitter.fit(variant)))
    (found,) = wrong_numbers(fitter, fit)
    assert found.effect == 'load_dependent_friction'
    numbers = dict(zip((number.name for number in found.fit.hypothesis.numbers), found.fit.vector,
                       strict=False))
    assert numbers['load_gain'] == pytest.approx(NOMINAL.friction.load_gain, rel=0.05)


def test_a_small_effect_beside_a_great_one_is_named():
    """Less than two hundredths of the whole, but nearly all of what the great one leaves."""
    brake = replace(NOMINAL, effects=(
        EffectSetting('cogging_torque', {'amplitude': 0.1, 'order': 3.0, 'phase': 0.4}),
        EffectSetting('actuation_lag', {'lag': 0.003, 'first_order': 0.0})))
    way = strokes_and_waves(2)
    recording = recorded(brake, lambda time, _: way.at(time), way.duration, seed=3, noise=0.002)
    result = search(Fitter(problem_of([recording], NOMINAL), 2))
    found = select(result)
    assert found.excess_after < 0.2
    assert set(found.chosen.hypothesis.ids) == {'cogging_torque', 'actuation_lag'}
    alone = excess(result.fits['cogging_torque',], result.fitter)
    assert alone < 0.02 * found.excess_before
    # What leaves a part of it may suit what the great one's formula misses.
    assert not worth_a_further_effect(alone, 0.3 * alone, found.excess_before)
    assert worth_a_further_effect(alone, 0.3 * alone, 2.0 * alone)


def test_what_stays_far_behind_is_given_up(loose):
    fitter = Fitter(problem_of([loose], NOMINAL))
    variant = variants_of(get_effect('torque_saturation'), fitter.problem.scene)[0]
    fit = fitter.fit(variant, rounds=8)
    early = fitter.fit(variant, rounds=8, hopeless=0.5 * fit.cost)
    assert early.cost == fitter.fit(variant, rounds=2).cost > fit.cost
    assert fitter.fit(variant, rounds=8, hopeless=1.1 * early.cost).cost == fit.cost


@pytest.mark.parametrize(('inertia', 'load_gain'), [(1.5, 0.0), (1.2, 0.02)])
def test_of_two_numbers_that_a_refit_held_both_are_named(inertia, load_gain):
    """No physics is missing: the file's other numbers moved, in plain torque, to make up for
    both."""
    way = strokes_and_waves(1)
    recording = recorded(NOMINAL, lambda time, _: way.at(time), way.duration, seed=2, noise=0.002)
    wrong = Fitter(problem_of([recording], replace(
        NOMINAL, motor=replace(NOMINAL.motor, inertia=inertia * NOMINAL.motor.inertia),
        friction=replace(NOMINAL.friction, load_gain=load_gain))))
    hypothesis = wrong.hypothesis((), tuple(
        number for number in wrong.numbers if number.name not in ('inertia', 'load_gain')))
    vector = least_squares(
        lambda vector: wrong.predict(hypothesis, vector) - wrong.measured,
        hypothesis.start_of_numbers(), x_scale='jac').x
    file = replace(hypothesis.corrected(vector), effects=())
    fitter = Fitter(problem_of([recording], file))
    assert set(fitter.held) == {'inertia', 'load_gain'}
    found = wrong_numbers(fitter, fitter.finish(fitter.base()))
    assert {entry.effect for entry in found} == {'inertia_error', 'load_dependent_friction'}
