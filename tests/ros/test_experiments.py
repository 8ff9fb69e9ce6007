# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""An experiment of the reproduction on live nodes: excitation, plant, recorder."""

from dataclasses import replace

import numpy as np

from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.identify.nominal_plant import fit_free_motor
from engb_core.io.bags.write import FloatTable, JointTable, write_bag
from engb_core.io.sealed import sealed
from engb_core.model import Model
from engb_core.reproduce import chosen
from engb_core.reproduce.drawn_brakes import draw_brake
from engb_core.reproduce.plan import HIGH, length, plan_of, REFERENCE
from engb_ros import interface
from engb_ros.experiments import live_experiments
from engb_ros.experiments.live_experiments import read_experiment, record_experiment
from engb_ros.files import config_file

PLAN = {entry.name: entry for entry in plan_of(chosen.FORM)}


def test_step_test_on_live_nodes_finds_the_motor(tmp_path):
    experiment = replace(PLAN['steps'], duration=2.5)
    told = []
    recording = record_experiment(experiment, chosen.NOMINAL, tmp_path / 'steps', 1, told.append)
    assert recording.time.size >= 2500
    assert np.diff(recording.time).max() < 0.01
    assert any('steps' in line for line in told)
    found = fit_free_motor([recording]).values
    assert abs(found['inertia'] / chosen.FORM.inertia - 1.0) < 0.05
    assert abs(found['coulomb'] / chosen.COULOMB - 1.0) < 0.1


def test_a_sealed_brake_runs_and_observer_and_identifier_listen(tmp_path):
    """The seal goes to the plant alone; d̂ and the model come from the live nodes."""
    brake = draw_brake(4)
    seal = tmp_path / 'brake.sealed'
    seal.write_text(sealed(brake.to_mapping()))
    model, bag = tmp_path / 'node.yaml', tmp_path / 'strokes'
    start = chosen.NOMINAL
    reference = replace(REFERENCE, amplitudes=(HIGH,))
    experiment = replace(PLAN['strokes'], reference=reference, duration=length(reference))
    recording = record_experiment(experiment, start, bag, 1, lambda line: None, sealed=seal,
                                  identified=model)
    # Sample for sample what the observer says of the recorded samples: it is causal.
    expected = DisturbanceObserver(start.motor).filter(recording.time, recording.velocity,
                                                       recording.effort)
    seen = recording.signals['disturbance'].at(recording.time)
    assert np.abs(seen - expected)[500:].max() < 1e-6
    assert recording.signals['load_cell'].value.max() > 500.0
    again = read_experiment(bag)
    assert np.array_equal(again.position, recording.position)
    # In the drive's units; its torque constant is another than the motor's.
    scale = brake.assumed_torque_constant / brake.torque_constant
    found = Model.read(model)
    assert abs(found.friction.coulomb / (scale * brake.coulomb) - 1.0) < 0.05
    assert abs(found.motor.inertia / (scale * brake.inertia) - 1.0) < 0.1


def answered(path, first, count=400):
    """Write a bag of which the disturbance is the number of its sample; those before `first` were
    missed."""
    stamp = 10**18 + 10**6 * np.arange(count)
    number = np.arange(count, dtype=float)
    write_bag(path, {
        '/engb/joint_states': JointTable(stamp, number, number, number),
        '/engb/disturbance': FloatTable((stamp + 400_000)[first:], number[first:])}, replace=True)


def test_a_disturbance_of_which_one_was_missed_is_not_paired_by_its_number(tmp_path):
    """It was paired with the sample before: off by 5e-3 N·m in a stroke."""
    for first in (0, 1):
        answered(tmp_path / 'bag', first)
        recording = read_experiment(tmp_path / 'bag')
        seen = recording.signals['disturbance'].at(recording.time)
        assert np.abs(seen - recording.position)[first:].max() < (0.5 if first else 1e-9)


def test_an_experiment_of_which_an_answer_was_missed_is_made_again(tmp_path, monkeypatch):
    missed, told = [1, 0], []
    experiment = replace(PLAN['strokes'], duration=0.4)
    assert experiment.observed
    monkeypatch.setattr(live_experiments, '_run',
                        lambda *given: answered(given[2], missed.pop(0)))
    recording = record_experiment(experiment, chosen.NOMINAL, tmp_path / 'bag', 1, told.append)
    assert not missed
    assert len(told) == 1
    assert np.array_equal(recording.signals['disturbance'].value, recording.position)


def test_excitation_lets_go_of_a_motor_that_runs_away(runner, probe):
    runner.start('plant', parameters={'lockstep': True, 'effort_noise': 0.0})
    efforts = probe.listen(interface.EFFORT_COMMAND)
    runner.start('excitation', parameters={'amplitude': 0.07, 'hold': 50.0, 'duration': 100.0,
                                           'highest_speed': 5.0})
    runner.wait_until(lambda: efforts, 'the excitation', pause=probe.spin)

    def let_go():
        return len(efforts) > 500 and all(message.data == 0.0 for message in efforts[-50:])

    runner.wait_until(let_go, 'the excitation to let go', pause=probe.spin)
    runner.stop()


def test_bad_excitation_ends_in_one_line(runner):
    process = runner.start('excitation', parameters={'duration': 0.0})
    assert process.wait(30.0) == 2
    assert process.output.strip().count('\n') == 0
    assert 'duration' in process.output
    runner.processes.pop('excitation')


def test_plant_takes_a_mechanism_file(runner, probe):
    runner.start('plant', parameters={'mechanism': config_file('mechanism.yaml'),
                                      'pad_friction': 0.1})
    states = probe.listen(interface.JOINT_STATES)
    runner.wait_until(lambda: len(states) > 20, 'joint states', pause=probe.spin)
    runner.stop()


def test_plant_refuses_a_mechanism_that_locks_itself(runner):
    process = runner.start('plant', parameters={'mechanism': config_file('mechanism.yaml'),
                                                'pad_friction': 0.99})
    assert process.wait(30.0) == 2
    assert 'self-locking' in process.output
    runner.processes.pop('plant')
