"""The reproduction, on the in-process bench: every chapter, the numbers, the page."""

from dataclasses import replace
import json
import re

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.kinematics import CHOSEN as MECHANISM
from engb_core.reproduce import chosen
from engb_core.reproduce.bench import run_experiment
from engb_core.reproduce.errata import ERRATA
from engb_core.reproduce.judgement import judgement
from engb_core.reproduce.numbers import published_numbers
from engb_core.reproduce.page import reproduction_page, results_mapping
from engb_core.reproduce.plan import PLAN, STAGES
from engb_core.reproduce.procedure import reproduce


@pytest.fixture(scope='module')
def results():
    return reproduce(run_experiment)


@pytest.fixture(scope='module')
def numbers(results):
    return {entry.name: entry for entry in published_numbers(results)}


def test_every_figure_of_the_paper_is_served_by_a_run():
    served = ' '.join(entry.figures for entry in PLAN)
    for figure in ('6', '7–16', '17', '18', '19–21', '22, 23', '24, 25'):
        assert figure in served
    assert {entry.stage for entry in PLAN} == set(STAGES)
    assert len({entry.name for entry in PLAN}) == len(PLAN)


def test_chosen_mechanism_stays_below_five_degrees():
    assert np.degrees(MECHANISM.posture(MECHANISM.stroke).gear_angle) < 5.0
    assert pytest.approx(0.430) == MECHANISM.gear_offset / MECHANISM.gear_radius


def test_nominal_plant_is_found_and_the_classical_bias_shown(results, numbers):
    joint = results.nominal.joint.values
    assert joint['inertia'] == pytest.approx(chosen.MOTOR.inertia, rel=0.01)
    assert joint['viscous_friction'] == pytest.approx(chosen.MOTOR.viscous_friction, rel=0.01)
    low, high = results.nominal.torque_constant.interval(0.99)
    assert low < chosen.MOTOR.torque_constant < high
    classical = numbers['B, classical step test']
    assert classical.low > chosen.MOTOR.viscous_friction


def test_a_better_estimator_of_the_linear_motor_is_biased_too(results):
    for found in (results.nominal.output_error_steps, results.nominal.output_error_sweep):
        assert found.viscous_friction.interval(0.99)[0] > chosen.MOTOR.viscous_friction
        assert found.inertia.value == pytest.approx(chosen.MOTOR.inertia, rel=0.1)


def test_the_joint_model_run_forward_meets_the_measured_response(results):
    measured, forward = results.nominal.response, results.nominal.simulated
    seen = measured.frequency[(measured.frequency < 9.5)]
    ratio = (np.interp(seen, forward.frequency, forward.response)
             / np.interp(seen, measured.frequency, measured.response))
    assert np.sqrt(np.mean((20.0 * np.log10(np.abs(ratio)))**2)) < 0.1
    # J and B alone, without the friction, do not.
    joint = results.nominal.joint.values
    alone = 1.0 / (2j * np.pi * seen * joint['inertia'] + joint['viscous_friction'])
    apart = alone / np.interp(seen, measured.frequency, measured.response)
    assert np.sqrt(np.mean((20.0 * np.log10(np.abs(apart)))**2)) > 1.0


def test_what_is_said_of_the_biases_is_what_they_are(results):
    said = ' '.join(judgement(results.strokes.biases))
    poor = {entry.way: entry for entry in results.strokes.biases
            if entry.recording == 'strokes_poor'}
    for way in ('samples paired by number', 'nearest neighbour, 400 points'):
        assert f'{abs(poor[way].load_gain):.4f}' in said


def test_cogging_orders_are_found_and_compensated(results):
    found = {entry.order: entry.amplitude for entry in results.nominal.nominal.cogging}
    assert set(found) == {entry.order for entry in chosen.COGGING}
    for entry in chosen.COGGING:
        assert found[entry.order] == pytest.approx(entry.amplitude, rel=0.05)
    assert results.cogging.rms_after < 0.1 * results.cogging.rms_before


