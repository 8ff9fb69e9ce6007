# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Bags that lack something or hold it otherwise than most: read, or told in a line."""

import os

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.bags.bag_files import bag_files
from engb_core.io.bags.cdr import float64_values
from engb_core.io.bags.compression import ZSTD_MAGIC
from engb_core.io.bags.read import read_recording
from engb_core.io.bags.storage import Batch, unwrapped
from engb_core.io.bags.write import FloatTable, JointTable, write_bag

from .samples import float64, Run, storage_file

TIME = np.arange(300) / 100.0
STATES = JointTable(TIME, np.sin(TIME), None, np.cos(TIME))


def test_what_is_neither_file_nor_folder_is_told(tmp_path):
    os.mkfifo(tmp_path / 'pipe.mcap')
    with pytest.raises(InputError, match='neither a file nor a folder'):
        read_recording(tmp_path / 'pipe.mcap')


def test_metadata_stands_for_its_folder(tmp_path):
    write_bag(tmp_path / 'run', {'/joint_states': STATES})
    recording = read_recording(tmp_path / 'run' / 'metadata.yaml')
    np.testing.assert_array_equal(recording.position, np.sin(TIME))


def test_an_empty_file_of_several_and_metadata_without_end_are_told(tmp_path):
    path = Run().long().write(tmp_path / 'run')
    file = storage_file(path)
    (path / file.name.replace('.mcap', '_1.mcap')).write_bytes(b'')
    os.truncate(path / 'metadata.yaml', 64 << 20)
    notes = []
    assert bag_files(path, notes) == [file]
    assert any('1 of 2 files are empty' in note for note in notes)
    assert any('metadata.yaml is missing or damaged: all 2 files were read' in note
               for note in notes)


@pytest.mark.parametrize(('name', 'storage'), [('run.db3', 'mcap'), ('run.mcap', 'sqlite3')])
def test_a_name_that_tells_another_storage_is_refused(tmp_path, name, storage):
    with pytest.raises(InputError, match=f"the name doesn't fit storage {storage}"):
        write_bag(tmp_path / name, {'/joint_states': STATES}, storage)


def test_a_bag_of_nothing_is_written(tmp_path):
    write_bag(tmp_path / 'run', {})
    with pytest.raises(InputError, match='run'):
        read_recording(tmp_path / 'run')


def test_numbers_of_either_byte_order_beside_what_is_none():
    little = np.frombuffer(float64(1.5), np.uint8)
    big = np.r_[np.uint8([0, 0, 0, 0]), np.frombuffer(np.array(2.5, '>f8').tobytes(), np.uint8)]
    odd = little.copy()
    odd[0] = 9
    rows = np.stack([little, big, odd])
    np.testing.assert_array_equal(float64_values(rows), [1.5, 2.5, np.nan])
    np.testing.assert_array_equal(float64_values(rows[:2, :6]), [np.nan, np.nan])


def test_messages_that_are_packed_one_by_one_lose_only_the_damaged():
    from backports import zstd
    packed = [zstd.compress(float64(value)) for value in (1.5, 2.5)]
    same = [packed[0], packed[0][:-4] + b'\0\0\0\0', packed[0]]
    assert same[1].startswith(ZSTD_MAGIC)
    rows = np.frombuffer(b''.join(same), np.uint8).reshape(3, -1)
    batch, lost = unwrapped(Batch('/a', np.array([1, 2, 3]), rows))
    assert len(batch) + lost == 3
    assert bytes(batch.rows[0]) == float64(1.5)
    broken = [ZSTD_MAGIC + b'nothing', packed[1]]
    batch, lost = unwrapped(Batch('/a', np.array([1, 2]), broken))
    assert (lost, batch.log_time.tolist()) == (1, [2]) and bytes(batch.rows[0]) == float64(2.5)


def test_a_signal_whose_values_are_all_lost_is_left_out_and_told(tmp_path):
    write_bag(tmp_path / 'run', {'/engb/joint_states': STATES, '/engb/disc_speed': FloatTable(
        TIME, np.full(TIME.size, 1e300))})
    recording = read_recording(tmp_path / 'run')
    assert 'disc_speed' not in recording.signals
    assert any('disc_speed: 300 values that are not finite' in note for note in recording.notes)


def test_a_set_point_without_stamps_is_put_by_its_log_time_and_one_of_nothing_is_none(tmp_path):
    run = Run().joint_states()
    run.joint_states('/engb/reference', stamp=np.zeros(run.size, np.int64))
    recording = read_recording(run.write(tmp_path / 'run'))
    assert recording.reference is not None
    np.testing.assert_allclose(np.interp(recording.time, recording.reference.time,
                                         recording.reference.position), run.position, atol=0.05)
    nothing = Run().joint_states()
    nothing.position = nothing.position * np.nan
    nothing.joint_states('/engb/reference')
    assert read_recording(nothing.write(tmp_path / 'other')).reference is None


def test_more_repairs_than_anybody_reads_are_counted(tmp_path):
    topics = {'/engb/joint_states': STATES}
    for number in range(30):
        topics[f'/engb/signal_{number}'] = FloatTable(TIME, np.full(TIME.size, 1e300))
    write_bag(tmp_path / 'run', topics)
    recording = read_recording(tmp_path / 'run')
    assert all('signal' in note or 'more repairs' in note for note in recording.notes)
