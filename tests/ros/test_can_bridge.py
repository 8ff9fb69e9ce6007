"""The loop over a real bus (UDP multicast): controller, bridge and drive as processes."""

import os

import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from engb_core.control.causes import Cause
from engb_ros.interface import DIAGNOSTICS, Service
from ros.live import LiveLoop

can = pytest.importorskip('can')
pytest.importorskip('msgpack')


@pytest.fixture
def bus():
    """Parameters of a bus of the test's own; skipped where the machine has no multicast."""
    parameters = {'interface': 'udp_multicast',
                  'channel': f'239.74.{os.getpid() % 250}.{os.getpid() // 250 % 250}'}
    try:
        with can.Bus(**parameters) as one, can.Bus(**parameters) as two:
            one.send(can.Message(arbitration_id=1, data=b'?', is_extended_id=False))
            if two.recv(2.0) is None:
                pytest.skip('no UDP multicast on this machine')
    except OSError as error:
        pytest.skip(f'no UDP multicast on this machine: {error}')
    return parameters


def act(probe, fault):
    """Let the drive act out a fault."""
    service = Service('~/set_parameters', 'rcl_interfaces/srv/SetParameters', '')
    request = SetParameters.Request(
        parameters=[Parameter('fault', value=fault).to_parameter_msg()])
    assert probe.call('drive_emulator', service, request=request).results[0].successful


def test_the_loop_over_can_and_every_fault_of_the_bus(runner, probe, bus, record_property):
    diagnostics = probe.listen(DIAGNOSTICS)
    loop = LiveLoop(runner, probe, [('drive_emulator', {'rate': 200.0, **bus}),
                                    ('can_bridge', bus)])
    loop.go(15.0)

    def bridge():
        for message in reversed(diagnostics):
            if message.status[0].name.endswith('can_bridge'):
                return {entry.key: entry.value for entry in message.status[0].values}
        return {'link': '', 'samples_withheld': '0'}

    def count(name):
        return int(bridge().get(f'frames_{name}', 0))

    # Lost and corrupted now and then: the loop goes on with what is sound.
    act(probe, 'lost')
    loop.until(lambda: count('some_lost') > 20, 'lost frames to be counted')
    loop.until(lambda: bridge()['link'] == 'valid', 'a valid link all the same')
    act(probe, 'none')
    loop.go(10.0)
    act(probe, 'corrupted')
    loop.until(lambda: count('wrong_crc') > 20, 'corrupted frames to be counted')
    act(probe, 'none')
    loop.until(lambda: loop.clear().success, 'a clear state')
    loop.go(12.0)

    # Repeated, silent, late, faulty sensor: no sample is believed, the torque goes.
    for fault, named in (('repeated', 'repeated'), ('bus_off', 'timeouts'),
                         ('late', 'timeouts'), ('sensor_fault', None)):
        before = count(named) if named else int(bridge()['samples_withheld'])
        act(probe, fault)
        if fault != 'late':
            record_property(f'{fault}: noticed after [s]', loop.until(
                lambda: loop.is_in('fault') and loop.has(Cause.STATE_STALE), fault))
            loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone')
        if named:
            loop.until(lambda named=named, before=before: count(named) > before,
                       f'{fault} to be counted')
        else:
            loop.until(lambda before=before: int(bridge()['samples_withheld']) > before,
                       'samples to be withheld')
        act(probe, 'none')
        loop.target = None
        loop.until(lambda: bridge()['link'] == 'valid' and loop.clear().success,
                   f'recovery from {fault}')
        loop.go(10.0)
    runner.stop()


def test_a_bus_that_does_not_exist_is_told_in_one_line(runner):
    process = runner.start('can_bridge', parameters={'interface': 'socketcan',
                                                     'channel': 'nowhere0'})
    assert process.wait(60.0) == 2
    assert 'cannot be opened' in process.output
    assert 'Traceback' not in process.output
