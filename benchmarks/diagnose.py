# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How long a diagnosis takes, where the time goes, how it grows, and the memory it needs.

    .venv/bin/python benchmarks/diagnose.py [--lengths 30 60 120] [--numbers 1 2 4] [--profile]

Recordings of a simulated brake at 1 kHz with two hidden effects (Stribeck friction and load
hysteresis), so that pairs are searched. Each line is a process of its own, which diagnoses a
short recording first: what is compiled or loaded once does not count. `wall` on a busy machine
says more about the others; `processor` is this process's own. --profile adds the functions that
take most of the time at 60 s.
"""

from __future__ import annotations

import argparse
import cProfile
import json
from pathlib import Path
import pstats
import subprocess
import sys
import time

from bench import NOMINAL, peak_memory, recorded, Stopwatch

from engb_core.diagnose.engine import diagnose

TARGET_SECONDS, TARGET_MEMORY = 5.0, 1024.0
# What the engine says at the start of a phase, and what the phase is called here.
PHASES = {'reading': 'motion', 'refitting': 'numbers', 'fitting': 'singles',
          'choosing': 'pairs', 'refining': 'refining', 'asking': 'flexible',
          'telling': 'wrong numbers', 'listening': 'resonance',
          'judging': 'second round', 'simulating': 'experiment and loops'}
# What is told of progress within a phase.
WITHIN = ('fitted',)


class Phases:
    """Adds up the processor time between what `diagnose` tells."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._name, self._since = '', time.process_time()

    def __call__(self, text: str) -> None:
        """Begin the phase of `text`."""
        if text.split()[0] in WITHIN:
            return
        now = time.process_time()
        if self._name:
            self.seconds[self._name] = self.seconds.get(self._name, 0.0) + now - self._since
        self._name, self._since = PHASES.get(text.split()[0], 'other'), now


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--lengths', type=float, nargs='+', default=[30.0, 60.0, 120.0],
                        metavar='SECONDS')
    parser.add_argument('--numbers', type=int, nargs='+', default=[1, 2, 4],
                        help='of recordings, 30 s each')
    parser.add_argument('--profile', action='store_true')
    parser.add_argument('--one', nargs=2, type=float, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measured(arguments.one[0], int(arguments.one[1]))))
        return
    print(f'{"recordings":<14}{"wall s":>8}{"processor s":>13}{"s per minute":>14}'
          f'{"peak MiB":>10}  found')
    sizes = [(length, 1) for length in arguments.lengths] + [
        (30.0, number) for number in arguments.numbers if number > 1]
    last = {}
    for length, number in sizes:
        done = subprocess.run([sys.executable, __file__, '--one', str(length), str(number)],
                              check=True, stdout=subprocess.PIPE, text=True)
        last[length, number] = result = json.loads(done.stdout)
        print(f'{f"{number} × {length:g} s":<14}{result["wall"]:8.2f}{result["processor"]:13.2f}'
              f'{60.0 * result["processor"] / (length * number):14.2f}{result["memory"]:10.0f}'
              f'  {", ".join(result["found"])}', flush=True)
    whole = last.get((60.0, 1))
    if whole:
        print(f'\n60 s at 1 kHz, target {TARGET_SECONDS:g} s and {TARGET_MEMORY:g} MiB: '
              f'{whole["wall"]:.2f} s, {whole["memory"]:.0f} MiB. Processor time by phase:')
        for name, seconds in whole['phases'].items():
            print(f'  {name:<24}{seconds:6.2f} s')
    if arguments.profile:
        profiled()


def measured(length: float, number: int) -> dict:
    """Diagnose `number` recordings of `length` [s] in this process."""
    recordings = [recorded(length, seed=1 + index, name=f'run_{index}')
                  for index in range(number)]
    diagnose([recorded(10.0)], NOMINAL)
    phases = Phases()
    with Stopwatch() as watch:
        result = diagnose(recordings, NOMINAL, progress=phases)
    phases('end')
    return {'wall': watch.wall, 'processor': watch.processor, 'memory': peak_memory(),
            'phases': phases.seconds,
            'found': [effect.effect for effect in result.effects] or [result.verdict]}


def profiled() -> None:
    """Print what takes most of the time of one diagnosis."""
    recording = recorded(60.0)
    diagnose([recorded(10.0)], NOMINAL)
    profile = cProfile.Profile(time.process_time)
    profile.runcall(diagnose, [recording], NOMINAL)
    print()
    root = Path(__file__).resolve().parents[1]
    entries = pstats.Stats(profile).stats
    print(f'{"calls":>8}{"own s":>8}{"total s":>9}  function')
    for (file, line, name), (calls, _, own, total, _) in sorted(
            entries.items(), key=lambda entry: -entry[1][2])[:20]:
        place = Path(file)
        where = place.relative_to(root) if place.is_relative_to(root) else place.name
        print(f'{calls:8}{own:8.2f}{total:9.2f}  {where}:{line} {name}')


if __name__ == '__main__':
    main()
