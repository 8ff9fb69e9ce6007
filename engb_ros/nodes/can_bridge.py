# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `can_bridge`: a motor drive on a CAN bus, with the topics of the plant."""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic
from typing import Any

from std_msgs.msg import String

from engb_core.model import Model
from engb_ros import interface
from engb_ros.can.bus import CanBus
from engb_ros.can.codec import dbc_file, DriveCodec, DriveCommand, DriveStatus, OFF, TORQUE
from engb_ros.can.drive_watch import DriveState, DriveWatch
from engb_ros.can.end_to_end import LinkState
from engb_ros.can.link import ControllerEnd
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.diagnostics import DiagnosticMessage, ERROR, OK, WARN
from engb_ros.nodes.joint import EFFORT_SOURCE, HARDWARE_ID, JOINT, listen_for_effort, with_joint
from engb_ros.nodes.messages import JointMessage, scalar
from engb_ros.nodes.parameters import ParameterSpec
from engb_ros.nodes.realtime import REALTIME

__all__ = ['BUS_PARAMETERS', 'CanBridgeNode', 'main']

BUS_PARAMETERS = (
    ParameterSpec('interface', 'socketcan', 'python-can\'s interface: socketcan, udp_multicast, '
                  'virtual, pcan, kvaser, …'),
    ParameterSpec('channel', 'can0', 'its channel; of udp_multicast GROUP or GROUP:PORT (groups '
                  'with one port hear each other)'),
    ParameterSpec('bitrate', 0, '0: as the interface is configured', 'bit/s', 0, 10_000_000),
    ParameterSpec('dbc', '', 'DBC file: a path, or one of this package: '
                  'engb_drive.dbc (also where it is empty), engb_four_drives.dbc'),
    ParameterSpec('drive', 'DRIVE', 'the drive\'s name in it, which its frames\' names begin '
                  'with: DRIVE_COMMAND, DRIVE_STATUS_1, DRIVE_STATUS_2'),
    ParameterSpec('reconnect_time', 1.0, 'pause before a failed bus is opened again', 's', 0.01,
                  60.0),
)

# How often the link is looked at, and how often an idle drive hears that it shall be off [s].
_TICK = 0.01

# The last word, that the drive shall be off, is tried again for so long while the bus's queue is
# full [s].
_LAST_WORD = 0.05

_SAID = {
    DriveState.REFUSES: 'the drive refuses: asked for torque, it reports mode {mode}{deaf}',
    DriveState.HOLDS_ON: 'the drive does not let go: asked to be off, it reports mode {mode}',
}


