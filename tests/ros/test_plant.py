# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The plant node: pace, drive timeout, effects, bad commands, simulated time."""

import math
import shlex
import time

from rcl_interfaces.srv import GetParameters
from sensor_msgs.msg import JointState

from engb_core.bench.virtual_brake import parse_effects
from engb_ros.interface import (
    CLOCK,
    DISC_SPEED,
    EFFORT_COMMAND,
    JOINT_COMMAND,
    JOINT_STATES,
    Service,
)
from engb_ros.nodes.plant import PlantNode
from engb_ros.processes.runner import node_command


def stamp(message):
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def test_it_keeps_real_time_and_lets_go_without_commands(runner, probe):
    runner.start('plant', parameters={'rate': 200.0, 'effort_noise': 0.0,
                                      'model': '', 'disc_speed_values': [12.0]})
    states, discs = probe.listen(JOINT_STATES), probe.listen(DISC_SPEED)
    runner.wait_until(lambda: len(states) > 20 and probe.subscribers(EFFORT_COMMAND), 'samples',
                      pause=probe.spin)
    begin, first = time.monotonic(), stamp(states[-1])
    runner.wait_until(lambda: stamp(states[-1]) - first > 1.0, 'a second', pause=probe.spin)
    assert 0.9 < time.monotonic() - begin < 5.0   # late on a loaded computer, never early
    assert discs[-1].data == 12.0
    assert abs(states[-1].position[0]) < 0.5   # the cogging torque moves it a little

    def turning():
        probe.publish(EFFORT_COMMAND, 0.1)
        probe.spin()
        return states[-1].velocity[0] > 10.0

    runner.wait_until(turning, 'the motor to turn', pause=probe.spin)
    assert states[-1].effort[0] == 0.1
    runner.wait_until(lambda: states[-1].effort[0] == 0.0, 'the drive to let go',
                      pause=probe.spin)
    probe.publish(EFFORT_COMMAND, math.nan)
    probe.publish(EFFORT_COMMAND, math.inf)
    count = len(states)
    runner.wait_until(lambda: len(states) > count + 50, 'more samples', pause=probe.spin)
    assert all(math.isfinite(message.effort[0] + message.position[0]) for message in states)
    runner.stop()


def test_in_lockstep_each_sample_waits_for_a_command_and_time_is_exact(runner, probe):
    runner.start('plant', parameters={'lockstep': True, 'speed': 0.0, 'publish_clock': True})
    states, clocks = [], probe.listen(CLOCK)

    def answer(message):
        states.append(message)
        probe.publish(EFFORT_COMMAND, 0.05 if len(states) < 100 else 0.0)

    probe.listen(JOINT_STATES, answer)
    runner.wait_until(lambda: len(states) > 400, '400 samples', pause=probe.spin, timeout=60.0)
    stamps = [message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
              for message in states]
    assert {later - earlier for earlier, later in zip(stamps, stamps[1:], strict=False)} \
        == {1_000_000}
    known = {clock.clock.sec * 10**9 + clock.clock.nanosec for clock in clocks}
    assert len(known & set(stamps)) > 300
    runner.stop()


def test_of_one_publisher_every_torque_is_obeyed_that_is_read(runner, probe):
    """Bursts, of which the newest alone is read, make no second publisher of it."""
    runner.start('plant', parameters={'rate': 200.0, 'effort_noise': 0.0})
    states = probe.listen(JOINT_STATES)
    runner.wait_until(lambda: states and probe.subscribers(EFFORT_COMMAND), 'the plant',
                      pause=probe.spin)
    for _ in range(60):
        for _ in range(40):
            probe.publish(EFFORT_COMMAND, 0.005)
        end = time.monotonic() + 0.03   # less than the drive waits for a command
        while time.monotonic() < end:
            probe.spin()
    assert max(message.effort[0] for message in states) > 0.0
    assert 'more than one node' not in runner.processes['plant'].output
    runner.stop()


def test_any_effect_of_the_library_can_be_switched_on(runner, probe):
    effects = ('{torque_offset: {offset: 0.03}, stribeck_friction: {breakaway_ratio: 1.5, '
               'stribeck_velocity: 3.0}, disc_runout: {amplitude: 0.01}}')
    runner.start('plant', parameters={'effects': effects, 'rate': 200.0})
    states = probe.listen(JOINT_STATES)
    runner.wait_until(lambda: len(states) > 10, 'samples', pause=probe.spin)
    runner.stop()


def test_effects_are_taken_as_their_description_writes_them(runner, probe):
    spec = next(spec for spec in PlantNode.parameters if spec.name == 'effects')
    words = shlex.split(spec.description.partition('on a command line: ')[2])
    assert words[0] == '-p' and len(words) == 2
    process = runner.start_command('plant', node_command('plant') + words)
    states = probe.listen(JOINT_STATES)
    runner.wait_until(lambda: len(states) > 10, 'samples', pause=probe.spin)
    request = GetParameters.Request(names=['effects'])
    service = Service('~/get_parameters', 'rcl_interfaces/srv/GetParameters', '')
    value = probe.call('plant', service, request=request).values[0].string_value
    assert parse_effects(value)[0].parameters == {'breakaway_ratio': 1.4,
                                                  'stribeck_velocity': 2.0}
    assert not process.output
    runner.stop()


def test_torque_comes_from_one_source_by_parameter(runner, probe):
    runner.start('plant', parameters={'rate': 200.0, 'effort_noise': 0.0, 'joint': 'front_left',
                                      'effort_source': 'joint_command'})
    states = probe.listen(JOINT_STATES)
    runner.wait_until(lambda: states and probe.subscribers(JOINT_COMMAND), 'the plant',
                      pause=probe.spin)
    assert states[-1].name == ['front_left']
    assert probe.subscribers(EFFORT_COMMAND) == 0

    def turned_by(**command):
        probe.publish(JOINT_COMMAND, JointState(**command))
        probe.spin()
        return states[-1].effort[0] == 0.1

    def let_go():
        return states[-1].effort[0] == 0.0

    # As joint_state_topic_hardware_interface sends it: effort alone, several joints.
    wanted = {'name': ['rear_left', 'front_left'], 'effort': [0.3, 0.1]}
    runner.wait_until(lambda: turned_by(**wanted), 'the torque', pause=probe.spin)
    runner.wait_until(let_go, 'the drive to let go', pause=probe.spin)
    for useless in ({'name': ['front_left']}, {'name': ['rear_left'], 'effort': [0.1]},
                    {'name': ['front_left'], 'effort': [math.nan]}):
        for _ in range(5):
            assert not turned_by(**useless)
    runner.stop()
