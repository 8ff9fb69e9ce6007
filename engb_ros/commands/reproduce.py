# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Make the paper's experiments, figures 6 to 25 and published numbers again.

examples:
  engb reproduce --out out/reproduction
  engb reproduce --offline --out out/reproduction
  engb reproduce --sealed 10 --out out/reproduction

Two simulated brakes stand in for the paper's: one of the model's form, one with what the model
leaves out. Without --offline each experiment runs on live nodes (plant, controller, observer,
recorder as processes) and leaves its bag in OUT/bags; the analysis reads those bags. With
--offline the bags kept with the package are read instead, and no ROS installation is needed.
OUT then holds report.html, results.json and the model.yaml identified from the first brake.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import json
from pathlib import Path
import time
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.text.printable import printable
from engb_ros.commands.common import add_progress, folder_output, Progress

if TYPE_CHECKING:
    # Importing these takes longer than `engb --help`.
    from engb_core.reproduce.opened_seals import SealedBrakes
    from engb_core.reproduce.plan import Experiment
    from engb_core.reproduce.results import Results

__all__ = ['add_arguments', 'run']

OUTPUTS = ('report.html', 'results.json', 'model.yaml', 'bags', 'sealed')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('--out', required=True, metavar='DIR', help='where the report goes')
    parser.add_argument('--offline', action='store_true',
                        help='read kept bags instead of running the nodes')
    parser.add_argument('--bags', metavar='DIR', help='the bags for --offline (default: those '
                        'that come with the source tree)')
    parser.add_argument('--seed', type=int, default=1, metavar='N',
                        help='of the sensor noise (default: 1)')
    parser.add_argument('--seeds', type=int, default=20, metavar='N',
                        help='of noise, over which each way of identifying is judged; those '
                        'after the first are simulated in this process (default: 20)')
    parser.add_argument('--no-diagnosis', action='store_true',
                        help='do not diagnose what the paper\'s model leaves over')
    parser.add_argument('--sealed', type=int, default=0, metavar='N',
                        help='so many brakes more, each drawn by a process of its own, identified '
                        'on live nodes and opened last (default: none; with --offline those kept '
                        'with the package are opened)')
    parser.add_argument('--every', type=int, default=1, metavar='N',
                        help='keep every n-th message in the bags (default: all)')
    add_progress(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    if arguments.seed < 0:
        raise InputError(f'--seed {arguments.seed}: must not be below 0')
    if not 1 <= arguments.every <= 20:
        raise InputError(f'--every {arguments.every}: must lie within 1 and 20')
    if arguments.seeds < 1:
        raise InputError(f'--seeds {arguments.seeds}: must be 1 or more')
    if arguments.sealed < 0 or (arguments.sealed and arguments.offline):
        raise InputError(f'--sealed {arguments.sealed}: must not be below 0, and needs the nodes: '
                         'leave out --offline')
    begin = time.monotonic()
    from engb_core.reproduce.chapters import reproduce
    from engb_core.reproduce.reproduction_page import reproduction_page, results_mapping
    inputs = [_kept_bags(arguments.bags)] if arguments.offline else []
    with Progress(arguments) as progress, folder_output(
            arguments.out, OUTPUTS, inputs) as scratch:
        if arguments.offline:
            kept = _kept_bags(arguments.bags)
            record = _from_bags(kept)
            origin = 'The recordings are the bags kept with the package, made on live nodes.'
        else:
            record = _live(scratch / 'bags', arguments.seed, arguments.every, progress)
            origin = (f'The recordings were made on live nodes (seed {arguments.seed}) and read '
                      'back from their bags.')
        results = reproduce(record, progress, arguments.seeds, not arguments.no_diagnosis)
        if arguments.offline:
            sealed = _opened(kept / 'sealed')
        else:
            sealed = _sealed(scratch / 'sealed', arguments.sealed, arguments.seed, progress)
        progress('writing the report')
        results.form.strokes.good.model.write(scratch / 'model.yaml')
        (scratch / 'results.json').write_text(
            json.dumps(results_mapping(results, sealed), indent=1, ensure_ascii=False,
                       allow_nan=False), encoding='utf-8')
        reproduction_page(results, origin, sealed).write(scratch / 'report.html')
    _tell(results, time.monotonic() - begin)
    print(printable(f'report: {Path(arguments.out) / "report.html"}'))


def _opened(folder: Path) -> SealedBrakes | None:
    from engb_ros.experiments.sealed_brakes import open_all
    return open_all(folder, 'They ran on live nodes, with observer and identifier, when the bags '
                    'kept with the package were made; what was found then is kept beside each '
                    'seal.')


def _sealed(folder: Path, count: int, seed: int, progress: Progress) -> SealedBrakes | None:
    if not count:
        return None
    from engb_ros.experiments.sealed_brakes import identify_sealed, open_all
    from engb_ros.processes.runner import RunnerError
    try:
        identify_sealed(folder, count, seed, progress)
    except RunnerError as error:
        raise InputError(f'sealed brakes: {error}') from error
    return open_all(folder, 'They ran on live nodes, with observer and identifier.')


def _kept_bags(given: str | None) -> Path:
    folder = Path(given) if given else Path(__file__).resolve().parents[2] / 'bags' / 'reproduce'
    if not folder.is_dir():
        raise InputError(f'{folder}: no such folder; name the bags of a former run with --bags '
                         '(its OUT/bags), or leave out --offline')
    return folder


def _from_bags(folder: Path) -> Callable[..., Recording]:
    from engb_ros.experiments.live_experiments import read_experiment

    def record(brake: str, experiment: Experiment, model: Model) -> Recording:
        path = folder / brake / experiment.name
        if not path.exists():
            raise InputError(f'{path}: no bag of experiment {experiment.name!r}')
        return read_experiment(path)

    return record


def _live(folder: Path, seed: int, every: int, progress: Progress) -> Callable[..., Recording]:
    try:
        import rclpy  # noqa: F401
    except ImportError:
        raise InputError('the nodes need ROS 2 (rclpy), which is not installed here; '
                         'use --offline') from None
    from engb_ros.experiments.live_experiments import record_experiment
    from engb_ros.processes.runner import RunnerError

    def record(brake: str, experiment: Experiment, model: Model) -> Recording:
        path = folder / brake / experiment.name
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            return record_experiment(experiment, model, path, seed, progress, every)
        except RunnerError as error:
            raise InputError(f'experiment {experiment.name}: {error}') from error

    return record


def _tell(results: Results, seconds: float) -> None:
    from engb_core.reproduce.published_numbers import published_numbers
    print(f'{"":<58} {"paper":>9} {"form":>10} {"":<8}{"true":>10} {"more":>10} {"":<8}'
          f'{"true":>10}')
    for entry in published_numbers(results):
        paper = '' if entry.paper is None else f'{entry.paper:.4g}'
        unit = f' [{entry.unit}]' if entry.unit not in ('', '-') else ''
        cells = ' '.join(f'{found.value:>10.4g} {found.word:<8}'
                         f'{"" if found.truth is None else f"{found.truth:.4g}":>10}'
                         for found in (entry.form, entry.more))
        print(f'{entry.name + unit:<58} {paper:>9} {cells}'.rstrip())
    print(f'{seconds:.0f} s')
