# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How long a loop stands still while somebody joins its graph, or is killed: measured.

    python -m benchmarks.joining [--joins 12] [--transports UDPv4 DEFAULT]

A loop holds a brake at 200 Hz. Again and again a node that listens to its topics starts; half of
them are killed (SIGKILL), the others end by themselves. Printed are the longest pauses of torque
commands, and how many joins had one longer than a drive waits (0.1 s), with Fast DDS's UDP
transport alone, and with its default, which shares memory (engb_ros/nodes/transport.py).
"""

from __future__ import annotations

import argparse
import sys
import time

from engb_ros.processes.live_loop import LiveLoop
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import reserved_domain, Runner

# A drive lets go after so long without a command [s].
PATIENCE = 0.1

# How long a listener stays [s].
STAYS = 2.5

LISTENER = f'''
import time, rclpy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
rclpy.init()
node = rclpy.create_node('listener', namespace='/engb')
node.create_subscription(Float64, 'effort_command', lambda message: None, 1)
node.create_subscription(JointState, 'joint_states', lambda message: None, 1)
end = time.monotonic() + {STAYS}
while time.monotonic() < end:
    rclpy.spin_once(node, timeout_sec=0.05)
'''


def pauses(transports: str, joins: int) -> list[float]:
    """Return the longest pause of torque commands during each join [s]."""
    found = []
    environment = {'FASTDDS_BUILTIN_TRANSPORTS': transports, 'FASTRTPS_DEFAULT_PROFILES_FILE': '',
                   'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
    with (reserved_domain() as domain, Probe(domain) as probe,
          Runner(domain, local=False, environment=environment) as runner):
        loop = LiveLoop(runner, probe, [('plant', {'rate': 200.0, 'effort_noise': 0.0})],
                        state_timeout=1.5)
        loop.go(25.0)
        for number in range(joins):
            process = runner.start_command('listener', [sys.executable, '-c', LISTENER])
            last, count, longest = time.monotonic(), len(loop.efforts), 0.0
            end = last + 2.0 * STAYS
            killed = False
            while time.monotonic() < end and (killed or process.status is None):
                if number % 2 and not killed and time.monotonic() > end - STAYS:
                    process.process.kill()
                    killed = True
                loop.pump()
                now = time.monotonic()
                if len(loop.efforts) > count:
                    longest, last, count = max(longest, now - last), now, len(loop.efforts)
            runner.processes.pop('listener').process.kill()
            found.append(max(longest, time.monotonic() - last))
        runner.kill()
    return found


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--joins', type=int, default=12)
    parser.add_argument('--transports', nargs='*', default=['UDPv4', 'DEFAULT'])
    options = parser.parse_args()
    for transports in options.transports:
        found = pauses(transports, options.joins)
        late = sum(pause > PATIENCE for pause in found)
        print(f'{transports}: longest pause {max(found):.3f} s; {late} of {len(found)} joins '
              f'longer than {PATIENCE} s: ' + ' '.join(f'{pause:.3f}' for pause in found),
              flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
