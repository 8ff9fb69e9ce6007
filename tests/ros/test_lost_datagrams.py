# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Datagrams of drive and controller are lost, below the middleware: the brake stays in hand."""

import pytest

from benchmarks.lossy import compiler, listen_to_what_comes, LossyWire
from engb_core.control.causes import Cause
from engb_ros.processes.runner import Runner
from ros.loops import closed_loop, plant

pytestmark = pytest.mark.skipif(compiler() is None, reason='no C compiler')


@pytest.fixture
def wire(tmp_path):
    """Loses datagrams of what is started in its environment."""
    return LossyWire(tmp_path)


@pytest.fixture
def runner(domain, wire):
    """Starts nodes whose datagrams may be lost."""
    with Runner(domain, environment=wire.environment) as made:
        yield made


@pytest.fixture
def loop(runner, probe):
    """A loop at 250 Hz, seen as a drive or a controller sees it: what is lost stays lost."""
    made = closed_loop(runner, probe, plant(rate=250.0))
    made.states = listen_to_what_comes(probe)
    made.until(lambda: made.states, 'joint states')
    return made


def test_a_fifth_of_all_datagrams_lost(loop, wire):
    def steps():
        begin, told = len(loop.states), len(loop.state)
        wire.lose(0.2)
        for angle in (20.0, 10.0, 20.0, 10.0):
            loop.target = angle
            loop.during(0.8)
        wire.lose(0.0)
        angles = [message.position[0] for message in loop.states[begin:]]
        assert 0.6 < len(angles) / (4 * 0.8 * 250.0) < 0.9 or loop.was_late()
        return (min(angles) > 9.0 and max(angles) < 21.0 and abs(angles[-1] - 10.0) < 0.5
                and not any(message.data == 'fault' for message in loop.state[told:]))

    assert any(loop.undisturbed(steps) for _ in range(3)), loop.words()


def test_all_datagrams_lost_for_a_while(loop, wire):
    loop.go(20.0)
    assert loop.effort > 0.02
    wire.lose(1.0)
    loop.during(0.5)
    wire.lose(0.0)
    loop.until(lambda: loop.is_in('fault') and loop.has(Cause.STATE_STALE), 'the fault')
    loop.until(lambda: loop.effort == 0.0, 'the torque to be gone')
    loop.healthy()
    loop.go(10.0)
