# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Bags that are damaged, foreign or empty: salvaged with a note, or one clear line."""

import shutil

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.bags.read import read_recording

from .samples import FLOAT64, float64, JOINT_STATE, Run, storage_file, write


def fails(path, *words, **options):
    """Assert that reading ends in an InputError of one line that holds the words."""
    with pytest.raises(InputError) as caught:
        read_recording(path, **options)
    text = str(caught.value)
    assert '\n' not in text
    for word in words:
        assert word in text, text


def test_nothing_there(tmp_path):
    fails(tmp_path / 'absent', 'absent', 'no such file')
    fails(tmp_path / 'no\0name', 'no')
    (tmp_path / 'empty').mkdir()
    fails(tmp_path / 'empty', 'no recording')


@pytest.mark.parametrize('name', ['run.mcap', 'run.db3', 'run.mcap.zstd'])
def test_empty_file(tmp_path, name):
    (tmp_path / name).write_bytes(b'')
    fails(tmp_path / name, name, 'empty')
    (tmp_path / 'folder').mkdir()
    shutil.move(tmp_path / name, tmp_path / 'folder')
    fails(tmp_path / 'folder', name, 'empty')


@pytest.mark.parametrize('name', ['run.mcap', 'run.db3', 'run.mcap.zstd', 'run.db3.zstd', 'x'])
@pytest.mark.parametrize('start', [b'', b'\x89MCAP0\r\n', b'SQLite format 3\0',
                                   b'\x28\xb5\x2f\xfd', b'#ROSBAG V2.0\n'])
def test_garbage(tmp_path, name, start):
    noise = np.random.default_rng(3).bytes(5000)
    (tmp_path / name).write_bytes(start + noise)
    fails(tmp_path / name, name)


def test_ros1_bag(tmp_path):
    (tmp_path / 'old.bag').write_bytes(b'#ROSBAG V2.0\n' + b'x' * 100)
    fails(tmp_path / 'old.bag', 'rosbags-convert')


def test_several_bags_in_a_folder_without_metadata(tmp_path):
    folder = tmp_path / 'day'
    folder.mkdir()
    for name in 'ab':
        shutil.move(storage_file(Run().joint_states().write(tmp_path / name)), folder)
    fails(folder, 'metadata.yaml', 'a.mcap')


def test_metadata_that_points_elsewhere(tmp_path):
    Run().joint_states().write(tmp_path / 'other')
    folder = Run().joint_states().write(tmp_path / 'run')
    (folder / 'metadata.yaml').write_text(
        'rosbag2_bagfile_information:\n  relative_file_paths: [../other/other.mcap]\n')
    assert read_recording(folder).time.size == 300
    assert read_recording(folder).notes


def test_foreign_bag(tmp_path):
    run = Run().floats('/camera/exposure', np.ones(300))
    fails(run.write(tmp_path / 'run'), 'joint_states', '/camera/exposure')
    fails(write(tmp_path / 'nothing', []), 'no topic')


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_wrong_type(tmp_path, storage):
    run = Run().floats('/engb/joint_states', np.ones(300))
    fails(run.write(tmp_path / 'run', storage), '/engb/joint_states', FLOAT64, JOINT_STATE)


def test_wrong_type_of_another_topic(tmp_path):
    run = Run().joint_states().joint_states('/engb/disc_speed')
    fails(run.write(tmp_path / 'run'), '/engb/disc_speed', FLOAT64)


def test_topic_without_messages(tmp_path):
    run = Run().joint_states()
    run.messages = run.messages[:1]
    fails(run.write(tmp_path / 'one'), 'one', '20', 'longer')


def test_samples_that_are_all_bad(tmp_path):
    run = Run()
    run.effort[:] = np.nan
    fails(run.joint_states().write(tmp_path / 'run'), 'effort', 'N·m')
    run = Run()
    run.position[:] = np.inf
    fails(run.joint_states().write(tmp_path / 'run2'), 'position')


def test_no_effort_at_all(tmp_path):
    run = Run()
    run.effort = np.zeros(0)
    for index in range(run.size):
        from .samples import joint_state
        run.add('/engb/joint_states', JOINT_STATE, int(run.stamp[index]), joint_state(
            int(run.stamp[index]), ['motor'], [1.0], [1.0], []))
    fails(run.write(tmp_path / 'run'), 'effort')


def test_messages_that_are_no_joint_states(tmp_path):
    run = Run()
    for index in range(300):
        run.add('/engb/joint_states', JOINT_STATE, int(run.stamp[index]), b'\0\1\0\0junk' * 3)
    fails(run.write(tmp_path / 'run'), '/engb/joint_states', '300')
    run.messages[5].data = b''
    fails(run.write(tmp_path / 'run2'), '/engb/joint_states')


