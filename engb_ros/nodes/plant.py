"""Node `plant`: the simulated brake behind its drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import sys
import time as steady
from typing import Any

from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64

from engb_core.control.clamp_force import read_mechanism
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.sensors import SensorSettings
from engb_core.statics import mechanism_load
from engb_ros import interface
from engb_ros.files import TRUE_BRAKE
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.messages import JointMessage, Scalar
from engb_ros.nodes.parameters import ParameterSpec

__all__ = ['PlantNode', 'main']

# A late timer makes up for no more than this at once; beyond, the brake's time falls behind [s].
_LONGEST_CATCH_UP = 0.05

# In lockstep, an answer that never comes is waited for so long [s].
_LOCKSTEP_PATIENCE = 0.25


class PlantNode(ManagedNode):
    """Publishes `joint_states` at the drive's rate and obeys `effort_command`.

    It keeps the pace of the clock, `speed` times. In lockstep it goes on only once a command
    has answered the last sample: a loaded computer makes it slower, never worse. With
    `publish_clock` its time is the graph's (`use_sim_time` for the others).
    """

    node_name = 'plant'
    parameters = (
        ParameterSpec('model', '', 'model file of the true brake; empty: the one in config/'),
        ParameterSpec('effects', '', 'further physics, as YAML: "stribeck_friction: '
                      '{breakaway_ratio: 1.4, stribeck_velocity: 2.0}"'),
        ParameterSpec('mechanism', '', 'mechanism file: its load torque and load-dependent '
                      'friction (chapter 2) take the place of the model\'s'),
        ParameterSpec('pad_friction', 0.0, 'μ of the pads on the turning disc, with `mechanism`',
                      '-', 0.0, 1.0),
        ParameterSpec('rate', 1000.0, 'samples per second', 'Hz', 10.0, 10000.0),
        ParameterSpec('speed', 1.0, 'simulated seconds per second; 0: as fast as commands answer '
                      '(lockstep only)', '-', 0.0, 1000.0),
        ParameterSpec('lockstep', False, 'wait for a command after each sample'),
        ParameterSpec('publish_clock', False, 'publish /clock'),
        ParameterSpec('effort_limit', 0.75, 'the drive gives no more', 'N·m', 0.0, 1e4),
        ParameterSpec('command_timeout', 0.1, 'without a command for so long, no torque', 's',
                      0.001, 10.0),
        ParameterSpec('physics_step', 5e-5, 'of the integration', 's', 1e-6, 1e-3),
        ParameterSpec('counts_per_revolution', 8192, 'of the encoder; 0: exact', '', 0, 1 << 24),
        ParameterSpec('velocity_cutoff', 100.0, 'low-pass of the drive\'s velocity; 0: none', 'Hz',
                      0.0, 1e5),
        ParameterSpec('effort_noise', 0.002, 'standard deviation of the measured effort', 'N·m',
                      0.0, 10.0),
        ParameterSpec('effort_resolution', 0.0002, 'of the measured effort; 0: exact', 'N·m', 0.0,
                      1.0),
        ParameterSpec('seed', 1, 'of the noise', '', 0, 2**31 - 1),
        ParameterSpec('disc_speed_times', [0.0], 'instants of the disc\'s speed profile', 's', 0.0,
                      1e6),
        ParameterSpec('disc_speed_values', [0.0], 'disc speed at these instants', 'rad/s', -1e4,
                      1e4),
        ParameterSpec('pad_temperature_times', [0.0], 'instants of the temperature profile', 's',
                      0.0, 1e6),
        ParameterSpec('pad_temperature_values', [20.0], 'pad temperature at these instants', '°C',
                      -273.0, 2000.0),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Build the brake."""
        if values['speed'] == 0.0 and not values['lockstep']:
            raise InputError('parameter speed is 0.0 without lockstep; nothing would set the '
                             'pace: set lockstep, or a speed above 0')
        # Here, not on top: compiling it at the first start takes seconds, in which a signal must
        # already be heeded.
        from engb_core.virtual_brake import DriveSettings, parse_effects, Profile, VirtualBrake
        model = Model.read(values['model'] or TRUE_BRAKE)
        if values['mechanism']:
            model = mechanism_load(model, read_mechanism(values['mechanism']),
                                   values['pad_friction'])
        model = replace(model, effects=model.effects + parse_effects(values['effects']))
        self._brake = VirtualBrake(
            model,
            DriveSettings(values['rate'], values['effort_limit'], values['command_timeout'],
                          values['physics_step']),
            SensorSettings(values['counts_per_revolution'], values['velocity_cutoff'],
                           values['effort_noise'], values['effort_resolution'], values['seed']),
            Profile(values['disc_speed_times'], values['disc_speed_values'], 'disc_speed'),
            Profile(values['pad_temperature_times'], values['pad_temperature_values'],
                    'pad_temperature'))
        self._lockstep = values['lockstep']
        self._speed = values['speed'] if values['speed'] > 0.0 else float('inf')
        self._joint = JointMessage(model.joint.name)
        self._scalar = Scalar()
        self._publish_joint = self.advertise(interface.JOINT_STATES).publish
        self._publish_disc = self.advertise(interface.DISC_SPEED).publish
        self._publish_temperature = self.advertise(interface.PAD_TEMPERATURE).publish
        self._publish_clock = (self.advertise(interface.CLOCK).publish if values['publish_clock']
                               else None)
        self.listen(interface.EFFORT_COMMAND, self._on_command)
        period = self._brake.period
        self.every(period if self._speed > 10.0 else max(period / self._speed, 2e-4), self._tick)
        self._period_ns = round(1e9 * period)
        self._disc_every = max(1, round(0.01 / period))
        self._temperature_every = max(1, round(0.1 / period))

    def start(self) -> None:
        """Let the time run from now on."""
        self._origin_ns = steady.time_ns() - self._brake.samples * self._period_ns
        self._restart_pace()
        self._answered = True
        self._sent = steady.monotonic()

    def _restart_pace(self) -> None:
        self._pace_start = steady.monotonic()
        self._pace_samples = self._brake.samples

    def _due(self) -> float:
        """Return how many samples the clock asks for and were not yet made."""
        passed = (steady.monotonic() - self._pace_start) * self._speed / self._brake.period
        return passed - (self._brake.samples - self._pace_samples)

    def _tick(self) -> None:
        if not self.active:
            return
        if self._lockstep:
            if not self._answered and steady.monotonic() - self._sent < _LOCKSTEP_PATIENCE:
                return
            if self._due() >= 1.0:
                self._sample()
            return
        due = int(self._due())
        if due * self._brake.period > _LONGEST_CATCH_UP * max(self._speed, 1.0):
            due = 1
            self._restart_pace()
        for _ in range(due):
            self._sample()

    def _on_command(self, message: Float64) -> None:
        if not self.active:
            return
        self._brake.command(message.data)
        self._answered = True
        if self._lockstep and self._due() >= 1.0:
            self._sample()

    def _sample(self) -> None:
        brake = self._brake
        if self._lockstep:
            self._answered = False
            self._sent = steady.monotonic()
            if self._due() * brake.period > _LONGEST_CATCH_UP * self._speed:
                self._restart_pace()
        measured = brake.advance()
        stamp = self._origin_ns + brake.samples * self._period_ns
        if self._publish_clock is not None:
            seconds, nanoseconds = divmod(stamp, 1_000_000_000)
            self._publish_clock(Clock(clock=Time(sec=seconds, nanosec=nanoseconds)))
        if brake.samples % self._disc_every == 0:
            self._publish_disc(self._scalar.fill(measured.disc_speed))
        if brake.samples % self._temperature_every == 0:
            self._publish_temperature(self._scalar.fill(measured.pad_temperature))
        self._publish_joint(self._joint.fill(
            stamp, measured.position, measured.velocity, measured.effort))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(PlantNode, args)


if __name__ == '__main__':
    sys.exit(main())
