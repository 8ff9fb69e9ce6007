# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A loop whose controller's diagnostics are kept, brought back to health after each fault."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import signal
import tempfile
import time
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from benchmarks.lossy import LossyWire
from engb_core.control.causes import Cause
from engb_ros.files import config_file, TRUE_BRAKE
from engb_ros.interface import CLEAR_FAULTS, DIAGNOSTICS, DISTURBANCE, EFFORT_COMMAND, Service
from engb_ros.nodes.messages import message_class
from engb_ros.processes.live_loop import Drive, LiveLoop
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import reserved_domain, Runner

__all__ = ['RATE', 'SPOILT', 'WatchedLoop', 'answer_of', 'closed_loop', 'nanoseconds', 'recover',
           'wake']

# The drive that goes wrong on request.
SPOILT = 'benchmarks.spoilt_drive'

# The prober hears every message: a slower drive leaves it time to be punctual [Hz].
RATE = 250.0

# The cause of a rejected input is told with the next diagnostics; here they come quickly [s].
DIAGNOSTICS_PERIOD = 0.05


class WatchedLoop(LiveLoop):
    """A live loop whose controller's diagnostics are kept."""

    def __init__(self, runner: Runner, probe: Probe, drive: Drive, **controller: Any) -> None:
        self.wire: LossyWire | None = None   # where its datagrams may be lost
        self.diagnostics = probe.listen(DIAGNOSTICS)
        self.torques: list[tuple[int, float]] = []   # when it arrived [ns], and how much [N·m]
        # A reliable reader waits up to a second for what was lost.
        probe.node.create_subscription(
            message_class(EFFORT_COMMAND.type), EFFORT_COMMAND.name,
            lambda message: self.torques.append((time.time_ns(), message.data)),
            QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT))
        super().__init__(runner, probe, drive, **controller)

    def noticed(self, begin: int, key: str, value: str = '1',
                node: str = 'controller') -> float:
        """Wait for a controller's first diagnostics since `begin` [ns] in which `key` is
        `value`; return how long after `begin` they were written [s]."""
        found: list[int] = []

        def told() -> bool:
            for message in self.diagnostics:
                status = message.status[0]
                stamp = nanoseconds(message.header.stamp)
                if stamp >= begin and status.name.endswith(f': {node}') and any(
                        entry.key == key and entry.value == value for entry in status.values):
                    found.append(stamp)
            return bool(found)

        self.until(told, f'{key} to be {value}')
        return 1e-9 * (min(found) - begin)

    def no_torque(self, begin: int) -> float:
        """Wait for the first command of no torque; return how long after `begin` [ns] it
        arrived [s]."""
        def gone() -> list[int]:
            return [arrived for arrived, torque in self.torques
                    if arrived > begin and torque == 0.0]

        self.until(gone, 'the torque to be gone')
        return 1e-9 * (gone()[0] - begin)


@contextlib.contextmanager
def closed_loop(kind: str) -> Iterator[WatchedLoop]:
    """Run a loop with the plant, over CAN, commanding by force with an observer, with a drive that
    goes wrong on request, or with the plant and datagrams that are lost on request."""
    brake = {'rate': RATE, 'effort_noise': 0.0}
    controller = {'diagnostics_period': DIAGNOSTICS_PERIOD}
    drive = [('plant', brake)]
    if kind == 'can':
        bus = {'interface': 'udp_multicast',
               'channel': f'239.75.0.1:{20_000 + os.getpid() % 12_000}'}
        drive = [('drive_emulator', {**brake, **bus}), ('can_bridge', bus)]
    elif kind == 'spoilt':
        drive = [(SPOILT, brake)]
    elif kind == 'force':
        drive.append(('disturbance_observer', {}))
        controller |= {'model': os.fspath(TRUE_BRAKE), 'observer_timeout': 0.1,
                       'mechanism': os.fspath(config_file('mechanism.yaml'))}
    with contextlib.ExitStack() as stack:
        wire = None
        if kind == 'lossy':
            wire = LossyWire(Path(stack.enter_context(tempfile.TemporaryDirectory())))
        domain = stack.enter_context(reserved_domain())
        runner = stack.enter_context(Runner(domain, environment=wire and wire.environment))
        probe = stack.enter_context(Probe(domain))
        loop = WatchedLoop(runner, probe, drive, **controller)
        loop.wire = wire
        if kind == 'force':
            loop.until(lambda: probe.publishers(DISTURBANCE), 'the observer')
        yield loop
        runner.kill()


def wake(loop: WatchedLoop) -> None:
    """Wake or restart whatever is frozen or gone: what caused the fault is over."""
    loop.target = None
    if loop.wire is not None:
        loop.wire.lose(0.0)
    for name in (*loop.drive, 'controller'):
        if name in loop.runner.processes:
            loop.runner.processes[name].signal(signal.SIGCONT)
        else:
            loop.start(name)
    if 'drive_emulator' in loop.drive:
        loop.set_parameter('drive_emulator', 'fault', 'none')
    if SPOILT in loop.drive:
        loop.set_parameter('plant', 'fault', 'none')
    count = len(loop.states)
    loop.until(lambda: len(loop.states) > count + 30, 'joint states')


def recover(loop: WatchedLoop) -> None:
    """Wake what is asleep, clear faults, and track 15 rad again."""
    wake(loop)
    asked = [0.0]

    def tracks() -> bool:
        # Under default timeouts a busy machine finds faults that nobody injected.
        if loop.is_in('fault') and time.monotonic() - asked[0] > 0.3:
            asked[0] = time.monotonic()
            _cleared(loop)
        return abs(loop.position - loop.target) < 0.3 and (
            loop.is_in('enabled') or loop.is_in('degraded'))

    loop.diagnostics.clear()
    loop.until(lambda: _cleared(loop), 'the faults to be cleared', timeout=60.0)
    loop.target = 15.0
    loop.until(tracks, 'the brake to track')
    loop.until(lambda: not loop.has(
        Cause.OBSERVER_STALE | Cause.CLOCK_JUMP | Cause.COMMAND_NOT_FINITE | Cause.STATE_JUMP
        | Cause.DRIVE_WEAK | Cause.COMMAND_OUT_OF_RANGE | Cause.COMMAND_LATE
        | Cause.COMMAND_REPEATED | Cause.COMMAND_CONFLICT
        | Cause.DISC_SPEED_STALE | Cause.EFFORT_MISSING
        | Cause.VELOCITY_WRONG), 'old causes to fade')
    loop.until(tracks, 'the brake to track')


def nanoseconds(stamp: Any) -> int:
    """Return a stamp in nanoseconds."""
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def _cleared(loop: WatchedLoop) -> bool:
    return answer_of(loop, 'controller', CLEAR_FAULTS)[0]


def answer_of(loop: WatchedLoop, node: str, service: Service) -> tuple[bool, str]:
    """Call a service; return its success and message, (False, '') without an answer."""
    try:
        answer = loop.probe.call(node, service, timeout=2.0)
    except TimeoutError:   # a request to the one that was killed: the graph forgets it slowly
        return False, ''
    return answer.success, answer.message
