# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A standby beside a primary: it waits, follows, takes over when the primary dies, and is told."""

import signal
import time

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import pytest
from std_msgs.msg import Float64

from engb_core.control.causes import Cause
from engb_ros.interface import (
    CONTROLLER_STATE,
    DIAGNOSTICS,
    EFFORT_COMMAND,
    Service,
)
from engb_ros.processes.runner import node_command
from ros.loops import closed_loop, PATIENT, plant
from ros.stepped import Stepped


def told(loop):
    """Return what the controllers said, for a failure's message."""
    return ([message.data for message in loop.state],
            sorted({str(Cause(message.data)) for message in loop.causes}),
            {name: process.output for name, process in loop.runner.processes.items()})


@pytest.fixture
def diagnosed(probe):
    """What each controller's diagnostics said last, by the node's name."""
    values = {}

    def take(message):
        status = message.status[0]
        values[status.name.rpartition(' ')[2]] = {
            entry.key: entry.value for entry in status.values}
    probe.listen(DIAGNOSTICS, take)
    return values


def state(diagnosed, name):
    """Return the state that a controller's diagnostics told last."""
    return diagnosed.get(name, {}).get('state')


def beside_a_standby(runner, probe, diagnosed, drive):
    """Return a loop at 25 rad, whose controller has had a standby beside it for no longer than it
    takes to be ready."""
    loop = closed_loop(runner, probe, drive, **PATIENT)
    loop.go(25.0)
    runner.start_command('standby', node_command(
        'controller', name='standby', parameters={**loop.controller, 'standby': True,
                                                  'diagnostics_period': 0.05}))
    loop.until(lambda: state(diagnosed, 'standby') == 'enabled', 'the standby')
    return loop


def test_a_standby_keeps_the_brake_applied_when_the_primary_is_killed(runner, probe, diagnosed):
    loop = beside_a_standby(runner, probe, diagnosed, plant(rate=200.0))
    assert abs(loop.position - 25.0) < 0.5, told(loop)
    begin = len(loop.states)
    loop.kill('controller')
    loop.during(2.0)
    angles = [message.position[0] for message in loop.states[begin:]]
    assert min(angles) > 15.0, told(loop)
    assert abs(loop.position - 25.0) < 0.5
    # The graph shows the dead one for a while yet: the standby is degraded.
    loop.target = 8.0
    loop.until(lambda: abs(loop.position - 8.0) < 0.3, '8 rad')
    runner.stop()


@pytest.mark.parametrize('torque', [0.0, -0.75])
def test_a_stranger_who_speaks_beside_the_primary_keeps_no_standby_from_taking_over(
        runner, probe, diagnosed, torque):
    """His torque is not that of the primary, whose silence the standby waits for."""
    loop = beside_a_standby(runner, probe, diagnosed, plant(rate=200.0))
    stranger = probe.node.create_publisher(Float64, EFFORT_COMMAND.name, 1)
    probe.repeat(0.01, lambda: stranger.publish(Float64(data=torque)))
    loop.during(1.5)
    assert abs(loop.position - 25.0) < 0.5, told(loop)
    begin = len(loop.states)
    loop.kill('controller')
    loop.during(2.0)
    assert min(message.position[0] for message in loop.states[begin:]) > 15.0, told(loop)
    assert abs(loop.position - 25.0) < 0.5
    runner.stop()


@pytest.mark.parametrize('pause', [0.15, 1.5])
def test_a_primary_that_was_frozen_and_goes_on_lets_nothing_go(runner, probe, diagnosed, pause):
    """The standby takes over, both speak for a moment, the standby yields."""
    loop = beside_a_standby(runner, probe, diagnosed, plant(rate=200.0))
    begin = len(loop.states)
    runner.processes['controller'].signal(signal.SIGSTOP)
    loop.during(pause)
    runner.processes['controller'].signal(signal.SIGCONT)
    loop.during(2.5)
    assert min(message.position[0] for message in loop.states[begin:]) > 24.0, told(loop)
    runner.stop()