def test_nearest_neighbour_repairs_poor_tracking(results):
    by_way = {entry.way: entry for entry in results.strokes.biases
              if entry.recording == 'strokes_poor'}
    paired = by_way['samples paired by number']
    nearest = by_way['nearest neighbour, 400 points']
    assert paired.mismatch > 50.0 * nearest.mismatch
    assert abs(paired.load_gain) > 10.0 * abs(nearest.load_gain)
    wrong_b = by_way['nearest neighbour, J and B of the classical step test']
    assert wrong_b.coulomb < -2e-3
    joint = by_way['joint regression, J, B and cogging known from the free motor']
    # Friction falls off at low speed, so pairs at different speeds bias the paper's way.
    assert joint.load < 0.5 * nearest.load
    assert abs(joint.load_gain) < abs(nearest.load_gain)
    assert abs(joint.coulomb) < 4e-4


def test_saturation_velocity_is_widened_by_the_papers_way_only(results):
    good = results.strokes.good
    low, high = good.estimates['saturation_velocity'].interval(0.99)
    assert low < chosen.SATURATION_VELOCITY < high
    assert good.paper.friction.saturation_velocity > high
    # (42) with its bare sign is pulled down by the strokes' ends.
    assert good.paper.sign_friction.load_gain < good.paper.friction.load_gain


def test_feedforward_and_model_leave_little(results):
    tracking = results.validation.tracking
    for load in ('middle', 'high'):
        assert tracking[f'{load}_feedforward'].rms < 0.3 * tracking[f'{load}_pid'].rms
    for left in results.validation.left:
        assert left.rms('even') < 0.05 * left.rms('even_before')
        assert left.rms('odd') < 0.1 * left.rms('odd_before')
    for offsets in (results.validation.offsets, results.validation.sticking_offsets):
        assert len(offsets) == 5
        assert max(abs(entry.error) for entry in offsets) < 0.1


def test_pad_friction_both_ways_round_and_the_bias_of_a_constant_slope(results, numbers):
    for entry in results.disc.directions:
        low, high = entry.joint.pad_friction.interval(0.99)
        assert low < entry.true_friction < high
    assert numbers['μ, the paper’s way, d/r constant'].ours > 0.252
    for entry in results.disc.directions:
        low, high = entry.identified.estimates['load_gain'].interval(0.99)
        assert low < chosen.true_brake().friction.load_gain < high


def test_numbers_are_json_and_hold_the_papers(results, numbers):
    text = json.dumps(results_mapping(results), allow_nan=False)
    assert json.loads(text)['format'] == 'engb-reproduction/1'
    published = {entry.paper for entry in numbers.values()}
    assert {0.0174, 6.813e-5, 1.125e-3, 0.83, 0.38, 0.32, 0.13, 0.1, 0.421, 0.249} <= published


def test_page_holds_figures_6_to_25_and_the_errata(results):
    html = reproduction_page(results, 'Made in a test.', backend='table').html()
    for figure in range(6, 26):
        assert f'Figure {figure}:' in html
    for place in ('(9), (12)', '(14)', '(29)', '(41)', '(44)'):
        assert place in html
    assert not re.search(r'\bnan\b', html)
    assert len(ERRATA) >= 10
    assert all(entry.why for entry in ERRATA)


def test_runs_are_deterministic_by_seed():
    experiment = replace(PLAN[0], duration=1.0)
    one, two, other = (run_experiment(experiment, chosen.NOMINAL, seed) for seed in (1, 1, 2))
    assert np.array_equal(one.effort, two.effort)
    assert not np.array_equal(one.effort, other.effort)


def test_recordings_without_strokes_end_in_one_line(results):
    def still(experiment, model):
        recording = run_experiment(replace(experiment, duration=0.3), model)
        return replace(recording, position=np.zeros_like(recording.position))

    with pytest.raises(InputError):
        reproduce(still)
