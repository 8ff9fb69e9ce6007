# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whole bags of all formats."""

import shutil

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.bags.read import read_recording

from .samples import FLOAT64, float64, JOINT_STATE, joint_state, Run, START, storage_file, write

FORMATS = [('mcap', 'none'), ('mcap', 'chunk'), ('mcap', 'message'), ('mcap', 'file'),
           ('sqlite3', 'none'), ('sqlite3', 'message'), ('sqlite3', 'file')]


@pytest.mark.parametrize(('storage', 'mode'), FORMATS)
@pytest.mark.parametrize('how', ['folder', 'file', 'no metadata', 'broken metadata'])
def test_every_format_gives_the_same_recording(tmp_path, storage, mode, how):
    run = Run().joint_states().floats('/engb/disc_speed', np.arange(300.0))
    folder = run.write(tmp_path / 'run1', storage, mode)
    path = folder
    if how == 'file':
        path = storage_file(folder)
    elif how == 'no metadata':
        (folder / 'metadata.yaml').unlink()
    elif how == 'broken metadata':
        (folder / 'metadata.yaml').write_text('rosbag2_bagfile_information:\n  files: [a, {')
    recording = read_recording(path)
    assert recording.name == 'run1'
    assert recording.joint == 'motor'
    assert recording.start == pytest.approx(START * 1e-9)
    np.testing.assert_allclose(recording.time, np.arange(300) / 1000, atol=1e-9)
    np.testing.assert_array_equal(recording.position, run.position)
    np.testing.assert_array_equal(recording.velocity, run.velocity)
    np.testing.assert_array_equal(recording.effort, run.effort)
    np.testing.assert_array_equal(recording.signals['disc_speed'].value, np.arange(300.0))
    assert len(recording.notes) == (1 if 'metadata' in how else 0)


def test_split_bag_is_put_together(tmp_path):
    run = Run().joint_states()
    whole = tmp_path / 'split'
    whole.mkdir()
    for number, part in enumerate((run.messages[:100], run.messages[100:250],
                                   run.messages[250:])):
        made = write(tmp_path / f'split_{number}', part)
        shutil.move(storage_file(made), whole / f'split_{number}.mcap')
    names = ''.join(f'    - split_{number}.mcap\n' for number in range(3))
    (whole / 'metadata.yaml').write_text(
        'rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths:\n' + names)
    np.testing.assert_array_equal(read_recording(whole).position, run.position)
    (whole / 'metadata.yaml').unlink()
    np.testing.assert_array_equal(read_recording(whole).position, run.position)
    (whole / 'split_1.mcap').unlink()
    assert read_recording(whole).time.size == 150


def test_a_folder_whose_recordings_lie_one_deeper_names_them(tmp_path):
    for name in ('second', 'first'):
        (tmp_path / name).mkdir()
        (tmp_path / name / 'recording.mcap').touch()
        (tmp_path / name / 'notes').mkdir()
    (tmp_path / 'pictures').mkdir()
    with pytest.raises(InputError, match='one of the 2 below it, such as .*first$'):
        read_recording(tmp_path)
    shutil.rmtree(tmp_path / 'first')
    with pytest.raises(InputError, match='give .*second$'):
        read_recording(tmp_path)


def test_missing_velocity_stays_missing(tmp_path):
    run = Run().joint_states(velocity=False)
    assert read_recording(run.write(tmp_path / 'run')).velocity is None


def test_velocity_that_starts_late_is_not_used(tmp_path):
    run = Run().joint_states()
    for index in range(100):
        run.messages[index].data = joint_state(
            int(run.stamp[index]), ['motor'], [run.position[index]], [], [run.effort[index]])
    recording = read_recording(run.write(tmp_path / 'run'))
    assert recording.velocity is None
    assert recording.time.size == 300
    assert any('velocity' in note for note in recording.notes)


@pytest.mark.parametrize(('names', 'column', 'asked', 'taken'), [
    (('a', 'motor', 'b'), 1, None, 'motor'),
    (('a', 'motor', 'b'), 2, 'b', 'b'),
    (('carriage',), 0, None, 'carriage'),
    (('carriage',), 0, 'motor', 'carriage'),
    (('carriage',), 0, 'servo', 'carriage'),
    ((), 0, None, ''),
])
def test_the_right_joint_is_taken(tmp_path, names, column, asked, taken):
    run = Run()
    if names:
        run.joint_states(names=names, column=column, frame='base_link')
    else:
        for index in range(run.size):
            run.add('/engb/joint_states', JOINT_STATE, int(run.stamp[index]), joint_state(
                int(run.stamp[index]), [], [run.position[index]], [], [run.effort[index]]))
    recording = read_recording(run.write(tmp_path / 'run'), joint=asked)
    assert recording.joint == taken
    np.testing.assert_array_equal(recording.position, run.position)


