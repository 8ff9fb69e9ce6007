# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Writing: the bytes are rosbags' own, the bag is whole or not there."""

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from engb_core.errors import InputError
from engb_core.io.bags.read import read_recording
from engb_core.io.bags.write import (
    float64_rows,
    FloatTable,
    joint_state_rows,
    JointTable,
    write_bag,
)

from .samples import FLOAT64, float64, JOINT_STATE, joint_state, STORE


@pytest.mark.parametrize('joint', ['motor', 'carriage', 'a', '', 'Rad_ü'])
@pytest.mark.parametrize('frame', ['', 'base', 'x' * 9])
@pytest.mark.parametrize('velocity', [None, 2.5])
@pytest.mark.parametrize('effort', [None, -1.0])
def test_serialisation_equals_rosbags(joint, frame, velocity, effort):
    def column(value):
        return None if value is None else np.array([value])
    row = joint_state_rows(np.array([5_000_000_007]), np.array([1.5]), column(velocity),
                           column(effort), joint, frame)[0].tobytes()
    expected = joint_state(5_000_000_007, [joint], [1.5], [] if velocity is None else [velocity],
                           [] if effort is None else [effort], frame)
    assert row == expected
    assert float64_rows(np.array([2.5]))[0].tobytes() == float64(2.5)


@pytest.mark.parametrize(('storage', 'compression'), [
    ('mcap', 'none'), ('mcap', 'chunk'), ('mcap', 'message'), ('mcap', 'file'),
    ('sqlite3', 'none'), ('sqlite3', 'message'), ('sqlite3', 'file')])
def test_rosbags_reads_what_is_written(tmp_path, storage, compression):
    time = 1.7e9 + np.arange(50) / 128
    path = tmp_path / 'deep' / 'run'
    write_bag(path, {'/a/joint_states': JointTable(time, time, None, -time, 'servo'),
                     '/a/disc_speed': FloatTable(time, 2 * time)}, storage, compression)
    assert sorted(entry.name for entry in path.parent.iterdir()) == ['run']
    with AnyReader([path], default_typestore=STORE) as reader:
        assert {entry.topic: (entry.msgtype, entry.digest) for entry in reader.connections} == {
            '/a/joint_states': (JOINT_STATE, STORE.hash_rihs01(JOINT_STATE)),
            '/a/disc_speed': (FLOAT64, STORE.hash_rihs01(FLOAT64))} or storage == 'mcap'
        messages = [reader.deserialize(raw, connection.msgtype)
                    for connection, _, raw in reader.messages()]
    states = [message for message in messages if hasattr(message, 'effort')]
    assert [message.position[0] for message in states] == time.tolist()
    assert states[0].name == ['servo']
    assert all(message.velocity.size == 0 for message in states)
    assert len(messages) == 100


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_single_file(tmp_path, storage):
    suffix = {'mcap': '.mcap', 'sqlite3': '.db3'}[storage]
    path = tmp_path / f'run{suffix}'
    time = np.arange(50) / 100
    write_bag(path, {'/joint_states': JointTable(time, time, None, time)}, storage)
    assert path.is_file()
    assert read_recording(path).name == 'run'


def test_what_is_there_stays_unless_told(tmp_path):
    time = np.arange(50) / 100
    topics = {'/joint_states': JointTable(time, time, None, time)}
    for name in ('run', 'run.mcap'):
        path = tmp_path / name
        write_bag(path, topics)
        with pytest.raises(InputError, match='exists'):
            write_bag(path, topics)
        write_bag(path, {'/x/joint_states': JointTable(time, time + 1, None, time)},
                  replace=True)
        assert read_recording(path).position[0] == 1
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ['run', 'run.mcap']


def test_nothing_half_written(tmp_path):
    time = np.array([0.0, np.nan])
    with pytest.raises(InputError, match='finite'):
        write_bag(tmp_path / 'run', {'/joint_states': JointTable(time, time, None, time)})
    with pytest.raises(InputError, match='cannot be'):
        (tmp_path / 'file').write_text('')
        write_bag(tmp_path / 'file' / 'run', {})
    assert [entry.name for entry in tmp_path.iterdir()] == ['file']
