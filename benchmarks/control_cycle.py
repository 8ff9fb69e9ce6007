# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a control cycle costs and how late it is: our controller beside a bare rclpy echo.

    python -m benchmarks.control_cycle [--rates 250 500 1000] [--rounds 20] [--commands 20]

A bare rclpy node that answers each JointState with a Float64, and the package's controller (PID,
feedforward, clamp-force estimate, supervision, reference and report topics on; it tracks strokes
that never rest) run side by side, each in a namespace of its own, each with the events and with
the single-threaded executor. A source sends joint states to one of them at a time: of a shaft that
turns under the torque that came back, so the loop is closed; a controller that does not track
would do less, and ends the measurement. Set-point commands come at a rate of their own and are no
part of a cycle; --commands adds them. Rounds are short and go through all of them, so a load of
the machine that comes and goes meets all alike; what is compared is always within a round, and
shown is the median over the rounds with its quartiles. --write puts the table into that page, in
the place of the one that is there.

Counted are the CPU time of the process per cycle (user + system, all its threads), and the round
trip from sending the sample to receiving the answer.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import contextlib
from dataclasses import dataclass
import os
from pathlib import Path
import subprocess
import sys
import time

import numpy as np

from benchmarks.page import markdown, write_table
from engb_ros.nodes.transport import stay_on_this_computer

stay_on_this_computer(os.environ)

ECHO = '''
import signal, sys
import rclpy
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
node = rclpy.create_node('echo', namespace=sys.argv[2])
publisher = node.create_publisher(Float64, 'effort_command', QoSProfile(depth=1))
message = Float64()
def on_state(state):
    message.data = state.position[0]
    publisher.publish(message)
node.create_subscription(JointState, 'joint_states', on_state, QoSProfile(depth=1))
if sys.argv[1] == 'events':
    from rclpy.experimental import EventsExecutor
    executor = EventsExecutor()
else:
    executor = rclpy.executors.SingleThreadedExecutor()
executor.add_node(node)
stop = []
signal.signal(signal.SIGINT, lambda *_: stop.append(1))
while not stop:
    executor.spin_once(timeout_sec=0.1)
'''

# A process that is driven again after a pause is warm after so long [s].
WARM = 0.2

# Between which angles the reference goes [rad].
STROKE = 1.0

# The shaft that is driven: its inertia [kg·m²], and the torque per speed [N·m·s/rad].
INERTIA, VISCOSITY = 7e-5, 1e-4


@dataclass(frozen=True)
class Candidate:
    """One process under test: `node` ('bare echo' or 'controller') with an executor."""

    node: str
    executor: str

    @property
    def name(self) -> str:
        """As the table shows it."""
        return f'{self.node}, {self.executor}'

    @property
    def namespace(self) -> str:
        """Where it lives."""
        return f'/{self.node.replace(" ", "_")}_{self.executor}'

    def start(self, domain: int, commands: bool) -> subprocess.Popen:
        """Start the process."""
        from engb_ros.files import config_file, TRUE_BRAKE
        from engb_ros.processes.runner import node_command
        if self.node == 'bare echo':
            command = [sys.executable, '-c', ECHO, self.executor, self.namespace]
        else:
            command = node_command('controller', namespace=self.namespace, parameters={
                'model': os.fspath(TRUE_BRAKE),
                'mechanism': os.fspath(config_file('mechanism.yaml')),
                'reference': 'command' if commands else 'strokes', 'repeat': True,
                'stroke_amplitudes': [STROKE], 'slow_range': [0.0, 0.0], 'stop_time': 0.0,
                # While the others are driven this one is left alone.
                'state_timeout': 0.0, 'command_timeout': 0.0})
        environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain),
                       'ENGB_EXECUTOR': self.executor, 'ROS_PYTHON_CHECK_FIELDS': '0'}
        return subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL)


@dataclass(frozen=True)
class Block:
    """One stretch of driving one process: `cpu` time per cycle [µs], round `trips` (n,) [µs],
    achieved `rate` [Hz], the part of the samples that was `answered`."""

    cpu: float
    trips: np.ndarray
    rate: float
    answered: float


