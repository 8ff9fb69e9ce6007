# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The codec bit by bit: what it writes where, what it cuts, and which files it refuses."""

import math

import pytest

from engb_core.errors import InputError

pytest.importorskip('cantools')

from engb_ros.can.codec import (  # noqa: E402
    dbc_file,
    DRIVE_DBC,
    DriveCodec,
    DriveCommand,
    DriveStatus,
    OFF,
    TORQUE,
)
from engb_ros.can.end_to_end import crc_start  # noqa: E402
from engb_ros.files import config_file  # noqa: E402

CODEC = DriveCodec()
TEXT = DRIVE_DBC.read_text()


def signed(data):
    return int.from_bytes(data, 'little', signed=True)


def changed(tmp_path, *changes):
    """Return the codec of the package's file with some texts replaced."""
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / 'bus.dbc'
    path.write_text(text)
    return DriveCodec(path)


def test_the_modes_of_the_file_are_the_codes():
    assert (OFF, TORQUE) == (0, 1)
    assert CODEC.mode_names[OFF] == 'off'
    assert CODEC.mode_names[TORQUE] == 'torque'
    assert DriveCommand() == DriveCommand(0.0, OFF)
    assert DriveStatus(1.0, 2.0, 3.0) == DriveStatus(1.0, 2.0, 3.0, TORQUE, (), 0.0, 20.0)


def test_what_is_said_is_not_changed_afterwards():
    for said in (DriveCommand(), DriveStatus(1.0, 2.0, 3.0)):
        with pytest.raises(AttributeError):
            said.mode = 3


def test_modes_without_names(tmp_path):
    import re
    text = re.sub(r'^VAL_ .*$', '', TEXT, flags=re.MULTILINE)
    path = tmp_path / 'bus.dbc'
    path.write_text(text)
    assert DriveCodec(path).mode_names == {}


@pytest.mark.parametrize('mode', [0, 1, 15])
def test_the_command_frame(mode):
    data = CODEC.encode_command(DriveCommand(-1.25, mode))
    assert len(data) == 8
    assert data[0] == 0
    assert data[1] == mode << 4           # low nibble: the counter, which is not the codec's
    assert signed(data[2:4]) == -12500
    assert bytes(data[4:]) == bytes(4)
    assert CODEC.decode_command(bytes(data)) == DriveCommand(-1.25, mode)


def test_the_status_frames():
    status = DriveStatus(-123.4567, 10.5, -2.5, 3, ('OVER_CURRENT', 'SENSOR_FAULT'), 30.25, 85.5)
    first, second = CODEC.encode_status(status)
    assert (first[0], first[1], second[0], second[1]) == (0, 3 << 4, 0, 0b1010 << 4)
    assert (signed(first[2:6]), signed(first[6:8])) == (-1234567, 525)
    assert [signed(second[place:place + 2]) for place in (2, 4, 6)] == [-1250, 3025, 855]
    found = CODEC.decode_status(bytes(first), bytes(second))
    for name in ('angle', 'speed', 'current', 'disc_speed', 'temperature'):
        assert getattr(found, name) == pytest.approx(getattr(status, name)), name
        assert isinstance(getattr(found, name), float)
    assert (found.mode, found.flags) == (3, status.flags)
    assert isinstance(found.mode, int)


@pytest.mark.parametrize('flag', ['COMMAND_LOST', 'OVER_CURRENT', 'OVER_TEMPERATURE',
                                  'SENSOR_FAULT'])
def test_each_flag_alone(flag):
    _, second = frames = CODEC.encode_status(DriveStatus(0.0, 0.0, 0.0, flags=(flag,)))
    assert bin(second[1]).count('1') == 1
    assert CODEC.decode_status(*frames).flags == (flag,)


@pytest.mark.parametrize(('torque', 'raw'), [
    (1e9, 32767), (-1e9, -32768), (3.2767, 32767), (-3.2768, -32768)])
