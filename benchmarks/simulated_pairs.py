# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Somebody's simulator (MuJoCo) in place of a model file: are the same names found?

    .venv/bin/python benchmarks/simulated_pairs.py --pairs 50

Each pair is a simulator's recording and a real one of the same machine with one effect more; what
it is stays in this process's memory and is only compared afterwards. `engb diagnose` runs twice on
the real recording, as a process of its own that is given files: with --simulated, and with the
machine's own numbers as a model file; with --units a third time, with --fmu and the machine in a
unit that is written by hand in C (tests/simulators/hand_made.c) and compiled for each pair.
Printed is which of them names the effect first; the last lines sum up. Needs mujoco (PyPI), and
--units fmpy and a C compiler, too.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import subprocess
import sys
import tempfile
import time

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from engb_core.model import Model  # noqa: E402
from tests.simulators.hand_made import hand_made_unit  # noqa: E402
from tests.simulators.mujoco_pairs import drawn_pair, table  # noqa: E402

ROUTES = {'--simulated': 'simulation.csv', '--model': 'machine.yaml', '--fmu': 'machine.fmu'}


def named(folder: Path, route: str, given: Path, real: Path) -> tuple[list[str], float]:
    """Return the names that a diagnosis by this route finds likely, and its seconds."""
    begun = time.perf_counter()
    out = folder / route.strip('-')
    result = subprocess.run(
        [sys.executable, '-m', 'engb_ros.commands.main', 'diagnose', str(real), route, str(given),
         '--out', str(out), '--quiet'], cwd=ROOT, capture_output=True, text=True, check=False)
    if result.returncode:
        raise SystemExit(f'{route}: {result.stderr.strip()}')
    effects = json.loads((out / 'diagnosis.json').read_text(encoding='utf-8'))['effects']
    return [entry['effect'] for entry in effects if entry['probability'] >= 0.5], (
        time.perf_counter() - begun)


def main() -> None:
    """Run the pairs and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('--pairs', type=int, default=12)
    parser.add_argument('--seed', type=int, default=0, help='of the first pair')
    parser.add_argument('--units', action='store_true', help='with --fmu, too')
    arguments = parser.parse_args()
    routes = [route for route in ROUTES if arguments.units or route != '--fmu']
    first = dict.fromkeys(routes, 0)
    alone = dict.fromkeys(routes, 0)
    for seed in range(arguments.seed, arguments.seed + arguments.pairs):
        pair = drawn_pair(seed)
        line = [f'{seed:3d} {pair.effect:28s}']
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            table(folder / 'real.csv', pair.real)
            table(folder / 'simulation.csv', pair.simulated)
            model: Model = pair.machine.model()
            model.write(folder / 'machine.yaml')
            if arguments.units:
                hand_made_unit(pair.machine, folder / 'machine.fmu')
            for route in routes:
                names, seconds = named(folder, route, folder / ROUTES[route], folder / 'real.csv')
                first[route] += names[:1] == [pair.effect]
                alone[route] += names == [pair.effect]
                line.append(f'{route} {", ".join(names) or "nothing"} ({seconds:.0f} s)')
        print('; '.join(line), flush=True)
    for route in routes:
        print(f'{route}: named first {first[route]} of {arguments.pairs}, and nothing else '
              f'{alone[route]}')


if __name__ == '__main__':
    main()
