# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `controller`: tracks angle or clamp force of one brake, and supervises itself."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from math import inf, isfinite
from time import monotonic, time_ns
from typing import Any

from rclpy.duration import Duration
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String, UInt64

from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings
from engb_core.control.causes import Cause, State
from engb_core.control.claims import CLAIM_PERIOD, ControllerClaims, STANDBY_CLAIM
from engb_core.control.clamp_force import read_mechanism
from engb_core.control.command_arbiter import Command
from engb_core.control.publisher_watch import FirstPublisher
from engb_core.errors import InputError
from engb_core.model import Model
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.controller_parameters import check_gains, controller_settings, PARAMETERS
from engb_ros.nodes.controller_words import ControllerWords
from engb_ros.nodes.joint import with_joint
from engb_ros.nodes.joint_reader import JointReader
from engb_ros.nodes.messages import (
    CLAMP,
    JointMessage,
    scalar,
    StampClock,
    stamped_command,
)
from engb_ros.nodes.model_door import ModelDoor

__all__ = ['ControllerNode', 'main']

# From the first joint state on a controller is silent for so long, to hear whether another is
# there: who hears the drive has been discovered, and hears the other one too [s].
_PROBATION = 0.5

# A standby that has not heard any torque yet gives a primary so long to start: of nodes that are
# started at once one comes seconds after the other, by chance. Discovery has had its time then,
# too: an announcement that is lost comes again within 3 s [s].
_FIRST_TAKEOVER = 5.0

# Faults of a standby that its primary has as well.
_OF_INPUTS = (Cause.STATE_STALE | Cause.COMMAND_STALE).value

# Primary and standby find the same commands stale within so long, looks at the clock included [s].
_BOTH_LATCH = 3.0 * CLAIM_PERIOD

