# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether this tree takes more processor time than another one: the gate before a release.

    .venv/bin/python benchmarks/against.py v0.1.0 [--rounds 11] [--only diagnosis …]

The other tree is a tag or commit of this repository, or a folder that holds one. Each tree works
in a process of its own, which has done everything once before it is measured, so that what is
compiled or loaded once does not count. A round asks both for the same work, in turns who comes
first; what is compared is their processor time within a round, so that a clock that slows down,
or a cache that others fill, meets both. A work fails where the median over the rounds of
(this tree / the other tree) is above 1.15; the quartiles say how sure that is. Ends with 1 where
a work fails.

The work is done through what stays from version to version: `engb_core.__all__`, the model file,
and the controller as a node calls it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
import contextlib
from dataclasses import dataclass
import io
import os
from pathlib import Path
import subprocess
import sys
import tarfile
import tempfile
import time
from typing import TextIO

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
# Of processor time; more than this fails.
LIMIT = 1.15
# Each work, and how often it is repeated for one measurement of about half a second.
WORKS = {'diagnosis': 1, 'prediction': 100, 'simulation': 20, 'control': 10_000}


@dataclass(frozen=True)
class Ratio:
    """This tree's processor time over the other's: the median and the quartiles of the rounds."""

    median: float
    low: float
    high: float

    @property
    def fails(self) -> bool:
        """Whether this tree takes too much more."""
        return self.median > LIMIT


def compared(mine: Sequence[float], others: Sequence[float]) -> Ratio:
    """Compare seconds (rounds,) of this tree with those of the other, round by round."""
    ratios = np.asarray(mine) / np.asarray(others)
    low, median, high = np.quantile(ratios, [0.25, 0.5, 0.75])
    return Ratio(float(median), float(low), float(high))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return 1 where a work takes too much more."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('other', help='a tag or commit, or the folder of another tree')
    parser.add_argument('--rounds', type=int, default=11)
    parser.add_argument('--only', nargs='+', choices=WORKS, default=list(WORKS))
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix='engb-against-') as folder, \
            contextlib.ExitStack() as stack:
        data = Path(folder, 'data')
        data.mkdir()
        trees = [ROOT, _tree(options.other, Path(folder, 'other'))]
        _prepare(data)
        workers = [stack.enter_context(_worker(tree, data)) for tree in trees]
        failed = False
        print(f'{"work":<12} {"here":>9} {"there":>9}  ratio (quartiles)')
        for work in options.only:
            for worker in workers:
                worker(work)
            seconds: tuple[list[float], list[float]] = ([], [])
            for count in range(options.rounds):
                for index in ((0, 1) if count % 2 else (1, 0)):
                    seconds[index].append(workers[index](work))
            ratio = compared(*seconds)
            failed = failed or ratio.fails
            here, there = (f'{1e3 * np.median(entry) / WORKS[work]:7.3g}ms' for entry in seconds)
            print(f'{work:<12} {here:>9} {there:>9}  {ratio.median:.3f} '
                  f'({ratio.low:.3f} to {ratio.high:.3f})' + '  FAILS' * ratio.fails, flush=True)
    return int(failed)


def _tree(name: str, folder: Path) -> Path:
    """Return the folder of the other tree; a tag's or commit's is unpacked."""
    if Path(name, 'engb_core').is_dir():
        return Path(name).resolve()
    packed = subprocess.run(
        ['git', '-C', os.fspath(ROOT), 'archive', name, 'engb_core', 'engb_ros'],
        capture_output=True, check=False)
    if packed.returncode:
        raise SystemExit(f'{name} is neither a tree nor a tag or commit: '
                         f'{packed.stderr.decode().strip()}')
    with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
        archive.extractall(folder, filter='data')
    return folder


@contextlib.contextmanager
def _worker(tree: Path, data: Path) -> Iterator[Callable[[str], float]]:
    """Start a tree's process; give what asks it for a work's processor seconds."""
    process = subprocess.Popen(
        [sys.executable, __file__, '--serve', data], cwd=data, text=True, stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, env={**os.environ, 'PYTHONPATH': os.fspath(tree)})

    def ask(work: str) -> float:
        assert process.stdin and process.stdout
        print(work, file=process.stdin, flush=True)
        answer = process.stdout.readline()
        if not answer:
            raise SystemExit(f'{tree} cannot do {work}; what it said stands above')
        return float(answer)

    try:
        place = ask('place')
        if not place:
            raise SystemExit(f'{tree}: another package was imported than the one there')
        yield ask
    finally:
        process.kill()
        process.communicate()


def _prepare(data: Path) -> None:
    """Write what both trees work on: a recording's columns, and the model file."""
    from bench import NOMINAL, recorded
    run = recorded(20.0)
    reference = run.reference
    np.savez(data / 'run.npz', time=run.time, position=run.position, effort=run.effort,
             velocity=run.velocity, reference=np.array([
                 reference.time, reference.position, reference.velocity, reference.effort]))
    NOMINAL.save(data / 'model.yaml')


def _serve(data: Path, tree: Path, questions: TextIO, answers: TextIO) -> None:
    """Do the works that are asked for; answer with processor seconds each."""
    import engb_core as engb
    from engb_core.recording import Reference
    columns = dict(np.load(data / 'run.npz'))
    reference = Reference(*columns.pop('reference'))
    run = engb.Recording(**columns, reference=reference)
    model = engb.load_model(data / 'model.yaml')
    control = _controller(model)
    works: dict[str, Callable[[], object]] = {
        'diagnosis': lambda: engb.diagnose(run, model),
        'prediction': lambda: engb.predict(run, model),
        'simulation': lambda: engb.simulate(run, model),
        'control': control}
    for line in questions:
        work = line.strip()
        if work == 'place':
            seconds = float(Path(engb.__file__).is_relative_to(tree))
        else:
            begin = time.process_time()
            for _ in range(WORKS[work]):
                works[work]()
            seconds = time.process_time() - begin
        print(seconds, file=answers, flush=True)


def _controller(model: object) -> Callable[[], object]:
    """Return one cycle of a controller that holds a position on a bench that follows."""
    from engb_core.control.brake_controller import BrakeController
    from engb_core.control.brake_settings import ControllerSettings
    from engb_core.control.loop import LoopSettings
    from engb_core.control.pid import PidGains
    controller = BrakeController(model, ControllerSettings(
        LoopSettings(PidGains(0.4, 1.5, 0.006, 0.75, -0.75, 0.5, -0.5)), position_max=36.0))
    now = 100.0
    effort = 0.0
    controller.start(now)

    def cycle() -> None:
        nonlocal now, effort
        now += 0.002
        if round(now * 500.0) % 50 == 0:
            # One that does not track would do less.
            if now > 101.0 and controller.supervisor.state.value != 'enabled':
                raise SystemExit(f'the controller is {controller.supervisor.state.value}')
            controller.on_position_command(now, 6.0)
        effort = controller.on_state(now, stamp=now, position=5.0 + 0.1 * np.sin(now),
                                     velocity=0.1 * np.cos(now), effort=effort) or 0.0

    return cycle


if __name__ == '__main__':
    if sys.argv[1:2] == ['--serve']:
        # What else prints goes where errors go.
        answers, sys.stdout = sys.stdout, sys.stderr
        _serve(Path(sys.argv[2]), Path(os.environ['PYTHONPATH']), sys.stdin, answers)
    else:
        sys.exit(main())
