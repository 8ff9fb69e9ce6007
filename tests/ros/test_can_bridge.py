# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The loop over a real bus (UDP multicast): controller, bridge and drive as processes."""

from pathlib import Path
import signal
import sys
import time

import pytest
from std_msgs.msg import Float64

from engb_core.control.causes import Cause
from engb_ros.can.codec import dbc_file, DriveCodec, DriveStatus
from engb_ros.can.link import DriveEnd
from engb_ros.interface import DIAGNOSTICS, DRIVE_STATE, EFFORT_COMMAND, JOINT_STATES
from engb_ros.processes.runner import node_command
from ros.loops import ATTEMPTS, can_drive, closed_loop

can = pytest.importorskip('can')

REFUSING = Path(__file__).resolve().parents[1] / 'can_bus' / 'refusing_bus.py'


class Bridge:
    """What the bridge's diagnostics say."""

    def __init__(self, probe):
        self._messages = probe.listen(DIAGNOSTICS)

    def __getitem__(self, key):
        """Return a value, '' before there is one."""
        for message in reversed(self._messages):
            status = message.status[0]
            if status.name.endswith('can_bridge'):
                return {entry.key: entry.value for entry in status.values}.get(key, '')
        return ''


def test_the_loop_over_can_and_every_fault_of_the_bus(runner, probe, bus):
    bridge = Bridge(probe)
    loop = closed_loop(runner, probe, can_drive(bus))
    loop.go(15.0)

    def act(fault):
        loop.set_parameter('drive_emulator', 'fault', fault)

    def count(name):
        return int(bridge[name] or 0)

    # Lost and corrupted now and then: the loop goes on with what is sound.
    act('lost')
    loop.until(lambda: count('frames_some_lost') > 20, 'lost frames to be counted')
    loop.until(lambda: bridge['link'] == 'valid', 'a valid link all the same')
    act('none')
    loop.go(10.0)
    act('corrupted')
    loop.until(lambda: count('frames_wrong_crc') > 20, 'corrupted frames to be counted')
    act('none')
    loop.healthy()
    loop.go(12.0)

    # Repeated, silent, late, faulty sensor: no sample is believed, the torque goes.
    for fault, named in (('repeated', 'frames_repeated'), ('bus_off', 'frames_timeouts'),
                         ('late', 'frames_timeouts'), ('sensor_fault', 'samples_withheld')):
        before = count(named)
        act(fault)
        if fault != 'late':
            loop.until(lambda: loop.is_in('fault') and loop.has(Cause.STATE_STALE), fault)
            loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone')
        loop.until(lambda named=named, before=before: count(named) > before,
                   f'{fault} to be counted')
        act('none')
        loop.until(lambda: bridge['link'] == 'valid', f'recovery from {fault}')
        loop.healthy()
        loop.go(10.0)
    runner.stop()


def test_refused_frames_cost_nothing_but_themselves(runner, probe, bus, tmp_path):
    word = tmp_path / 'refuse'
    bridge = Bridge(probe)
    loop = closed_loop(runner, probe, can_drive(bus))
    loop.kill('can_bridge')
    loop.until(lambda: loop.has(Cause.STATE_STALE), 'the word')
    runner.start_command('can_bridge', [
        sys.executable, str(REFUSING), 'can_bridge', *node_command(
            'can_bridge', parameters={**bus, 'channel': f'{word},{bus["channel"]}'})[4:]])
    loop.until(lambda: not loop.has(Cause.STATE_STALE), 'the bridge')
    loop.go(15.0)
    begin = len(loop.state)
    for reason in ('once', 'ENOBUFS', 'full'):
        before = int(bridge['sends_refused'])
        word.write_text(reason)
        loop.during(0.03)   # less than the drive waits for a command
        word.unlink(missing_ok=True)
        loop.until(lambda before=before: int(bridge['sends_refused']) > before, reason)
    loop.go(10.0)
    assert bridge['bus_failures'] == '0'
    assert not any(message.data == 'fault' for message in loop.state[begin:])
    runner.stop()


