# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Make the recordings of this folder with the package's own nodes.

    python bags/make_bags.py            make them again from their seals
    python bags/make_bags.py --new      draw new effects, seal them, record

The drawn effect is told to nobody: it goes from the random generator to the plant's parameter
and into `truth.sealed`. `healthy` has none; the model that goes with all of them is identified
from it. The noise's seed is in the seal, too, but nodes start at their own moments: a recording
that is made again has the same physics, not the same noise, sample for sample.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import random
import secrets
import shutil
import sys

import yaml

from engb_core.identify.procedure import identify
from engb_core.io.bags.read import read_recording
from engb_core.io.sealed import digest, opened, sealed
from engb_core.model import Model
from engb_ros.files import NOMINAL_MODEL
from engb_ros.processes.bench import Bench
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import reserved_domain, Runner

FOLDER = Path(__file__).resolve().parent
NAMES = ('brake_1', 'brake_2', 'brake_3', 'brake_4')

# Effects to draw from, with the range of each parameter.
EFFECTS = {
    'asymmetric_friction': {'asymmetry': (0.15, 0.30)},
    'backlash': {'gap': (0.3, 0.8)},
    'disc_runout': {'amplitude': (0.008, 0.016)},
    'friction_drift': {'friction_ratio': (0.6, 0.75)},
    'load_hysteresis': {'hysteresis_ratio': (0.06, 0.12)},
    'nonlinear_viscous_friction': {'quadratic_viscous_friction': (1.0e-5, 2.0e-5)},
    'pad_creep': {'relaxed_fraction': (0.12, 0.25), 'time_constant': (0.3, 0.8)},
    'self_energizing': {'load_ratio': (0.45, 0.75)},
    'stribeck_friction': {'breakaway_ratio': (1.5, 2.0), 'stribeck_velocity': (1.5, 4.0)},
    'torque_saturation': {'torque_loss': (0.08, 0.16)},
}

RATE = 500.0
CONTROLLER = {
    'stroke_amplitudes': [12.0, 36.0, 24.0, 30.0], 'stroke_acceleration': 80.0,
    'stop_time': 0.7, 'slow_speeds': [1.0, 4.0], 'slow_range': [0.3, 3.0],
}
# The disc turns during a part of every recording, whatever the effect.
PLANT = {
    'disc_speed_times': [0.0, 14.0, 15.0, 30.0], 'disc_speed_values': [0.0, 0.0, 55.0, 70.0],
    'pad_temperature_times': [0.0, 14.0, 30.0], 'pad_temperature_values': [25.0, 30.0, 90.0],
}


def draw() -> dict:
    """Return a truth: an effect, its parameters, a seed and salt."""
    source = random.SystemRandom()
    effect = source.choice(sorted(EFFECTS))
    parameters = {name: float(f'{source.uniform(*bounds):.3g}')
                  for name, bounds in EFFECTS[effect].items()}
    return {'effect': effect, 'parameters': parameters, 'seed': source.randrange(1, 2**31 - 1),
            'salt': secrets.token_hex(16)}


def record(folder: Path, effect: str | None, parameters: dict, seed: int) -> None:
    """Record one brake into folder/recording."""
    shutil.rmtree(folder / 'recording', ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    effects = yaml.safe_dump({effect: parameters}, default_flow_style=True) if effect else ''
    with reserved_domain() as domain, Runner(domain) as runner, Probe(domain) as probe:
        bench = Bench(runner, probe, RATE)
        bench.record(folder / 'recording', {**PLANT, 'effects': effects.strip(), 'seed': seed},
                     CONTROLLER, others=(),
                     progress=lambda state: print(f'\r{folder.name} {state.time:5.1f} of '
                                                  f'{state.duration:.1f} s', end='', flush=True))
        bench.stop()
    print()


def note(folder: Path, sealed_digest: str | None) -> None:
    """Write how a recording was made."""
    what = ('Nothing is added to its physics.' if sealed_digest is None else
            f'One effect is added to its physics. Which one is in `truth.sealed` (SHA-256 of its '
            f'content: `{sealed_digest}`).')
    (folder / 'README.md').write_text(
        f'# {folder.name}\nRecorded by the `recorder` node from the `plant` and `controller` '
        f'nodes of this package, three processes in lockstep over DDS at {RATE:.0f} Hz: slow '
        'strokes in the clearance, then strokes of 12, 36, 24 and 30 rad at 80 rad/s². The disc '
        'stands at first and turns from 14 s on (after the plant\'s start). The brake is '
        f'`engb_ros/config/brake.yaml`. {what}\n\n'
        '`model.yaml` is what `engb identify` found on `bags/healthy`.\n'
        + ('' if sealed_digest is None else
           f'\n    engb diagnose bags/{folder.name}/recording \\\n        --model '
           f'bags/{folder.name}/model.yaml --out out/{folder.name}\n'), encoding='utf-8')


def overview(seals: dict[str, str]) -> None:
    """Write this folder's README."""
    lines = '\n'.join(f'| `{name}` | `{value}` |' for name, value in seals.items())
    (FOLDER / 'README.md').write_text(
        '# Recordings\nMade by `bags/make_bags.py` with the package\'s own nodes. `healthy` is '
        'the brake as its model says; in each of the others one effect is added, drawn by a '
        'random generator and sealed before anyone saw it.\n\n'
        '| recording | SHA-256 of what `truth.sealed` holds |\n| --- | --- |\n' + lines
        + '\n\nTo open a seal, beside a diagnosis or without:\n\n'
        '    engb prove --open bags/brake_1/truth.sealed --diagnosis out/brake_1/diagnosis.json\n',
        encoding='utf-8')


def main() -> int:
    """Make all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--new', action='store_true', help='draw new effects')
    parser.add_argument('--only', nargs='*', help='only these')
    arguments = parser.parse_args()
    healthy = FOLDER / 'healthy'
    if not arguments.only or 'healthy' in arguments.only:
        record(healthy, None, {}, 7)
        note(healthy, None)
        found = identify([read_recording(str(healthy / 'recording'))],
                         Model.read(NOMINAL_MODEL))
        found.model.write(healthy / 'model.yaml')
        print(found.summary())
    taken: set[str] = set()
    for name in NAMES:
        folder = FOLDER / name
        seal = folder / 'truth.sealed'
        if arguments.only and name not in arguments.only:
            continue
        if arguments.new or not seal.exists():
            truth = draw()
            while truth['effect'] in taken:
                truth = draw()
            folder.mkdir(parents=True, exist_ok=True)
            seal.write_text(sealed(truth), encoding='ascii')
        truth = opened(seal.read_text(encoding='ascii'))
        taken.add(truth['effect'])
        record(folder, truth['effect'], truth['parameters'], truth['seed'])
        shutil.copy(healthy / 'model.yaml', folder / 'model.yaml')
        note(folder, digest(seal.read_text(encoding='ascii')))
    overview({name: digest((FOLDER / name / 'truth.sealed').read_text(encoding='ascii'))
              for name in NAMES if (FOLDER / name / 'truth.sealed').exists()})
    return 0


if __name__ == '__main__':
    sys.exit(main())
