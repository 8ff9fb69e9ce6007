"""Node `controller`: tracks angle or clamp force of one brake, and supervises itself."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from math import inf
import sys
from time import monotonic, time_ns
from typing import Any

from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String, UInt32, UInt64

from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings
from engb_core.control.causes import Cause
from engb_core.errors import InputError
from engb_core.model import Model
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.controller_parameters import controller_settings, PARAMETERS
from engb_ros.nodes.diagnostics import controller_status, DiagnosticMessage
from engb_ros.nodes.messages import joint_sample, JointMessage, Scalar, StampClock

__all__ = ['ControllerNode', 'main']

# How often the graph is searched for another controller [s].
_LOOK = 0.5

# From the first joint state on a controller is silent for so long, to hear whether another is
# there: who hears the drive has been discovered, and hears the other one too [s].
_PROBATION = 0.5

# Of a stranger that says nothing of itself, who was alone for so long was here first [s].
_ALONE = 1.0

# The last command is given so long to arrive [s].
_LAST_WORD = 0.3


class ControllerNode(ManagedNode):
    """One control cycle per `joint_states` message: the drive's clock sets the pace.

    The watchdogs look at a steady clock, also when no message comes.
    """

    node_name = 'controller'
    parameters = PARAMETERS

    def configure(self, values: dict[str, Any]) -> None:
        """Build the controller and its endpoints."""
        model = Model.read(values['model']) if values['model'] else Model()
        self._controller = BrakeController(model, self._settings(values))
        self._joint = model.joint.name
        self._stamps = StampClock()
        self._scalar = Scalar()
        self._reference = JointMessage(self._joint)
        self._report = JointState(name=['input', 'command', 'output'],
                                  position=array('d', [0.0] * 3), effort=array('d', [0.0] * 3))
        self._diagnostic = DiagnosticMessage(f'{self.get_namespace().strip("/")}: controller')
        self._reference_every = values['reference_every']
        self._force_every = values['force_every']
        self._report_every = values['report_every']
        self._count = 0
        self._told: tuple[Any, int] | None = None
        self._activation = 0
        self._speak_at, self._look_at = inf, 0.0
        self._other_activations: set[int] = set()
        self._other_present = False
        self._alone_since = inf
        self._effort_publisher = self.advertise(interface.EFFORT_COMMAND)
        self._publish_effort = self._effort_publisher.publish
        self._publish_reference = self.advertise(interface.REFERENCE).publish
        self._publish_report = self.advertise(interface.CONTROL_REPORT).publish
        self._publish_force = (self.advertise(interface.CLAMP_FORCE).publish
                               if self._controller.estimator else None)
        self._publish_state = self.advertise(interface.CONTROLLER_STATE).publish
        self._publish_causes = self.advertise(interface.CONTROLLER_CAUSES).publish
        self._publish_activation = self.advertise(interface.CONTROLLER_ACTIVATION).publish
        self.listen(interface.CONTROLLER_ACTIVATION, self._on_activation)
        self._publish_diagnostics = self.advertise(interface.DIAGNOSTICS).publish
        self.listen(interface.POSITION_COMMAND, self._on_position_command)
        self.listen(interface.CLAMP_FORCE_COMMAND, self._on_force_command)
        self.listen(interface.DISC_SPEED, self._on_disc_speed)
        if values['observer_timeout'] > 0.0:
            self.listen(interface.DISTURBANCE, self._on_disturbance)
        self.listen(interface.JOINT_STATES, self._on_joint_states)
        self.serve(interface.START_REFERENCE, self._start_reference)
        self.serve(interface.CLEAR_FAULTS, self._clear_faults)
        self.serve(interface.ACCEPT_MODEL, self._accept_model)
        self.poll_period = _watch_period(values)
        self.every(_LOOK, self._look_for_others)
        self.every(values['diagnostics_period'], self._diagnose)

    def validate(self, values: dict[str, Any]) -> None:
        """Check the settings together."""
        controller_settings(values)

    def reconfigure(self, values: dict[str, Any]) -> None:
        """Take up new settings without a jump of the torque."""
        if hasattr(self, '_controller'):
            self._controller.apply(self._settings(values))
            self.poll_period = _watch_period(values)

    def _settings(self, values: dict[str, Any]) -> ControllerSettings:
        if self.get_parameter('use_sim_time').value:
            # Simulated time may stand still, or be slow: joint states have no age then.
            values = {**values, 'state_timeout': 0.0}
        return controller_settings(values)

    def start(self) -> None:
        """Begin at the position where the motor stands, unless someone else drives it."""
        self._controller.start(monotonic())
        self._activation = time_ns()
        self._speak_at = self._alone_since = inf
        self._other_activations.clear()
        self._other_present = False
        self._publish_activation(UInt64(data=self._activation))
        self._look_for_others()
        self._tell()

    def stop(self) -> None:
        """Send a last command: no torque."""
        if not self._controller.silent:
            self._publish_effort(self._scalar.fill(0.0))
            # A publisher that is destroyed takes along what is still under way.
            self._effort_publisher.wait_for_all_acked(Duration(seconds=_LAST_WORD))

    # Services.

    def _start_reference(self) -> str:
        return f'the reference takes {self._controller.start_reference():.1f} s'

    def _clear_faults(self) -> str:
        left = self._controller.clear(monotonic())
        self._tell()
        if left:
            raise InputError('still there: ' + ', '.join(cause.name.lower() for cause in Cause
                                                         if left & cause))
        return 'cleared; the position is held until a new command comes'

    def _accept_model(self) -> str:
        path = self.values['candidate_model']
        if not path:
            raise InputError('parameter candidate_model is empty; set it to the model file to '
                             'accept')
        self._controller.accept_model(Model.read(path))
        self.get_logger().info(f'model {path} accepted')
        return f'{path} is in use'

    # Messages and timers.

    def _on_position_command(self, message: Float64) -> None:
        now = monotonic()
        if self.active and now >= self._speak_at:
            self._controller.on_position_command(now, message.data)

    def _on_force_command(self, message: Float64) -> None:
        now = monotonic()
        if self.active and now >= self._speak_at:
            self._controller.on_force_command(now, message.data)

    def _on_disc_speed(self, message: Float64) -> None:
        self._controller.on_disc_speed(monotonic(), message.data)

    def _on_disturbance(self, message: Float64) -> None:
        self._controller.on_disturbance(monotonic(), message.data)

    def _on_joint_states(self, message: JointState) -> None:
        now = monotonic()
        if now < self._speak_at or not self.active:
            if self._speak_at == inf and self.active:
                self._speak_at = now + _PROBATION
            return
        controller = self._controller
        sample = joint_sample(message, self._joint)
        if sample is None:
            controller.on_wrong_joint(now)
            return
        stamp = message.header.stamp
        torque = controller.on_state(now, self._stamps.seconds(stamp), *sample)
        if torque is None:
            return
        self._publish_effort(self._scalar.fill(torque))
        self._count = count = self._count + 1
        if self._reference_every and count % self._reference_every == 0:
            setpoint = controller.setpoint
            self._publish_reference(self._reference.fill_at(
                stamp, setpoint.position, setpoint.velocity, controller.feedforward))
        elif self._publish_force is not None and count % self._force_every == 1:
            self._publish_force(self._scalar.fill(controller.estimator.force))
        if self._report_every and count % self._report_every == 0:
            self._send_report(stamp)

    def poll(self) -> None:
        """Let the watchdogs look; say so if the state has changed."""
        now = monotonic()
        if not self.active or now < self._look_at:
            return
        self._look_at = now + self.poll_period
        torque = self._controller.on_tick(now)
        if torque is not None:
            self._publish_effort(self._scalar.fill(torque))
        supervisor = self._controller.supervisor
        if self._told != (supervisor.state, supervisor.faults):
            self._tell()

    def _on_activation(self, message: UInt64) -> None:
        if self.active and message.data != self._activation:
            self._other_activations.add(message.data)
            self._look_for_others()

    def _look_for_others(self) -> None:
        if not self.active:
            return
        now = monotonic()
        present = self.count_publishers(interface.EFFORT_COMMAND.name) > 1
        if self._other_present and not present:
            self._other_activations.clear()   # it has gone
        self._other_present = present
        if not present and self._speak_at < inf:
            self._alone_since = min(self._alone_since, now)
        # Its activation may be heard before its publisher is discovered, or after.
        if self._other_activations:
            was_first = self._activation < min(self._other_activations)
        else:
            was_first = now - self._alone_since > _ALONE
        self._controller.on_other_controller(now, present, was_first)

    # Telling.

    def _send_report(self, stamp: Any) -> None:
        values, message = self._controller.report, self._report
        message.header.stamp.sec, message.header.stamp.nanosec = stamp.sec, stamp.nanosec
        position, effort = message.position, message.effort
        position[0], position[1], position[2] = (
            values.position_input, values.position_command, values.position_output)
        effort[0], effort[1], effort[2] = (
            values.effort_input, values.effort_command, values.effort_output)
        self._publish_report(message)

    def _tell(self) -> None:
        """Publish the state now, because it has changed."""
        supervisor = self._controller.supervisor
        before, self._told = self._told, (supervisor.state, supervisor.faults)
        self._publish_state(String(data=supervisor.state.value))
        self._diagnose()
        if before is not None and before[1] != self._told[1] and supervisor.latched:
            self.get_logger().error('fault: ' + ', '.join(
                cause.name.lower() for cause in Cause if supervisor.latched & cause))

    def _diagnose(self) -> None:
        if not self.active:
            return
        now = monotonic()
        self._publish_causes(UInt32(data=int(self._controller.supervisor.active(now))))
        level, message, values = controller_status(self._controller, now)
        self._publish_diagnostics(self._diagnostic.fill(
            self.get_clock().now().to_msg(), level, message, values))


def _watch_period(values: dict[str, Any]) -> float:
    """Return how often the watchdog of the joint states looks [s].

    While they come, each cycle looks at all ages itself; this is for when they don't.
    """
    timeout = values['state_timeout']
    return min(max(0.1 * timeout, 0.002), 0.02) if timeout > 0.0 else 0.02


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(ControllerNode, args)


if __name__ == '__main__':
    sys.exit(main())
