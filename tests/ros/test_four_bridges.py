# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Four bridges as the launch file starts them, on one real bus: each wheel has its own drive."""

from contextlib import ExitStack

from engb_ros.files import config_file
from engb_ros.interface import DIAGNOSTICS, EFFORT_COMMAND, JOINT_STATES
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import node_command
from ros.launched import launched

WHEELS = ('front_left', 'front_right', 'rear_left', 'rear_right')


def bridges(bus, **arguments):
    """Return the four bridges' commands."""
    nodes = launched('four_wheels.launch.xml', plant='false', can='true',
                     can_interface=bus['interface'], can_channel=bus['channel'], **arguments)
    return {name: command for name, command in nodes.items() if name.endswith('/can_bridge')}


def test_each_wheel_of_the_launch_has_its_drive_its_joint_and_its_hardware(runner, domain, bus):
    with ExitStack() as stack:
        probes = {wheel: stack.enter_context(Probe(domain, f'/{wheel}')) for wheel in WHEELS}
        states = {wheel: probe.listen(JOINT_STATES) for wheel, probe in probes.items()}
        told = probes['front_left'].listen(DIAGNOSTICS)
        for wheel in WHEELS:
            runner.start_command(f'{wheel}_drive', node_command(
                'drive_emulator', namespace=f'/{wheel}', parameters={**bus, 'rate': 50.0},
                parameter_file=config_file('four_drives_can.yaml')))
        for name, command in bridges(bus).items():
            runner.start_command(name.replace('/', '_'), command)

        def spin():
            for probe in probes.values():
                probe.spin(0.005)

        runner.wait_until(lambda: all(len(states[wheel]) > 10 for wheel in WHEELS),
                          'the four drives', timeout=90.0, pause=spin)
        for wheel in WHEELS:
            assert {message.name[0] for message in states[wheel]} == {f'{wheel}_motor'}
        runner.wait_until(lambda: {(entry.name, entry.hardware_id) for message in told
                                   for entry in message.status} >= {
            (f'{wheel}: can_bridge', f'brake_{wheel}') for wheel in WHEELS},
            'their diagnostics', pause=spin)

        def applied():   # free of any load, one wheel's torque turns that wheel alone
            probes['rear_left'].publish(EFFORT_COMMAND, 0.05)
            spin()
            return states['rear_left'][-1].position[0] > 1.0

        runner.wait_until(applied, 'the rear left brake')
        for wheel in set(WHEELS) - {'rear_left'}:
            assert abs(states[wheel][-1].position[0]) < 0.1
        runner.stop()


def test_a_bus_file_of_ones_own_reaches_the_bridges(runner, bus, tmp_path):
    mine = tmp_path / 'mine.dbc'
    mine.write_text(config_file('engb_four_drives.dbc').read_text().replace(
        'FRONT_LEFT', 'LEFT_FRONT'))
    command = bridges(bus, can_dbc=str(mine))['/front_left/can_bridge']
    process = runner.start_command('bridge', command)
    assert process.wait(60.0) == 2
    assert str(mine) in process.output
    assert 'FRONT_LEFT_COMMAND' in process.output
