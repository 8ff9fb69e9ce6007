# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `disturbance_observer`: publishes d̂ of equation (30) for every motor sample."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from engb_core.bench.sensors import VelocityFromPosition
from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.loop import VELOCITY_CUTOFF
from engb_core.model import Model
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.joint import JOINT, JointListener, with_joint
from engb_ros.nodes.joint_reader import JointReader
from engb_ros.nodes.messages import scalar, StampClock
from engb_ros.nodes.parameters import ParameterSpec
from engb_ros.nodes.realtime import REALTIME

__all__ = ['DisturbanceObserverNode', 'main']


class DisturbanceObserverNode(ManagedNode):
    """d̂ = q ∗ (J·ω̇ + B·ω − u), with u the measured effort.

    A sample of no use (a number that is none, a stamp that does not advance) is not answered: who
    listens shall miss the estimate rather than take an old one for new.
    """

    node_name = 'disturbance_observer'
    parameters = (
        ParameterSpec('model', '', 'model file, for J and B; empty: the paper\'s nominal motor'),
        JOINT,
        *REALTIME,
        ParameterSpec('cutoff', 20.0, 'q\'s −3 dB frequency', 'Hz', 0.1, 1e4),
        ParameterSpec('order', 2, 'q\'s order', '', 1, 2),
        ParameterSpec('publish_every', 1, 'publish every n-th estimate', '', 1, 1000),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Build the observer."""
        model = with_joint(Model.read(values['model']) if values['model'] else Model(), values)
        self._reader = JointReader(model.joint.name)
        self._joint = JointListener(self, model.joint.name)
        self._observer = DisturbanceObserver(model.motor, values['cutoff'], values['order'])
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self._stamps = StampClock()
        self._every = values['publish_every']
        self._count = 0
        self._publish = self.advertise(interface.DISTURBANCE).publish
        self.listen(interface.JOINT_STATES, self._on_joint_states, every=True, raw=True)

    def start(self) -> None:
        """Begin without a past."""
        self._observer.reset()

    def _on_joint_states(self, message: bytes) -> None:
        if not self.active:
            return
        sample = self._reader.read(message)
        if sample is None:
            self._joint.other(self._reader.names(message))
            return
        self._joint.present()
        sec, nanosec, position, velocity, effort = sample
        time = self._stamps.seconds_of(sec, nanosec)
        if velocity != velocity:
            derived = self._derived.step(time, position)
            velocity = derived if math.isfinite(position) else math.nan
        rejected = self._observer.rejected
        estimate = self._observer.step(time, velocity, effort)
        if self._observer.rejected != rejected:
            return
        self._count += 1
        if self._count % self._every == 0:
            self._publish(scalar(estimate))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(DisturbanceObserverNode, args)
