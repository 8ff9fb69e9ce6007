# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The recorder: everything sent is in the bag, whoever stops it and however."""

import contextlib
import os
import shutil
import signal
import struct
import time

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.srv import ChangeState
from mcap.stream_reader import StreamReader
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String
import yaml

from engb_ros.interface import (
    CLOCK,
    CONTROLLER_STATE,
    DIAGNOSTICS,
    DISC_SPEED,
    EFFORT_COMMAND,
    JOINT_STATES,
    RECORDED,
    Service,
)
from engb_ros.processes.runner import node_command


def send(probe, runner, count, pause=0.001):
    runner.wait_until(lambda: probe.subscribers(JOINT_STATES) and probe.subscribers(DISC_SPEED),
                      'the recorder', pause=probe.spin)
    message = JointState(name=['motor'], position=[0.0], velocity=[0.0], effort=[0.0])
    for index in range(count):
        message.position[0] = float(index)
        message.header.stamp.nanosec = index
        probe.publish(JOINT_STATES, message)
        if index % 10 == 0:
            probe.publish(DISC_SPEED, index)
        time.sleep(pause)


def until_recorded(runner, probe, *topics, pause=None):
    """Wait until the recorder says that a message of each topic is in its bag."""
    runner.wait_until(lambda: all(topic in probe.call('recorder', RECORDED).message for topic in
                                  topics), 'a message in the bag', pause=pause or probe.spin)


def read(path):
    found = {}
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(
                reader.deserialize(raw, connection.msgtype))
    return found


@pytest.mark.parametrize(('number', 'compression'), [
    (signal.SIGINT, 'none'), (signal.SIGTERM, 'zstd')])
def test_nothing_is_lost(runner, probe, tmp_path, number, compression):
    runner.start('recorder', parameters={'bag': str(tmp_path / 'bag'),
                                         'compression': compression})
    probe.publish(JOINT_STATES, JointState())   # the publishers exist before anything is sent
    probe.publish(DISC_SPEED, 0.0)
    send(probe, runner, 1000)
    time.sleep(0.3)
    runner.stop(number=number)
    found = read(tmp_path / 'bag')
    positions = [message.position[0] for message in found['/engb/joint_states']
                 if len(message.position)]
    # The first few may go out before both sides know each other; from then on none is missing.
    first = int(positions[0])
    assert first < 200
    assert positions == [float(index) for index in range(first, 1000)]
    speeds = [message.data for message in found['/engb/disc_speed'] if message.data > first]
    assert speeds == [float(index) for index in range(first + 10 - first % 10, 1000, 10)]


def test_killed_while_writing_it_loses_less_than_a_second(runner, probe, tmp_path):
    process = runner.start('recorder', parameters={'bag': str(tmp_path / 'bag')})
    probe.publish(JOINT_STATES, JointState())
    probe.publish(DISC_SPEED, 0.0)
    send(probe, runner, 2000)
    process.signal(signal.SIGKILL)
    killed = time.time_ns()
    process.wait()
    runner.processes.clear()
    with next((tmp_path / 'bag').glob('*.mcap')).open('rb') as file:
        records = []
        try:
            for record in StreamReader(file).records:
                records.append(record)
        except Exception as error:   # the file ends in the middle
            assert records, error
    last = max(record.log_time for record in records if type(record).__name__ == 'Message')
    assert killed - last < 1_000_000_000


def test_a_best_effort_publisher_is_heard(runner, probe, tmp_path):
    runner.start('recorder', parameters={'bag': str(tmp_path / 'bag'), 'all': True})
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    publisher = probe.node.create_publisher(
        Float64, EFFORT_COMMAND.name,
        QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT))
    foreign = probe.node.create_publisher(Float64, '/elsewhere/pressure', 10)
    runner.wait_until(lambda: publisher.get_subscription_count()
                      and foreign.get_subscription_count(), 'the recorder', pause=probe.spin)

    def publish():
        publisher.publish(Float64(data=1.5))
        foreign.publish(Float64(data=2.5))
        probe.spin(0.02)

    until_recorded(runner, probe, '/engb/effort_command', '/elsewhere/pressure', pause=publish)
    runner.stop()
    found = read(tmp_path / 'bag')
    assert found['/engb/effort_command'][-1].data == 1.5
    assert found['/elsewhere/pressure'][-1].data == 2.5


