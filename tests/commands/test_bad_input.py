# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Bad input to the commands: one clear line, status 2, nothing half-written."""

import numpy as np
import pytest

from engb_core.io.bags.write import FloatTable, JointTable, write_bag
from engb_core.model import Model

from .conftest import motion

TIME = 1.7e9 + np.arange(400) / 1000


def states(**change):
    """Return joint_states of a good motion with some columns changed."""
    run = motion(400)
    columns = {name: run[name] for name in ('position', 'velocity', 'effort')} | change
    return JointTable(TIME[:len(columns['position'])], **columns)


def bad_recording(kind, folder):
    """Make a bad recording; return its path and a word that must be in the complaint."""
    path = folder / 'bad'
    good = {'/engb/joint_states': states()}
    if kind == 'missing':
        return path, 'bad'
    if kind == 'empty file':
        path = folder / 'bad.mcap'
        path.write_bytes(b'')
        return path, 'bad.mcap'
    if kind == 'empty folder':
        path.mkdir()
        return path, 'bad'
    if kind == 'a text file':
        path.write_text('time,position\n0,1\n')
        return path, 'bad'
    if kind == 'truncated to its head':
        path = folder / 'bad.mcap'
        write_bag(path, good)
        path.write_bytes(path.read_bytes()[:300])
        return path, 'bad.mcap'
    topics, word = {
        'foreign': ({'/camera/exposure': FloatTable(TIME, TIME)}, 'joint_states'),
        'wrong type': ({'/engb/joint_states': FloatTable(TIME, TIME)}, 'JointState'),
        'wrong type beside it': (good | {'/engb/disc_speed': states()}, 'disc_speed'),
        'only NaN': ({'/engb/joint_states': states(effort=np.full(400, np.nan))}, 'effort'),
        'one lone sample': ({'/engb/joint_states': states(
            position=np.ones(1), velocity=np.ones(1), effort=np.ones(1))}, '20'),
        'no message': ({'/engb/joint_states': states(
            position=np.ones(0), velocity=np.ones(0), effort=np.ones(0))}, 'joint_states'),
    }[kind]
    write_bag(path, topics)
    return path, word


KINDS = ['missing', 'empty file', 'empty folder', 'a text file', 'truncated to its head',
         'foreign', 'wrong type', 'wrong type beside it', 'only NaN', 'one lone sample',
         'no message']
COMMANDS = {'diagnose': 'result', 'predict': 'out.npz', 'identify': 'out.yaml'}


def text(model):
    """Return a model file's text."""
    import yaml
    return yaml.safe_dump(model)


def bad_model(kind):
    """Return the text of a bad model file and a word that must be in the complaint."""
    data = Model().to_mapping()
    if kind == 'unknown key':
        return text(data | {'colour': 'red'}), 'colour'
    if kind == 'unknown key within':
        return text(data | {'motor': data['motor'] | {'inertai': 1}}), 'motor.inertai'
    if kind == 'a unit':
        return text(data | {'motor': data['motor'] | {'inertia': '6.8e-5 kg m2'}}), 'motor.inertia'
    if kind == 'not finite':
        return text(data | {'motor': data['motor'] | {'inertia': float('nan')}}), 'motor.inertia'
    if kind == 'not YAML':
        return 'motor: {inertia: [\n', 'line'
    if kind == 'binary':
        return '\0\1\2', 'model.yaml'
    return '', 'format'


MODELS = ['unknown key', 'unknown key within', 'a unit', 'not finite', 'not YAML', 'binary',
          'empty']


def left_over(folder):
    """Return what stands in a folder, deep."""
    return sorted(str(entry.relative_to(folder)) for entry in folder.rglob('*'))


@pytest.mark.parametrize('command', COMMANDS)
@pytest.mark.parametrize('kind', KINDS)
def test_bad_recording(refused, tmp_path, model_file, command, kind):
    path, word = bad_recording(kind, tmp_path)
    before = left_over(tmp_path)
    refused(command, path, '--model', model_file, '--out', tmp_path / COMMANDS[command],
            words=[path.name, word])
    assert left_over(tmp_path) == before


@pytest.mark.parametrize('command', COMMANDS)
@pytest.mark.parametrize('kind', MODELS)
def test_bad_model(refused, tmp_path, bag, command, kind):
    content, word = bad_model(kind)
    (tmp_path / 'model.yaml').write_text(content)
    before = left_over(tmp_path)
    refused(command, bag, '--model', 'model.yaml', '--out', tmp_path / COMMANDS[command],
            words=['model.yaml', word])
    assert left_over(tmp_path) == before


@pytest.mark.parametrize('command', COMMANDS)
def test_missing_model(refused, bag, command):
    refused(command, bag, '--model', 'nowhere.yaml', '--out', COMMANDS[command],
            words=['nowhere.yaml'])


@pytest.mark.parametrize('command', COMMANDS)
def test_out_that_cannot_be(refused, tmp_path, bag, model_file, command):
    (tmp_path / 'file').write_text('keep')
    name = {'diagnose': 'file', 'predict': 'file.txt', 'identify': 'file'}[command]
    refused(command, bag, '--model', model_file, '--out', name, words=['--out'])
    refused(command, bag, '--model', model_file, '--out', f'file/{COMMANDS[command]}',
            words=['--out'])
    assert (tmp_path / 'file').read_text() == 'keep'


def test_holdout_is_checked_too(refused, tmp_path, bag, model_file):
    refused('diagnose', bag, '--model', model_file, '--out', 'x', '--holdout', 'nope',
            words=['nope'])
    refused('diagnose', bag, '--model', model_file, '--out', 'x', '--holdout', bag,
            words=['twice'])
    assert not (tmp_path / 'x').exists()
