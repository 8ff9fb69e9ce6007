# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Limits of what a controller believes, and of what it sends."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from engb_core.control.causes import Cause, CAUSES, Stop, STOPPING
from engb_core.errors import InputError

__all__ = ['STALE_ACTIONS', 'SupervisorSettings', 'default_stops']

STALE_ACTIONS = ('hold', 'ramp_to_zero', 'ramp_to_value')


def default_stops() -> dict[Cause, Stop]:
    """Return the stop of each fault that has one, as the table of causes proposes."""
    return {cause: CAUSES[cause].stops[0] for cause in STOPPING}


@dataclass(frozen=True)
class SupervisorSettings:
    """Limits of what is believed.

    Attributes:
        command_timeout, state_timeout, observer_timeout, disc_speed_timeout: [s]; 0: not watched.
        stale_action: one of STALE_ACTIONS.
        stops: what becomes of the torque, by fault.
        command_source: the only source that is obeyed; '': whoever comes first.
        largest_command_step, largest_force_step: larger steps between two commands are told
            [rad, N]; inf: none.
        largest_speed: of the motor [rad/s].
        jump_time: an angle that jumped and stayed for so long is lost [s].
        velocity_tolerance: the told velocity may be off from that of the angles by so much, in the
            mean [rad/s]; 0: not watched. At the default gain 25 rad/s are 0.15 N·m of damping,
            as much as `drive_tolerance`.
        largest_error: of tracking [rad], for `error_time` [s]; also how far the angle may leave
            its range.
        drive_tolerance: the measured torque may be off by so much [N·m]; 0: not watched. A
            motor's torque constant falls by a fifth when it is hot.
        drive_time: of the mean that is held against it [s].
        drive_delay: the measured torque may lag so far behind what is asked [s].
        seized_time: a shaft may stand still at full torque for so long [s]; 0: not watched.
        effort_limit: final clamp [N·m].
        effort_rate: final clamp's slew rate [N·m/s].
        ramp_time: from full torque to none [s].
    """

    command_timeout: float = 0.25
    state_timeout: float = 0.1
    observer_timeout: float = 0.0
    disc_speed_timeout: float = 0.5
    stale_action: str = 'hold'
    stops: dict[Cause, Stop] = field(default_factory=default_stops)
    command_source: str = ''
    largest_command_step: float = math.inf
    largest_force_step: float = math.inf
    largest_speed: float = 400.0
    jump_time: float = 0.05
    velocity_tolerance: float = 25.0
    largest_error: float = 2.0
    error_time: float = 0.3
    drive_tolerance: float = 0.15
    drive_time: float = 0.1
    drive_delay: float = 0.05
    seized_time: float = 1.0
    effort_limit: float = 0.75
    effort_rate: float = 1000.0
    ramp_time: float = 0.2

    def __post_init__(self) -> None:
        if self.stale_action not in STALE_ACTIONS:
            raise InputError(f'stale_action is {self.stale_action!r}; it must be one of '
                             f'{", ".join(STALE_ACTIONS)}')
        for name in ('effort_limit', 'effort_rate', 'ramp_time', 'largest_speed', 'drive_time',
                     'drive_delay'):
            value = getattr(self, name)
            if not value > 0.0:
                raise InputError(f'{name} is {value}; it must be above 0')
        for cause in STOPPING:
            if self.stops.get(cause) not in CAUSES[cause].stops:
                raise InputError(
                    f'stop_{cause.word} must be one of '
                    f'{", ".join(stop.value for stop in CAUSES[cause].stops)}')

    def with_stop(self, stop: Stop) -> int:
        """Return the faults that are stopped so, as bits."""
        return sum(cause.value for cause in STOPPING if self.stops[cause] is stop)
