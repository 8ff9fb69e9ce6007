# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `drive_emulator`: the simulated brake behind a CAN bus, as a motor drive would be.

It has no topics: everything goes over the bus. It is a node for its parameters' sake, among
them the faults that it can act out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from time import monotonic
from typing import Any

from engb_core.bench.virtual_brake import Measurement
from engb_ros.can.bus import CanBus
from engb_ros.can.codec import dbc_file, DriveCodec, DriveCommand, DriveStatus, OFF
from engb_ros.can.link import DriveEnd
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.brake_parameters import BRAKE_PARAMETERS, make_brake, word_about_torque
from engb_ros.nodes.can_bridge import BUS_PARAMETERS
from engb_ros.nodes.parameters import ParameterSpec

__all__ = ['DriveEmulatorNode', 'FAULTS', 'main']

FAULTS = ('none', 'lost', 'repeated', 'corrupted', 'late', 'bus_off', 'sensor_fault', 'refuses',
          'holds_on', 'deaf')

# A late timer makes up for no more than this at once [s]; late frames come in bursts so long.
_LONGEST_CATCH_UP = 0.05
_LATE = 0.12


class DriveEmulatorNode(ManagedNode):
    """Sends status frames at the drive's rate and obeys command frames."""

    node_name = 'drive_emulator'
    parameters = (
        *BRAKE_PARAMETERS,
        *BUS_PARAMETERS,
        ParameterSpec('fault', 'none', 'acted out now: every other sample lost, frames repeated, '
                      'a bit of each third frame wrong, frames held back and sent in bursts, '
                      'nothing sent or heard at all, the sensor\'s fault flag, no torque and mode '
                      'OFF whatever is asked, the last torque kept and mode TORQUE, commands not '
                      'heard', choices=FAULTS, live=True),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Build the brake and open the bus."""
        self._brake = make_brake(values)
        if word := word_about_torque(values):
            self.get_logger().warning(word)
        codec = DriveCodec(dbc_file(values['dbc']), values['drive'])
        self._link = DriveEnd(codec, values['command_timeout'])
        self._torque_constant = self._brake.model.motor.torque_constant
        self._commands: deque[tuple[int, bytes]] = deque(maxlen=100)
        self._held: list[tuple[int, bytes]] = []
        self._held_since = 0.0
        self._mode = OFF
        self.every(self._brake.period, self._tick)
        self._bus: CanBus | None = CanBus(
            values['interface'], values['channel'], values['bitrate'], self._on_frame,
            {codec.command.frame_id}, values['reconnect_time'])

    def start(self) -> None:
        """Let the time run."""
        self._pace_start = monotonic()
        self._pace_samples = self._brake.samples

    def close(self) -> None:
        """Give the bus back."""
        bus = getattr(self, '_bus', None)
        if bus is not None:
            bus.close()
            self._bus = None

    def _on_frame(self, identifier: int, data: bytes, _now: float, _waited: float) -> None:
        self._commands.append((identifier, data))   # the bus's thread; the timer obeys

    def _tick(self) -> None:
        if not self.active:
            return
        now, brake, fault = monotonic(), self._brake, self.values['fault']
        while self._commands:
            frame = self._commands.popleft()
            command = (None if fault in ('bus_off', 'deaf')
                       else self._link.receive(*frame, now))
            if command is not None and fault != 'holds_on':
                self._obey(command if fault != 'refuses' else DriveCommand(0.0, OFF))
        lost = self._link.receiver.watch(now)
        if fault == 'holds_on':
            brake.command(brake.torque)
        elif lost:
            self._obey(DriveCommand(0.0, OFF))
        due = int((now - self._pace_start) / brake.period) - (brake.samples - self._pace_samples)
        if due * brake.period > _LONGEST_CATCH_UP:
            due = 1
            self.start()
        for step in range(due):
            measured = self._brake.advance()
            # A frame has no stamp: what was missed is not sent late, as no drive would.
            if step == due - 1:
                self._sample(measured, fault, now)

    def _obey(self, command: DriveCommand) -> None:
        self._mode = command.mode
        self._brake.command(command.torque if command.mode != OFF else 0.0)

    def _sample(self, measured: Measurement, fault: str, now: float) -> None:
        flags = () if self._link.receiver.state.value == 'valid' else ('COMMAND_LOST',)
        if fault == 'sensor_fault':
            flags = (*flags, 'SENSOR_FAULT')
        frames = list(self._link.status(DriveStatus(
            measured.position, measured.velocity, measured.effort / self._torque_constant,
            self._mode, flags, measured.disc_speed, measured.pad_temperature)))
        count = self._brake.samples
        if fault == 'bus_off' or (fault == 'lost' and count % 2):
            return
        if fault == 'repeated':
            frames = frames * 2 if not self._held else self._held
            self._held = frames
        elif fault == 'corrupted' and count % 3 == 0:
            frames = [(identifier, data[:4] + bytes([data[4] ^ 0x10]) + data[5:])
                      for identifier, data in frames]
        elif fault == 'late':
            if not self._held:
                self._held_since = now
            self._held += frames
            if now - self._held_since < _LATE:
                return
            frames, self._held = self._held, []
        else:
            self._held = []
        if self._bus is not None:
            for frame in frames:
                self._bus.send(*frame)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(DriveEmulatorNode, args)
