"""Real nodes as real processes over real DDS, each test in a ROS domain of its own."""

import os

import pytest

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'

rclpy = pytest.importorskip('rclpy')

from engb_ros.probe import Probe  # noqa: E402
from engb_ros.runner import reserved_domain, Runner  # noqa: E402


@pytest.fixture
def domain():
    """A ROS_DOMAIN_ID that nobody else on this machine uses."""
    with reserved_domain() as number:
        yield number


@pytest.fixture
def runner(domain):
    """Starts nodes; whatever still runs at the end is killed."""
    with Runner(domain) as made:
        yield made


@pytest.fixture
def probe(domain):
    """A node of the test's own in the same domain and namespace /engb."""
    with Probe(domain) as made:
        yield made