def test_of_two_standbys_one_takes_over_and_the_brake_stays_applied(runner, probe, diagnosed):
    loop = beside_a_standby(runner, probe, diagnosed, plant(rate=200.0))
    runner.start_command('second', node_command(
        'controller', name='second', parameters={**loop.controller, 'standby': True,
                                                 'diagnostics_period': 0.05}))
    loop.until(lambda: state(diagnosed, 'second') == 'enabled', 'the second standby')
    begin = len(loop.states)
    loop.kill('controller')
    loop.during(3.0)
    assert min(message.position[0] for message in loop.states[begin:]) > 15.0, told(loop)
    sent, samples = len(loop.efforts), len(loop.states)
    loop.during(1.0)
    assert len(loop.efforts) - sent < 1.2 * (len(loop.states) - samples), told(loop)
    assert abs(loop.position - 25.0) < 0.5
    runner.stop()


def test_a_planned_hand_over_lets_nothing_go(runner, probe, diagnosed):
    """Deactivated beside a standby, a primary leaves it the torque that is there."""
    loop = beside_a_standby(runner, probe, diagnosed, plant())
    begin, sent = len(loop.states), len(loop.efforts)
    service = Service('~/change_state', 'lifecycle_msgs/srv/ChangeState', '')
    request = ChangeState.Request()
    request.transition.id = Transition.TRANSITION_DEACTIVATE
    assert probe.call('controller', service, request=request).success
    loop.during(1.5)
    assert not any(message.data == 0.0 for message in loop.efforts[sent:])
    assert len(loop.efforts) > sent + 100
    assert min(message.position[0] for message in loop.states[begin:]) > 24.0, told(loop)
    runner.stop()


def test_a_primary_and_a_standby_that_start_at_once_know_their_parts(runner, probe):
    runner.start('controller', name='standby', parameters={**PATIENT, 'standby': True})
    loop = closed_loop(runner, probe, **PATIENT)
    loop.target = 10.0
    loop.until(lambda: abs(loop.position - 10.0) < 0.3, 'the brake')
    loop.during(1.5)
    assert not any(message.data == 'fault' for message in loop.state), told(loop)
    runner.stop()


def test_a_standby_waits_for_a_primary_that_starts_later(runner, probe):
    """Of nodes that are started at once one comes a second after the other, by chance."""
    for name, drive in plant():
        runner.start(name, parameters=drive)
    told = probe.listen(CONTROLLER_STATE)
    torques = probe.listen(EFFORT_COMMAND)
    runner.start('controller', name='standby', parameters={**PATIENT, 'standby': True})
    runner.wait_until(lambda: told, 'the standby', pause=probe.spin)
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        probe.spin()
    begin = len(torques)
    runner.start('controller', parameters=PATIENT)
    runner.wait_until(lambda: len(torques) > begin + 100, 'the primary', pause=probe.spin)
    assert not any(message.data == 'fault' for message in told)
    assert not begin
    runner.stop()


def test_a_standby_that_has_no_primary_takes_over_in_the_end(runner, probe):
    for name, drive in plant():
        runner.start(name, parameters=drive)
    told, torques = probe.listen(CONTROLLER_STATE), probe.listen(EFFORT_COMMAND)
    runner.start('controller', name='standby', parameters={
        'standby': True, 'state_timeout': PATIENT['state_timeout']})
    runner.wait_until(lambda: len(torques) > 100, 'the standby', pause=probe.spin)
    assert told
    runner.stop()


def test_a_pause_of_the_drive_leaves_a_standby_ready(runner, probe, diagnosed):
    loop = closed_loop(runner, probe, **PATIENT)
    loop.go(20.0)
    # It shall not take over where the computer lets the primary wait: another test's matter.
    runner.start('controller', name='standby', parameters={
        **loop.controller, 'standby': True, 'takeover_time': PATIENT['state_timeout']})
    loop.until(lambda: state(diagnosed, 'standby') == 'enabled', 'the standby')
    drive = runner.processes['plant']
    drive.signal(signal.SIGSTOP)
    loop.until(lambda: {state(diagnosed, name) for name in diagnosed} == {'fault'},
               'both to miss the drive')
    drive.signal(signal.SIGCONT)
    loop.until(lambda: state(diagnosed, 'standby') != 'fault', 'the standby to be back')
    loop.during(0.5)
    assert state(diagnosed, 'controller') == 'fault'   # its own fault stays latched
    loop.until(lambda: loop.clear().success, 'the fault to be cleared')
    loop.until(lambda: abs(loop.position - 20.0) < 0.3 and state(diagnosed, 'standby') == 'enabled'
               and state(diagnosed, 'controller') != 'fault', 'the brake')
    runner.stop()


