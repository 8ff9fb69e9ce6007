"""What a control cycle costs and how late it is: our controller beside a bare rclpy echo.

    python benchmarks/control_cycle.py [--seconds 10] [--rates 250 500 1000]

A source process sends JointState at each rate. On the other side runs, in turn, a bare rclpy
node that answers each JointState with a Float64, and the package's controller (PID,
feedforward, clamp-force estimate, supervision, reference and report topics on). Counted are the
CPU time of that process per cycle (user + system, from /proc), and the round trip from sending
the sample to receiving the answer. Both run the same executor; the bare one also with the
single-threaded executor, for the choice of executor.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import subprocess
import sys
import time

import numpy as np

os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')

ROOT = Path(__file__).resolve().parents[1]
TICKS = os.sysconf('SC_CLK_TCK')

ECHO = '''
import os, signal, sys
import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
node = rclpy.create_node('echo', namespace='/engb')
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


def cpu_time(pid: int) -> float:
    """Return user + system time of a process [s]."""
    fields = Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def measure(command: list[str], environment: dict[str, str], domain: int, rate: float,
            seconds: float) -> dict[str, float]:
    """Return cost and latency of one process that answers joint states."""
    import rclpy
    from rclpy.experimental import EventsExecutor
    from rclpy.qos import QoSProfile
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64
    context = rclpy.Context()
    context.init(domain_id=domain)
    node = rclpy.create_node('source', context=context, namespace='/engb')
    publisher = node.create_publisher(JointState, 'joint_states', QoSProfile(depth=10))
    commands = node.create_publisher(Float64, 'position_command', QoSProfile(depth=1))
    sent = [0.0]
    trips: list[float] = []

    counts = {'samples': 0, 'answers': 0}

    def on_answer(message: Float64) -> None:
        counts['answers'] += 1
        if sent[0]:
            trips.append(time.perf_counter() - sent[0])
            sent[0] = 0.0

    node.create_subscription(Float64, 'effort_command', on_answer, QoSProfile(depth=1))
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    process = subprocess.Popen(command, env=environment, cwd=ROOT, stdout=subprocess.DEVNULL)
    message = JointState(name=['motor'], position=[0.0], velocity=[0.0], effort=[0.0])

    def tick() -> None:
        stamp = node.get_clock().now().to_msg()
        message.header.stamp = stamp
        sent[0] = time.perf_counter()
        publisher.publish(message)
        counts['samples'] += 1
        if counts['samples'] % max(1, round(rate / 20.0)) == 0:
            commands.publish(Float64(data=0.0))

    timer = node.create_timer(1.0 / rate, tick)
    try:
        end = time.monotonic() + 60.0
        while len(trips) < rate * 1.5:   # warm, and past the controller's probation
            executor.spin_once(timeout_sec=0.1)
            if time.monotonic() > end or process.poll() is not None:
                raise RuntimeError(f'{command[:3]} does not answer')
        trips.clear()
        counts['samples'] = counts['answers'] = 0
        begin, used = time.monotonic(), cpu_time(process.pid)
        while time.monotonic() - begin < seconds:
            executor.spin_once(timeout_sec=0.1)
        spent = cpu_time(process.pid) - used
        passed = time.monotonic() - begin
    finally:
        node.destroy_timer(timer)
        process.send_signal(2)
        process.wait(20.0)
        node.destroy_node()
        context.try_shutdown()
    late = 1e6 * np.array(trips)
    return {'rate': counts['samples'] / passed, 'answered': counts['answers'] / counts['samples'],
            'cpu': 1e6 * spent / counts['answers'], 'p50': float(np.percentile(late, 50)),
            'p99': float(np.percentile(late, 99)), 'max': float(late.max())}


def main() -> int:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=10.0)
    parser.add_argument('--rates', type=float, nargs='+', default=[250.0, 500.0, 1000.0])
    parser.add_argument('--rounds', type=int, default=3, help='each pair so often, in turn; the '
                        'median is shown')
    options = parser.parse_args()
    from engb_ros.files import config_file, TRUE_BRAKE
    from engb_ros.runner import node_command, reserved_domain
    controller = node_command('controller', parameters={
        'model': os.fspath(TRUE_BRAKE), 'mechanism': os.fspath(config_file('mechanism.yaml')),
        'state_timeout': 5.0, 'command_timeout': 5.0})
    settings = {
        'bare echo, events': [sys.executable, '-c', ECHO, 'events'],
        'controller, events': controller,
        'bare echo, single': [sys.executable, '-c', ECHO, 'single'],
        'controller, single': controller,
    }
    print(f'{"":20} {"asked":>6} {"got":>7} {"answered":>9} {"CPU µs/cycle":>13} '
          f'{"p50 µs":>8} {"p99 µs":>8} {"max µs":>8}')
    with reserved_domain() as domain:
        for rate in options.rates:
            found: dict[str, list[dict[str, float]]] = {name: [] for name in settings}
            for _ in range(options.rounds):
                for name, command in settings.items():
                    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain),
                                   'ENGB_EXECUTOR': name.rpartition(' ')[2],
                                   'ROS_PYTHON_CHECK_FIELDS': '0'}
                    found[name].append(measure(command, environment, domain, rate,
                                               options.seconds))
            middle = {name: {key: float(np.median([row[key] for row in rows]))
                             for key in rows[0]} for name, rows in found.items()}
            for name, row in middle.items():
                print(f'{name:20} {rate:6.0f} {row["rate"]:7.1f} {row["answered"]:9.4f} '
                      f'{row["cpu"]:13.1f} {row["p50"]:8.0f} {row["p99"]:8.0f} '
                      f'{row["max"]:8.0f}', flush=True)
            ratio = middle['controller, events']['cpu'] / middle['bare echo, events']['cpu']
            print(f'{"":20} controller / bare echo, events: {ratio:.2f} of the CPU per cycle')
    return 0


if __name__ == '__main__':
    sys.exit(main())