class CanBridgeNode(ManagedNode):
    """Turns status frames into `joint_states` and torque commands into command frames.

    Only samples whose frames pass the end-to-end check are published; when the link is not
    valid, nothing is, and the controller's watchdog does the rest. A sample's stamp is the time at
    which its frame came, not the one at which a busy computer read it; one that was read later
    than `link_timeout` tells nothing of the brake any more and is left out. Whether the drive is
    in the mode that it was asked for is told as `drive_state`.
    """

    node_name = 'can_bridge'
    parameters = (
        ParameterSpec('model', '', 'model file, for torque constant and joint; empty: the '
                      'paper\'s motor'),
        JOINT,
        HARDWARE_ID,
        *BUS_PARAMETERS,
        *REALTIME,
        EFFORT_SOURCE,
        ParameterSpec('effort_limit', 0.75, 'the drive is asked for no more; what no frame could '
                      'carry is no command of its controller, and not taken at all', 'N·m', 0.0,
                      1e4),
        ParameterSpec('link_timeout', 0.05, 'without status frames for so long the link is '
                      'invalid; a frame that was read so late is no news', 's', 0.001, 10.0),
        ParameterSpec('command_timeout', 0.1, 'without a torque command for so long the drive is '
                      'switched off', 's', 0.001, 10.0),
        ParameterSpec('mode_timeout', 0.1, 'a drive that is not in the mode it was asked for, '
                      'so long, refuses; not below the drive\'s own command timeout', 's', 0.001,
                      10.0),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Open the bus."""
        model = with_joint(Model.read(values['model']) if values['model'] else Model(), values)
        codec = DriveCodec(dbc_file(values['dbc']), values['drive'])
        self._torque_constant = model.motor.torque_constant
        self._link = ControllerEnd(codec, values['link_timeout'])
        self._watch = DriveWatch(values['mode_timeout'])
        self._limit, self._largest = values['effort_limit'], codec.largest_torque
        self._modes = codec.mode_names
        self._joint = JointMessage(model.joint.name)
        self._flags: tuple[str, ...] = ()
        self._samples = self._withheld = self._late = self._limited = self._rejected = 0
        self._ignored = 0
        self._counted = (0, 0, 0)
        self._news: tuple[bool, ...] = (False, False, False)
        self._command_time: float | None = None
        self._told: str | None = None
        self._drive_state: DriveState | None = None
        self._diagnostic = DiagnosticMessage(f'{self.get_namespace().strip("/")}: can_bridge',
                                             values['hardware_id'])
        self._publish_joint = self.advertise(interface.JOINT_STATES).publish
        self._publish_disc = self.advertise(interface.DISC_SPEED).publish
        self._publish_temperature = self.advertise(interface.PAD_TEMPERATURE).publish
        self._publish_drive = self.advertise(interface.DRIVE_STATE).publish
        self._publish_diagnostics = self.advertise(interface.DIAGNOSTICS).publish
        listen_for_effort(self, values, model.joint.name, self._on_effort, self._on_other_effort)
        self.every(_TICK, self._on_tick)
        self.every(0.5, self._report)
        self._bus: CanBus | None = CanBus(
            values['interface'], values['channel'], values['bitrate'], self._on_frame,
            {codec.status_1.frame_id, codec.status_2.frame_id}, values['reconnect_time'])

    def start(self) -> None:
        """Say from the beginning what the drive does."""
        self._told = self._drive_state = None

    def stop(self) -> None:
        """Switch the drive off."""
        if self._bus is not None:
            link = self._link

            def off() -> tuple[int, bytes]:
                return link.command(DriveCommand(0.0, OFF))

            self._bus.send_surely(off, _LAST_WORD)

    def close(self) -> None:
        """Give the bus back."""
        bus = getattr(self, '_bus', None)
        if bus is not None:
            bus.close()
            self._bus = None

    def _send(self, command: DriveCommand, now: float) -> None:
        self._watch.ask(command.mode, now)
        if self._bus is not None and not self._bus.send(*self._link.command(command)):
            self._link.take_back()

    def _on_effort(self, torque: float) -> None:
        if not self.active:
            return
        if not abs(torque) <= self._largest:   # NaN too
            self._rejected += 1
            return
        if abs(torque) > self._limit:
            self._limited += 1
            torque = min(max(torque, -self._limit), self._limit)
        now = self._command_time = monotonic()
        self._send(DriveCommand(torque, TORQUE), now)

    def _on_other_effort(self) -> None:
        self._ignored += 1

    def _on_frame(self, identifier: int, data: bytes, now: float, waited: float) -> None:
        """Take a frame; runs in the bus's thread."""
        status = self._link.receive(identifier, data, now)
        if status is None or not self.active:
            return
        self._flags = status.flags
        self._watch.report(status, now)
        if 'SENSOR_FAULT' in status.flags:
            self._withheld += 1
            return
        if waited > self.values['link_timeout']:
            self._late += 1
            return
        self._publish(status, now - waited)

    def _publish(self, status: DriveStatus, came: float) -> None:
        stamp = self.get_clock().now().nanoseconds - round(1e9 * (monotonic() - came))
        self._publish_joint(self._joint.fill(
            stamp, status.angle, status.speed, self._torque_constant * status.current))
        self._samples += 1
        if self._samples % 10 == 0:
            self._publish_disc(scalar(status.disc_speed))
        if self._samples % 100 == 0:
            self._publish_temperature(scalar(status.temperature))

    def _on_tick(self) -> None:
        if not self.active:
            return
        now = monotonic()
        self._link.watch(now)
        if self._command_time is None or now - self._command_time > self.values['command_timeout']:
            self._send(DriveCommand(0.0, OFF), now)
        up = self._bus is not None and self._bus.is_up
        state = self._watch.state(up and self._link.state is LinkState.VALID, now)
        # Said again and again while the drive does not obey: one message counts for nothing.
        if state is not self._drive_state or state in _SAID:
            self._drive_state = state
            self._publish_drive(String(data=state.value))
        _, text, _ = self._status()
        if text != self._told:
            self._diagnose()

    def _status(self) -> tuple[int, str, dict[str, str]]:
        bus, link, state = self._bus, self._link, self._drive_state
        assert bus is not None, 'an active node has its bus'
        number = self._watch.reported_mode
        mode = str(number) if number is None else self._modes.get(number, str(number))
        values = {'bus': 'up' if bus.is_up else 'down', 'bus_failures': str(bus.failures),
                  'sends_refused': str(bus.refused), 'link': link.state.value,
                  'drive_state': state.value if state else '', 'drive_mode': mode,
                  'samples': str(self._samples), 'samples_withheld': str(self._withheld),
                  'samples_late': str(self._late),
                  'commands_limited': str(self._limited),
                  'commands_rejected': str(self._rejected),
                  'commands_of_others': str(self._ignored), 'flags': ' '.join(self._flags)}
        values |= {f'frames_{name}': str(count) for name, count in link.counts().items()}
        if not bus.is_up:
            return ERROR, 'bus down (bus-off or cut off); reconnecting', values
        if link.state is not LinkState.VALID:
            return ERROR, f'link {link.state.value}', values
        if state in _SAID:
            deaf = ' and hears no commands' if 'COMMAND_LOST' in self._flags else ''
            return ERROR, _SAID[state].format(mode=mode, deaf=deaf), values
        if self._flags:
            return WARN, 'drive: ' + ', '.join(flag.lower() for flag in self._flags), values
        refusing, beyond, others = self._news
        if refusing:
            return WARN, 'the bus takes no frames (queue full); commands are dropped', values
        if beyond:
            return WARN, ('torque commands beyond the limit; is someone else on the topic, or '
                          'effort_limit not the controller\'s?'), values
        if others:
            return WARN, ('more than one node commands torque; the one that came first is '
                          'obeyed'), values
        return OK, 'link valid', values

    def _report(self) -> None:
        """Look, twice a second, whether what comes and goes with each message has happened."""
        counted = (self._bus.refused if self._bus is not None else 0,
                   self._rejected + self._limited, self._ignored)
        self._news = tuple(
            now > before for now, before in zip(counted, self._counted, strict=True))
        self._counted = counted
        self._diagnose()

    def _diagnose(self) -> None:
        if not self.active:
            return
        level, text, values = self._status()
        if text != self._told:
            # Two calls: rclpy raises where one place in the code logs at two severities.
            if level == OK:
                self.get_logger().info(text)
            else:
                self.get_logger().warning(text)
        self._told = text
        self._publish_diagnostics(self._diagnostic.fill(
            self.get_clock().now().to_msg(), level, text, values))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(CanBridgeNode, args)
