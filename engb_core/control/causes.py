# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What can go wrong, how bad it is, and what is done about it: one bit per cause."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntFlag

__all__ = ['CAUSES', 'Cause', 'CauseInfo', 'Severity', 'State', 'Stop', 'STOPPING']


class State(Enum):
    """What the controller is doing."""

    READY = 'ready'
    ENABLED = 'enabled'
    DEGRADED = 'degraded'
    FAULT = 'fault'
    INACTIVE = 'inactive'


class Severity(Enum):
    """What a cause does: notice (told), degraded (tracking goes on), fault (latched)."""

    NOTICE = 'notice'
    DEGRADED = 'degraded'
    FAULT = 'fault'


class Stop(Enum):
    """What becomes of the torque in a fault; compare the stop categories 0, 1, 2 of IEC 60204-1.

    `release` takes it away at once, `ramp` within `ramp_time`, `hold` keeps the angle that the
    brake has: only lower requests are followed.
    """

    RELEASE = 'release'
    RAMP = 'ramp'
    HOLD = 'hold'


class Cause(IntFlag):
    """One bit per cause."""

    @property
    def key(self) -> str:
        """Its name as parameters, diagnostics and pages write it."""
        return str(self.name).lower()

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
    STATE_REPEATED = 1 << 15
    ANGLE_LOST = 1 << 16
    ANGLE_OUT_OF_RANGE = 1 << 17
    DRIVE_WEAK = 1 << 18
    DRIVE_OFF = 1 << 19
    DRIVE_WRONG = 1 << 20
    SHAFT_SEIZED = 1 << 21
    COMMAND_CONFLICT = 1 << 22
    COMMAND_LATE = 1 << 23
    COMMAND_REPEATED = 1 << 24
    FORCE_NOT_CONFIGURED = 1 << 25
    NOT_WATCHED = 1 << 26
    DISC_SPEED_STALE = 1 << 27
    OTHER_DRIVE = 1 << 28
    STANDBY_NOT_READY = 1 << 29
    EFFORT_MISSING = 1 << 30
    VELOCITY_WRONG = 1 << 31

    @property
    def word(self) -> str:
        """Its name as parameters and diagnostics have it."""
        return (self.name or '').lower()


@dataclass(frozen=True)
class CauseInfo:
    """What a cause means and what is done about it.

    Attributes:
        severity, meaning, reaction: as the documentation tells them.
        stops: of a fault whose torque is stopped: what its stop may be, the default first.
        reason: why that is the default.
    """

    severity: Severity
    meaning: str
    reaction: str
    stops: tuple[Stop, ...] = ()
    reason: str = ''


_BLIND = (Stop.RAMP, Stop.RELEASE)   # without an angle nothing can be held
_ANY = (Stop.RELEASE, Stop.RAMP, Stop.HOLD)

