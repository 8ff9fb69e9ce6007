# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How late the controller answers on a busy computer, with and without real-time options.

    python -m benchmarks.jitter [--rate 250] [--seconds 20] [--load 4] [--write docs/integrate.md]

A source (SCHED_FIFO itself, where that is permitted, so that only the controller is judged) sends
joint states; shown is the round trip until the torque comes, without load, then beside --load
processes that compute without a pause, each with the controller as the system schedules it, and
with `scheduling_priority`, `lock_memory` and `processors`. What is not permitted is left out, and
said. `missed`: no answer before the next sample.
"""

from __future__ import annotations

import argparse
import contextlib
import os
from pathlib import Path
import subprocess
import sys
import time

import numpy as np

from benchmarks.page import markdown, write_table
from engb_ros.nodes.transport import stay_on_this_computer

stay_on_this_computer(os.environ)

PRIORITY = 50
OPTIONS = {
    'as the system does': {},
    'SCHED_FIFO': {'scheduling_priority': PRIORITY},
    'SCHED_FIFO, memory locked, one processor': {
        'scheduling_priority': PRIORITY, 'lock_memory': True,
        'processors': [max(os.sched_getaffinity(0))]},
}
HEAD = ('controller', 'load', 'round trip p50, p99, p99.9, largest [µs]', 'missed')


def trips(domain: int, namespace: str, rate: float, seconds: float) -> tuple[np.ndarray, int]:
    """Return round trips (n,) [µs], and how many samples had no answer before the next one."""
    import rclpy
    from rclpy.experimental import EventsExecutor
    from rclpy.qos import QoSProfile
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64
    context = rclpy.Context()
    context.init(domain_id=domain)
    node = rclpy.create_node('source', context=context, namespace=namespace)
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    publish = node.create_publisher(JointState, 'joint_states', QoSProfile(depth=10)).publish
    message = JointState(name=['motor'], position=[0.0], velocity=[0.0], effort=[0.0])
    found: list[float] = []
    sent, missed, samples = 0.0, 0, 0

    def on_answer(answer: Float64) -> None:
        nonlocal sent
        if sent:
            found.append(time.perf_counter() - sent)
            sent = 0.0

    def tick() -> None:
        nonlocal sent, missed, samples
        missed += bool(sent) and samples > rate   # the first second is for finding each other
        samples += 1
        message.header.stamp = node.get_clock().now().to_msg()
        sent = time.perf_counter()
        publish(message)

    node.create_subscription(Float64, 'effort_command', on_answer, QoSProfile(depth=1))
    node.create_timer(1.0 / rate, tick)
    with contextlib.suppress(PermissionError):
        for thread in Path('/proc/self/task').iterdir():
            os.sched_setscheduler(int(thread.name), os.SCHED_FIFO,
                                  os.sched_param(PRIORITY + 10))
    end = time.monotonic() + 60.0
    while len(found) < 2 * rate and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    found.clear()
    missed, end = 0, time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()
    return 1e6 * np.array(found), missed


def child(arguments: list[str]) -> int:
    """Measure in a process of its own: its scheduling must not outlive the measurement."""
    domain, namespace, rate, seconds = arguments
    found, missed = trips(int(domain), namespace, float(rate), float(seconds))
    p50, p99, p999 = np.percentile(found, [50, 99, 99.9])
    print(f'{p50:.0f}, {p99:.0f}, {p999:.0f}, {found.max():.0f}|{missed} of '
          f'{len(found) + missed}')
    return 0


def row(name: str, load: int, rate: float, seconds: float) -> tuple[str, ...] | None:
    """Return a line of the table; None where the system does not permit the options."""
    from engb_ros.files import config_file, TRUE_BRAKE
    from engb_ros.processes.runner import reserved_domain, Runner
    with reserved_domain() as domain, Runner(domain) as runner:
        controller = runner.start('controller', parameters={
            'model': os.fspath(TRUE_BRAKE), 'mechanism': os.fspath(config_file('mechanism.yaml')),
            'state_timeout': 0.0, 'command_timeout': 0.0, **OPTIONS[name]})
        busy = [subprocess.Popen([sys.executable, '-c', 'while True: pass'])
                for _ in range(load)]
        try:
            time.sleep(3.0)
            if controller.status is not None:
                print(f'{name}: {controller.output.strip()}', file=sys.stderr)
                return None
            told = subprocess.run(
                [sys.executable, '-m', 'benchmarks.jitter', '--child', str(domain), '/engb',
                 str(rate), str(seconds)], env=runner.environment, capture_output=True,
                text=True, check=True).stdout
        finally:
            for process in busy:
                process.kill()
                process.wait()
        runner.stop()
    return (name, f'{load} processes' if load else 'none', *told.strip().split('|'))


def main() -> int:
    """Measure and print a table."""
    if sys.argv[1:2] == ['--child']:
        return child(sys.argv[2:])
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rate', type=float, default=250.0, metavar='HZ')
    parser.add_argument('--seconds', type=float, default=20.0, help='each is measured so long')
    parser.add_argument('--load', type=int, default=2 * (os.cpu_count() or 1), metavar='N',
                        help='processes that compute without a pause')
    parser.add_argument('--write', metavar='PAGE', help='page whose table is replaced')
    options = parser.parse_args()
    lines = [HEAD, ('---',) * len(HEAD)]
    for load in (0, options.load):
        for name in OPTIONS:
            made = row(name, load, options.rate, options.seconds)
            if made is not None:
                lines.append(made)
                print(' | '.join(made), file=sys.stderr, flush=True)
    text = markdown(lines)
    print(text)
    if options.write:
        write_table(Path(options.write), 'jitter', text)
    return 0


if __name__ == '__main__':
    sys.exit(main())