# The source of stamped commands that name none.
UNNAMED = '(unnamed)'

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
        model = with_joint(Model.read(values['model']) if values['model'] else Model(), values)
        self._mechanism = (read_mechanism(values['mechanism']) if values['mechanism'] else None)
        self._controller = BrakeController(model, self._settings(values))
        self._joint = model.joint.name
        self._read = JointReader(self._joint).read
        self._stamps = StampClock()
        self._reference = JointMessage(self._joint)
        self._report = JointState(name=['input', 'command', 'output'],
                                  position=array('d', [0.0] * 3), effort=array('d', [0.0] * 3))
        self._reference_every = values['reference_every']
        self._force_every = values['force_every']
        self._report_every = values['report_every']
        self._count = 0
        self._speak_at, self._look_at = inf, 0.0
        self._claims = ControllerClaims()
        self._spoke = False
        self._standby = values['standby']
        self._heard_torque, self._heard_at = 0.0, inf
        self._looked_at_clock = 0
        self._well_at = inf
        self._hears_primary = False
        self._effort_publisher = self.advertise(interface.EFFORT_COMMAND)
        self._publish_effort = self._effort_publisher.publish
        self._publish_reference = self.advertise(interface.REFERENCE).publish
        self._publish_report = self.advertise(interface.CONTROL_REPORT).publish
        self._publish_force = (self.advertise(interface.CLAMP_FORCE).publish
                               if self._controller.estimator else None)
        self._words = ControllerWords(self, self._controller, values['hardware_id'])
        self.listen(interface.CONTROLLER_STATE, self._on_state_of_another)
        self._somebody_left = False
        activation = self.advertise(interface.CONTROLLER_ACTIVATION)
        self._publish_activation = activation.publish
        self.listen(interface.CONTROLLER_ACTIVATION, self._on_activation)
        self._command_topics = [
            self.listen(topic, callback).topic_name for topic, callback in (
                (interface.POSITION_COMMAND, self._on_position_command),
                (interface.CLAMP_FORCE_COMMAND, self._on_force_command))]
        self.listen(interface.POSITION_COMMAND_STAMPED, self._on_position_command_stamped)
        self.listen(interface.CLAMP_FORCE_COMMAND_STAMPED, self._on_force_command_stamped)
        self.listen(interface.DRIVE_STATE, self._on_drive_state)
        if self._standby:
            self._primary = FirstPublisher()
            self.listen_by_publisher(interface.EFFORT_COMMAND, self._on_torque_of_another)
        self.listen(interface.DISC_SPEED, self._on_disc_speed)
        if values['observer_timeout'] > 0.0:
            self.listen(interface.DISTURBANCE, self._on_disturbance)
        joint_states = self.listen(interface.JOINT_STATES, self._on_joint_states, raw=True)
        self._drives = FirstPublisher()
        self._drive: bytes | None = None
        self._joint_states_by_publisher: Any = None
        self._tells_drives_apart = self._several_drives = False
        # Names as they are after remapping: the graph knows no others.
        self._effort_topic = self._effort_publisher.topic_name
        self._joint_topic = joint_states.topic_name
        self._activation_topic = activation.topic_name
        self.serve(interface.START_REFERENCE, self._start_reference)
        self.serve(interface.CLEAR_FAULTS, self._clear_faults)
        self._door = ModelDoor(self, self._controller, lambda: self.values['candidate_model'],
                               lambda candidate: with_joint(candidate, self.values))
        self.poll_period = _watch_period(values)
        self.every(CLAIM_PERIOD, self._look_for_others)
        self.every(values['diagnostics_period'], self._diagnose)

    def validate(self, values: dict[str, Any]) -> None:
        """Check the settings together; no change may leave a loop that holds nothing."""
        controller_settings(values, getattr(self, '_mechanism', None))
        if hasattr(self, '_controller'):
            check_gains(values, self.values)

    def reconfigure(self, values: dict[str, Any]) -> None:
        """Take up new settings without a jump of the torque."""
        if hasattr(self, '_controller'):
            self._controller.apply(self._settings(values))

    def close(self) -> None:
        """End the thread that reads models."""
        door = self.__dict__.pop('_door', None)
        if door is not None:
            door.close()

    def _settings(self, values: dict[str, Any]) -> ControllerSettings:
        if self.sim_time:
            # Simulated time may stand still, or be slow: joint states have no age then.
            values = {**values, 'state_timeout': 0.0}
        return controller_settings(values, self._mechanism)

    def start(self) -> None:
        """Begin at the position where the motor stands, unless someone else drives it."""
        now = monotonic()
        self._controller.start(now)
        self._claims.start(now, time_ns())
        self._speak_at, self._spoke = inf, False
        self._controller.silent = self._standby
        self._heard_at, self._hears_primary = now, False
        if self._standby:
            self._primary.forget()
        self._well_at = now
        if not self._standby:
            self._claim()
        if self._controller.supervisor.holds(Cause.NOT_WATCHED):
            self.get_logger().warning('the age of joint states or commands is not watched '
                                      '(state_timeout, command_timeout, use_sim_time)')
        self._look_for_others()
        self._words.tell()

    def stop(self) -> None:
        """Send a last command: no torque; and say so. A healthy controller leaves a standby the
        torque that is there; should none take over, the drive lets go by its own timeout."""
        hands_over = (self._claims.standby(monotonic())
                      and not self._controller.supervisor.stopping)
        if not self._controller.silent and not hands_over:
            self._publish_effort(scalar(0.0))
            # A publisher that is destroyed takes along what is still under way.
            self._effort_publisher.wait_for_all_acked(Duration(seconds=_LAST_WORD))
        self._words.say_inactive(_LAST_WORD)

    # Services.

    def _start_reference(self) -> str:
        return f'the reference takes {self._controller.start_reference():.1f} s'

    def _clear_faults(self) -> str:
        left = self._controller.clear(monotonic(), speak=not self._standby)
        self._words.tell()
        if left:
            raise InputError('still there: ' + ', '.join(cause.key for cause in Cause
                                                         if left & cause))
        if self._controller.source.commanded_by_trajectory:
            return ('cleared; the position is held until ~/start_reference begins the reference '
                    'anew')
        return 'cleared; the position is held until a new command comes'

    # Messages and timers.

    def _on_position_command(self, message: Float64) -> None:
        self._command(Command(message.data))

    def _on_force_command(self, message: Float64) -> None:
        self._command(Command(message.data, by_force=True))

    def _on_position_command_stamped(self, message: JointState) -> None:
        self._stamped(message, self._joint, False)

    def _on_force_command_stamped(self, message: JointState) -> None:
        self._stamped(message, CLAMP, True)

    def _stamped(self, message: JointState, entry: str, by_force: bool) -> None:
        command = stamped_command(message, entry, by_force)
        if command is None:
            return
        now = self.get_clock().now().nanoseconds
        if now < self._looked_at_clock:
            self._controller.supervisor.commands.clock_was_set()
        self._looked_at_clock = now
        age = 1e-9 * (now - command.stamp)
        self._command(Command(command.value, by_force, command.source or UNNAMED, command.stamp,
                              age, command.counter))

    def _command(self, command: Command) -> None:
        now = monotonic()
        if self.active and now >= self._speak_at:
            self._controller.on_command(now, command)

    def _on_drive_state(self, message: String) -> None:
        if self.active:
            self._controller.on_drive_state(monotonic(), message.data)

    def _on_torque_of_another(self, message: Float64, publisher: bytes | None) -> None:
        now = monotonic()
        if (self._controller.silent and isfinite(message.data)
                and self._primary.is_first(now, publisher)):
            self._heard_torque, self._heard_at = message.data, now
            self._hears_primary = True

    def _on_disc_speed(self, message: Float64) -> None:
        self._controller.on_disc_speed(monotonic(), message.data)

    def _on_disturbance(self, message: Float64) -> None:
        self._controller.on_disturbance(monotonic(), message.data)

    def _on_joint_states(self, message: bytes) -> None:
        if not self._tells_drives_apart:
            self._on_joint_state(message)

    def _on_joint_states_by_publisher(self, message: bytes, publisher: bytes | None) -> None:
        if publisher is None or not self._several_drives:   # nobody tells them apart, or need
            return
        first = self._drives.is_first(monotonic(), publisher)
        if not self._tells_drives_apart:
            self._tells_drives_apart = first   # what it says next counts, and nobody else's
        elif first:
            self._on_joint_state(message)

    def _look_at_drives(self, now: float) -> None:
        """While several nodes publish joint states take those of the first alone.

        That costs a fifth of a cycle more (`KnownPublisherSubscription`): not without need.
        """
        several = self.count_publishers(self._joint_topic) > 1
        self._controller.supervisor.set(Cause.OTHER_DRIVE, several, now)
        if several and not self._several_drives:
            self._drives.forget()
            if self._drive is not None:
                self._drives.is_first(now, self._drive)
            # Kept until the cleanup: whoever comes and goes shall not have it made anew.
            if self._joint_states_by_publisher is None:
                self._joint_states_by_publisher = self.listen_by_publisher(
                    interface.JOINT_STATES, self._on_joint_states_by_publisher, raw=True)
        self._several_drives = several
        if not several:
            self._tells_drives_apart = False
            self._drive = next((bytes(entry.endpoint_gid) for entry in
                                self.get_publishers_info_by_topic(self._joint_topic)), None)

    def _on_joint_state(self, message: bytes) -> None:
        now = monotonic()
        if now < self._speak_at or not self.active:
            if self._speak_at == inf and self.active:
                self._speak_at = now + _PROBATION
                self._heard_at = now   # who hears the drive can hear a primary from here on
            return
        if not self._spoke and self._claims.unclear(now):
            self._speak_at = now + CLAIM_PERIOD
            return
        controller = self._controller
        sample = self._read(message)
        if sample is None:
            controller.on_wrong_joint(now)
            self._words.hear_wrong_joint(message, self._joint)
            return
        sec, nanosec, position, velocity, effort = sample
        torque = controller.on_state(now, self._stamps.seconds_of(sec, nanosec), position,
                                     velocity, effort)
        if torque is None:
            if self._standby and controller.silent:
                self._maybe_take_over(now)
            return
        self._spoke = True
        self._publish_effort(scalar(torque))
        self._count = count = self._count + 1
        if self._reference_every and count % self._reference_every == 0:
            setpoint = controller.setpoint
            self._publish_reference(self._reference.fill_at(
                sec, nanosec, setpoint.position, setpoint.velocity, controller.feedforward))
        elif self._publish_force is not None and count % self._force_every == 1:
            assert controller.estimator is not None, 'a force is published where it is estimated'
            self._publish_force(scalar(controller.estimator.force))
        if self._report_every and count % self._report_every == 0:
            self._send_report(sec, nanosec)

    def _door_look(self) -> None:
        door = self.__dict__.get('_door')
        if door is not None:
            door.look()

    def poll(self) -> None:
        """Let the watchdogs look; say so if the state has changed."""
        now = monotonic()
        self._door_look()
        if not self.active or now < self._look_at:
            return
        self._look_at = now + self.poll_period
        torque = self._controller.on_tick(now)
        if torque is not None:
            self._publish_effort(scalar(torque))
        self._words.tell_changes()

    def _on_activation(self, message: UInt64) -> None:
        if self.active:
            self._claims.hear(monotonic(), message.data)

    def _on_state_of_another(self, message: String) -> None:
        self._somebody_left |= message.data == State.INACTIVE.value

    def _claim(self) -> None:
        """Say that this controller drives the brake; who has a fault makes no claim."""
        self._publish_activation(UInt64(data=self._claims.own))

    def _look_for_others(self) -> None:
        if not self.active:
            return
        if self._somebody_left:   # his last word on the topic that both share hides this one's
            self._somebody_left = False
            self._words.tell()
        now, controller, count = monotonic(), self._controller, self.count_publishers
        supervisor = controller.supervisor
        supervisor.commands.rivals = self._has_rivals([count(topic)
                                                       for topic in self._command_topics])
        self._look_at_drives(now)
        if controller.silent and self._standby:
            if not supervisor.faults:
                self._well_at = now
            if supervisor.faults == Cause.STATE_STALE or (
                    supervisor.faults and not supervisor.faults & ~_OF_INPUTS
                    and self._claims.claimed_since(self._well_at + _BOTH_LATCH)):
                # It gives no torque that could come back: where the drive is back it is ready.
                # Stale commands have latched the primary, too: whoever clears that one, which is
                # then healthy and says so, means both.
                controller.clear(now, speak=False)
            supervisor.set(Cause.STANDBY_NOT_READY, not self._could_take_over(now), now)
            if not supervisor.stopping:
                self._publish_activation(UInt64(data=STANDBY_CLAIM))
            return   # it hears the other one, and whether it falls silent
        faulty = bool(supervisor.stopping & ~Cause.OTHER_CONTROLLER.value)
        present, was_first = self._claims.judge(
            now, count(self._effort_topic), self._spoke, faulty)
        controller.on_other_controller(now, present, was_first, latch=not self._standby)
        if controller.silent:
            self._heard_at, self._spoke = now, False
        elif not supervisor.stopping:
            self._claim()

    def _has_rivals(self, counts: list[int]) -> bool:
        """Whether more than one node publishes commands without a name: on one topic, or one node
        angles and another one forces."""
        if max(counts) > 1:
            return True
        return min(counts) > 0 and len(
            {(_process(entry), entry.node_namespace, entry.node_name)
             for topic in self._command_topics
             for entry in self.get_publishers_info_by_topic(topic)}) > 1

    def _could_take_over(self, now: float) -> bool:
        """Whether a standby hears the one that it stands by for, and the drive would hear it.

        A drive is known by the process that publishes joint states: once that one is seen to
        listen to torque, it is matched. A drive in two processes is never seen so: of it any
        listener counts, once the discovery of all has had its time.
        """
        if not self._hears_primary:
            return False
        listeners = {_process(entry) for entry in
                     self.get_subscriptions_info_by_topic(self._effort_topic)}
        drives = {_process(entry) for entry in
                  self.get_publishers_info_by_topic(self._joint_topic)}
        controllers = {_process(entry) for entry in
                       self.get_publishers_info_by_topic(self._activation_topic)}
        return bool(listeners & drives or (
            now - self._speak_at > _FIRST_TAKEOVER and listeners - controllers))

    def _maybe_take_over(self, now: float) -> None:
        """Speak if the one who spoke has fallen silent, and nobody else claims to."""
        patience = self.values['takeover_time'] if self._hears_primary else _FIRST_TAKEOVER
        supervisor = self._controller.supervisor
        if now - self._heard_at <= patience or supervisor.stopping:
            return
        supervisor.set(Cause.STANDBY_NOT_READY, False, now)
        self._claims.take_over(time_ns())
        # It speaks from here on: the dead one, whom the graph shows for a while yet, is nobody to
        # wait for, though he says nothing of himself.
        self._spoke = True
        self._controller.take_over(now, self._heard_torque)
        # The torque that was there, at once; the next sample's comes a cycle later.
        self._publish_effort(scalar(self._controller.clamp.output))
        self._claim()
        self.get_logger().warning('the other controller fell silent: this one takes over')

    # Telling.

    def _send_report(self, sec: int, nanosec: int) -> None:
        values, message = self._controller.report, self._report
        message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
        position, effort = message.position, message.effort
        position[0], position[1], position[2] = (
            values.position_input, values.position_command, values.position_output)
        effort[0], effort[1], effort[2] = (
            values.effort_input, values.effort_command, values.effort_output)
        self._publish_report(message)

    def _diagnose(self) -> None:
        if self.active:
            self._words.diagnose()


def _process(endpoint: TopicEndpointInfo) -> bytes:
    """Return what the endpoints of one process have in common: the prefix of their GUIDs (RTPS
    2.5, 9.3.1)."""
    return bytes(endpoint.endpoint_gid[:12])


def _watch_period(values: dict[str, Any]) -> float:
    """Return how often the watchdog of the joint states looks [s].

    While they come, each cycle looks at all ages itself; this is for when they don't.
    """
    timeout = values['state_timeout']
    return min(max(0.1 * timeout, 0.002), 0.02) if timeout > 0.0 else 0.02


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(ControllerNode, args)