def test_what_a_frame_cannot_carry_is_cut(torque, raw):
    assert signed(CODEC.encode_command(DriveCommand(torque, 1))[2:4]) == raw
    assert CODEC.largest_torque == pytest.approx(3.2767)


def test_the_largest_torque_is_the_smaller_of_both_directions(tmp_path):
    assert changed(tmp_path, ('[-3.2768|3.2767]', '[-2.5|3.0]')).largest_torque == 2.5
    assert changed(tmp_path, ('[-3.2768|3.2767]', '[-3.0|2.25]')).largest_torque == 2.25


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('name', ['angle', 'speed', 'current', 'disc_speed', 'temperature'])
def test_what_is_not_finite_is_never_encoded(name, value):
    values = {'angle': 0.0, 'speed': 0.0, 'current': 0.0, name: value}
    with pytest.raises(ValueError, match=name.upper()):
        CODEC.encode_status(DriveStatus(**values))
    with pytest.raises(ValueError, match='DRIVE_COMMAND.TORQUE is'):
        CODEC.encode_command(DriveCommand(value, 1))


@pytest.mark.parametrize(('line', 'low', 'high'), [
    ('16|16@1- (0.0001,0) [0|0]', -3.2768, 3.2767),
    ('16|16@1- (0.01,5) [0|0]', -322.68, 332.67),
    ('16|16@1+ (0.5,-3) [0|0]', -3.0, 32764.5),
    ('16|12@1- (1,0) [0|0]', -2048, 2047),
    ('16|12@1+ (1,0) [0|0]', 0, 4095)])
def test_without_a_range_the_bits_are_the_range(tmp_path, line, low, high):
    codec = changed(tmp_path, ('16|16@1- (0.0001,0) [-3.2768|3.2767]', line))
    for wish, end in ((1e12, high), (-1e12, low)):
        assert codec.decode_command(bytes(codec.encode_command(DriveCommand(wish, 1)))).torque \
            == pytest.approx(end)


def test_the_data_ids_are_the_files():
    assert [CODEC.data_id(frame) for frame in (CODEC.command, CODEC.status_1, CODEC.status_2)] \
        == [17665, 17921, 17922]


def test_a_file_without_data_ids_is_refused(tmp_path):
    lines = [line for line in TEXT.splitlines() if 'E2eDataId' not in line]
    path = tmp_path / 'bus.dbc'
    path.write_text('\n'.join(lines))
    with pytest.raises(InputError, match='DRIVE_COMMAND of the DBC file has no attribute E2eDa'):
        DriveCodec(path)
    path.write_text('\n'.join(line for line in lines if not line.startswith('BA_')))
    with pytest.raises(InputError, match='no attribute E2eDataId'):
        DriveCodec(path)


OTHER = '''BO_ {identifier} OTHER: 8 DRIVE
 SG_ CRC : 0|8@1+ (1,0) [0|255] "" BRAKE_CONTROLLER

CM_ BO_ 129'''


def beside(tmp_path, identifier, data_id):
    """Return the codec of a file that holds one more frame."""
    attribute = '' if data_id is None else f'BA_ "E2eDataId" BO_ {identifier} {data_id};\n'
    return changed(tmp_path, ('CM_ BO_ 129', OTHER.format(identifier=identifier)),
                   ('BA_ "GenMsgCycleTime" BO_ 129', f'{attribute}BA_ "GenMsgCycleTime" BO_ 129'))


def test_frames_without_protection_may_share_the_bus(tmp_path):
    assert beside(tmp_path, 600, None).command.frame_id == 129
    assert beside(tmp_path, 600, 300).command.frame_id == 129


