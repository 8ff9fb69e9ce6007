"""Node `controller`: position control of one brake, equations (26)–(28)."""

from __future__ import annotations

from collections.abc import Sequence
import math
import sys
from typing import Any

from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.pid import ANTIWINDUP_STRATEGIES, PidGains
from engb_core.control.reference import REFERENCES, ReferenceSettings, ReferenceSource
from engb_core.errors import InputError
from engb_core.model import Model
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.messages import joint_sample, JointMessage, Scalar, StampClock
from engb_ros.nodes.parameters import ParameterSpec

__all__ = ['ControllerNode', 'main']

PARAMETERS = (
    ParameterSpec('model', '', 'model file; empty: the paper\'s nominal motor alone'),
    ParameterSpec('p', 0.4, 'proportional gain', 'N·m/rad', 0.0, 1e3, live=True),
    ParameterSpec('i', 1.5, 'integral gain', 'N·m/(rad·s)', 0.0, 1e4, live=True),
    ParameterSpec('d', 0.006, 'derivative gain, on the measured velocity', 'N·m·s/rad', 0.0, 1e2,
                  live=True),
    ParameterSpec('u_clamp_max', 0.75, 'highest torque demanded', 'N·m', 0.0, 1e3, live=True),
    ParameterSpec('u_clamp_min', -0.75, 'lowest torque demanded', 'N·m', -1e3, 0.0, live=True),
    ParameterSpec('i_clamp_max', 0.5, 'highest integral part', 'N·m', 0.0, 1e3, live=True),
    ParameterSpec('i_clamp_min', -0.5, 'lowest integral part', 'N·m', -1e3, 0.0, live=True),
    ParameterSpec('antiwindup_strategy', 'back_calculation', 'what keeps the integral part from '
                  'winding up', choices=ANTIWINDUP_STRATEGIES, live=True),
    ParameterSpec('tracking_time_constant', 0.0, 'of the back-calculation; 0: chosen from the '
                  'gains', 's', 0.0, 1e3, live=True),
    ParameterSpec('error_deadband', 0.0, 'smaller errors are not integrated', 'rad', 0.0, 1e3,
                  live=True),
    ParameterSpec('save_i_term', False, 'keep the integral part over a reset', live=True),
    ParameterSpec('derivative_filter_time', 0.0, 'low-pass on the measured velocity', 's', 0.0,
                  10.0, live=True),
    ParameterSpec('load_feedforward', True, 'add the model\'s load torque', live=True),
    ParameterSpec('friction_feedforward', True, 'add the model\'s friction torque', live=True),
    ParameterSpec('cogging_feedforward', True, 'add the model\'s cogging torque', live=True),
    ParameterSpec('disturbance_compensation', False, 'take off what the observer sees beyond the '
                  'model', live=True),
    ParameterSpec('disturbance_cutoff', 20.0, 'low-pass of that observer', 'Hz', 0.1, 1e4,
                  live=True),
    ParameterSpec('reference', 'command', 'what to track: `position_command`, the identification '
                  'strokes, or a CSV file of time,position', choices=REFERENCES),
    ParameterSpec('reference_file', '', 'CSV file for reference:=file'),
    ParameterSpec('start_on_request', False, 'wait for service ~/start_reference with the '
                  'trajectory'),
    ParameterSpec('repeat', False, 'begin the trajectory again when it ends'),
    ParameterSpec('stroke_amplitudes', [12.0, 24.0, 36.0], 'lengths of the identification strokes',
                  'rad', -1e4, 1e4),
    ParameterSpec('stroke_acceleration', 60.0, 'of the identification strokes', 'rad/s²', 1e-3,
                  1e6),
    ParameterSpec('stroke_repetitions', 1, 'strokes of each amplitude', '', 1, 1000),
    ParameterSpec('stop_time', 0.6, 'stop section after each half stroke', 's', 0.0, 100.0),
    ParameterSpec('slow_speeds', [1.0, 4.0], 'speeds of the slow unloaded strokes before', 'rad/s',
                  1e-3, 1e3),
    ParameterSpec('slow_range', [0.3, 3.0], 'angles between which they run; equal: none', 'rad',
                  -1e4, 1e4),
    ParameterSpec('approach_acceleration', 400.0, 'of moves to a command or to a trajectory\'s '
                  'start', 'rad/s²', 1e-3, 1e6),
    ParameterSpec('apply_speed', 60.0, 'highest speed of these moves while applying', 'rad/s',
                  1e-3, 1e4),
    ParameterSpec('release_speed', 60.0, 'highest speed of these moves while releasing', 'rad/s',
                  1e-3, 1e4),
    ParameterSpec('reference_every', 4, 'publish `reference` every n-th cycle; 0: never', '', 0,
                  1000),
)


