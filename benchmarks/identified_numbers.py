# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How near `engb identify` comes to the truth, and how near the fit of a diagnosis does.

    .venv/bin/python -m benchmarks.identified_numbers [--brakes 24] [--seed 11]

Brakes are drawn about the paper's and simulated by Runge-Kutta (tests/identify/bench.py, no code
of the package), with counts, noise and sampling rates drawn as well. Both get the same recording
and start at the paper's numbers: the identification's joint regression, and the refit of the
nominal numbers that every diagnosis begins with. Printed are the errors as parts of the truth and
how many of the stated intervals (two deviations) hold it.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.nominal import with_numbers
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.uncertainty import vector_deviations
from engb_core.identify.procedure import identify
from engb_core.model import Friction, LoadTorque, Model
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques
from engb_core.recording import Recording
from tests.identify.bench import PAPER, simulate, stroke_reference

Array = NDArray[np.float64]
NAMES = {'inertia': 'inertia', 'viscous_friction': 'viscous', 'coulomb': 'coulomb',
         'load_gain': 'gain', 'saturation_velocity': 'saturation'}
# What was found: value and deviation by name, and the load curve.
Found = tuple[dict[str, tuple[float, float]], Array]


def drawn(generator: np.random.Generator, seed: int) -> tuple[dict[str, Any], Recording, float]:
    """Return a brake's true numbers, a recording of its strokes, and the shortest stroke [rad]."""
    spread = {'inertia': 0.25, 'viscous': 0.25, 'coulomb': 0.4, 'gain': 0.4, 'saturation': 0.3}
    truth = {name: PAPER[name] * float(np.exp(size * generator.standard_normal()))
             for name, size in spread.items()}
    truth['load'] = tuple(value * float(np.exp(0.3 * generator.standard_normal()))
                          for value in PAPER['load'])
    truth['contact'] = float(generator.uniform(1.0, 5.0)) if seed % 2 else None
    interval = float(generator.choice([1e-3, 2e-3]))
    tops = generator.uniform(12.0, 20.0, 4).tolist()
    strokes = stroke_reference(tops=tops, acceleration=float(generator.uniform(60.0, 200.0)),
                               interval=interval)
    return truth, simulate(
        strokes, truth, seed=seed, noise=float(generator.choice([1e-3, 3e-3, 6e-3])),
        counts=int(generator.choice([1024, 4096, 8192])), interval=interval), min(tops)


def identified(recording: Recording, start: Model, angles: Array) -> Found:
    """Return what the identification finds."""
    found = identify([recording], start)
    return ({name: (found.estimates[name].value, found.estimates[name].std) for name in NAMES},
            found.load_torque(angles))


def refitted(recording: Recording, start: Model, angles: Array) -> Found:
    """Return what the refit finds that a diagnosis begins with."""
    fitter = Fitter(problem_of([recording], start))
    fit = fitter.finish(fitter.refine(fitter.base()))
    numbers = {}
    for number, value, deviation in zip(fit.hypothesis.numbers, fit.vector,
                                        vector_deviations(fit, fitter), strict=True):
        size = float(np.exp(value)) if number.logarithmic else float(value)
        numbers[number.name] = size, float(deviation) * (size if number.logarithmic else 1.0)
    model = with_numbers(fit.hypothesis.model,
                         {name: value for name, (value, _) in numbers.items()})
    return numbers, load_torques(nominal_vector(model), angles)


def main(arguments: list[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--brakes', type=int, default=24)
    parser.add_argument('--seed', type=int, default=11)
    given = parser.parse_args(arguments)
    generator = np.random.default_rng(given.seed)
    off: dict[str, list[tuple[float, ...]]] = {name: [] for name in NAMES}
    loads = []
    for seed in range(given.brakes):
        truth, recording, top = drawn(generator, seed)
        start = replace(Model(), friction=Friction(0.012, 0.11, 1.5), load_torque=LoadTorque(
            'polynomial', PAPER['load'], None if truth['contact'] is None else 3.0))
        angles = np.linspace(0.5, top - 0.5, 50)
        found = [way(recording, start, angles) for way in (identified, refitted)]
        for name, key in NAMES.items():
            off[name].append(tuple(
                part / truth[key] for numbers, _ in found for part in
                (numbers[name][0] - truth[key], numbers[name][1])))
        beyond = angles if truth['contact'] is None else np.maximum(angles - truth['contact'], 0.0)
        load = np.polynomial.polynomial.polyval(beyond, truth['load'])
        loads.append([np.sqrt(np.mean((curve - load) ** 2)) / load.max() for _, curve in found])
        print(f'brake {seed + 1} of {given.brakes}', file=sys.stderr)
    print(f'{f"{given.brakes} brakes":<22} {"identify":>12} {"held":>8}'
          f' {"the refit":>19} {"held":>8}')
    for name, rows in off.items():
        error, deviation, other, its = np.array(rows).T
        print(f'{name:<22} {np.sqrt(np.mean(error ** 2)):12.1%} '
              f'{np.mean(np.abs(error) < 2.0 * deviation):8.0%}'
              f' {np.sqrt(np.mean(other ** 2)):19.1%} {np.mean(np.abs(other) < 2.0 * its):8.0%}')
    curve, other = np.array(loads).T
    print(f'{"load curve (rms/top)":<22} {np.median(curve):12.2%} {np.median(other):28.2%}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