# The one table of causes; the documentation is made from it.
CAUSES: dict[Cause, CauseInfo] = {
    Cause.COMMAND_STALE: CauseInfo(
        Severity.FAULT, 'no valid command within `command_timeout`',
        'the set-point does what `stale_action` says; until cleared only lower requests are '
        'followed, of a source that has been back for `command_timeout`'),
    Cause.COMMAND_NOT_FINITE: CauseInfo(
        Severity.NOTICE, 'a command was NaN, infinite, or a number beyond 1e6',
        'not taken; the last one stands'),
    Cause.COMMAND_OUT_OF_RANGE: CauseInfo(
        Severity.NOTICE, 'a command lay outside its range', 'taken at the range\'s end'),
    Cause.COMMAND_JUMP: CauseInfo(
        Severity.NOTICE, 'a command differed from the last of its kind by more than '
        '`largest_command_step` or `largest_force_step`', 'taken: an emergency looks like this'),
    Cause.STATE_STALE: CauseInfo(
        Severity.FAULT, 'no valid joint state within `state_timeout`; before the first command '
        'also joint states that come too seldom for the loop to have any phase margin',
        'stopped by `stop_state_stale`; before the first command since activation not latched: '
        'waited for, told as a warning', _BLIND,
        'a torque that nobody watches must go, but the vehicle shall not jerk'),
    Cause.STATE_NOT_FINITE: CauseInfo(
        Severity.NOTICE, 'a joint state held NaN, infinity, or a number beyond 1e6',
        'the sample is not used'),
    Cause.STATE_JUMP: CauseInfo(
        Severity.NOTICE, 'the angle moved faster than `largest_speed`, or its velocity said so',
        'the sample is not used, from the second on the motor gets what holds the load; if it '
        'stays there, `angle_lost`'),
    Cause.STATE_WRONG_JOINT: CauseInfo(
        Severity.NOTICE, 'a joint state did not hold the joint\'s position',
        'the message is not used'),
    Cause.CLOCK_JUMP: CauseInfo(
        Severity.NOTICE, 'stamps went backwards, or parted from the steady clock by more than '
        '0.1 s', 'the steady clock\'s step takes the place of the stamps\''),
    Cause.OBSERVER_STALE: CauseInfo(
        Severity.DEGRADED, 'no `disturbance` within `observer_timeout`',
        'the force estimate relies on the angle alone'),
    Cause.OUTPUT_LIMITED: CauseInfo(
        Severity.NOTICE, 'the final clamp changed the torque', 'the clamped torque is sent'),
    Cause.OUTPUT_NOT_FINITE: CauseInfo(
        Severity.FAULT, 'the computed torque was NaN or infinite, or could not be computed',
        'stopped by `stop_output_not_finite`', _BLIND,
        'the loop cannot hold what it cannot compute'),
    Cause.TRACKING_ERROR: CauseInfo(
        Severity.DEGRADED, 'the angle is off by more than `largest_error` for `error_time`, or '
        'swings so far to both sides of one set-point', 'tracking goes on'),
    Cause.OTHER_CONTROLLER: CauseInfo(
        Severity.FAULT, 'someone else publishes `effort_command`',
        'the one who came later is silent; who was there first goes on, degraded'),
    Cause.FORCE_UNCERTAIN: CauseInfo(
        Severity.DEGRADED, 'angle and current disagree about the clamp force',
        'tracking goes on; the force\'s uncertainty says how far to trust it'),
    Cause.STATE_REPEATED: CauseInfo(
        Severity.NOTICE, 'the stamp of a joint state did not advance',
        'the sample is not used; if it lasts, `state_stale`'),
    Cause.ANGLE_LOST: CauseInfo(
        Severity.FAULT, 'the angle jumped and stayed there for `jump_time`',
        'stopped by `stop_angle_lost`; clearing believes the new angle', _BLIND,
        'the old angle is gone, the new one is not to be believed'),
    Cause.ANGLE_OUT_OF_RANGE: CauseInfo(
        Severity.FAULT, 'the angle lies outside `position_min` and `position_max` by more than '
        '`largest_error`, for two samples', 'stopped by `stop_angle_out_of_range`', _ANY,
        'beyond the stroke\'s end every further torque is wrong; the load pushes back'),
    Cause.DRIVE_WEAK: CauseInfo(
        Severity.DEGRADED, 'the drive gives less torque than it is asked for, by '
        '`drive_tolerance` for `drive_time`', 'tracking goes on; nothing winds up'),
    Cause.DRIVE_OFF: CauseInfo(
        Severity.FAULT, 'the drive gives no torque though it is asked for it, or says so itself',
        'stopped by `stop_drive_off`', (Stop.RAMP, Stop.RELEASE),
        'a drive that comes back must not find a torque that waited for it'),
    Cause.DRIVE_WRONG: CauseInfo(
        Severity.FAULT, 'the drive gives more torque than it is asked for, or the other way '
        'round, by `drive_tolerance` for `drive_time`, or does not let go',
        'stopped by `stop_drive_wrong`', (Stop.RELEASE, Stop.RAMP),
        'a loop around a torque that does not obey runs away'),
    Cause.SHAFT_SEIZED: CauseInfo(
        Severity.FAULT, 'the angle is off by more than `largest_error` and does not move at full '
        'torque for `seized_time`', 'stopped by `stop_shaft_seized`',
        (Stop.HOLD, Stop.RAMP, Stop.RELEASE),
        'what is clamped stays clamped; the torque falls to what the angle needs'),
    Cause.COMMAND_CONFLICT: CauseInfo(
        Severity.DEGRADED, 'more than one source sends commands',
        'who came first is obeyed as long as it speaks; of sources without a name the highest '
        'request of the last `command_timeout`'),
    Cause.COMMAND_LATE: CauseInfo(
        Severity.NOTICE, 'a stamped command was older than `command_timeout`, or from the future',
        'not taken; the last one stands'),
    Cause.COMMAND_REPEATED: CauseInfo(
        Severity.NOTICE, 'the stamp or the counter of a stamped command did not advance',
        'not taken; the last one stands'),
    Cause.FORCE_NOT_CONFIGURED: CauseInfo(
        Severity.NOTICE, 'a clamp force was commanded, but no `mechanism` is set', 'not taken'),
    Cause.NOT_WATCHED: CauseInfo(
        Severity.NOTICE, '`state_timeout` or `command_timeout` is 0, or `use_sim_time` is set',
        'that age is not watched'),
    Cause.DISC_SPEED_STALE: CauseInfo(
        Severity.DEGRADED, '`disc_speed` fell silent for `disc_speed_timeout`',
        'the disc counts as standing; the force estimate relies on the angle alone'),
    Cause.OTHER_DRIVE: CauseInfo(
        Severity.DEGRADED, 'more than one node publishes `joint_states`',
        'those of who came first are used alone'),
    Cause.STANDBY_NOT_READY: CauseInfo(
        Severity.DEGRADED, 'this standby hears no torque of a primary yet, or has not yet found '
        'its drive among the listeners of `effort_command`',
        'should the primary die now, the brake lets go: wait until this is over'),
    Cause.EFFORT_MISSING: CauseInfo(
        Severity.DEGRADED, 'joint states have told no torque, or none that is a number, for '
        '`drive_time`, while `drive_tolerance` is above 0',
        'tracking goes on; whether the drive obeys is not watched, and the force estimate relies '
        'on the angle alone'),
    Cause.VELOCITY_WRONG: CauseInfo(
        Severity.DEGRADED, 'the velocity is not that of the angles, by `velocity_tolerance` in '
        'the mean', 'the one derived from the angles is used'),
}

# Faults whose torque is stopped by a parameter `stop_…`.
STOPPING = tuple(cause for cause, info in CAUSES.items() if info.stops)
