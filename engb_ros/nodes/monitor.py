# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `monitor`: warns on /diagnostics when model and measurement part, and says where."""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic
from typing import Any

from sensor_msgs.msg import JointState

from engb_core.bench.sensors import VelocityFromPosition
from engb_core.control.loop import VELOCITY_CUTOFF
from engb_core.control.mismatch_monitor import LONGEST_STEP, MismatchMonitor, MonitorSettings
from engb_core.control.sample_watch import SampleWatch, SILENCE
from engb_core.errors import InputError
from engb_core.model import Model
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.diagnostics import DiagnosticMessage, OK, STALE, WARN
from engb_ros.nodes.joint import HARDWARE_ID, JOINT, with_joint
from engb_ros.nodes.messages import joint_sample, StampClock
from engb_ros.nodes.parameters import ParameterSpec

__all__ = ['MonitorNode', 'main']


class MonitorNode(ManagedNode):
    """Compares live; when it warns, take a recording and run `engb diagnose` on it.

    While no usable samples come it judges nothing: its status is stale then, and says what is
    missing.
    """

    node_name = 'monitor'
    parameters = (
        ParameterSpec('model', '', 'model file to hold the brake against; needed'),
        JOINT,
        HARDWARE_ID,
        ParameterSpec('threshold', 0.008, 'rms of the torque residual that is too much', 'N·m',
                      1e-6, 1e3),
        ParameterSpec('window', 5.0, 'memory of the running rms', 's', 0.1, 1e4),
        ParameterSpec('cutoff', 10.0, 'filter of model and measurement', 'Hz', 0.1, 1e4),
        ParameterSpec('period', 1.0, 'between messages on /diagnostics', 's', 0.05, 60.0),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Build the monitor."""
        if not values['model']:
            raise InputError('parameter model is empty; set it to the model file to hold the '
                             'brake against')
        model = with_joint(Model.read(values['model']), values)
        self._joint = model.joint.name
        self._watch = SampleWatch(self._joint, LONGEST_STEP)
        self._monitor = MismatchMonitor(model, MonitorSettings(
            values['threshold'], values['window'], values['cutoff']))
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self._stamps = StampClock()
        self._told = OK, ''
        self._diagnostic = DiagnosticMessage(f'{self.get_namespace().strip("/")}: monitor',
                                             values['hardware_id'])
        self._publish_diagnostics = self.advertise(interface.DIAGNOSTICS).publish
        self.listen(interface.JOINT_STATES, self._on_joint_states, every=True)
        self.every(values['period'], self._diagnose)

    def start(self) -> None:
        """Be patient from now on."""
        self._watch.reset(monotonic())

    def _on_joint_states(self, message: JointState) -> None:
        if not self.active:
            return
        sample = joint_sample(message, self._joint)
        if sample is None:
            self._watch.other(monotonic(), message.name)
            return
        position, velocity, effort = sample
        time = self._stamps.seconds(message.header.stamp)
        if velocity != velocity:
            velocity = self._derived.step(time, position)
        self._watch.take(monotonic(), time, position, velocity, effort)
        self._monitor.step(time, position, velocity, effort)

    def _diagnose(self) -> None:
        if not self.active:
            return
        monitor = self._monitor
        missing = self._watch.missing(monotonic())
        if missing:
            level, text, values = STALE, f'nothing is judged: {missing}', {}
        else:
            level, text = WARN if monitor.parted() else OK, monitor.verdict()
            values = {f'rms {zone}': f'{value:.5f}' for zone, value in monitor.rms().items()}
            values['residual'] = f'{monitor.residual:.5f}'
            if level == WARN:
                text += '; record a run and diagnose it'
        # Once each time it changes; silence is one matter, and samples of no use are another.
        kind = level, SILENCE if missing == SILENCE else ''
        if kind != self._told:
            if level == OK:   # rclpy allows a place one severity
                self.get_logger().info(text)
            else:
                self.get_logger().warning(text)
        self._told = kind
        self._publish_diagnostics(self._diagnostic.fill(
            self.get_clock().now().to_msg(), level, text, values))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(MonitorNode, args)
