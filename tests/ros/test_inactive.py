# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A controller that is not active says so, also to who joins later."""

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import pytest

from engb_core.control.causes import Cause
from engb_ros.interface import CONTROLLER_CAUSES, CONTROLLER_STATE, Service
from engb_ros.processes.probe import Probe
from ros.loops import closed_loop, PATIENT


def transition(probe, node, number):
    """Ask a node for a transition."""
    request = ChangeState.Request(transition=Transition(id=number))
    service = Service('~/change_state', 'lifecycle_msgs/srv/ChangeState', '')
    assert probe.call(node, service, request=request).success, number


def heard_by_a_latecomer(runner, domain):
    """Return the states and causes that are there for who joins now."""
    with Probe(domain) as late:
        states, causes = late.listen(CONTROLLER_STATE), late.listen(CONTROLLER_CAUSES)
        runner.wait_until(lambda: states and causes, 'the latched words', pause=late.spin)
        return states[-1].data, causes[-1].data


def test_who_joins_later_hears_that_the_controller_is_inactive(runner, probe, domain):
    """It had heard `enabled`, of a controller that gave no torque."""
    loop = closed_loop(runner, probe)
    loop.go(10.0)
    transition(probe, 'controller', Transition.TRANSITION_DEACTIVATE)
    assert heard_by_a_latecomer(runner, domain) == ('inactive', 0)
    loop.until(lambda: loop.is_in('inactive') and loop.causes[-1].data == 0, 'its last word')
    loop.target = None
    transition(probe, 'controller', Transition.TRANSITION_ACTIVATE)
    loop.until(lambda: loop.is_in('ready'), 'its first word')
    assert heard_by_a_latecomer(runner, domain)[0] == 'ready'
    runner.stop()


@pytest.mark.parametrize('number', [Transition.TRANSITION_ACTIVE_SHUTDOWN, None])
def test_who_listens_hears_it_before_the_publisher_goes(runner, probe, number):
    loop = closed_loop(runner, probe)
    loop.go(10.0)
    if number is None:
        runner.stop(['controller'])
    else:
        transition(probe, 'controller', number)
    loop.until(lambda: loop.is_in('inactive') and loop.causes[-1].data == 0, 'its last word')
    runner.stop()


def test_a_standby_that_is_deactivated_leaves_the_primary_the_last_word(runner, probe):
    """Both say their state on one topic."""
    loop = closed_loop(runner, probe, **PATIENT)
    loop.go(10.0)
    runner.start('controller', name='standby', parameters={**PATIENT, 'standby': True})
    loop.until(lambda: loop.has(Cause.OTHER_CONTROLLER), 'the standby')
    begin = len(loop.state)
    transition(probe, 'standby', Transition.TRANSITION_DEACTIVATE)

    def words():
        return [message.data for message in loop.state[begin:]]

    loop.until(lambda: 'inactive' in words(), 'the standby\'s last word')
    loop.until(lambda: words()[-1] in ('enabled', 'degraded'), 'the primary\'s state')
    runner.stop()