@pytest.mark.parametrize('mine', [17665, 17921, 17922])
def test_frames_that_could_pass_for_ones_own_are_refused(tmp_path, mine):
    with pytest.raises(InputError, match='have the same E2eDataId; each needs its own'):
        beside(tmp_path, 600, mine)
    twin = next(number for number in range(20000, 65536) if crc_start(number) == crc_start(mine))
    with pytest.raises(InputError, match=f'the CRC cannot tell .*{mine} and {twin}'):
        beside(tmp_path, 600, twin)


def test_ones_own_frames_need_identifiers_of_their_own():
    import copy
    codec = copy.copy(CODEC)
    twin = copy.copy(CODEC.status_2)
    twin._frame_id = CODEC.command.frame_id
    with pytest.raises(InputError, match='file: DRIVE_COMMAND and DRIVE_STATUS_2 have the same '
                                         'identifier'):
        codec._check_against_others('file', (CODEC.command, CODEC.status_1, twin), [])


def test_identifiers_are_compared_by_their_numbers():
    import copy
    codec, command, twin = copy.copy(CODEC), copy.copy(CODEC.command), copy.copy(CODEC.status_2)
    command._frame_id, twin._frame_id = int('1000'), int('1000')
    with pytest.raises(InputError, match='have the same identifier'):
        codec._check_against_others('file', (command, CODEC.status_1, twin), [])


def test_flags_that_the_file_names_are_flags_all_the_same(tmp_path):
    codec = changed(tmp_path, ('VAL_ 257 MODE', 'VAL_ 258 OVER_CURRENT 0 "NO" 1 "YES" ;\n'
                                                'VAL_ 257 MODE'))
    for flags in ((), ('OVER_CURRENT',)):
        frames = codec.encode_status(DriveStatus(0.0, 0.0, 0.0, flags=flags))
        assert codec.decode_status(*frames).flags == flags


def test_without_cantools_it_says_what_to_install(monkeypatch):
    import sys
    monkeypatch.setitem(sys.modules, 'cantools', None)
    with pytest.raises(InputError, match='cantools is not installed'):
        DriveCodec()


def test_the_drives_that_are_there_are_told(tmp_path):
    path = tmp_path / 'bus.dbc'
    path.write_text(TEXT)
    with pytest.raises(InputError, match="holds no frame 'REAR_COMMAND'; a drive called REAR needs"
                       r' REAR_COMMAND, REAR_STATUS_1 and REAR_STATUS_2 \(drives there: DRIVE\)$'):
        DriveCodec(path, 'REAR')
    path.write_text('VERSION ""\nBU_: A\n')
    with pytest.raises(InputError, match='and DRIVE_STATUS_2$'):
        DriveCodec(path)


@pytest.mark.parametrize(('text', 'told'), [
    ('BO_ what', 'not a valid DBC file'), ('', 'not a valid DBC file'),
    (None, r'cannot be read \(No such file'),
    (TEXT.replace('8|4@1+', '4|4@1+'), 'not a valid DBC file')])     # it overlaps the CRC
def test_a_file_that_is_none_is_refused(tmp_path, text, told):
    path = tmp_path / 'bus.dbc'
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=told):
        DriveCodec(path)


def test_a_bare_name_is_the_packages_own_file_unless_one_lies_here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert dbc_file('') == DRIVE_DBC
    assert dbc_file('engb_four_drives.dbc') == config_file('engb_four_drives.dbc')
    assert str(dbc_file('mine.dbc')) == 'mine.dbc'
    assert str(dbc_file('folder/engb_four_drives.dbc')) == 'folder/engb_four_drives.dbc'
    # A bare name is one by its letters; a path to the package's own folder is none.
    for name in [b'engb_four_drives.dbc'.decode() for _ in range(2)]:
        assert dbc_file(name) == config_file('engb_four_drives.dbc')
    assert str(dbc_file('../config/engb_drive.dbc')) == '../config/engb_drive.dbc'
    (tmp_path / 'engb_four_drives.dbc').write_text('')
    assert str(dbc_file('engb_four_drives.dbc')) == 'engb_four_drives.dbc'