def test_what_publishers_offer_is_in_the_bag_and_diagnostics_and_clock_are(runner, probe,
                                                                           tmp_path):
    runner.start('recorder', parameters={'bag': str(tmp_path / 'bag')})
    probe.publish(JOINT_STATES, JointState())
    probe.publish(CONTROLLER_STATE, String(data='ready'))
    probe.publish(CLOCK, Clock())
    probe.publish(DIAGNOSTICS, DiagnosticArray())
    runner.wait_until(lambda: all(probe.subscribers(topic) for topic in (
        JOINT_STATES, CONTROLLER_STATE, CLOCK, DIAGNOSTICS)), 'the recorder', pause=probe.spin)
    for _ in range(30):   # the first ones may go out before both sides know each other
        probe.spin(0.05)
        for topic, kind in ((JOINT_STATES, JointState), (DIAGNOSTICS, DiagnosticArray),
                            (CLOCK, Clock)):
            probe.publish(topic, kind())
    until_recorded(runner, probe, '/diagnostics', '/clock', '/engb/joint_states',
                   '/engb/controller_state')
    runner.stop()
    metadata = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text(encoding='utf-8'))
    offered = {entry['topic_metadata']['name']: entry['topic_metadata']['offered_qos_profiles']
               for entry in metadata['rosbag2_bagfile_information']['topics_with_message_count']}
    assert {'/diagnostics', '/clock', '/engb/joint_states', '/engb/controller_state'} == {*offered}
    assert offered['/engb/controller_state'][0]['durability'] == 'transient_local'
    assert offered['/engb/joint_states'][0]['durability'] == 'volatile'
    assert offered['/engb/joint_states'][0]['reliability'] == 'reliable'


def test_a_status_said_before_the_recorder_came_is_in_the_bag(runner, probe, tmp_path):
    probe.publish(CONTROLLER_STATE, String(data='enabled'))
    runner.start('recorder', parameters={'bag': str(tmp_path / 'bag')})
    probe.publish(JOINT_STATES, JointState())
    runner.wait_until(lambda: probe.subscribers(CONTROLLER_STATE), 'the recorder',
                      pause=probe.spin)
    until_recorded(runner, probe, '/engb/controller_state')
    runner.stop()
    assert [message.data for message in read(tmp_path / 'bag')['/engb/controller_state']] == [
        'enabled']


def test_a_status_of_a_publisher_that_keeps_nothing_is_heard(runner, probe, tmp_path):
    runner.start('recorder', parameters={'bag': str(tmp_path / 'bag')})
    publisher = probe.node.create_publisher(String, CONTROLLER_STATE.name, 10)
    runner.wait_until(publisher.get_subscription_count, 'the recorder', pause=probe.spin)
    publisher.publish(String(data='ready'))
    until_recorded(runner, probe, '/engb/controller_state')
    runner.stop()
    assert read(tmp_path / 'bag')['/engb/controller_state'][0].data == 'ready'


def test_a_bag_in_several_files_holds_everything(runner, probe, tmp_path):
    runner.start('recorder', parameters={'bag': str(tmp_path / 'bag'), 'split_time': 0.5})
    probe.publish(JOINT_STATES, JointState())
    probe.publish(DISC_SPEED, 0.0)
    send(probe, runner, 1000, pause=0.002)
    time.sleep(0.3)
    runner.stop()
    files = sorted((tmp_path / 'bag').glob('*.mcap'))
    assert len(files) >= 4
    assert files[0].name == 'bag_0.mcap'
    positions = [message.position[0] for message in read(tmp_path / 'bag')['/engb/joint_states']
                 if len(message.position)]
    assert positions[-1] == 999.0
    assert positions == [float(index) for index in range(int(positions[0]), 1000)]
    metadata = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text(encoding='utf-8'))
    bag = metadata['rosbag2_bagfile_information']
    assert bag['relative_file_paths'] == [file.name for file in files]
    assert sum(part['message_count'] for part in bag['files']) == bag['message_count']


