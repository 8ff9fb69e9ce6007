"""Limits of what a controller believes, and of what it sends."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.errors import InputError

__all__ = ['STALE_ACTIONS', 'SupervisorSettings']

STALE_ACTIONS = ('hold', 'ramp_to_zero', 'ramp_to_value')


@dataclass(frozen=True)
class SupervisorSettings:
    """Limits of what is believed.

    Attributes:
        command_timeout, state_timeout, observer_timeout: [s]; 0: not watched.
        stale_action: one of STALE_ACTIONS.
        largest_command_step: between two commands, in the command's unit; inf: any.
        largest_speed: of the motor [rad/s].
        largest_error: of tracking [rad], for `error_time` [s].
        effort_limit: final clamp [N·m].
        effort_rate: final clamp's slew rate [N·m/s].
        ramp_time: from full torque to none [s].
    """

    command_timeout: float = 0.25
    state_timeout: float = 0.1
    observer_timeout: float = 0.0
    stale_action: str = 'hold'
    largest_command_step: float = math.inf
    largest_speed: float = 400.0
    largest_error: float = 2.0
    error_time: float = 0.3
    effort_limit: float = 0.75
    effort_rate: float = 1000.0
    ramp_time: float = 0.2

    def __post_init__(self) -> None:
        if self.stale_action not in STALE_ACTIONS:
            raise InputError(f'stale_action is {self.stale_action!r}; it must be one of '
                             f'{", ".join(STALE_ACTIONS)}')
        for name in ('effort_limit', 'effort_rate', 'ramp_time', 'largest_speed'):
            value = getattr(self, name)
            if not value > 0.0:
                raise InputError(f'{name} is {value}; it must be above 0')
