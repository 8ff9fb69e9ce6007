# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `monitor`: warns on /diagnostics when model and measurement part, and says where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sensor_msgs.msg import JointState

from engb_core.bench.sensors import VelocityFromPosition
from engb_core.control.loop import VELOCITY_CUTOFF
from engb_core.control.mismatch_monitor import MismatchMonitor, MonitorSettings
from engb_core.model import Model
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.diagnostics import DiagnosticMessage, OK, WARN
from engb_ros.nodes.joint import HARDWARE_ID, JOINT, with_joint
from engb_ros.nodes.messages import joint_sample, StampClock
from engb_ros.nodes.parameters import ParameterSpec

__all__ = ['MonitorNode', 'main']


class MonitorNode(ManagedNode):
    """Compares live; when it warns, take a recording and run `engb diagnose` on it."""

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
        model = with_joint(Model.read(values['model']), values)
        self._joint = model.joint.name
        self._monitor = MismatchMonitor(model, MonitorSettings(
            values['threshold'], values['window'], values['cutoff']))
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self._stamps = StampClock()
        self._warned = False
        self._diagnostic = DiagnosticMessage(f'{self.get_namespace().strip("/")}: monitor',
                                             values['hardware_id'])
        self._publish_diagnostics = self.advertise(interface.DIAGNOSTICS).publish
        self.listen(interface.JOINT_STATES, self._on_joint_states, every=True)
        self.every(values['period'], self._diagnose)

    def _on_joint_states(self, message: JointState) -> None:
        sample = joint_sample(message, self._joint) if self.active else None
        if sample is None:
            return
        position, velocity, effort = sample
        time = self._stamps.seconds(message.header.stamp)
        if velocity != velocity:
            velocity = self._derived.step(time, position)
        self._monitor.step(time, position, velocity, effort)

    def _diagnose(self) -> None:
        if not self.active:
            return
        monitor = self._monitor
        parted = monitor.parted()
        values = {f'rms {zone}': f'{value:.5f}' for zone, value in monitor.rms().items()}
        values['residual'] = f'{monitor.residual:.5f}'
        if parted:
            worst_first = sorted(parted.items(), key=lambda entry: -entry[1])
            where = ', '.join(f'{zone} ({1e3 * value:.1f} mN·m)' for zone, value in worst_first)
            text = f'model and measurement part: {where}; record a run and diagnose it'
            if not self._warned:
                self.get_logger().warning(text)
        else:
            text = 'model and measurement agree'
        self._warned = bool(parted)
        self._publish_diagnostics(self._diagnostic.fill(
            self.get_clock().now().to_msg(), WARN if parted else OK, text, values))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(MonitorNode, args)