def test_several_joints_without_a_hint_are_an_error(tmp_path):
    path = Run().joint_states(names=('left', 'right')).write(tmp_path / 'run')
    with pytest.raises(InputError, match='left, right.*joint.name'):
        read_recording(path)


def test_joints_of_several_publishers_on_one_topic(tmp_path):
    run = Run().joint_states(names=('wheel',))
    run.position = run.position + 5
    run.joint_states(names=('motor',))
    np.testing.assert_array_equal(read_recording(run.write(tmp_path / 'run')).position,
                                  run.position)


def test_namespaces(tmp_path):
    run = Run().joint_states('/front_left/joint_states')
    run.floats('/front_left/disc_speed', np.full(300, 1.0))
    run.floats('/front_right/disc_speed', np.full(300, 2.0))
    run.floats('/vehicle/speed', np.full(300, 3.0))
    run.joint_states('/front_right/joint_states')
    path = run.write(tmp_path / 'run')
    with pytest.raises(InputError, match='--namespace'):
        read_recording(path)
    right = read_recording(path, namespace='front_right')
    assert {name: signal.value[0] for name, signal in right.signals.items()} == {
        'disc_speed': 2.0, 'speed': 3.0}
    with pytest.raises(InputError, match='rear'):
        read_recording(path, namespace='/rear')


@pytest.mark.parametrize('topic', ['/joint_states', '/a/b/c/joint_states', 'joint_states'])
def test_any_namespace(tmp_path, topic):
    speed = topic.replace('joint_states', 'disc_speed')
    run = Run().joint_states(topic).floats(speed, np.arange(300.0))
    recording = read_recording(run.write(tmp_path / 'run'))
    assert list(recording.signals) == ['disc_speed']


def test_reference(tmp_path):
    run = Run().joint_states()
    for index in range(0, 300, 4):
        run.add('/engb/reference', JOINT_STATE, int(run.stamp[index]), joint_state(
            int(run.stamp[index]), ['motor'], [run.position[index]], [], [0.5]))
    reference = read_recording(run.write(tmp_path / 'run')).reference
    np.testing.assert_array_equal(reference.position, run.position[::4])
    np.testing.assert_allclose(reference.time, np.arange(0, 300, 4) / 1000, atol=1e-9)
    assert reference.velocity is None
    assert (reference.effort == 0.5).all()


@pytest.mark.parametrize('offset', [0, 7_200_000_000_000, -50_000_000])
def test_signals_are_on_the_stamps_clock(tmp_path, offset):
    run = Run(size=2000)
    run.joint_states(delay=offset + 500_000)
    run.floats('/engb/disc_speed', run.position, delay=offset + 500_000)
    recording = read_recording(run.write(tmp_path / 'run'))
    signal = recording.signal('disc_speed')
    assert np.abs(signal - recording.position).max() < 1e-4


def test_signals_follow_a_clock_that_runs_at_another_rate(tmp_path):
    """Simulated time at five times the recorder's pace."""
    run = Run(size=2000)
    run.joint_states().floats('/engb/disc_speed', run.position, delay=500_000)
    for message in run.messages:
        message.log_time = START + (message.log_time - START) // 5
    recording = read_recording(run.write(tmp_path / 'run'))
    assert np.abs(recording.signal('disc_speed') - recording.position).max() < 0.005


def test_without_stamps_the_log_time_counts(tmp_path):
    run = Run().joint_states(stamp=np.zeros(300, np.int64))
    recording = read_recording(run.write(tmp_path / 'run'))
    np.testing.assert_allclose(recording.time, np.arange(300) / 1000, atol=1e-9)
    assert any('stamp' in note for note in recording.notes)


def test_order_doubles_and_gaps_are_repaired(tmp_path):
    run = Run().joint_states()
    messages = run.messages
    messages[10].log_time, messages[11].log_time = messages[11].log_time, messages[10].log_time
    messages[50:60] = []
    messages.append(messages[5])
    recording = read_recording(run.write(tmp_path / 'run'))
    assert recording.time.size == 290
    assert np.all(np.diff(recording.time) > 0)
    assert len(recording.notes) == 2


def test_values_that_are_not_numbers_are_left_out(tmp_path):
    run = Run()
    run.effort[7] = np.nan
    run.position[8] = np.inf
    run.velocity[9] = 1e300
    run.joint_states().floats('/engb/disc_speed', np.where(np.arange(300) == 3, np.nan, 1.0))
    recording = read_recording(run.write(tmp_path / 'run'))
    assert recording.time.size == 297
    assert recording.signals['disc_speed'].value.size == 299
    assert len(recording.notes) == 2


