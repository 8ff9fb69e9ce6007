# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The DBC file, the codec's limits, and both ends of the link against each other."""

from hypothesis import given, strategies
import pytest

from engb_core.errors import InputError

pytest.importorskip('cantools')

from engb_ros.can.codec import (  # noqa: E402
    DRIVE_DBC,
    DriveCodec,
    DriveCommand,
    DriveStatus,
)
from engb_ros.can.end_to_end import CheckStatus, LinkState  # noqa: E402
from engb_ros.can.link import ControllerEnd, DriveEnd  # noqa: E402

CODEC = DriveCodec()


@given(strategies.floats(-3.2, 3.2), strategies.sampled_from([0, 1]))
def test_a_command_survives_the_bus(torque, mode):
    found = CODEC.decode_command(CODEC.encode_command(DriveCommand(torque, mode)))
    assert found.mode == mode
    assert found.torque == pytest.approx(torque, abs=0.6e-4)


@given(strategies.floats(-1e3, 1e3), strategies.floats(-600.0, 600.0),
       strategies.floats(-60.0, 60.0), strategies.sets(strategies.sampled_from(
           ['COMMAND_LOST', 'OVER_CURRENT', 'OVER_TEMPERATURE', 'SENSOR_FAULT'])))
def test_a_sample_survives_the_bus(angle, speed, current, flags):
    found = CODEC.decode_status(*CODEC.encode_status(
        DriveStatus(angle, speed, current, flags=tuple(flags))))
    assert found.angle == pytest.approx(angle, abs=0.6e-4)
    assert found.speed == pytest.approx(speed, abs=0.011)
    assert found.current == pytest.approx(current, abs=0.0011)
    assert set(found.flags) == flags


@pytest.mark.parametrize('value', [1e9, -1e9])
def test_what_is_too_much_is_cut(value):
    assert abs(CODEC.decode_command(CODEC.encode_command(DriveCommand(value, 1))).torque) \
        == pytest.approx(3.2767, abs=2e-4)


@pytest.mark.parametrize('value', [float('nan'), float('inf')])
def test_what_is_not_finite_is_never_sent(value):
    with pytest.raises(ValueError, match='TORQUE'):
        CODEC.encode_command(DriveCommand(value, 1))


def run(ends, count=5, now=0.0):
    controller, drive = ends
    found = []
    for index in range(count):
        now += 0.001
        for identifier, data in drive.status(DriveStatus(0.1 * index, 1.0, 2.0)):
            sample = controller.receive(identifier, data, now)
        found.append(sample)
        command = drive.receive(*controller.command(DriveCommand(0.1, 1)), now)
    return found, command, now


def test_both_ends_come_to_trust_each_other():
    ends = ControllerEnd(CODEC), DriveEnd(CODEC)
    found, command, _ = run(ends)
    assert found[:2] == [None, None]   # three sound frames make a valid link
    assert found[4].angle == pytest.approx(0.4)
    assert command == DriveCommand(0.1, 1)
    assert ends[0].state is LinkState.VALID


def test_half_a_sample_is_no_sample():
    ends = ControllerEnd(CODEC), DriveEnd(CODEC)
    _, _, now = run(ends)
    controller, drive = ends
    first, _ = drive.status(DriveStatus(1.0, 0.0, 0.0))
    assert controller.receive(*first, now) is None
    _, second = drive.status(DriveStatus(2.0, 0.0, 0.0))
    assert controller.receive(*second, now) is None   # its partner is missing
    assert controller.unpaired == 1
    found, _, _ = run(ends, 2, now)
    assert found[-1] is not None


@given(strategies.integers(0, 0x7FF), strategies.binary(max_size=64))
def test_foreign_and_broken_frames_do_nothing(identifier, data):
    controller, drive = ControllerEnd(CODEC), DriveEnd(CODEC)
    assert controller.receive(identifier, data, 0.0) is None
    assert drive.receive(identifier, data, 0.0) is None