def test_a_full_disk_ends_the_recorder_in_one_line_and_loses_nothing_written(runner, probe,
                                                                             tmp_path):
    # The system lets the process write no file beyond 256 KiB, several of the bag's chunks: what a
    # full disk does.
    command = node_command('recorder', parameters={'bag': str(tmp_path / 'bag')})
    process = runner.start_command('recorder', [
        'bash', '-c', 'ulimit -f 256; exec "$@"', 'bash', *command])
    probe.publish(JOINT_STATES, JointState())
    probe.publish(DISC_SPEED, 0.0)
    runner.wait_until(lambda: probe.subscribers(JOINT_STATES), 'the recorder', pause=probe.spin)
    message = JointState(name=['motor'], position=[0.0], velocity=[0.0], effort=[0.0])
    end = time.monotonic() + 60.0
    while process.status is None and time.monotonic() < end:
        message.header.stamp.nanosec += 100_000
        probe.publish(JOINT_STATES, message)
        time.sleep(0.001)
    assert process.status == 2
    assert 'cannot be written (File too large)' in process.output
    said = [line for line in process.output.splitlines() if '[INFO]' not in line]
    assert len(said) == 1, said
    runner.processes.clear()
    with (tmp_path / 'bag' / 'bag.mcap').open('rb') as file:
        kinds = []
        with contextlib.suppress(Exception):   # the file ends in the middle
            kinds.extend(type(record).__name__ for record in StreamReader(file).records)
    assert kinds.count('Message') > 100


def test_an_existing_folder_is_not_overwritten(runner, tmp_path):
    (tmp_path / 'bag').mkdir()
    process = runner.start('recorder', parameters={'bag': str(tmp_path / 'bag')})
    assert process.wait(60.0) == 2
    assert 'exists already' in process.output


def said_at_the_end(process, status):
    """Return what a node has said before it ended with `status`, but for what went well."""
    assert process.wait(30.0) == status
    return [line for line in process.output.splitlines() if '[INFO]' not in line]


@pytest.mark.parametrize('stop', [True, False])
def test_a_bag_that_was_removed_ends_the_recorder_in_one_line(runner, probe, tmp_path, stop):
    process = runner.start('recorder', parameters={'bag': str(tmp_path / 'bag'),
                                                   'chunk_time': 60.0 if stop else 0.1})
    runner.wait_until(lambda: probe.subscribers(JOINT_STATES), 'the recorder', pause=probe.spin)
    shutil.rmtree(tmp_path / 'bag')
    if stop:
        process.signal(signal.SIGINT)
    lines = said_at_the_end(process, 2)
    assert len(lines) == 1 and 'was moved or removed' in lines[0], lines
    runner.processes.clear()


def test_a_bag_that_was_moved_is_whole_and_what_took_its_place_stays(runner, probe, tmp_path):
    process = runner.start('recorder', parameters={'bag': str(tmp_path / 'bag'),
                                                   'chunk_time': 60.0})
    send(probe, runner, 50)
    until_recorded(runner, probe, '/engb/joint_states')
    (tmp_path / 'bag').rename(tmp_path / 'moved')
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'metadata.yaml').write_text('precious')
    process.signal(signal.SIGINT)
    lines = said_at_the_end(process, 2)
    assert len(lines) == 1 and 'was moved or removed' in lines[0], lines
    runner.processes.clear()
    assert (tmp_path / 'bag' / 'metadata.yaml').read_text() == 'precious'
    assert [path.name for path in (tmp_path / 'bag').iterdir()] == ['metadata.yaml']
    with next((tmp_path / 'moved').glob('*.mcap')).open('rb') as file:
        kinds = [type(record).__name__ for record in StreamReader(file).records]
    assert 'Message' in kinds and kinds[-1] == 'Footer'


@pytest.mark.parametrize('name', ['bad name!', 'a//b', '{wheel}'])
def test_a_configuration_that_fails_leaves_no_bag(runner, tmp_path, name):
    process = runner.start('recorder', parameters={'bag': str(tmp_path / 'bag'),
                                                   'topics': [name]})
    lines = said_at_the_end(process, 2)
    assert len(lines) == 1 and f'parameter topics holds {name!r}' in lines[0], lines
    assert '.c:' not in lines[0]
    assert not list(tmp_path.iterdir())
    runner.processes.clear()


def test_a_publisher_that_is_not_heard_is_told_of_under_way_and_at_the_end(runner, probe,
                                                                           tmp_path):
    process = runner.start('recorder', parameters={'bag': str(tmp_path / 'bag')})
    publisher = probe.advertise(JOINT_STATES)
    runner.wait_until(publisher.get_subscription_count, 'the recorder', pause=probe.spin)
    runner.wait_until(lambda: 'nothing has come of it' in process.output, 'the words',
                      pause=probe.spin)
    process.signal(signal.SIGINT)
    lines = said_at_the_end(process, 0)
    assert len(lines) == 2, lines
    assert 'ros2 topic info -v /engb/joint_states' in lines[0]
    assert 'holds no /engb/joint_states: a publisher was there' in lines[1]
    runner.processes.clear()