def test_some_damaged_messages_are_left_out(tmp_path):
    run = Run().joint_states()
    run.messages[3].data = run.messages[3].data[:40]
    run.messages[4].data = b''
    count = bytearray(run.messages[5].data)
    count[20:24] = b'\xff\xff\xff\x7f'
    run.messages[5].data = bytes(count)
    run.messages[6].data = b'\x28\xb5\x2f\xfd' + run.messages[6].data
    run.messages[7].data = float64(1.0)
    recording = read_recording(run.write(tmp_path / 'run'))
    assert recording.time.size == 295
    assert any('decoded' in note for note in recording.notes)


@pytest.mark.parametrize('mode', ['none', 'chunk', 'message'])
def test_truncated_mcap_is_salvaged(tmp_path, mode):
    run = Run(size=30_000).long()
    data = storage_file(run.write(tmp_path / 'run', 'mcap', mode)).read_bytes()
    sizes = []
    for share in (0.2, 0.55, 0.8, 0.95, 0.999):
        path = tmp_path / 'cut.mcap'
        path.write_bytes(data[:int(share * len(data))])
        recording = read_recording(path)
        np.testing.assert_array_equal(recording.position, run.position[:recording.time.size])
        assert any('cut.mcap' in note for note in recording.notes)
        sizes.append(recording.time.size)
    assert sizes == sorted(sizes)
    # The unfinished chunk is read too, up to the cut (a zstd block may be missing).
    assert sizes[1] > 0.3 * 30_000
    assert sizes[-1] == 30_000


def test_truncated_at_every_place(tmp_path):
    data = storage_file(Run(size=40).joint_states().write(tmp_path / 'run')).read_bytes()
    path = tmp_path / 'cut.mcap'
    outcomes = set()
    for end in range(0, len(data), 29):
        path.write_bytes(data[:end])
        try:
            recording = read_recording(path)
            assert recording.notes
            outcomes.add('salvaged')
        except InputError:
            outcomes.add('refused')
    assert outcomes == {'salvaged', 'refused'}


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_truncated_zstd_file(tmp_path, storage):
    run = Run(size=30_000).long()
    file = storage_file(run.write(tmp_path / 'run', storage, 'file'))
    data = file.read_bytes()
    file.write_bytes(data[:int(0.7 * len(data))])
    recording = read_recording(file)
    assert 5000 < recording.time.size < 30_000
    assert recording.notes
    file.write_bytes(file.read_bytes()[:100])
    fails(file, file.name)


def test_truncated_sqlite_is_salvaged(tmp_path):
    run = Run(size=30_000).long()
    file = storage_file(run.write(tmp_path / 'run', 'sqlite3'))
    data = file.read_bytes()
    for share in (0.2, 0.5, 0.9):
        file.write_bytes(data[:int(share * len(data))])
        recording = read_recording(file)
        assert recording.time.size > 0.95 * share * 30_000 - 200
        np.testing.assert_array_equal(recording.position, run.position[:recording.time.size])
        assert any('cut off' in note for note in recording.notes)
    for end in (100, 3000, 20_000):
        file.write_bytes(data[:end])
        fails(file, 'run.db3')


def test_damaged_chunk_in_the_middle_is_left_out(tmp_path):
    run = Run(size=60_000).long()
    file = storage_file(run.write(tmp_path / 'run', 'mcap', 'chunk'))
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle:middle + 40_000] = bytes(40_000)
    file.write_bytes(data)
    recording = read_recording(file)
    assert 30_000 < recording.time.size < 60_000
    assert any('damaged' in note for note in recording.notes)


def test_one_bad_file_of_a_split_bag(tmp_path):
    run = Run(size=1000).joint_states()
    folder = tmp_path / 'run'
    folder.mkdir()
    for number in range(2):
        made = write(tmp_path / f'run_{number}', run.messages[number::2])
        shutil.move(storage_file(made), folder)
    (folder / 'run_1.mcap').write_bytes(b'nonsense')
    recording = read_recording(folder)
    assert recording.time.size == 500
    assert any('run_1.mcap' in note for note in recording.notes)


def test_no_temporary_files_stay(tmp_path, monkeypatch):
    scratch = tmp_path / 'scratch'
    scratch.mkdir()
    monkeypatch.setenv('TMPDIR', str(scratch))
    import tempfile
    monkeypatch.setattr(tempfile, 'tempdir', None)
    file = storage_file(Run().joint_states().write(tmp_path / 'run', 'sqlite3', 'file'))
    read_recording(file)
    file.write_bytes(file.read_bytes()[:50])
    fails(file)
    assert not list(scratch.iterdir())
