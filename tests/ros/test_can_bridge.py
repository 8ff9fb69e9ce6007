"""The loop over a real bus (UDP multicast): controller, bridge and drive as processes."""

from engb_core.control.causes import Cause
from engb_ros.interface import DIAGNOSTICS
from ros.loops import can_drive, closed_loop


def test_the_loop_over_can_and_every_fault_of_the_bus(runner, probe, bus):
    diagnostics = probe.listen(DIAGNOSTICS)
    loop = closed_loop(runner, probe, can_drive(bus))
    loop.go(15.0)

    def act(fault):
        loop.set_parameter('drive_emulator', 'fault', fault)

    def bridge():
        for message in reversed(diagnostics):
            if message.status[0].name.endswith('can_bridge'):
                return {entry.key: entry.value for entry in message.status[0].values}
        return {'link': '', 'samples_withheld': '0'}

    def count(name):
        return int(bridge().get(f'frames_{name}', 0))

    # Lost and corrupted now and then: the loop goes on with what is sound.
    act('lost')
    loop.until(lambda: count('some_lost') > 20, 'lost frames to be counted')
    loop.until(lambda: bridge()['link'] == 'valid', 'a valid link all the same')
    act('none')
    loop.go(10.0)
    act('corrupted')
    loop.until(lambda: count('wrong_crc') > 20, 'corrupted frames to be counted')
    act('none')
    loop.until(lambda: loop.clear().success, 'a clear state')
    loop.go(12.0)

    # Repeated, silent, late, faulty sensor: no sample is believed, the torque goes.
    for fault, named in (('repeated', 'repeated'), ('bus_off', 'timeouts'),
                         ('late', 'timeouts'), ('sensor_fault', None)):
        before = count(named) if named else int(bridge()['samples_withheld'])
        act(fault)
        if fault != 'late':
            loop.until(lambda: loop.is_in('fault') and loop.has(Cause.STATE_STALE), fault)
            loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone')
        if named:
            loop.until(lambda named=named, before=before: count(named) > before,
                       f'{fault} to be counted')
        else:
            loop.until(lambda before=before: int(bridge()['samples_withheld']) > before,
                       'samples to be withheld')
        act('none')
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
