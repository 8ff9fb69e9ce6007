# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings of sealed cases in wrong units: how many slips are told, how many true ones refused.

    python benchmarks/unit_slips.py [--cases 30] [--seed N] [--slips 5]

The machines, what they hide and their model files are those of `engb prove --brief`; half of the
files have, beside their own errors, each number wrong by about 30 %. A slip is told if every
quantity that is scaled is named, with the factor that takes it back; it is asked if that is one of
several that the line names, or if the line asks for the unit; it is told partly if what is named
is right, and not all.
"""

from __future__ import annotations

import argparse
from collections import Counter
import dataclasses
import math
from pathlib import Path
import re
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from engb_core import read  # noqa: E402
from engb_core.model import Model  # noqa: E402
from engb_core.recording import Recording  # noqa: E402
from engb_core.signals.plausibility import Plausibility  # noqa: E402
from tests.proof.generate import DEFAULT_STRATA, generate  # noqa: E402

ROTARY = {'degrees': 180.0 / math.pi, 'turns': 0.5 / math.pi, 'counts': 0.0}
LINEAR = {'mm': 1e3}
EFFORTS = {'m': 1e3, 'amperes': 0.0, 'milliamperes': 0.0, 'minus': -1.0}
TIMES = {'ms': 1e3, 'µs': 1e6}
# About 30 % off.
OFF = 0.26
# Factors that lie nearer than this are one: those of currents are shown in two digits.
ALIKE = 1.1


def slipped(recording: Recording, model: Model, rng: np.random.Generator,
            ) -> tuple[Recording, dict[str, float], str]:
    """Return a recording in drawn units; what takes it back to SI units, and the slip in words."""
    positions = LINEAR if model.joint.type == 'prismatic' else ROTARY
    chosen = rng.choice(['position', 'effort', 'both', 'time', 'position time'],
                        p=[0.35, 0.2, 0.3, 0.1, 0.05])
    scales: dict[str, float] = {}
    words = []
    if chosen != 'effort' and chosen != 'time':
        unit = str(rng.choice(list(positions)))
        scales['position'] = positions[unit] or float(
            rng.choice([1024, 4000, 4096, 8192, 65536])) / (2.0 * math.pi)
        words.append(unit)
    if chosen in ('effort', 'both'):
        unit = str(rng.choice(list(EFFORTS)[:3] if chosen == 'both' else list(EFFORTS)))
        scales['effort'] = EFFORTS[unit] or {'amperes': 1.0, 'milliamperes': 1e3}[unit] / (
            model.motor.torque_constant)
        words.append({'m': 'mN·m', 'minus': 'opposite sign'}.get(unit, unit))
    if 'time' in chosen:
        unit = str(rng.choice(list(TIMES)))
        scales['time'] = TIMES[unit]
        words.append(unit)
    columns = {name: getattr(recording, name) * factor for name, factor in scales.items()}
    if 'counts' in words:
        columns['position'] = np.rint(columns['position'])
    return (dataclasses.replace(recording, **columns, velocity=None, signals={}, reference=None),
            {name: 1.0 / factor for name, factor in scales.items()}, ' + '.join(words))


def outcome(fault: str, scales: dict[str, float], words: str) -> str:
    """Return 'told', 'asked', 'told partly', 'told wrongly' or 'missed'."""
    if not fault:
        return 'missed'
    if '--unit position' in fault:      # asks for the counts in a turn, or for any unit
        return 'asked' if 'position' in scales or 'effort=UNIT' in fault else 'told wrongly'
    remedies = [{name: float(value)
                 for name, value in re.findall(r'--scale (\w+)=([-.e\d]+)', one)} for one in
                re.findall(r'(?:--scale \w+=[-.e\d]+ ?)+', fault)]
    right = [found for found in remedies if all(
        name in scales and 1.0 / ALIKE < found[name] / scales[name] < ALIKE for name in found)]
    if not any(set(found) == set(scales) for found in right):
        return 'told partly' if right else 'told wrongly'
    return 'told' if len(remedies) == 1 else 'asked'


def wrong_numbers(model: Model, rng: np.random.Generator) -> Model:
    """Return the model with each number about 30 % off."""
    def off() -> float:
        return float(np.exp(OFF * rng.standard_normal()))
    load = model.load_torque
    factor = off()
    return dataclasses.replace(
        model,
        motor=dataclasses.replace(model.motor, inertia=model.motor.inertia * off(),
                                  viscous_friction=model.motor.viscous_friction * off()),
        friction=dataclasses.replace(model.friction, coulomb=model.friction.coulomb * off()),
        load_torque=dataclasses.replace(
            load, coefficients=tuple(factor * value for value in load.coefficients),
            amplitude=factor * load.amplitude))


def main() -> None:
    """Draw the cases and print what was missed and what was refused."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--cases', type=int, default=30)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--slips', type=int, default=5, help='of each case')
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument('--cases-in', type=Path, help='a folder to make the cases in, or to take '
                        'them from where it stands')
    parser.add_argument('--verbose', action='store_true', help='print every line')
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    counted: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as scratch:
        out = arguments.cases_in or Path(scratch) / 'cases'
        if not out.exists():
            generate(arguments.cases, arguments.seed, out, Path(scratch) / 'truth',
                     dict(DEFAULT_STRATA), jobs=arguments.jobs, progress=lambda text: None,
                     brief=True)
        for number, folder in enumerate(sorted(out.iterdir())):
            model = Model.read(folder / 'nominal.yaml')
            kind = 'file'
            if number % 2:
                model, kind = wrong_numbers(model, rng), '30 % off'
            recording = read(sorted(folder.glob('train*'))[0])
            fault = Plausibility(recording, model).fault()
            counted['true recordings'] += 1
            if fault:
                counted['true recordings refused'] += 1
                print(f'REFUSED {folder.name} ({kind}): {fault}')
            for _ in range(arguments.slips):
                changed, scales, words = slipped(recording, model, rng)
                fault = Plausibility(changed, model).fault()
                counted['slips'] += 1
                found = outcome(fault, scales, words)
                counted['slips ' + found] += 1
                if arguments.verbose or found not in ('told', 'asked'):
                    print(f'{found} {folder.name} ({kind}) {words}: {fault or "nothing"}; '
                          f'{scales}')
    print(', '.join(f'{count} {name}' for name, count in counted.items()))


if __name__ == '__main__':
    main()
