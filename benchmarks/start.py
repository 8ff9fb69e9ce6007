# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How long commands and nodes take to start.

    .venv/bin/python benchmarks/start.py [--rounds 9]

Commands: `engb --help` and each command's --help, from starting the process to its end. Nodes:
from starting the process until its lifecycle state is active, as a `get_state` call from outside
tells. Each figure is the median of --rounds starts; `processor` is what the process itself
used, which a busy machine does not change much. Without rclpy the nodes are left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
import statistics
import subprocess
import sys
import tempfile
import time

from bench import ROOT

TARGET_HELP, TARGET_NODE = 0.4, 2.0
ENGB = (sys.executable, '-m', 'engb_ros.commands.main')
COMMANDS = ('', 'diagnose', 'predict', 'identify', 'import', 'survey', 'reproduce', 'prove')
NODES = ('plant', 'controller', 'disturbance_observer', 'identifier', 'recorder', 'excitation')


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rounds', type=int, default=9)
    arguments = parser.parse_args()
    environment = os.environ | {'PYTHONPATH': str(ROOT)}
    print(f'{"":<24}{"median s":>9}{"best s":>8}{"processor s":>13}')
    for command in COMMANDS:
        call = [*ENGB, *([command] if command else []), '--help']
        show(f'engb {command} --help'.replace('  ', ' '),
             [timed(lambda call=call: subprocess.run(
                 call, check=True, stdout=subprocess.DEVNULL, env=environment))
              for _ in range(arguments.rounds)], TARGET_HELP)
    try:
        import rclpy  # noqa: F401
    except ImportError:
        print('rclpy is not installed: no nodes')
        return
    for node in NODES:
        show(node, [ready(node) for _ in range(arguments.rounds)], TARGET_NODE)


def show(name: str, times: list[tuple[float, float]], target: float) -> None:
    """Print the median of (wall, processor) seconds."""
    wall, processor = zip(*times, strict=True)
    print(f'{name:<24}{statistics.median(wall):9.2f}{min(wall):8.2f}'
          f'{statistics.median(processor):13.2f}   (target {target:g})', flush=True)


def timed(action: Callable[[], object]) -> tuple[float, float]:
    """Return wall and processor seconds of an action and of the processes that it ended."""
    before, begin = os.times(), time.perf_counter()
    action()
    after = os.times()
    return time.perf_counter() - begin, (after.children_user + after.children_system
                                         - before.children_user - before.children_system)


def ready(node: str) -> tuple[float, float]:
    """Return the wall seconds until a node is active, and the processor seconds of its life."""
    from engb_ros.interface import Service
    from engb_ros.processes.probe import Probe
    from engb_ros.processes.runner import reserved_domain, Runner
    state = Service('~/get_state', 'lifecycle_msgs/srv/GetState', '')
    before = os.times()
    with tempfile.TemporaryDirectory() as folder, reserved_domain() as domain, \
            Probe(domain) as probe, Runner(domain) as runner:
        options = {'bag': f'{folder}/bag'} if node == 'recorder' else {}
        begin = time.perf_counter()
        runner.start(node, parameters=options)
        while probe.call(node, state).current_state.label != 'active':
            probe.spin()
        seconds = time.perf_counter() - begin
        runner.stop()
    after = os.times()
    return seconds, (after.children_user + after.children_system
                     - before.children_user - before.children_system)


if __name__ == '__main__':
    main()