def test_a_stamp_far_off_does_not_stretch_the_recording(tmp_path):
    run = Run()
    stamp = run.stamp.copy()
    stamp[100] += 2**28 * 10**9
    stamp[200] = 17
    recording = read_recording(run.joint_states(stamp=stamp).write(tmp_path / 'run'))
    assert recording.time.size == 298
    assert recording.duration < 1


def test_a_clock_that_was_set_leaves_the_longer_part(tmp_path):
    run = Run()
    stamp = run.stamp.copy()
    stamp[:100] -= START
    recording = read_recording(run.joint_states(stamp=stamp).write(tmp_path / 'run'))
    assert recording.time.size == 200


def test_big_endian(tmp_path):
    run = Run().joint_states().floats('/engb/disc_speed', np.arange(300.0))
    for message in run.messages:
        little = message.data
        if message.type == FLOAT64:
            message.data = b'\0\0\0\0' + little[4:][::-1]
        else:
            head = np.frombuffer(little[4:28], '<u4').astype('>u4').tobytes()
            # sec, nanosec, frame length 1, padded frame; one name of six bytes, its padding.
            head = head[:12] + b'\0\0\0\0' + head[16:24]
            names = little[28:36]
            rest = little[36:]
            swapped = bytearray()
            for _ in range(3):
                swapped += rest[:4][::-1] + rest[4:8] + rest[8:16][::-1]
                rest = rest[16:]
            message.data = b'\0\0\0\0' + head + names + bytes(swapped)
    recording = read_recording(run.write(tmp_path / 'run'))
    np.testing.assert_array_equal(recording.position, run.position)
    np.testing.assert_array_equal(recording.effort, run.effort)
    np.testing.assert_array_equal(recording.signals['disc_speed'].value, np.arange(300.0))


def test_layouts_that_change_all_the_time(tmp_path):
    run = Run()
    for index in range(run.size):
        run.add('/engb/joint_states', JOINT_STATE, int(run.stamp[index]), joint_state(
            int(run.stamp[index]), ['motor', 'x' * (index % 97)], [run.position[index], 1],
            [run.velocity[index], 1], [run.effort[index], 1], 'f' * (index % 53)))
    recording = read_recording(run.write(tmp_path / 'run'))
    np.testing.assert_array_equal(recording.position, run.position)
    np.testing.assert_array_equal(recording.effort, run.effort)


def test_names_of_equal_length_are_told_apart(tmp_path):
    """The motion's joint is first in every second message, second in the others."""
    run = Run()
    for index in range(run.size):
        order = ['motor', 'wheel'] if index % 2 else ['wheel', 'motor']
        values = [[run.position[index], 8.0], [run.velocity[index], 8.0],
                  [run.effort[index], 8.0]]
        run.add('/engb/joint_states', JOINT_STATE, int(run.stamp[index]), joint_state(
            int(run.stamp[index]), order, *(value if index % 2 else value[::-1]
                                            for value in values)))
    np.testing.assert_array_equal(read_recording(run.write(tmp_path / 'run')).position,
                                  run.position)


def test_float64_of_a_longer_message_is_read(tmp_path):
    """Some middleware pads messages to four bytes and more."""
    run = Run().joint_states()
    for index in range(300):
        run.add('/engb/disc_speed', FLOAT64, int(run.stamp[index]),
                float64(index) + b'\0' * (4 * (index % 3)))
    values = read_recording(run.write(tmp_path / 'run')).signals['disc_speed'].value
    np.testing.assert_array_equal(values, np.arange(300.0))


def test_a_forgotten_recorder_leaves_the_longer_part(tmp_path):
    run = Run()
    stamp = run.stamp.copy()
    stamp[200:] += 3600 * 10**9
    recording = read_recording(run.joint_states(stamp=stamp).write(tmp_path / 'run'))
    assert recording.time.size == 200
    assert any('pause' in note for note in recording.notes)


def test_a_pause_that_the_motion_outweighs_stays(tmp_path):
    run = Run(size=600, rate=20.0)
    stamp = run.stamp.copy()
    stamp[200:] += 61 * 10**9
    recording = read_recording(run.joint_states(stamp=stamp).write(tmp_path / 'run'))
    assert recording.time.size == 600
    assert recording.notes == ()


@pytest.mark.parametrize('rate', [1e9, 1e6, 0.5, 1e-3])
def test_stamps_that_cannot_be_times_of_sampling(tmp_path, rate):
    with pytest.raises(InputError, match='stamp'):
        read_recording(Run(rate=rate).joint_states().write(tmp_path / 'run'))
