"""Make the paper's experiments, figures 6 to 25 and published numbers again.

examples:
  engb reproduce --out out/reproduction
  engb reproduce --offline --out out/reproduction

Without --offline each experiment runs on live nodes (plant, controller, recorder as processes)
and leaves its bag in OUT/bags; the analysis reads those bags. With --offline the bags kept with
the package are read instead, and no ROS installation is needed. OUT then holds report.html,
results.json and the identified model.yaml.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import json
from pathlib import Path
import time

from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.printable import printable
from engb_core.recording import Recording
from engb_ros.commands.common import add_progress, folder_output, Progress

__all__ = ['add_arguments', 'run']

OUTPUTS = ('report.html', 'results.json', 'model.yaml', 'bags')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('--out', required=True, metavar='DIR', help='where the report goes')
    parser.add_argument('--offline', action='store_true',
                        help='read kept bags instead of running the nodes')
    parser.add_argument('--bags', metavar='DIR', help='the bags for --offline (default: those '
                        'that come with the source tree)')
    parser.add_argument('--seed', type=int, default=1, metavar='N',
                        help='of the sensor noise (default: 1)')
    parser.add_argument('--every', type=int, default=1, metavar='N',
                        help='keep every n-th message in the bags (default: all)')
    add_progress(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    if arguments.seed < 0:
        raise InputError(f'--seed {arguments.seed}: must not be below 0')
    if not 1 <= arguments.every <= 20:
        raise InputError(f'--every {arguments.every}: must lie within 1 and 20')
    begin = time.monotonic()
    from engb_core.reproduce.page import reproduction_page, results_mapping
    from engb_core.reproduce.procedure import reproduce
    inputs = [_kept_bags(arguments.bags)] if arguments.offline else []
    with Progress(arguments) as progress, folder_output(
            arguments.out, OUTPUTS, inputs) as scratch:
        if arguments.offline:
            record = _from_bags(_kept_bags(arguments.bags))
            origin = 'The recordings are the bags kept with the package.'
        else:
            record = _live(scratch / 'bags', arguments.seed, arguments.every, progress)
            origin = (f'The recordings were made on live nodes (seed {arguments.seed}) and read '
                      'back from their bags.')
        results = reproduce(record, progress)
        progress('writing the report')
        results.strokes.good.model.write(scratch / 'model.yaml')
        (scratch / 'results.json').write_text(
            json.dumps(results_mapping(results), indent=1, ensure_ascii=False, allow_nan=False),
            encoding='utf-8')
        reproduction_page(results, origin).write(scratch / 'report.html')
    _tell(results, time.monotonic() - begin)
    print(printable(f'report: {Path(arguments.out) / "report.html"}'))


def _kept_bags(given: str | None) -> Path:
    folder = Path(given) if given else Path(__file__).resolve().parents[2] / 'bags' / 'reproduce'
    if not folder.is_dir():
        raise InputError(f'{folder}: no such folder; name the bags of a former run with --bags '
                         '(its OUT/bags), or leave out --offline')
    return folder


def _from_bags(folder: Path) -> Callable[..., Recording]:
    from engb_ros.bags.read import read_recording

    def record(experiment, model: Model) -> Recording:
        path = folder / experiment.name
        if not path.exists():
            raise InputError(f'{path}: no bag of experiment {experiment.name!r}')
        return read_recording(path)

    return record


def _live(folder: Path, seed: int, every: int, progress: Progress) -> Callable[..., Recording]:
    try:
        import rclpy  # noqa: F401
    except ImportError:
        raise InputError('the nodes need ROS 2 (rclpy), which is not installed here; '
                         'use --offline') from None
    from engb_ros.experiments import record_experiment
    from engb_ros.runner import RunnerError

    def record(experiment, model: Model) -> Recording:
        folder.mkdir(exist_ok=True)
        path = folder / experiment.name
        try:
            return record_experiment(experiment, model, path, seed, progress, every)
        except RunnerError as error:
            raise InputError(f'experiment {experiment.name}: {error}') from error

    return record


def _tell(results, seconds: float) -> None:
    from engb_core.reproduce.numbers import published_numbers
    print(f'{"":<52} {"paper":>9} {"ours":>10} {"simulated":>10}')
    for entry in published_numbers(results):
        paper = '' if entry.paper is None else f'{entry.paper:.4g}'
        truth = '' if entry.truth is None else f'{entry.truth:.4g}'
        unit = f' [{entry.unit}]' if entry.unit not in ('', '-') else ''
        print(f'{entry.name + unit:<52} {paper:>9} {entry.ours:>10.4g} {truth:>10}'.rstrip())
    print(f'{seconds:.0f} s')