def test_a_bag_in_the_users_home_is_made_there(runner_of_commands, tmp_path):
    runner = runner_of_commands
    runner.environment['HOME'] = str(tmp_path)
    process = runner.start('recorder', parameters={'bag': '~/bag'})
    runner.wait_until(lambda: (tmp_path / 'bag').is_dir(), 'the bag')
    process.signal(signal.SIGINT)
    assert process.wait(30.0) == 0
    assert not os.path.lexists('~')
    assert 'which nobody published' in process.output
    runner.processes.clear()


def test_a_cleanup_of_a_bag_that_was_removed_fails_in_one_line(runner, probe, tmp_path):
    process = runner.start('recorder', parameters={'bag': str(tmp_path / 'bag'),
                                                   'chunk_time': 60.0})
    runner.wait_until(lambda: probe.subscribers(JOINT_STATES), 'the recorder', pause=probe.spin)
    shutil.rmtree(tmp_path / 'bag')
    service = Service('~/change_state', 'lifecycle_msgs/srv/ChangeState', '')
    answers = []
    for transition in (4, 2, 1, 3):   # deactivate, cleanup, and begin anew
        request = ChangeState.Request()
        request.transition.id = transition
        answers.append(probe.call('recorder', service, request=request).success)
    assert answers == [True, False, True, True]
    process.signal(signal.SIGINT)
    lines = said_at_the_end(process, 0)
    assert sum('was moved or removed' in line for line in lines) == 1, lines
    assert 'Traceback' not in process.output
    assert (tmp_path / 'bag' / 'metadata.yaml').is_file()
    runner.processes.clear()


def test_the_first_messages_have_the_times_at_which_they_were_sent(runner, probe, tmp_path):
    """Discovery keeps them back for seconds, now and then; here the recorder stands still."""
    process = runner.start('recorder', parameters={'bag': str(tmp_path / 'bag')})
    publisher = probe.advertise(DISC_SPEED)
    runner.wait_until(publisher.get_subscription_count, 'the recorder', pause=probe.spin)
    probe.call('recorder', RECORDED)   # it has found the publisher, too
    process.signal(signal.SIGSTOP)
    sent = []

    def send():
        sent.append(time.time())
        probe.publish(DISC_SPEED, sent[-1])
        probe.spin(0.01)

    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        send()
    process.signal(signal.SIGCONT)
    runner.wait_until(lambda: time.monotonic() > end + 1.5, 'later ones', pause=send)
    until_recorded(runner, probe, '/engb/disc_speed')
    runner.stop()
    with next((tmp_path / 'bag').glob('*.mcap')).open('rb') as file:
        records = list(StreamReader(file).records)
    channels = {record.id: record.topic for record in records
                if type(record).__name__ == 'Channel'}
    logged = [(record.log_time * 1e-9, struct.unpack_from('<d', record.data, 4)[0])
              for record in records if type(record).__name__ == 'Message'
              and channels[record.channel_id] == '/engb/disc_speed']
    assert [value for _, value in logged] == sent[-len(logged):]
    # All that the middleware kept, the first one among it.
    assert logged[0][1] < sent[0] + 1.0
    assert abs(logged[0][0] - logged[0][1]) < 0.5


def test_in_simulated_time_a_message_has_the_time_of_the_clock(runner, probe, tmp_path):
    runner.start('recorder', parameters={'bag': str(tmp_path / 'bag'), 'use_sim_time': True})
    for topic, kind in ((CLOCK, Clock()), (DISC_SPEED, 0.0)):
        probe.publish(topic, kind)
    runner.wait_until(lambda: probe.subscribers(CLOCK) >= 2 and probe.subscribers(DISC_SPEED),
                      'the recorder', pause=probe.spin)
    clock, count = Clock(), 0

    def send():
        nonlocal count
        count += 1
        clock.clock.sec = 100 + count
        probe.publish(CLOCK, clock)
        probe.spin(0.05)
        probe.publish(DISC_SPEED, count)
        probe.spin(0.05)

    until_recorded(runner, probe, '/engb/disc_speed', pause=send)
    for _ in range(5):
        send()
    runner.stop()
    path = [tmp_path / 'bag']
    with AnyReader(path, default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        logged = [(time, reader.deserialize(raw, connection.msgtype).data) for connection, time,
                  raw in reader.messages() if connection.topic == '/engb/disc_speed']
    assert len(logged) >= 5
    # A busy computer may let it see the next second before a message of this one.
    assert all(0 <= when - (100 + value) * 10**9 <= 10**9 for when, value in logged if value)
