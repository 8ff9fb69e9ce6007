# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""No node of this package shares memory with others, unless it was asked to."""

import os
from pathlib import Path

import pytest

from engb_ros.interface import EFFORT_COMMAND, JOINT_STATES
from engb_ros.nodes.transport import share_no_memory, stay_on_this_computer, word_about
from engb_ros.processes.runner import Runner

WHOLE_NETWORK = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF', 'FASTRTPS_DEFAULT_PROFILES_FILE': ''}


def shared(process):
    """Return the shared memory that a process has mapped."""
    maps = Path(f'/proc/{process.process.pid}/maps').read_text()
    return {line.split()[-1] for line in maps.splitlines() if '/dev/shm/fast' in line}


@pytest.mark.skipif(not Path('/proc/self/maps').exists(), reason='needs /proc')
def test_a_closed_loop_shares_no_memory(runner, probe):
    states, efforts = probe.listen(JOINT_STATES), probe.listen(EFFORT_COMMAND)
    processes = [runner.start('plant'), runner.start('controller')]
    runner.wait_until(lambda: states and efforts, 'the loop', pause=probe.spin)
    for process in processes:
        assert not shared(process)
        assert 'share memory' not in process.output
    runner.stop()


@pytest.mark.skipif(not Path('/proc/self/maps').exists(), reason='needs /proc')
@pytest.mark.parametrize(('environment', 'shares'), [
    ({}, False), ({'FASTDDS_BUILTIN_TRANSPORTS': 'DEFAULT'}, True),
    # rmw_fastrtps asks for shared memory then, whatever Fast DDS was asked for.
    ({'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}, True)])
def test_a_node_shares_memory_only_on_request_and_says_so(domain, environment, shares):
    # Nobody hears it: the profile that keeps the tests on this computer is left out.
    with Runner(domain, local=False, environment={**WHOLE_NETWORK, **environment}) as runner:
        process = runner.start('controller', parameters={'command_timeout': 0.0})
        runner.wait_until(lambda: 'not watched' in process.output, 'the active node')
        assert bool(shared(process)) is shares
        assert ('share memory' in process.output) is shares
        runner.stop()


def test_what_the_environment_says_stands():
    chosen = {'FASTDDS_BUILTIN_TRANSPORTS': 'SHM'}
    share_no_memory(chosen)
    assert chosen == {'FASTDDS_BUILTIN_TRANSPORTS': 'SHM'}
    assert 'UDPv4' in word_about(chosen)
    mine = {'FASTRTPS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    stay_on_this_computer(mine)
    assert mine == {'FASTRTPS_DEFAULT_PROFILES_FILE': 'mine.xml'}
    other = {'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp'}
    stay_on_this_computer(other)
    assert other['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
    assert not word_about(other)


def test_this_computers_profile_is_there():
    told = {}
    stay_on_this_computer(told)
    assert os.path.exists(told['FASTRTPS_DEFAULT_PROFILES_FILE'])
