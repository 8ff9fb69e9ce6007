# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Four brakes at once: one namespace and one parameter file each, and none hears another's."""

from contextlib import ExitStack
import time

from engb_ros.files import config_file
from engb_ros.interface import DIAGNOSTICS, JOINT_STATES, POSITION_COMMAND
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import RunnerError

TARGETS = {'front_left': 6.0, 'front_right': 9.0, 'rear_left': 12.0, 'rear_right': 15.0}


def test_four_loops_at_once(runner, domain):
    with ExitStack() as stack:
        probes, states = {}, {}
        for wheel in TARGETS:
            probes[wheel] = stack.enter_context(Probe(domain, f'/{wheel}'))
            states[wheel] = probes[wheel].listen(JOINT_STATES)
            for node, slow in (('plant', {'rate': 100.0}),
                               ('controller', {'state_timeout': 2.0, 'command_timeout': 5.0})):
                runner.start_command(f'{wheel}_{node}', _command(node, wheel, slow))
        told = probes['front_left'].listen(DIAGNOSTICS)
        last = 0.0

        def arrived():
            nonlocal last
            if time.monotonic() - last > 0.1:
                last = time.monotonic()
                for wheel, target in TARGETS.items():
                    if probes[wheel].subscribers(POSITION_COMMAND):
                        probes[wheel].publish(POSITION_COMMAND, target)
            for probe in probes.values():
                probe.spin(0.005)
            return all(states[wheel] and abs(states[wheel][-1].position[0] - target) < 0.3
                       for wheel, target in TARGETS.items())

        try:
            runner.wait_until(arrived, 'all four brakes', timeout=90.0)
        except RunnerError as error:
            words = {wheel: (entry[-1].position[0] if entry else 'no joint states')
                     for wheel, entry in states.items()}
            faults = {entry.name: entry.message for message in told for entry in message.status}
            raise type(error)(f'{error}: {words}, {faults}') from None
        for wheel in TARGETS:   # each with names of its own
            assert states[wheel][-1].name == [f'{wheel}_motor']
        runner.wait_until(lambda: {(entry.name, entry.hardware_id) for message in told
                                   for entry in message.status} >= {
            (f'{wheel}: controller', f'brake_{wheel}') for wheel in TARGETS},
            'their diagnostics', pause=lambda: probes['front_left'].spin(0.05))
        runner.stop()


def _command(node, wheel, parameters):
    from engb_ros.processes.runner import node_command
    command = node_command(node, namespace=f'/{wheel}', parameters=parameters,
                           parameter_file=config_file(f'{wheel}.yaml'))
    return [*command, '--params-file', str(config_file('vehicle.yaml'))]
