# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A running loop to disturb: drive and controller as processes, commands from this process.

The fault injection of tests and benchmarks uses it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import threading
import time
from typing import Any

from engb_core.control.causes import Cause, CAUSES, Severity
from engb_ros.interface import (
    CLEAR_FAULTS,
    CONTROLLER_CAUSES,
    CONTROLLER_STATE,
    EFFORT_COMMAND,
    JOINT_STATES,
    POSITION_COMMAND,
    Service,
    Topic,
)
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import Runner, RunnerError, RunnerTimeout

__all__ = ['Drive', 'LiveLoop', 'Request']

# A fault that was just cleared may still be the last word for so long [s].
LASTING_FAULT = 3.0

# What the graph makes of who was killed, until his lease ends.
_STILL_SHOWN = Cause.OTHER_DRIVE | Cause.OTHER_CONTROLLER
_DEGRADES = Cause(sum(cause.value for cause, info in CAUSES.items()
                      if info.severity is Severity.DEGRADED))

Drive = Sequence[tuple[str, Mapping[str, Any]]]


class Request:
    """What a loop commands on one topic, as an attribute of it; None: nothing, or something else.

    What is set takes the place of whatever was commanded before.
    """

    def __init__(self, topic: Topic) -> None:
        self._topic = topic

    def __get__(self, loop: LiveLoop, owner: Any = None) -> float | None:
        return loop.asked(self._topic)

    def __set__(self, loop: LiveLoop, value: float | None) -> None:
        loop.ask(self._topic, value)


class LiveLoop:
    """Sends position commands at 20 Hz, whatever its user does meanwhile.

    A stack is a process of its own: that a test writes a file, or waits for a process to end,
    makes no command late.

    Args:
        runner, probe: in the same ROS domain.
        drive: the nodes in the place of the motor drive, each with its parameters.
        controller: parameters of the controller.

    Attributes:
        states, efforts, state, causes: messages of `joint_states`, `effort_command`,
            `controller_state` and `controller_causes` so far.
        target: the angle that is commanded [rad]; None: nothing is.
        pause: the longest one between two commands [s], since somebody set it to 0.
        command_period: from one command to the next [s].

    Raises:
        RunnerError: a node ended, or the loop is not closed within a minute.
    """

    command_period = 0.05   # [s]
    target = Request(POSITION_COMMAND)

    def __init__(self, runner: Runner, probe: Probe, drive: Drive, **controller: Any) -> None:
        self.runner, self.probe = runner, probe
        self.states, self.efforts = probe.listen(JOINT_STATES), probe.listen(EFFORT_COMMAND)
        self.state, self.causes = probe.listen(CONTROLLER_STATE), probe.listen(CONTROLLER_CAUSES)
        self.pause = 0.0
        self._killed = False
        self._sent: float | None = None   # when the last one was
        self._request: tuple[Topic, float] | None = None
        self._sending = threading.Lock()
        probe.repeat(self.command_period, self._send)
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
        self._killed = True
        process = self.runner.processes.pop(name)
        process.process.kill()
        process.wait()

    def pump(self) -> None:
        """Handle messages for a moment."""
        self.probe.spin(0.01)

    def asked(self, topic: Topic) -> float | None:
        """Return what is commanded on `topic`; None: nothing is."""
        return self._request[1] if self._request and self._request[0] == topic else None

    def ask(self, topic: Topic, value: float | None) -> None:
        """Command something else, or nothing: the next command says so."""
        if value is not None:
            self.probe.advertise(topic)   # in the user's thread, which alone makes endpoints
        with self._sending:
            self._request = None if value is None else (topic, value)

    def _send(self) -> None:
        with self._sending:
            if not self.command():
                self._sent = None
                return
            now = time.monotonic()
            if self._sent is not None:
                self.pause = max(self.pause, now - self._sent)
            self._sent = now

    def command(self) -> bool:
        """Send what is commanded, and return whether anything is; not in the user's thread."""
        if self._request is None:
            return False
        self.send(*self._request)
        return True

    def send(self, topic: Topic, value: float) -> None:
        """Send one command."""
        self.probe.publish(topic, value)

    def until(self, condition: Callable[[], Any], what: str, timeout: float = 60.0) -> float:
        """Wait for `condition` and return how long it took [s].

        Raises:
            RunnerTimeout: not met within `timeout` [s].
            RunnerError: a node ended. Both say what the loop was at.
        """
        begin = time.monotonic()
        try:
            self.runner.wait_until(condition, what, timeout, pause=self.pump)
        except RunnerError as error:
            raise type(error)(f'{error}; {self.words()}') from None
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
        """Track `angle` [rad] and wait until the brake is there (`tracks`).

        Raises:
            RunnerTimeout: it is not there within a minute, or the controller stays in a fault,
                which nothing but clearing ends: waiting would not help.
            RunnerError: a node ended.
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
                raise RunnerTimeout(f'a fault keeps the brake from {angle} rad')
            return abs(self.position - angle) < 0.3 and self.tracks()

        self.until(there, f'{angle} rad')

    def is_in(self, state: str) -> bool:
        """Whether the controller's last word was this state."""
        return bool(self.state) and self.state[-1].data == state

    def tracks(self) -> bool:
        """Whether it is enabled, or degraded by nothing but somebody whom this loop has killed:
        the graph shows him until his lease of 20 s ends."""
        return self.is_in('enabled') or (
            self._killed and self.is_in('degraded')
            and self.has(_STILL_SHOWN) and not self.has(_DEGRADES & ~_STILL_SHOWN))

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
        """The brake's angle [rad]: the newest one that was told."""
        return next(float(message.position[0]) for message in reversed(self.states)
                    if len(message.position))

    @property
    def effort(self) -> float:
        """The drive's measured torque [N·m]: the newest one that was told."""
        return next(float(message.effort[0]) for message in reversed(self.states)
                    if len(message.effort))
