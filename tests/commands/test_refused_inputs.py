# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Tables, models and results that do not go together are told before anything is computed."""

from dataclasses import replace
import json
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.tables.measure import Measured
from engb_core.model import Joint, Model
from engb_ros.commands.diagnose import summary
from engb_ros.commands.import_table import write_recording
from tests.report.samples import explained

from .conftest import motion

TIME = np.arange(300) * 0.01


def table(path, titles='t [s],phi [rad],M [N·m]', scale=1.0):
    path.write_text(titles + '\n' + ''.join(
        f'{t:.3f},{scale * np.sin(3 * t):.6f},{np.cos(3 * t):.6f}\n' for t in TIME))
    return path


def test_options_that_can_have_no_effect_are_refused(refused, tmp_path, bag, model_file):
    table(tmp_path / 'a.csv')
    for words in (['--unit', 'position=deg'], ['--rate', '100'], ['--torque-constant', '0.1']):
        refused('diagnose', bag, '--model', model_file, '--out', 'out', *words,
                words=[words[0], 'has no effect', 'leave it out'])
        refused('predict', bag, '--model', model_file, '--out', 'o.npz', *words,
                words=[words[0], 'has no effect'])
    refused('model', 'a.csv', '--out', 'm.yaml', '--namespace', '/left',
            words=['--namespace /left: has no effect on a table'])
    refused('diagnose', bag, '--out', 'out', '--fmu-variable', 'effort=M',
            words=['--fmu-variable: has no effect without --fmu'])


def test_angles_and_lengths_are_of_different_axes(refused, tmp_path):
    table(tmp_path / 'angle.csv')
    table(tmp_path / 'length.csv', 't [s],x [mm],F [N]', 1000.0)
    refused('diagnose', 'angle.csv', 'length.csv', '--out', 'out',
            words=['different kinds of axis: angles and lengths'])
    replace(Model(), joint=Joint('motor', 'prismatic')).write(tmp_path / 'model.yaml')
    refused('diagnose', 'angle.csv', '--model', 'model.yaml', '--out', 'out',
            words=["position is that of a revolute axis, the model's of a prismatic one"])


def test_a_model_is_a_yaml_file(refused, tmp_path):
    table(tmp_path / 'a.csv')
    refused('model', 'a.csv', '--out', 'model.txt', words=['the name must end in .yaml'])


def test_a_table_may_be_predicted(engb, refused, tmp_path):
    table(tmp_path / 'a.csv')
    Model().write(tmp_path / 'model.yaml')
    outcome = engb('predict', 'a.csv', '--model', 'model.yaml', '--out', 'o.npz')
    assert outcome.status == 0 and 'a.csv: position: column phi [rad]' in outcome.out
    with np.load(tmp_path / 'o.npz') as arrays:
        assert arrays['effort'].size == TIME.size
    table(tmp_path / 'b.csv', 't,phi,M')
    refused('predict', 'b.csv', '--model', 'model.yaml', '--out', 'o.npz',
            words=['b.csv', 'engb predict b.csv', '--unit position=deg effort='])


def test_a_table_may_be_identified(engb, tmp_path):
    run = motion(8000)
    current = run['effort'] / 0.05
    np.savetxt(tmp_path / 'a.csv', np.stack([run['time'], run['position'], current], 1),
               delimiter=',', comments='', header='t [s],phi [rad],I [A]')
    outcome = engb('identify', 'a.csv', '--torque-constant', '0.05', '--joint', 'left', '--out',
                   'm.yaml')
    assert outcome.status == 0, outcome.err
    assert 'a.csv: effort: column I [A], times 0.05 N·m/A' in outcome.out
    found = Model.read(tmp_path / 'm.yaml')
    assert found.motor.torque_constant == 0.05 and found.joint.name == 'left'
    assert found.motor.inertia == pytest.approx(6.8e-5, rel=0.1)


