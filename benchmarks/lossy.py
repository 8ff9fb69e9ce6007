# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Lost datagrams: a process's own are thrown away at its system calls, below the middleware.

    python -m benchmarks.lossy [--parts 0 0.1 0.2 0.3 0.4] [--rounds 3]

No rights are needed, and nobody else's network is touched. What is lost are whole datagrams of
UDP: samples, acknowledgements, discovery. The command steps a brake to and fro between 10 and
20 rad while drive and controller lose a part of what they send, and prints how far it goes beyond.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import contextlib
from pathlib import Path
import shutil
import struct
import subprocess
import sys
import tempfile
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy

from engb_core.control.causes import Cause
from engb_ros.interface import JOINT_STATES
from engb_ros.nodes.messages import message_class
from engb_ros.processes.live_loop import LiveLoop
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import reserved_domain, Runner

__all__ = ['LossyWire', 'compiler', 'listen_to_what_comes']

# The drive's samples per second, and the steps [Hz, rad].
RATE, LOW, HIGH = 250.0, 10.0, 20.0


def compiler() -> str | None:
    """Return the C compiler that is at hand, if any."""
    return shutil.which('cc')


class LossyWire:
    """What processes with this environment send is lost in part: none to begin with.

    Args:
        folder: of its own, for the library and the word.

    Attributes:
        environment: variables for the processes.
    """

    def __init__(self, folder: Path) -> None:
        library, self._word = folder / 'lossy.so', folder / 'part'
        subprocess.run([str(compiler()), '-O2', '-shared', '-fPIC', '-o', str(library),
                        str(Path(__file__).with_name('lossy.c')), '-ldl', '-lpthread'],
                       check=True)
        self.lose(0.0)
        self.environment = {'LD_PRELOAD': str(library), 'LOSSY_FILE': str(self._word)}

    def lose(self, part: float) -> None:
        """From now on lose this part, 0 to 1, of the datagrams."""
        mode = 'r+b' if self._word.exists() else 'wb'
        with self._word.open(mode) as file:   # in place: it is mapped
            file.write(struct.pack('f', part))


def listen_to_what_comes(probe: Probe) -> list[Any]:
    """Return the list in which joint states gather that are not lost: whoever asks for reliable
    ones waits for those that are, too."""
    heard: list[Any] = []
    probe.node.create_subscription(
        message_class(JOINT_STATES.type), JOINT_STATES.name, heard.append,
        QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT))
    return heard


@contextlib.contextmanager
def stepped(part: float) -> Iterator[tuple[LiveLoop, LossyWire]]:
    """Run a loop at LOW; afterwards `part` is lost."""
    with tempfile.TemporaryDirectory(prefix='engb_lossy_') as folder:
        wire = LossyWire(Path(folder))
        with reserved_domain() as domain, Runner(domain, environment=wire.environment) as runner, \
                Probe(domain) as probe:
            loop = LiveLoop(runner, probe, [('plant', {'rate': RATE, 'effort_noise': 0.0})])
            loop.states = listen_to_what_comes(probe)
            loop.until(lambda: loop.states, 'joint states')
            loop.go(LOW)
            wire.lose(part)
            yield loop, wire
            runner.kill()


def main() -> int:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--parts', type=float, nargs='+', default=[0.0, 0.1, 0.2, 0.3, 0.4])
    parser.add_argument('--rounds', type=int, default=3)
    options = parser.parse_args()
    if compiler() is None:
        print('no C compiler (cc)', file=sys.stderr)
        return 2
    print('| lost | lowest, highest angle [rad] | faults |\n| --- | --- | --- |')
    for part in options.parts:
        angles, found = [], Cause(0)
        for _ in range(options.rounds):
            with stepped(part) as (loop, wire):
                begin, told = len(loop.states), len(loop.causes)
                for target in (HIGH, LOW, HIGH, LOW):
                    loop.target = target
                    loop.during(1.0)
                angles += [message.position[0] for message in loop.states[begin:]]
                latched = loop.is_in('fault')
                wire.lose(0.0)
                loop.during(0.5)
                if latched or loop.is_in('fault'):
                    for message in loop.causes[told:]:
                        found |= Cause(message.data)
        print(f'| {part:.0%} | {min(angles):.2f}, {max(angles):.2f} | '
              f'{(found.name or "none").lower()} |', flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
