# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Real nodes as real processes over real DDS, each test in a ROS domain of its own."""

import gc
import os

import pytest

os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'

rclpy = pytest.importorskip('rclpy')

from engb_ros.nodes.transport import stay_on_this_computer  # noqa: E402
from engb_ros.processes.probe import Probe  # noqa: E402
from engb_ros.processes.runner import reserved_domain, Runner  # noqa: E402
from ros.forked import NodeServer  # noqa: E402

stay_on_this_computer(os.environ)


@pytest.fixture(scope='session')
def _frozen():
    """What pytest has imported need not be walked again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _no_collection(_frozen):
    """No test waits for the garbage collector in its midst: it takes a tenth of a second and more,
    in which nobody sends commands; watchdogs wait no longer than two."""
    gc.disable()
    yield
    gc.enable()
    gc.collect()


@pytest.fixture
def domain():
    """A ROS_DOMAIN_ID that nobody else on this machine uses."""
    with reserved_domain() as number:
        yield number


@pytest.fixture(scope='session')
def spawn():
    """Starts processes; nodes of this package without importing ROS each time."""
    with NodeServer() as server:
        yield server.spawn


@pytest.fixture
def runner(domain, spawn):
    """Starts nodes; whatever still runs at the end is killed. A test that fails shows what those
    printed which it has not stopped itself."""
    with Runner(domain, spawn=spawn) as made:
        yield made
        for process in made.processes.values():
            print(f'{process.name} (status {process.status}) printed: {process.output[-2000:]}')


@pytest.fixture
def runner_of_commands(domain):
    """Starts nodes as their commands do, imports and all."""
    with Runner(domain) as made:
        yield made


@pytest.fixture
def probe(domain):
    """A node of the test's own in the same domain and namespace /engb."""
    with Probe(domain) as made:
        yield made


@pytest.fixture
def bus():
    """Parameters of a bus of the test's own; skipped where the machine has no multicast."""
    can = pytest.importorskip('can')
    pytest.importorskip('msgpack')
    # A port for each process: groups with one port hear each other on one machine.
    group, port = '239.74.0.1', 20_000 + os.getpid() % 12_000
    options = {'interface': 'udp_multicast', 'channel': group, 'port': port}
    try:
        with can.Bus(**options) as one, can.Bus(**options) as two:
            one.send(can.Message(arbitration_id=1, data=b'?', is_extended_id=False))
            if two.recv(2.0) is None:
                pytest.skip('no UDP multicast on this machine')
    except OSError as error:
        pytest.skip(f'no UDP multicast on this machine: {error}')
    return {'interface': 'udp_multicast', 'channel': f'{group}:{port}'}