class Shaft:
    """A rigid shaft under the `torque` [N·m] that came back: `angle` [rad], `speed` [rad/s]."""

    def __init__(self) -> None:
        self.angle = self.speed = self.torque = 0.0

    def turn(self, dt: float) -> None:
        """Go on by `dt` [s]."""
        self.speed += dt * (self.torque - VISCOSITY * self.speed) / INERTIA
        self.angle += dt * self.speed


ECHOES = [Candidate('bare echo', name) for name in ('events', 'single')]
CONTROLLERS = [Candidate('controller', name) for name in ('events', 'single')]
CANDIDATES = [candidate for pair in zip(ECHOES, CONTROLLERS, strict=True) for candidate in pair]


def cpu_time(pid: int) -> float:
    """Return the CPU time of all threads of a process [s], to the nanosecond."""
    # The kernel's number of another process's CPU clock (clock_getcpuclockid).
    return time.clock_gettime((~pid << 3) | 2)


class Source:
    """Sends joint states to one process at a time, and times the answers."""

    def __init__(self, domain: int, commands: float) -> None:
        import rclpy
        from rclpy.experimental import EventsExecutor
        from rclpy.qos import QoSProfile
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64, String
        self._context = rclpy.Context()
        self._context.init(domain_id=domain)
        self._node = rclpy.create_node('source', context=self._context)
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._states, self._commands = {}, {}
        self._shafts = {candidate: Shaft() for candidate in CANDIDATES}
        self._told: dict[Candidate, str] = {}
        for candidate in CANDIDATES:
            space = candidate.namespace
            self._states[candidate] = self._node.create_publisher(
                JointState, f'{space}/joint_states', QoSProfile(depth=10))
            self._commands[candidate] = self._node.create_publisher(
                Float64, f'{space}/position_command', QoSProfile(depth=1))
            self._node.create_subscription(
                Float64, f'{space}/effort_command',
                lambda message, candidate=candidate: self._on_answer(candidate, message.data),
                QoSProfile(depth=1))
            self._node.create_subscription(
                String, f'{space}/controller_state',
                lambda message, candidate=candidate: self._told.update({candidate: message.data}),
                QoSProfile(depth=1))
        self._message = JointState(name=['motor'], position=[0.0], velocity=[0.0], effort=[0.0])
        self._command = Float64()
        self._driven: Candidate | None = None
        self._sent = 0.0
        self._samples = self._answers = 0
        self._rate = commands
        self._trips: list[float] = []

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def drive(self, candidate: Candidate, process: subprocess.Popen, rate: float,
              seconds: float) -> Block:
        """Drive one process at `rate` [Hz] for `seconds`, after it is warm."""
        every = max(1, round(rate / self._rate)) if self._rate else 0
        publish, shaft = self._states[candidate].publish, self._shafts[candidate]
        shaft.torque = 0.0
        message = self._message

        def tick() -> None:
            shaft.turn(1.0 / rate)
            message.position[0], message.velocity[0] = shaft.angle, shaft.speed
            message.effort[0] = shaft.torque
            message.header.stamp = self._node.get_clock().now().to_msg()
            self._sent = time.perf_counter()
            publish(message)
            self._samples += 1
            if every and self._samples % every == 0:
                # Back and forth: the reference never rests.
                self._command.data = STROKE - self._command.data
                self._commands[candidate].publish(self._command)

        self._driven = candidate
        timer = self._node.create_timer(1.0 / rate, tick)
        try:
            self._reset()
            self._wait_for_answers(candidate, process, round(WARM * rate))
            self._reset()
            begin, used = time.monotonic(), cpu_time(process.pid)
            while time.monotonic() - begin < seconds:
                self._executor.spin_once(timeout_sec=0.1)
            spent, passed = cpu_time(process.pid) - used, time.monotonic() - begin
        finally:
            self._node.destroy_timer(timer)
            self._driven = None
        if candidate in CONTROLLERS and self._told.get(candidate) not in ('enabled', 'degraded'):
            raise RuntimeError(f'{candidate.name} is {self._told.get(candidate)}: it does not '
                               'track, so it does less than it should')
        return Block(1e6 * spent / max(self._answers, 1), 1e6 * np.array(self._trips),
                     self._samples / passed, self._answers / max(self._samples, 1))

    def _reset(self) -> None:
        self._trips, self._samples, self._answers, self._sent = [], 0, 0, 0.0

    def _wait_for_answers(self, candidate: Candidate, process: subprocess.Popen,
                          count: int) -> None:
        end = time.monotonic() + 60.0
        while self._answers < count:
            self._executor.spin_once(timeout_sec=0.1)
            if time.monotonic() > end or process.poll() is not None:
                raise RuntimeError(f'{candidate.name} does not answer')

    def _on_answer(self, candidate: Candidate, torque: float) -> None:
        if candidate is not self._driven:
            return
        if candidate in CONTROLLERS:
            self._shafts[candidate].torque = torque
        self._answers += 1
        if self._sent:
            self._trips.append(time.perf_counter() - self._sent)
            self._sent = 0.0


