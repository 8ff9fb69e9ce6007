# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Brakes that nobody knows: identified, judged, and the seals that keep them."""

from dataclasses import replace
import json
import subprocess
import sys

import numpy as np
import pytest

from engb_core.bench.settings import BenchSettings
from engb_core.control.clamp_force import read_mechanism
from engb_core.errors import InputError
from engb_core.io.sealed import digest, read_sealed, sealed
from engb_core.reproduce import chosen
from engb_core.reproduce.blind import drawing, estimate_brake, judge, NUMBERS, summarise, WAYS
from engb_core.reproduce.drawn_brakes import draw_brake
from engb_core.reproduce.in_process import run_experiment
from engb_core.reproduce.truth import truth_of
from engb_ros.experiments.draw_brake import DRAWING, SEAL
from engb_ros.experiments.sealed_brakes import FOUND, open_all

BRAKE = draw_brake(2)


@pytest.fixture(scope='module')
def found():
    asked = []

    def record(experiment, model):
        asked.append(experiment)
        return run_experiment(replace(experiment, brake=BRAKE), model, 7)

    ways = estimate_brake(record, drawing(BRAKE.mechanism))
    # It names its own brake in each run; the true one never reaches it.
    assert all(experiment.brake == chosen.FORM for experiment in asked)
    return ways


def test_drawing_tells_lengths_and_no_forces():
    told = drawing(BRAKE.mechanism)
    assert told.lever_input == BRAKE.mechanism.lever_input
    assert told.clearance == chosen.MECHANISM.clearance != BRAKE.mechanism.clearance
    assert told.clamp_stiffness == chosen.MECHANISM.clamp_stiffness
    assert told.efficiency == chosen.MECHANISM.efficiency


def test_joint_regression_finds_the_drawn_brake(found):
    outcomes = {entry.way: entry for entry in judge(found, BRAKE)}
    assert tuple(outcomes) == WAYS
    joint = outcomes['joint regression']
    for name, allowed in (('inertia', 0.02), ('viscous_friction', 0.02), ('torque_constant', 0.02),
                          ('coulomb', 0.03), ('load_gain', 0.06), ('saturation_velocity', 0.06),
                          ('cogging', 0.03), ('pad_friction', 0.04)):
        true, value, deviation = joint.numbers[name]
        assert value == pytest.approx(true, rel=allowed), name
        assert abs(value - true) < 4.0 * deviation, name
    assert joint.load < 0.01
    assert joint.orders[0] == joint.orders[1]
    paper = outcomes[WAYS[0]]
    assert abs(paper.numbers['coulomb'][1] / paper.numbers['coulomb'][0] - 1.0) > 0.1
    assert paper.band is None
    if joint.determined:
        assert joint.numbers['contact_angle'][1] == pytest.approx(
            joint.numbers['contact_angle'][0], rel=0.02)


def test_judgement_counts_what_it_is_given():
    truth = truth_of(BRAKE)
    model = truth.model
    exact = {'inertia': [model.motor.inertia, 1e-7],
             'contact_angle': [1.05 * model.load_torque.contact_angle, 0.01],
             'cogging': [9.0, 0.1]}
    way = {'numbers': exact, 'load': (truth.load + 1e-3).tolist(),
           'band': [(truth.load - 1.0).tolist(), (truth.load + 1.0).tolist()],
           'orders': [5.0], 'determined': True}
    far = way | {'numbers': exact | {'inertia': [2.0 * model.motor.inertia, 1e-7]},
                 'band': [(truth.load + 1.0).tolist(), (truth.load + 2.0).tolist()],
                 'determined': False}
    outcomes = [*judge({'one': way}, BRAKE), *judge({'one': far}, BRAKE)]
    table = summarise(outcomes)['one']
    assert table['numbers']['inertia']['coverage'] == 0.5
    assert table['numbers']['inertia']['worst'] == pytest.approx(1.0)
    # An amplitude of another order is no amplitude of this one.
    assert 'cogging' not in table['numbers']
    assert table['load']['coverage'] == 0.5
    assert table['load']['median'] == pytest.approx(1e-3 / truth.load.max())
    assert table['contact'] == {'determined': 1, 'worst': pytest.approx(0.05),
                                'beyond_2_percent': 1}
    assert table['orders_right'] == 0
    assert set(NUMBERS) >= set(table['numbers'])


def keep(folder, number, found, brake):
    place = folder / f'brake_{number}'
    place.mkdir(parents=True)
    text = sealed(brake.to_mapping() | {'salt': str(number)})
    (place / SEAL).write_text(text, encoding='ascii')
    (place / FOUND).write_text(json.dumps({'digest': digest(text), 'ways': found}))
    return place


def test_seals_are_opened_last_and_must_be_the_ones_that_were_told(tmp_path, found):
    assert open_all(tmp_path, 'Nowhere.') is None
    for number in (2, 10, 1):
        keep(tmp_path, number, found, BRAKE)
    opened = open_all(tmp_path, 'In a test.')
    assert len(opened.digests) == 3
    assert opened.table == summarise(judge(found, BRAKE) * 3)
    keep(tmp_path, 11, found, BRAKE)
    (tmp_path / 'brake_11' / SEAL).write_text(sealed(draw_brake(5).to_mapping()))
    with pytest.raises(InputError, match='brake_11'):
        open_all(tmp_path, 'In a test.')
    (tmp_path / 'brake_11' / FOUND).unlink()
    with pytest.raises(InputError, match='brake_11'):
        open_all(tmp_path, 'In a test.')


def test_another_process_draws_and_seals(tmp_path):
    told = []
    for name in ('one', 'two'):
        done = subprocess.run([sys.executable, '-m', 'engb_ros.experiments.draw_brake',
                               str(tmp_path / name)], capture_output=True, text=True, check=True)
        told.append(done.stdout.strip())
        assert digest((tmp_path / name / SEAL).read_text()) == told[-1]
    assert told[0] != told[1]
    truth = read_sealed(tmp_path / 'one' / SEAL)
    truth.pop('salt')
    brake = BenchSettings.from_mapping(truth)
    plain = read_mechanism(tmp_path / 'one' / DRAWING)
    assert plain == drawing(brake.mechanism)
    text = ''.join(path.read_text() for path in (tmp_path / 'one').iterdir())
    assert f'{brake.inertia}' not in text
    assert np.isfinite(brake.inertia)


def test_a_seal_that_is_none_is_told(tmp_path):
    with pytest.raises(InputError, match='cannot be read'):
        read_sealed(tmp_path / 'nothing.sealed')