def test_a_diagnosis_that_is_a_list_cannot_be_adopted(refused, tmp_path):
    (tmp_path / 'result').mkdir()
    (tmp_path / 'result' / 'diagnosis.json').write_text('[]')
    refused('adopt', 'result', '--name', 'mine', words=['not a diagnosis; write it anew'])
    (tmp_path / 'result' / 'diagnosis.json').write_text('{')
    refused('adopt', 'result', '--name', 'mine', words=['not valid JSON; write it anew'])
    (tmp_path / 'result' / 'diagnosis.json').unlink()
    refused('adopt', 'result', '--name', 'mine', words=['name the folder that engb diagnose'])


def test_a_law_may_be_adopted_into_a_folder_of_its_own(engb, tmp_path):
    folder = tmp_path / 'result'
    folder.mkdir()
    law = {'pattern': 'a * abs(load)', 'acts_as': 'torque',
           'parameters': {'a': {'value': 0.3, 'std': 0.01, 'unit': '-'}}}
    (folder / 'diagnosis.json').write_text(json.dumps({'unexplained': {'law': law}}))
    Model().write(folder / 'model.yaml')
    outcome = engb('adopt', 'result', '--name', 'my_own_law', '--out', 'effects')
    assert outcome.status == 0, outcome
    assert 'ENGB_EFFECTS=effects' in outcome.out and 'found in a recording' in (
        tmp_path / 'effects' / 'my_own_law.py').read_text()


def measured(time):
    return Measured('a', time, {'position': np.sin(time), 'effort': np.cos(time)}, 'revolute',
                    (), ())


def test_times_before_a_trigger_count_from_the_first_and_those_of_another_unit_are_refused(
        tmp_path):
    from engb_core.io.bags.read import read_recording
    write_recording(tmp_path / 'run', measured(TIME - 1.0))
    found = read_recording(tmp_path / 'run')
    assert found.time[0] == 0.0 and found.time[-1] == pytest.approx(TIME[-1])
    with pytest.raises(InputError, match='check the unit of time'):
        write_recording(tmp_path / 'other', measured(1e12 + TIME))


def test_a_summary_without_held_out_figures_has_none():
    assert 'held out (rms)' in summary(explained())
    assert 'held out (rms)' not in summary(replace(explained(), held_out=()))


def test_a_model_without_finite_torque_predicts_nothing(refused, tmp_path, monkeypatch):
    from engb_core.io.bags.write import JointTable, write_bag
    write_bag(tmp_path / 'run', {'/joint_states': JointTable(
        TIME, np.sin(TIME), None, np.cos(TIME))})
    Model().write(tmp_path / 'model.yaml')
    monkeypatch.setattr('engb_core.prediction.predict_effort',
                        lambda recording, model: np.full(recording.time.size, np.nan))
    refused('predict', 'run', '--model', 'model.yaml', '--out', 'o.npz',
            words=['give no finite effort for run; check their size and unit'])


def test_a_simulator_s_clock_is_told_where_commands_are_alike(monkeypatch):
    """What `--simulated` says of the clocks of each pair of recordings."""
    from engb_core.recording import Recording
    from engb_ros.commands import nominal_source
    time = np.arange(800) * 0.01

    def run(name, speed):
        position = np.sin(speed * time) + 0.3 * np.sin(2.7 * speed * time)
        return Recording(name, time, position, np.cos(time))

    real, alike, other = run('real', 2.0), run('alike', 2.0), run('other', 5.1)
    monkeypatch.setattr(nominal_source, 'read_inputs', lambda *_, **__: SimpleNamespace(
        recordings=(alike, other), told=('said before',), request=SimpleNamespace(
            torque_constant=None)))
    monkeypatch.setattr('engb_core.simulated.surrogate.surrogate_of', lambda *_: SimpleNamespace(
        model=Model(), told=lambda: ('the surrogate',)))
    arguments = SimpleNamespace(fmu=None, simulated=['a', 'b'], fmu_variable=[], joint=None)
    found = nominal_source.simulator_of(arguments, [real], Model().joint, None, print)
    assert found.told[0] == 'said before' and found.told[-1] == 'the surrogate'
    clocks = [text for text in found.told if 'the simulated alike' in text]
    assert len(clocks) == 1 and 'have the same motion' in clocks[0]
    assert [text for text in found.told if 'other' in text][0].startswith(
        'The simulated other has not the same commands as real')
