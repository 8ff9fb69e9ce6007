# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A bench in a computer: nodes as processes, a trajectory driven, a bag recorded.

The demo, the maker of the bags that come with the package, and the tests use it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import os
from pathlib import Path
import time
from typing import Any

from sensor_msgs.msg import JointState

from engb_core.errors import InputError
from engb_ros.files import NOMINAL_MODEL
from engb_ros.interface import (
    EFFORT_COMMAND,
    JOINT_STATES,
    RECORDED,
    REFERENCE,
    START_REFERENCE,
    TOPICS,
)
from engb_ros.nodes.messages import joint_sample, StampClock
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import Runner

__all__ = ['Bench', 'BenchProgress']

# The brake's time may stand still for so long before the bench gives up [s].
_PATIENCE = 30.0

# A recorder keeps up with so many samples a second [Hz].
_FASTEST = 1000.0


@dataclass(frozen=True)
class BenchProgress:
    """How far a run has come: simulated `time` of `duration` [s], the brake's angle [rad] and
    torque [N·m]."""

    time: float
    duration: float
    position: float
    effort: float


class Bench:
    """Runs the nodes in lockstep: a loaded computer makes it slower, never worse.

    Args:
        runner, probe: in the same ROS domain.
        rate: of drive and loop [Hz].
    """

    def __init__(self, runner: Runner, probe: Probe, rate: float = 1000.0) -> None:
        self._runner = runner
        self._probe = probe
        self._rate = rate

    def record(
        self,
        bag: Path | None,
        plant: Mapping[str, Any] | None = None,
        controller: Mapping[str, Any] | None = None,
        others: Sequence[str] = ('disturbance_observer',),
        progress: Callable[[BenchProgress], None] | None = None,
        started: Callable[[str], None] | None = None,
    ) -> float:
        """Start the nodes and drive the controller's trajectory once; return its length [s].

        The nodes run on until `stop`.

        Args:
            bag: folder of the recording; None: nothing is recorded.
            plant, controller: parameters.
            others: further nodes.
            progress: called now and then.
            started: called once all nodes hear each other, with their names.

        Raises:
            RunnerError: a node ended by itself or never came up.
            InputError: the controller has no trajectory, or the brake's time stands still.
        """
        runner, probe = self._runner, self._probe
        clock = {'use_sim_time': True}
        model = {'model': os.fspath(NOMINAL_MODEL)}
        if bag is not None:
            runner.start('recorder', parameters={
                'bag': os.fspath(bag), 'compression': 'zstd', **clock})
            # It listens before anyone speaks: nothing of the run is missed.
            runner.wait_until(lambda: all(probe.subscribers(topic) for topic in TOPICS),
                              'the recorder', timeout=60.0, pause=probe.spin)
        for name in others:
            runner.start(name, parameters={**model, **clock})
        runner.start('controller', parameters={
            **model, 'reference': 'strokes', 'start_on_request': True, 'reference_every': 4,
            **clock, **(controller or {})})
        runner.start('plant', parameters={
            'rate': self._rate, 'lockstep': True, 'publish_clock': True,
            'speed': max(1.0, _FASTEST / self._rate),
            **(plant or {})})
        listeners = 1 + len(others) + (bag is not None)
        runner.wait_until(
            lambda: (probe.publishers(JOINT_STATES) and probe.publishers(EFFORT_COMMAND)
                     and probe.subscribers(JOINT_STATES) >= listeners
                     and probe.ready('controller', START_REFERENCE)),
            'the nodes to hear each other', timeout=60.0, pause=probe.spin)
        if bag is not None:
            # That two nodes are there does not say that they hear each other yet.
            runner.wait_until(self._is_recorded, 'the recorder to hear all', timeout=60.0,
                              pause=lambda: probe.spin(0.1))
        if started is not None:
            started(', '.join(runner.processes))
        return self._drive(progress or (lambda state: None))

    def stop(self) -> None:
        """Stop all nodes by signal; the recorder closes its bag."""
        self._runner.stop(reversed(list(self._runner.processes)))

    def _is_recorded(self) -> bool:
        answer = self._probe.call('recorder', RECORDED).message
        recorded = {name.rpartition('/')[2] for name in answer.split(', ')}
        return {JOINT_STATES.name, EFFORT_COMMAND.name, REFERENCE.name} <= recorded

    def _drive(self, progress: Callable[[BenchProgress], None]) -> float:
        probe, stamps = self._probe, StampClock()
        latest: list[tuple[float, float, float]] = []

        def on_joint_states(message: JointState) -> None:
            sample = joint_sample(message, message.name[0])
            if sample is not None:
                latest[:] = [(stamps.seconds(message.header.stamp), sample.position,
                              sample.effort)]

        probe.listen(JOINT_STATES, on_joint_states, depth=1)
        self._runner.wait_until(lambda: latest, 'the first sample', pause=probe.spin)
        answer = probe.call('controller', START_REFERENCE)
        if not answer.success:
            raise InputError(f'the controller says: {answer.message}')
        duration = float(answer.message.split()[-2])
        begin = latest[0][0]
        told = moved = time.monotonic()
        last = begin
        while latest[0][0] - begin < duration + 0.5:
            probe.spin()
            now = time.monotonic()
            if latest[0][0] > last:
                last, moved = latest[0][0], now
            elif now - moved > _PATIENCE:
                raise InputError(f'the brake\'s time stands still since {_PATIENCE:.0f} s')
            if now - told > 0.2:
                told = now
                self._runner.check()
                progress(BenchProgress(min(last - begin, duration), duration, *latest[0][1:]))
        progress(BenchProgress(duration, duration, *latest[0][1:]))
        return duration
