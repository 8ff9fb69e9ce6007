# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How good is the identification? Many drawn brakes, each identified blind: errors and coverage.

    python -m benchmarks.blind_brakes --brakes 40
    python -m benchmarks.blind_brakes --brakes 300 --strokes-only
    python -m benchmarks.blind_brakes --brakes 40 --strokes-only --thorough

Simulated in this process (`engb reproduce --sealed N` does the same on live nodes). A brake takes
some seconds, with --strokes-only half a second: then the strokes alone are recorded, and
identified from a start that knows nothing of the brake. --thorough drives slow strokes through the
contact and each amplitude thrice, a minute instead of ten seconds.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
import json
import sys

from engb_core.bench.settings import BenchSettings
from engb_core.control.reference import ReferenceSettings
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.reproduce import chosen
from engb_core.reproduce.blind import (
    BlindOutcome,
    drawing,
    estimate_brake,
    estimate_strokes,
    judge,
    summarise,
    WAYS,
)
from engb_core.reproduce.drawn_brakes import draw_brake
from engb_core.reproduce.in_process import run_experiment
from engb_core.reproduce.plan import Experiment, length, STROKES

THOROUGH = ReferenceSettings(kind='strokes', amplitudes=(8.0, 14.0, 20.0), repetitions=3,
                             slow_speeds=(2.0, 4.0, 8.0), slow_range=(0.0, 12.0))


def main() -> int:
    """Identify the brakes and print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--brakes', type=int, default=40, metavar='N')
    parser.add_argument('--first', type=int, default=0, metavar='SEED')
    parser.add_argument('--strokes-only', action='store_true')
    parser.add_argument('--thorough', action='store_true')
    arguments = parser.parse_args()
    outcomes: list[BlindOutcome] = []
    for seed in range(arguments.first, arguments.first + arguments.brakes):
        brake = draw_brake(seed)
        found = (_strokes(brake, seed, arguments.thorough) if arguments.strokes_only
                 else estimate_brake(partial(_run, brake, seed), drawing(brake.mechanism)))
        outcomes += judge(found, brake)
        print(f'brake {seed}', file=sys.stderr)
    for way, entry in summarise(outcomes).items():
        print(f'{way}: {entry["brakes"]} brakes; contact {json.dumps(entry["contact"])}; cogging '
              f'order right {entry["orders_right"]}')
        for name, row in (*entry['numbers'].items(), ('load', entry['load'])):
            held = '' if row['coverage'] is None else f'{100 * row["coverage"]:.1f} %'
            print(f'  {name:<22} median {100 * row["median"]:8.3f} %  worst '
                  f'{100 * row["worst"]:8.2f} %  in 2 sigma {held}')
    return 0


def _run(brake: BenchSettings, seed: int, experiment: Experiment, model: Model) -> Recording:
    return run_experiment(replace(experiment, brake=brake), model, seed)


def _strokes(brake: BenchSettings, seed: int, thorough: bool) -> dict[str, dict]:
    experiment = replace(STROKES, brake=brake)
    if thorough:
        experiment = replace(experiment, reference=THOROUGH, duration=length(THOROUGH))
    return {WAYS[3]: estimate_strokes(run_experiment(experiment, chosen.NOMINAL, seed),
                                      chosen.NOMINAL)}


if __name__ == '__main__':
    sys.exit(main())
