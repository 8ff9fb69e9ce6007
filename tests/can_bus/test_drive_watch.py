# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The drive's mode against the one it was asked for."""

import pytest

pytest.importorskip('cantools')

from engb_ros.can.codec import DriveStatus, OFF, TORQUE  # noqa: E402
from engb_ros.can.drive_watch import DriveState, DriveWatch  # noqa: E402

PATIENCE = 0.125
OTHER = 7     # a mode that nobody knows here
WIDE = '1000'     # one more, of a file whose mode has more than 8 bits


def status(mode, *flags):
    return DriveStatus(0.0, 0.0, 0.0, mode, flags)


def watched(*events):
    """Return a watch after (time, asked mode or status) in turn."""
    watch = DriveWatch(PATIENCE)
    for time, event in events:
        (watch.ask if isinstance(event, int) else watch.report)(event, time)
    return watch


@pytest.mark.parametrize(('asked', 'reported', 'while_waiting', 'at_last'), [
    (TORQUE, status(TORQUE), DriveState.OBEYS, DriveState.OBEYS),
    (TORQUE, status(OFF), DriveState.OBEYS, DriveState.REFUSES),
    (TORQUE, status(7), DriveState.OBEYS, DriveState.REFUSES),
    (TORQUE, status(TORQUE, 'COMMAND_LOST'), DriveState.OBEYS, DriveState.REFUSES),
    (OFF, status(OFF), DriveState.OFF, DriveState.OFF),
    (OFF, status(OFF, 'COMMAND_LOST'), DriveState.OFF, DriveState.OFF),
    (OFF, status(TORQUE), DriveState.OFF, DriveState.HOLDS_ON),
    (OTHER, status(TORQUE), DriveState.OFF, DriveState.HOLDS_ON),
    (OTHER, status(OTHER, 'COMMAND_LOST'), DriveState.OFF, DriveState.OFF)])
def test_it_is_patient_and_then_says(asked, reported, while_waiting, at_last):
    watch = watched((0.0, asked), (0.01, reported))
    assert watch.state(True, 0.09) is while_waiting
    watch.report(reported, 0.15)
    assert watch.state(True, 0.15) is at_last


def test_it_is_patient_to_the_end():
    watch = watched((1.0, TORQUE), (1.0, status(OFF)))
    assert watch.state(True, 1.125) is DriveState.OBEYS
    assert watch.state(True, 1.126) is DriveState.REFUSES


def test_each_wish_gets_the_patience_anew():
    watch = watched((0.0, TORQUE), (0.01, status(OFF)), (0.2, OFF), (0.2, TORQUE))
    assert watch.state(True, 0.25) is DriveState.OBEYS
    assert watch.state(True, 0.33) is DriveState.REFUSES


def test_modes_are_compared_by_their_numbers():
    # As they come of frames: each an integer of its own.
    watch = watched((0.0, int(WIDE)), (0.01, status(int(WIDE))))
    assert watch.state(True, 0.5) is DriveState.OFF
    watch = watched((0.0, int(WIDE)), (0.01, status(OFF)), (0.1, int(WIDE)))
    assert watch.state(True, 0.126) is DriveState.HOLDS_ON     # asked again is no other wish


def test_before_any_wish_it_is_off():
    watch = watched((0.0, status(TORQUE)))
    assert watch.state(True, 9.0) is DriveState.OFF


def test_a_drive_that_follows_again_is_believed_at_once():
    watch = watched((0.0, TORQUE), (0.01, status(OFF)))
    assert watch.state(True, 0.2) is DriveState.REFUSES
    watch.report(status(TORQUE), 0.21)
    assert watch.state(True, 0.21) is DriveState.OBEYS


def test_without_a_link_nothing_is_known():
    watch = watched((0.0, TORQUE), (0.01, status(TORQUE)))
    assert watch.state(False, 0.5) is DriveState.LOST
    assert watch.state(True, 0.55) is DriveState.OBEYS