class ControllerNode(ManagedNode):
    """One control cycle per `joint_states` message: the drive's clock sets the pace."""

    node_name = 'controller'
    parameters = PARAMETERS

    def configure(self, values: dict[str, Any]) -> None:
        """Build the loop and the reference."""
        model = Model.read(values['model']) if values['model'] else Model()
        self._joint = model.joint.name
        self._loop = PositionLoop(model, loop_settings(values))
        self._source = ReferenceSource(reference_settings(values))
        self._stamps = StampClock()
        self._effort = Scalar()
        self._reference = JointMessage(self._joint)
        self._every = values['reference_every']
        self._count = 0
        self._publish_effort = self.advertise(interface.EFFORT_COMMAND).publish
        self._publish_reference = self.advertise(interface.REFERENCE).publish
        self.listen(interface.POSITION_COMMAND, self._on_command)
        self.listen(interface.JOINT_STATES, self._on_joint_states)
        self.serve(interface.START_REFERENCE, self._start_reference)

    def validate(self, values: dict[str, Any]) -> None:
        """Check the gains together."""
        loop_settings(values)

    def reconfigure(self, values: dict[str, Any]) -> None:
        """Take up new gains without a jump of the torque."""
        if hasattr(self, '_loop'):
            self._loop.set_settings(loop_settings(values))

    def start(self) -> None:
        """Begin at the position where the motor stands."""
        self._loop.reset()
        self._source.reset()

    def stop(self) -> None:
        """Send a last command: no torque."""
        self._publish_effort(self._effort.fill(0.0))

    def _start_reference(self) -> str:
        self._source.start()
        return f'the reference takes {self._source.duration:.1f} s'

    def _on_command(self, message: Float64) -> None:
        if math.isfinite(message.data):
            self._source.command(message.data)

    def _on_joint_states(self, message: JointState) -> None:
        if not self.active:
            return
        sample = joint_sample(message, self._joint)
        if sample is None:
            return
        position, velocity, effort = sample
        time = self._stamps.seconds(message.header.stamp)
        setpoint = self._source.at(time, position)
        torque = self._loop.step(time, position, velocity, effort, setpoint)
        self._publish_effort(self._effort.fill(torque))
        self._count += 1
        if self._every and self._count % self._every == 0:
            self._publish_reference(self._reference.fill_at(
                message.header.stamp, setpoint.position, setpoint.velocity,
                self._loop.feedforward))


def loop_settings(values: dict[str, Any]) -> LoopSettings:
    """Return the loop's settings from parameter values."""
    gains = PidGains(**{name: values[name] for name in PidGains.__dataclass_fields__})
    return LoopSettings(gains, values['load_feedforward'], values['friction_feedforward'],
                        values['cogging_feedforward'], values['disturbance_compensation'],
                        values['disturbance_cutoff'])


def reference_settings(values: dict[str, Any]) -> ReferenceSettings:
    """Return the reference's settings from parameter values."""
    if len(values['slow_range']) != 2:
        raise InputError('parameter slow_range must hold two angles [rad]')
    return ReferenceSettings(
        kind=values['reference'], file=values['reference_file'],
        start_on_request=values['start_on_request'], repeat=values['repeat'],
        amplitudes=tuple(values['stroke_amplitudes']),
        acceleration=values['stroke_acceleration'], repetitions=values['stroke_repetitions'],
        stop_time=values['stop_time'], slow_speeds=tuple(values['slow_speeds']),
        slow_range=tuple(values['slow_range']),
        approach_acceleration=values['approach_acceleration'],
        apply_speed=values['apply_speed'], release_speed=values['release_speed'])


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(ControllerNode, args)


if __name__ == '__main__':
    sys.exit(main())
