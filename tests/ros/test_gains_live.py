# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Gains changed on a running controller: no request leaves a loop that follows nothing."""

from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter

from engb_ros.interface import Service
from ros.loops import closed_loop

# What lies within the deadband is not integrated: without p nothing answers an error then.
DEAF = {'p': 0.0, 'error_deadband': 1000.0, 'load_feedforward': False,
        'friction_feedforward': False}
SHIPPED = {'p': 0.4, 'error_deadband': 0.0, 'load_feedforward': True,
           'friction_feedforward': True}


def asked(loop, values, kind=SetParameters):
    """Ask for parameters in one request; return what was refused, and why."""
    name = 'set_parameters' + ('_atomically' if kind is SetParametersAtomically else '')
    answer = loop.probe.call(
        'controller', Service(f'~/{name}', f'rcl_interfaces/srv/{kind.__name__}', ''),
        request=kind.Request(parameters=[Parameter(key, value=value).to_parameter_msg()
                                         for key, value in values.items()]))
    results = [answer.result] if kind is SetParametersAtomically else answer.results
    return [result.reason for result in results if not result.successful]


def test_no_request_leaves_a_loop_that_follows_nothing(runner, probe):
    loop = closed_loop(runner, probe)
    loop.go(20.0)
    for values in (DEAF, dict(reversed(DEAF.items())), {'p': 0.0}):
        for kind in (SetParameters, SetParametersAtomically):
            told = asked(loop, values, kind)
            assert len(told) == 1, (values, told)
            assert 'would not hold the brake: an error of 2 rad would bring' in told[0]
            loop.go(12.0)
            loop.go(20.0)
            assert asked(loop, SHIPPED) == []
    runner.stop()