def test_a_pause_of_the_stack_leaves_a_standby_ready_once_the_primary_is_cleared(runner, probe,
                                                                                  diagnosed):
    """Its own latched fault had been told, and kept it from taking over, until it was cleared too;
    without a healthy primary it stays latched."""
    loop = closed_loop(runner, probe, **PATIENT)
    loop.go(20.0)
    runner.start('controller', name='standby', parameters={
        **loop.controller, 'standby': True, 'takeover_time': PATIENT['state_timeout']})
    loop.until(lambda: state(diagnosed, 'standby') == 'enabled', 'the standby')
    loop.target = None
    loop.until(lambda: {state(diagnosed, name) for name in diagnosed} == {'fault'},
               'both to miss the stack')
    loop.target = 20.0
    loop.during(1.0)
    assert {state(diagnosed, name) for name in diagnosed} == {'fault'}
    loop.until(lambda: loop.clear().success, 'the fault to be cleared')
    loop.until(lambda: state(diagnosed, 'standby') == 'enabled'
               and state(diagnosed, 'controller') != 'fault', 'both to be well')
    runner.stop()


def test_a_standby_without_a_primary_tells_that_it_is_not_ready(runner, probe, diagnosed):
    for name, drive in plant():
        runner.start(name, parameters=drive)
    runner.start('controller', name='standby', parameters={
        'standby': True, 'state_timeout': PATIENT['state_timeout']})
    runner.wait_until(
        lambda: diagnosed.get('standby', {}).get('standby_not_ready') == '1', 'its word',
        pause=probe.spin)
    torques = probe.listen(EFFORT_COMMAND)
    runner.wait_until(lambda: len(torques) > 20, 'the standby to speak', pause=probe.spin)
    runner.wait_until(lambda: diagnosed['standby']['standby_not_ready'] == '0',
                      'nothing to be ready for any more', pause=probe.spin)
    runner.stop()


@pytest.fixture
def stepped(domain):
    """A standby whose primary the test plays; without gains, to which the test's samples, which
    come seldom, would close no loop."""
    with Stepped(domain, with_primary=True, standby=True, p=0.0, i=0.0, d=0.0) as made:
        yield made


def test_who_has_taken_over_goes_on_whoever_the_graph_still_shows(stepped):
    """The look at the graph may come between its first torque and the next sample: it had then
    been silent for a second, because it did not know who the dead primary was."""
    standby = stepped.controller

    def took_over():
        stepped.sample()
        return not standby._controller.silent

    stepped.until(lambda: standby.count_publishers(EFFORT_COMMAND.name) == 2)
    stepped.sample()
    stepped.spin(0.6)   # a controller listens for half a second before it may speak
    for _ in range(5):   # the primary speaks
        stepped.sample()
        standby._on_torque_of_another(Float64(data=0.1), b'primary')
        stepped.spin()
    stepped.until(took_over)
    standby._look_for_others()
    stepped.until(lambda: stepped.heard)
    stepped.heard.clear()
    for _ in range(10):
        stepped.sample()
    stepped.spin(0.1)
    assert len(stepped.heard) == 10
    assert all(message.data == pytest.approx(0.1, abs=0.05) for message in stepped.heard)


def test_a_standby_is_ready_once_it_hears_the_primary_and_reaches_the_drive(stepped):
    standby = stepped.controller

    def ready():
        standby._look_for_others()
        return not standby._controller.supervisor.holds(Cause.STANDBY_NOT_READY)

    stepped.sample()
    assert not ready()
    standby._on_torque_of_another(Float64(data=0.1), b'primary')
    stepped.until(ready)   # the other node publishes joint states and listens to torque
