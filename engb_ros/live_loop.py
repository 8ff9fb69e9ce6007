# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A running loop to disturb: drive and controller as processes, commands from this process.

The fault injection of tests and benchmarks uses it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import time
from typing import Any

from engb_core.control.causes import Cause
from engb_ros.interface import (
    CLEAR_FAULTS,
    CONTROLLER_CAUSES,
    CONTROLLER_STATE,
    EFFORT_COMMAND,
    JOINT_STATES,
    POSITION_COMMAND,
    Service,
)
from engb_ros.probe import Probe
from engb_ros.runner import Runner, RunnerError

__all__ = ['Drive', 'LiveLoop']

# Position commands [s apart].
COMMAND_PERIOD = 0.05

# A fault that was just cleared may still be the last word for so long [s].
LASTING_FAULT = 3.0

Drive = Sequence[tuple[str, Mapping[str, Any]]]


class LiveLoop:
    """Sends position commands at 20 Hz whenever the probe is spun.

    Args:
        runner, probe: in the same ROS domain.
        drive: the nodes in the place of the motor drive, each with its parameters.
        controller: parameters of the controller.

    Attributes:
        states, efforts, state, causes: messages of `joint_states`, `effort_command`,
            `controller_state` and `controller_causes` so far.
        target: the angle that is commanded [rad]; None: nothing is.

    Raises:
        RunnerError: a node ended, or the loop is not closed within a minute.
    """

    def __init__(self, runner: Runner, probe: Probe, drive: Drive, **controller: Any) -> None:
        self.runner, self.probe = runner, probe
        self.states, self.efforts = probe.listen(JOINT_STATES), probe.listen(EFFORT_COMMAND)
        self.state, self.causes = probe.listen(CONTROLLER_STATE), probe.listen(CONTROLLER_CAUSES)
        self.target: float | None = None
        # A timer: commands go on while a service's answer is waited for, too.
        probe.node.create_timer(COMMAND_PERIOD, self._command)
        self.drive = dict(drive)
        self.controller = controller
        for name in (*self.drive, 'controller'):
            self.start(name)
        self.until(lambda: self.states and self.efforts and probe.subscribers(POSITION_COMMAND),
                   'the loop to be closed', timeout=60.0)

    def start(self, name: str) -> None:
        """Start (again) the controller, or a node of the drive."""
        parameters = self.controller if name == 'controller' else self.drive[name]
        self.runner.start(name, parameters=parameters)

    def kill(self, name: str) -> None:
        """End a node as a crash would (SIGKILL)."""
        process = self.runner.processes.pop(name)
        process.process.kill()
        process.wait()

    def pump(self) -> None:
        """Handle messages for a moment, the command's timer among them."""
        self.probe.spin(0.01)

    def _command(self) -> None:
        if self.target is not None:
            self.probe.publish(POSITION_COMMAND, self.target)

    def until(self, condition: Callable[[], Any], what: str, timeout: float = 60.0) -> float:
        """Wait for `condition` and return how long it took [s].

        Raises:
            RunnerError: not met within `timeout`, or a node ended; it says what the loop was at.
        """
        begin = time.monotonic()
        try:
            self.runner.wait_until(condition, what, timeout, pause=self.pump)
        except RunnerError as error:
            raise RunnerError(f'{error}; {self.words()}') from None
        return time.monotonic() - begin

    def words(self) -> str:
        """Return what the loop is at: the controller's state and causes, the angle, the torque."""
        state = self.state[-1].data if self.state else 'unknown'
        causes = (Cause(self.causes[-1].data).name or 'no cause') if self.causes else 'unknown'
        shaft = (f'{self.position:.3f} rad, {self.effort:.4f} N·m' if self.states
                 else 'no joint states')
        return (f'the controller is {state} ({causes}), the drive at {shaft}, '
                f'{self.target} rad commanded')

    def during(self, seconds: float) -> None:
        """Let time pass."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.pump()
        self.runner.check()

    def go(self, angle: float) -> None:
        """Track `angle` [rad] and wait until the brake is there.

        Raises:
            RunnerError: it is not there within a minute, or the controller stays in a fault, which
                nothing but clearing ends: waiting would not help.
        """
        self.target = angle
        fault_since: float | None = None

        def there() -> bool:
            nonlocal fault_since
            if not self.is_in('fault'):
                fault_since = None
            elif fault_since is None:
                fault_since = time.monotonic()
            elif time.monotonic() - fault_since > LASTING_FAULT:
                raise RunnerError(f'a fault keeps the brake from {angle} rad')
            return abs(self.position - angle) < 0.3 and self.is_in('enabled')

        self.until(there, f'{angle} rad')

    def is_in(self, state: str) -> bool:
        """Whether the controller's last word was this state."""
        return bool(self.state) and self.state[-1].data == state

    def has(self, cause: Cause) -> bool:
        """Whether the controller reports this cause."""
        return bool(self.causes) and bool(self.causes[-1].data & cause)

    def clear(self) -> Any:
        """Clear faults; return the service's response."""
        return self.probe.call('controller', CLEAR_FAULTS)

    def set_parameter(self, node: str, name: str, value: Any) -> None:
        """Change a parameter of a running node; RuntimeError where it refuses."""
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter
        service = Service('~/set_parameters', 'rcl_interfaces/srv/SetParameters', '')
        request = SetParameters.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()])
        result = self.probe.call(node, service, request=request).results[0]
        if not result.successful:
            raise RuntimeError(f'{node} refused {name}: {result.reason}')

    @property
    def position(self) -> float:
        """The brake's angle [rad]."""
        return self.states[-1].position[0]

    @property
    def effort(self) -> float:
        """The drive's measured torque [N·m]."""
        return self.states[-1].effort[0]