def test_a_frame_of_another_length_is_a_wrong_one_on_either_end():
    """A checksum of its own would be right: what is missing could be taken for zeros."""
    ends = ControllerEnd(CODEC), DriveEnd(CODEC)
    _, _, now = run(ends)
    controller, drive = ends
    identifier, data = controller.command(DriveCommand(0.1, 1))
    for wrong in (data[:-1], data + b'\0', b''):
        assert drive.receive(identifier, wrong, now) is None
    assert drive.receiver.counts[CheckStatus.WRONG_CRC] == 3
    first, second = drive.status(DriveStatus(1.0, 0.0, 0.0))
    assert controller.receive(first[0], first[1] + b'\0', now) is None
    assert controller.receive(*second, now) is None
    assert controller.receivers[0].counts[CheckStatus.WRONG_CRC] == 1


def test_silence_is_seen_on_both_ends():
    ends = ControllerEnd(CODEC), DriveEnd(CODEC)
    _, _, now = run(ends)
    assert ends[0].watch(now + 0.06)
    assert ends[0].state is LinkState.INVALID
    assert ends[1].receiver.watch(now + 0.11)


@pytest.mark.parametrize(('text', 'told'), [
    ('VERSION ""\nBU_: A\n', 'holds no frame'), ('BO_ what', 'not a valid DBC'),
    ('', 'not a valid DBC'), (None, 'cannot be read')])
def test_a_bad_dbc_file_is_refused(tmp_path, text, told):
    path = tmp_path / 'bus.dbc'
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=told):
        DriveCodec(path)


def test_a_command_that_never_went_out_leaves_no_gap():
    controller, drive = ends = ControllerEnd(CODEC), DriveEnd(CODEC)
    _, _, now = run(ends)
    for _ in range(20):   # refused by the bus
        controller.command(DriveCommand(0.1, 1))
        controller.take_back()
    assert drive.receive(*controller.command(DriveCommand(0.2, 1)), now) is not None
    assert drive.receiver.counts[CheckStatus.SOME_LOST] == 0


def test_a_bus_with_several_drives(tmp_path):
    text = DRIVE_DBC.read_text()
    path = tmp_path / 'bus.dbc'
    path.write_text(text.replace('DRIVE_', 'REAR_LEFT_'))
    assert DriveCodec(path, 'REAR_LEFT').command.frame_id == CODEC.command.frame_id
    with pytest.raises(InputError, match='drives there: REAR_LEFT'):
        DriveCodec(path, 'REAR_RIGHT')


@pytest.mark.parametrize(('old', 'new', 'told'), [
    ('BO_ 258 17922', 'BO_ 258 17921', 'same E2eDataId'),
    ('BA_DEF_ BO_ "E2eDataId" INT 0 65535;', '', 'valid DBC|no attribute')])
def test_frames_that_could_be_taken_for_each_other_are_refused(tmp_path, old, new, told):
    text = DRIVE_DBC.read_text()
    assert old in text
    path = tmp_path / 'bus.dbc'
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=told):
        DriveCodec(path)


def sent(controller, torque):
    return controller.command(DriveCommand(torque, 1))


def test_one_forged_frame_is_obeyed_until_the_next_but_one_and_ends_no_link():
    """A CRC is no signature: what bears the next counter is taken, and the true one repeats it."""
    controller, drive = ends = ControllerEnd(CODEC), DriveEnd(CODEC)
    _, _, now = run(ends)
    forger = ControllerEnd(CODEC)
    while sent(forger, 0.0)[1][1] & 0x0F != sent(controller, 0.1)[1][1] & 0x0F:
        controller.take_back()
    controller.take_back()
    forger.take_back()
    assert drive.receive(*sent(forger, -3.0), now).torque == pytest.approx(-3.0)
    assert drive.receive(*sent(controller, 0.2), now) is None
    assert drive.receive(*sent(controller, 0.2), now).torque == pytest.approx(0.2)
    assert drive.receiver.state is LinkState.VALID


def test_who_silences_the_drive_and_speaks_in_its_place_is_believed():
    controller, drive = ends = ControllerEnd(CODEC), DriveEnd(CODEC)
    _, _, now = run(ends)
    found, _, _ = run((controller, DriveEnd(CODEC)), 5, now + 1.0)
    assert found[-1] is not None