@contextlib.contextmanager
def running(domain: int, commands: bool) -> Iterator[dict[Candidate, subprocess.Popen]]:
    """Run all candidates."""
    processes = {candidate: candidate.start(domain, commands) for candidate in CANDIDATES}
    try:
        yield processes
    finally:
        for process in processes.values():
            process.send_signal(2)
        for process in processes.values():
            process.wait(20.0)


def quartiles(values: list[float]) -> str:
    """Return 'median (first … third quartile)'."""
    low, middle, high = np.percentile(values, [25, 50, 75])
    return f'{middle:.2f} ({low:.2f} … {high:.2f})'


HEAD = ('node, executor', 'asked, got [Hz]', 'answered', 'CPU [µs/cycle]', 'CPU / bare echo',
        'round trip p50, p99, largest [µs]')


def rows(rate: float, found: dict[Candidate, list[Block]]) -> list[tuple[str, ...]]:
    """Return one rate's rows of the table."""
    made = []
    for candidate, blocks in found.items():
        trips = np.concatenate([block.trips for block in blocks])
        ratio = '1'
        if candidate in CONTROLLERS:
            bare = found[ECHOES[CONTROLLERS.index(candidate)]]
            ratio = quartiles([ours.cpu / theirs.cpu
                               for ours, theirs in zip(blocks, bare, strict=True)])
        made.append((
            candidate.name, f'{rate:.0f}, {np.median([b.rate for b in blocks]):.1f}',
            f'{100.0 * np.mean([b.answered for b in blocks]):.1f} %',
            f'{np.median([b.cpu for b in blocks]):.0f}', ratio,
            f'{np.percentile(trips, 50):.0f}, {np.percentile(trips, 99):.0f}, '
            f'{trips.max():.0f}'))
    return made


def main() -> int:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rates', type=float, nargs='+', default=[250.0, 500.0, 1000.0],
                        metavar='HZ')
    parser.add_argument('--rounds', type=int, default=20, help='each process so often, in turn')
    parser.add_argument('--seconds', type=float, default=0.6, help='of each of these turns')
    parser.add_argument('--commands', type=float, default=0.0, metavar='HZ',
                        help='position commands to the controller (default: none)')
    parser.add_argument('--write', metavar='PAGE', help='page whose table is replaced')
    options = parser.parse_args()
    from engb_ros.processes.runner import reserved_domain
    lines = [HEAD, ('---',) * len(HEAD)]
    print(markdown(lines))
    with reserved_domain() as domain, running(domain, options.commands > 0.0) as processes:
        source = Source(domain, options.commands)
        try:
            for candidate, process in processes.items():   # all are up, past their probation
                source.drive(candidate, process, 100.0, 1.0)
            for rate in options.rates:
                found: dict[Candidate, list[Block]] = {name: [] for name in CANDIDATES}
                for number in range(options.rounds):
                    # Forth and back, so that a drift of the machine favours neither.
                    for candidate in CANDIDATES[::-1 if number % 2 else 1]:
                        found[candidate].append(source.drive(
                            candidate, processes[candidate], rate, options.seconds))
                lines += rows(rate, found)
                print(markdown(lines[-len(CANDIDATES):]), flush=True)
        finally:
            source.close()
    if options.write:
        write_table(Path(options.write), 'cycle', markdown(lines))
    return 0


if __name__ == '__main__':
    sys.exit(main())
