"""What can go wrong, how bad it is, and what is done about it: one bit per cause."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntFlag

__all__ = ['CAUSES', 'Cause', 'CauseInfo', 'Severity', 'State']


class State(Enum):
    """What the controller is doing."""

    READY = 'ready'
    ENABLED = 'enabled'
    DEGRADED = 'degraded'
    FAULT = 'fault'


class Severity(Enum):
    """What a cause does: notice (told), degraded (tracking goes on), fault (latched)."""

    NOTICE = 'notice'
    DEGRADED = 'degraded'
    FAULT = 'fault'


class Cause(IntFlag):
    """One bit per cause."""

    COMMAND_STALE = 1 << 0
    COMMAND_NOT_FINITE = 1 << 1
    COMMAND_OUT_OF_RANGE = 1 << 2
    COMMAND_JUMP = 1 << 3
    STATE_STALE = 1 << 4
    STATE_NOT_FINITE = 1 << 5
    STATE_JUMP = 1 << 6
    STATE_WRONG_JOINT = 1 << 7
    CLOCK_JUMP = 1 << 8
    OBSERVER_STALE = 1 << 9
    OUTPUT_LIMITED = 1 << 10
    OUTPUT_NOT_FINITE = 1 << 11
    TRACKING_ERROR = 1 << 12
    OTHER_CONTROLLER = 1 << 13
    FORCE_UNCERTAIN = 1 << 14


@dataclass(frozen=True)
class CauseInfo:
    """What a cause means and what is done about it."""

    severity: Severity
    meaning: str
    reaction: str


# The one table of causes; the documentation is made from it.
CAUSES: dict[Cause, CauseInfo] = {
    Cause.COMMAND_STALE: CauseInfo(
        Severity.FAULT, 'no valid command within `command_timeout`',
        'the set-point does what `stale_action` says; later commands are ignored until cleared'),
    Cause.COMMAND_NOT_FINITE: CauseInfo(
        Severity.NOTICE, 'a command was NaN or infinite', 'not taken; the last one stands'),
    Cause.COMMAND_OUT_OF_RANGE: CauseInfo(
        Severity.NOTICE, 'a command lay outside its range', 'not taken; the last one stands'),
    Cause.COMMAND_JUMP: CauseInfo(
        Severity.NOTICE, 'a command differed from the last by more than `largest_command_step`',
        'not taken; the last one stands'),
    Cause.STATE_STALE: CauseInfo(
        Severity.FAULT, 'no valid joint state within `state_timeout`',
        'the torque ramps to zero within `ramp_time`'),
    Cause.STATE_NOT_FINITE: CauseInfo(
        Severity.NOTICE, 'a joint state held NaN, infinity, or a number beyond 1e6',
        'the sample is not used'),
    Cause.STATE_JUMP: CauseInfo(
        Severity.NOTICE, 'the angle moved faster than `largest_speed`', 'the sample is not used'),
    Cause.STATE_WRONG_JOINT: CauseInfo(
        Severity.NOTICE, 'a joint state did not hold the joint\'s position',
        'the message is not used'),
    Cause.CLOCK_JUMP: CauseInfo(
        Severity.NOTICE, 'stamps and the steady clock parted by more than 0.1 s',
        'nothing is integrated over the jump'),
    Cause.OBSERVER_STALE: CauseInfo(
        Severity.DEGRADED, 'no `disturbance` within `observer_timeout`',
        'the force estimate relies on the angle alone'),
    Cause.OUTPUT_LIMITED: CauseInfo(
        Severity.NOTICE, 'the final clamp changed the torque', 'the clamped torque is sent'),
    Cause.OUTPUT_NOT_FINITE: CauseInfo(
        Severity.FAULT, 'the computed torque was NaN or infinite',
        'the torque ramps to zero within `ramp_time`'),
    Cause.TRACKING_ERROR: CauseInfo(
        Severity.DEGRADED, 'the angle is off by more than `largest_error` for `error_time`',
        'tracking goes on'),
    Cause.OTHER_CONTROLLER: CauseInfo(
        Severity.FAULT, 'someone else publishes `effort_command`',
        'the one who came later is silent; who was there first goes on, degraded'),
    Cause.FORCE_UNCERTAIN: CauseInfo(
        Severity.DEGRADED, 'angle and current disagree about the clamp force',
        'tracking goes on; the force\'s uncertainty says how far to trust it'),
}
