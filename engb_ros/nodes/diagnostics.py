# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Diagnostic messages, whose level is a byte that rclpy fills with garbage if given a number."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from engb_core.control.brake_controller import BrakeController
from engb_core.control.causes import Cause, CAUSES, Severity, State

__all__ = ['DiagnosticMessage', 'ERROR', 'OK', 'STALE', 'WARN', 'controller_status']

OK, WARN, ERROR, STALE = 0, 1, 2, 3


class DiagnosticMessage:
    """A DiagnosticArray with one status.

    Args:
        name: of what is diagnosed, 'brake: node'.
        hardware_id: of the hardware; empty: the brake's name.
    """

    def __init__(self, name: str, hardware_id: str = '') -> None:
        self._status = DiagnosticStatus(
            name=name, hardware_id=hardware_id or name.partition(':')[0])
        self._message = DiagnosticArray(status=[self._status])

    def fill(self, stamp: Time, level: int, text: str, values: dict[str, str]) -> DiagnosticArray:
        """Set stamp, level (OK, WARN, ERROR, STALE), text and values; return the message."""
        self._message.header.stamp = stamp
        self._status.level = bytes([int(level)])
        self._status.message = text
        self._status.values = [KeyValue(key=key, value=value) for key, value in values.items()]
        return self._message


def controller_status(controller: BrakeController, now: float) -> tuple[int, str, dict[str, str]]:
    """Return level, message and values of a controller's status."""
    supervisor, report = controller.supervisor, controller.report
    active = supervisor.active(now)
    named = [cause.key for cause in Cause if active & cause]
    state = supervisor.state
    severities = {CAUSES[cause].severity for cause in Cause if active & cause}
    if state is State.FAULT:
        level = ERROR
    elif state is State.DEGRADED or severities:
        level = WARN
    else:
        level = OK
    if severities == {Severity.NOTICE} and active == Cause.OUTPUT_LIMITED:
        level = OK if state is not State.FAULT else level
    values = {'state': state.value, 'causes': str(int(active)),
              'latched': str(int(supervisor.latched))}
    for name in ('position', 'effort'):
        for part in ('input', 'command', 'output'):
            values[f'{name}_{part}'] = f'{getattr(report, f"{name}_{part}"):.6g}'
    values['final_clamp_activity'] = str(controller.clamp.activity)
    estimator = controller.estimator
    if estimator is not None:
        values |= {'clamp_force': f'{estimator.force:.1f}',
                   'clamp_force_std': f'{estimator.force_std:.1f}',
                   'contact_angle': f'{estimator.contact_angle:.3f}',
                   'contact_shift_std': f'{estimator.shift_std:.3f}'}
    for cause in Cause:
        values[cause.key] = '1' if active & cause else '0'
        values[f'{cause.key}_count'] = str(supervisor.counts[cause])
    return level, state.value + (': ' + ', '.join(named) if named else ''), values
