# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Four drives on one bus: no wheel takes another's frames for its own."""

import itertools
import os
import threading
import time

import pytest
import yaml

can = pytest.importorskip('can')
pytest.importorskip('cantools')
pytest.importorskip('msgpack')

from engb_core.errors import InputError  # noqa: E402
from engb_ros.can.bus import CanBus  # noqa: E402
from engb_ros.can.codec import (  # noqa: E402
    dbc_file,
    DRIVE_DBC,
    DriveCodec,
    DriveCommand,
    DriveStatus,
    TORQUE,
)
from engb_ros.can.end_to_end import LinkState  # noqa: E402
from engb_ros.can.link import ControllerEnd, DriveEnd  # noqa: E402
from engb_ros.files import config_file  # noqa: E402

WHEELS = ('FRONT_LEFT', 'FRONT_RIGHT', 'REAR_LEFT', 'REAR_RIGHT')
FOUR = dbc_file('engb_four_drives.dbc')

# A frame of 8 bytes with 11 bits of identifier: 111 bits, and a stuff bit after each fourth of the
# 98 that are stuffed at worst (Davis et al. 2007, Controller Area Network schedulability).
BITS_PER_FRAME = 135
BIT_RATE = 1_000_000


def test_the_wheels_frames_are_the_single_drives():
    one = DriveCodec(DRIVE_DBC)
    for wheel in WHEELS:
        codec = DriveCodec(FOUR, wheel)
        for mine, single in ((codec.command, one.command), (codec.status_1, one.status_1),
                             (codec.status_2, one.status_2)):
            assert mine.name == single.name.replace('DRIVE', wheel)
            assert [(signal.name, signal.start, signal.length, signal.scale, signal.choices)
                    for signal in mine.signals] == [
                (signal.name, signal.start, signal.length, signal.scale, signal.choices)
                for signal in single.signals]


@pytest.mark.parametrize(('path', 'wheels'), [(DRIVE_DBC, ('DRIVE',)), (FOUR, WHEELS)])
def test_a_classical_bus_carries_the_cycle_times_of_the_file(path, wheels):
    frames = [frame for codec in (DriveCodec(path, wheel) for wheel in wheels)
              for frame in (codec.command, codec.status_1, codec.status_2)]
    load = sum(BITS_PER_FRAME * 1000 / frame.dbc.attributes['GenMsgCycleTime'].value
               for frame in frames) / BIT_RATE
    assert load < 0.5


def test_a_wheel_whose_frames_could_pass_for_anothers_is_refused(tmp_path):
    text = FOUR.read_text()
    path = tmp_path / 'bus.dbc'
    from engb_ros.can.end_to_end import crc_start
    twin = next(number for number in range(18000, 65536)
                if crc_start(number) == crc_start(17665))
    for number, told in ((17666, 'same E2eDataId'), (twin, 'CRC cannot tell')):
        path.write_text(text.replace('"E2eDataId" BO_ 131 17667', f'"E2eDataId" BO_ 131 {number}'))
        with pytest.raises(InputError, match=told):
            DriveCodec(path, 'REAR_LEFT')


def test_four_drives_over_a_real_bus():
    options = {'interface': 'udp_multicast',
               'channel': f'239.76.0.2:{20_000 + os.getpid() % 12_000}'}
    lock = threading.Lock()
    drives, ends, samples, obeyed = {}, {}, {}, {}

    def drive_hears(wheel):
        def hear(identifier, data, now, _waited):
            with lock:
                command = drives[wheel].receive(identifier, data, now)
                if command is not None:
                    obeyed.setdefault(wheel, set()).add(round(command.torque, 4))
        return hear

    def controller_hears(wheel):
        def hear(identifier, data, now, _waited):
            with lock:
                status = ends[wheel].receive(identifier, data, now)
                if status is not None:
                    samples.setdefault(wheel, set()).add(status.angle)
        return hear

    buses = []
    try:
        for wheel in WHEELS:
            codec = DriveCodec(FOUR, wheel)
            drives[wheel], ends[wheel] = DriveEnd(codec, 1.0), ControllerEnd(codec, 1.0)
            buses.append((
                wheel,
                CanBus(**_named(options), receive=drive_hears(wheel),
                       identifiers={codec.command.frame_id}),
                CanBus(**_named(options), receive=controller_hears(wheel),
                       identifiers={codec.status_1.frame_id, codec.status_2.frame_id})))
        end = time.monotonic() + 20.0
        while time.monotonic() < end and not (len(samples) == len(obeyed) == 4):
            for number, (wheel, of_drive, of_controller) in enumerate(buses):
                with lock:
                    frames = drives[wheel].status(DriveStatus(10.0 + number, 0.0, 0.0))
                    command = ends[wheel].command(DriveCommand(0.1 * (number + 1), TORQUE))
                for frame in frames:
                    of_drive.send(*frame)
                of_controller.send(*command)
            time.sleep(0.004)
    except InputError as error:
        pytest.skip(f'no UDP multicast on this machine: {error}')
    finally:
        for bus in itertools.chain.from_iterable(pair[1:] for pair in buses):
            bus.close()
    if not samples and not obeyed:
        pytest.skip('no UDP multicast on this machine')
    for number, wheel in enumerate(WHEELS):
        assert samples[wheel] == {10.0 + number}
        assert obeyed[wheel] == {round(0.1 * (number + 1), 4)}
        assert ends[wheel].state is LinkState.VALID
        assert ends[wheel].counts()['wrong_crc'] == 0


def test_the_parameter_file_names_each_wheels_frames_joint_and_hardware():
    entries = yaml.safe_load(config_file('four_drives_can.yaml').read_text(encoding='utf-8'))
    bridges = {name: entry['ros__parameters'] for name, entry in entries.items()
               if name.endswith('/can_bridge')}
    assert len(bridges) == len(WHEELS)
    for name, values in bridges.items():
        wheel = name.split('/')[1]
        emulator = entries[f'/{wheel}/drive_emulator']['ros__parameters']
        DriveCodec(dbc_file(values['dbc']), values['drive'])
        assert (values['drive'], values['hardware_id']) == (wheel.upper(), f'{wheel}_drive')
        assert {key: emulator[key] for key in ('dbc', 'drive', 'joint')} == {
            key: values[key] for key in ('dbc', 'drive', 'joint')}


def _named(options):
    return {**options, 'bitrate': 0}
