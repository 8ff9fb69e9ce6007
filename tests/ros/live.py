"""A running loop to disturb: drive and controller as processes, commands from the test."""

from collections.abc import Callable
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
)

# A loaded computer lets processes wait: shorter timeouts would find faults that nobody injected.
STATE_TIMEOUT = 0.6


class LiveLoop:
    """Sends position commands at 20 Hz while it waits for things to happen.

    Args:
        runner, probe: of the test.
        drive: parameters of the plant; or a list of (node, parameters) in its place.
        controller: parameters of the controller.
    """

    def __init__(self, runner, probe, drive: Any = None, **controller: Any) -> None:
        self.runner, self.probe = runner, probe
        self.states, self.efforts = probe.listen(JOINT_STATES), probe.listen(EFFORT_COMMAND)
        self.state, self.causes = probe.listen(CONTROLLER_STATE), probe.listen(CONTROLLER_CAUSES)
        self.target: float | None = None
        self._sent = 0.0
        self.drive = drive if isinstance(drive, list) else [
            ('plant', {'rate': 200.0, **(drive or {})})]
        self.controller = {'state_timeout': STATE_TIMEOUT, 'command_timeout': 1.0, **controller}
        for name, parameters in self.drive:
            runner.start(name, parameters=parameters)
        runner.start('controller', parameters=self.controller)
        self.until(lambda: self.states and self.efforts and probe.subscribers(POSITION_COMMAND),
                   'the loop to be closed', timeout=60.0)

    def pump(self) -> None:
        """Handle messages for a moment; send the command if it is time."""
        now = time.monotonic()
        if self.target is not None and now - self._sent > 0.05:
            self._sent = now
            self.probe.publish(POSITION_COMMAND, self.target)
        self.probe.spin(0.01)

    def until(self, condition: Callable[[], Any], what: str, timeout: float = 30.0) -> float:
        """Wait for `condition` and return how long it took [s]."""
        begin = time.monotonic()
        self.runner.wait_until(condition, what, timeout, pause=self.pump)
        return time.monotonic() - begin

    def during(self, seconds: float) -> None:
        """Let time pass."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.pump()
        self.runner.check()

    def go(self, angle: float) -> None:
        """Track `angle` [rad] and wait until the brake is there."""
        self.target = angle
        self.until(lambda: abs(self.position - angle) < 0.3 and self.is_in('enabled'),
                   f'{angle} rad')

    def is_in(self, state: str) -> bool:
        """Whether the controller's last word was this state."""
        return bool(self.state) and self.state[-1].data == state

    def has(self, cause: Cause) -> bool:
        """Whether the controller reports this cause."""
        return bool(self.causes) and bool(self.causes[-1].data & cause)

    def clear(self) -> Any:
        """Clear faults."""
        return self.probe.call('controller', CLEAR_FAULTS)

    @property
    def position(self) -> float:
        """The brake's angle [rad]."""
        return self.states[-1].position[0]

    @property
    def effort(self) -> float:
        """The drive's measured torque [N·m]."""
        return self.states[-1].effort[0]