def test_stamps_are_of_when_frames_came_not_of_when_they_were_read(runner, probe, bus):
    bridge = runner.start('can_bridge', parameters={**bus, 'link_timeout': 0.2})
    states = probe.listen(JOINT_STATES)
    group, port = bus['channel'].split(':')
    drive, sent = DriveEnd(DriveCodec(dbc_file(''), 'DRIVE')), {}

    def send():
        angle = 0.01 * len(sent)   # tells which sample it was
        before = time.time()
        for identifier, data in drive.status(DriveStatus(angle, 0.0, 0.0)):
            wire.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
        sent[len(sent)] = before, time.time()
        time.sleep(0.01)
        probe.spin(0.0)

    def came_with(message):
        return round(message.position[0] / 0.01)

    with can.Bus(interface='udp_multicast', channel=group, port=int(port)) as wire:
        runner.wait_until(lambda: len(states) > 20, 'a valid link', pause=send)
        bridge.signal(signal.SIGSTOP)
        first = len(sent)
        end = time.monotonic() + 0.6
        while time.monotonic() < end:
            send()
        # What the bridge read and passed on while the signal was under way did not wait.
        before_it = len(states)
        last, woken = len(sent), time.time()
        bridge.signal(signal.SIGCONT)
        runner.wait_until(lambda: came_with(states[-1]) >= last, 'the samples after it',
                          pause=send)
    waited = [message for message in states[before_it:] if first <= came_with(message) < last]
    assert len(waited) >= 5
    for message in waited:
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        before, after = sent[came_with(message)]
        assert before - 0.005 < stamp < after + 0.005
        # What waited longer than `link_timeout` is no news.
        assert stamp > woken - 0.2 - 0.005
    runner.stop()


def test_a_bus_that_does_not_exist_is_told_in_one_line(runner):
    process = runner.start('can_bridge', parameters={'interface': 'socketcan',
                                                     'channel': 'nowhere0'})
    assert process.wait(60.0) == 2
    assert 'cannot be opened' in process.output
    assert 'Traceback' not in process.output


def test_a_drive_that_does_not_obey_is_told(runner, probe, bus):
    bridge = Bridge(probe)
    drive = probe.listen(DRIVE_STATE)
    loop = closed_loop(runner, probe, can_drive(bus))
    loop.go(15.0)
    for fault, state in (('refuses', 'refuses'), ('deaf', 'refuses')):
        loop.until(lambda: drive[-1].data == 'obeys', 'an obedient drive')
        loop.set_parameter('drive_emulator', 'fault', fault)
        loop.until(lambda state=state: drive[-1].data == state, fault)
        loop.until(lambda: bridge['drive_mode'] == 'off', 'its mode')
        loop.set_parameter('drive_emulator', 'fault', 'none')
        loop.healthy()
        loop.until(lambda: drive[-1].data == 'obeys', 'recovery')
        loop.go(15.0)
    loop.during(0.5)   # at rest, so the torque that is held on is the load's
    loop.set_parameter('drive_emulator', 'fault', 'holds_on')
    loop.kill('controller')
    loop.until(lambda: drive[-1].data == 'holds_on', 'a drive that does not let go')
    assert loop.effort > 0.0
    runner.stop()


def test_torque_that_no_controller_asks_for_is_not_passed_on(runner, probe, bus):
    bridge = Bridge(probe)
    for name, parameters in can_drive(bus):
        runner.start(name, parameters=parameters)
    states = probe.listen(JOINT_STATES)
    runner.wait_until(lambda: states and probe.subscribers(EFFORT_COMMAND), 'the drive',
                      pause=probe.spin)

    def told(value, count):
        probe.publish(EFFORT_COMMAND, value)
        probe.spin()
        return int(bridge[count] or 0) > 3

    for value, count in ((1e6, 'commands_rejected'), (2.0, 'commands_limited')):
        runner.wait_until(lambda value=value, count=count: told(value, count), count,
                          pause=probe.spin)
    assert max(message.effort[0] for message in states) <= 0.76
    runner.stop()


def test_torque_of_a_second_node_is_not_passed_on(runner, probe, bus):
    bridge = Bridge(probe)
    loop = closed_loop(runner, probe, can_drive(bus))

    def moves_nothing():
        loop.go(15.0)
        intruder = probe.node.create_publisher(Float64, EFFORT_COMMAND.name, 1)
        begin, told, end = len(loop.states), len(loop.state), time.monotonic() + 2.0
        while time.monotonic() < end:
            intruder.publish(Float64(data=-0.7))
            loop.during(0.005)
        probe.node.destroy_publisher(intruder)
        angles = [message.position[0] for message in loop.states[begin:]]
        return (max(angles) - min(angles) < 1.0
                and not any(message.data == 'fault' for message in loop.state[told:]))

    for _ in range(ATTEMPTS):
        if moves_nothing():
            break
        loop.healthy()   # a controller that the computer lets wait is silent: others are obeyed
    else:
        raise AssertionError(loop.words())
    loop.until(lambda: int(bridge['commands_of_others'] or 0) > 100, 'the word')
    runner.stop()
