"""Damaged input at scale: each case must end in a result or in one clear line with status 2.

    .venv/bin/python tests/fuzz/run.py --count 10000
    .venv/bin/python tests/fuzz/run.py --seed 4711 --count 1 --keep out/case     # one again

Every case follows from its number (--seed counts up). Cases run in worker processes with bounded
memory; one that takes too long, or kills its worker, is a finding. Time is the worker's own
processor time, so that a busy machine makes no findings; who does nothing for ten times as long
hangs. Status 1 if there is any.
"""

from __future__ import annotations

import argparse
from collections import Counter
import json
import multiprocessing
from multiprocessing.connection import Connection, wait
import os
from pathlib import Path
import re
import resource
import shutil
import sys
import tempfile
import time
import warnings

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / 'tests')]

MEMORY = 6 << 30    # address space; what a worker has mapped (numba's LLVM, numpy) counts too


def main() -> int:
    """Run the cases and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--count', type=int, default=10_000, help='cases (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0, help='number of the first case')
    parser.add_argument('--jobs', type=int, default=1, help='worker processes')
    parser.add_argument('--seconds', type=float, default=120,
                        help='of processor time that a case may take')
    parser.add_argument('--commands', nargs='+', default=None, help='only these commands')
    parser.add_argument('--keep', type=Path, help='keep the files of findings here')
    parser.add_argument('--log', type=Path, help='write each finding as a line of JSON here')
    arguments = parser.parse_args()
    begin = time.monotonic()
    endings, findings = _all(arguments)
    print(f'\n{sum(endings.values())} cases in {time.monotonic() - begin:.0f} s, '
          f'{len(findings)} findings')
    for text, count in endings.most_common(40):
        print(f'{count:7}  {text}')
    return 1 if findings else 0


def _all(arguments: argparse.Namespace) -> tuple[Counter, list[dict]]:
    todo = iter(range(arguments.seed, arguments.seed + arguments.count))
    workers = [_Worker(arguments) for _ in range(arguments.jobs)]
    endings: Counter = Counter()
    findings: list[dict] = []
    active = [worker for worker in workers if worker.next(todo)]
    shown = time.monotonic()
    while active:
        ready = wait([worker.pipe for worker in active], timeout=1)
        for worker in list(active):
            result = None
            if worker.pipe in ready:
                result = worker.take()
            elif worker.late(arguments.seconds):
                result = worker.lost(f'no end after {arguments.seconds:.0f} s')
            if result is None:
                continue
            endings[_kind(result['ending'] if not result['wrong'] else 'FINDING')] += 1
            if result['wrong']:
                findings.append(result)
                print(f'case {result["seed"]} ({result["about"]}): {result["wrong"]}', flush=True)
                if arguments.log:
                    with arguments.log.open('a', encoding='utf-8') as file:
                        file.write(json.dumps(result) + '\n')
            if not worker.next(todo):
                active.remove(worker)
        if time.monotonic() - shown > 30:
            shown = time.monotonic()
            print(f'… {sum(endings.values())} cases, {len(findings)} findings', file=sys.stderr,
                  flush=True)
    for worker in workers:
        worker.stop()
    return endings, findings


def _kind(ending: str) -> str:
    """Take names and numbers out of a line, so that equal ones count together."""
    ending = re.sub(r'/\S+', '…', re.sub(r"'[^']*'", "'…'", ending))
    return re.sub(r'[-+]?\d[\d.e+-]*', '#', ending)[:110]


class _Worker:
    """A process that runs one case after another."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        self._arguments = arguments
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context('spawn')
        self.pipe, other = context.Pipe()
        self._process = context.Process(target=_work, args=(
            other, self._arguments.commands, self._arguments.keep), daemon=True)
        self._process.start()
        other.close()
        self._begin()
        self._seed = -1

    def _begin(self) -> None:
        self._since, self._processor = time.monotonic(), self._processor_time()

    def _processor_time(self) -> float:
        """Return what the process has used so far [s]; on systems without /proc the time."""
        try:
            words = Path(f'/proc/{self._process.pid}/stat').read_text().rsplit(')', 1)[1].split()
        except (OSError, IndexError):
            return time.monotonic()
        return (int(words[11]) + int(words[12])) / os.sysconf('SC_CLK_TCK')

    def late(self, seconds: float) -> bool:
        """Whether the case has worked for too long, or hangs."""
        return (self._processor_time() - self._processor > seconds
                or time.monotonic() - self._since > 10.0 * seconds)

    def next(self, todo) -> bool:
        """Hand out the next case; False where there is none."""
        self._seed = next(todo, -1)
        if self._seed < 0:
            return False
        self._begin()
        self.pipe.send(self._seed)
        return True

    def take(self) -> dict:
        """Return the case's result, also if it has killed the process."""
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            return self.lost('the process died')

    def lost(self, why: str) -> dict:
        """Give up a case and its process."""
        seed = self._seed
        self.stop()
        self._start()
        return {'seed': seed, 'about': '', 'wrong': why, 'ending': 'lost'}

    def stop(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


def _work(pipe: Connection, commands: list[str] | None, keep: Path | None) -> None:
    warnings.simplefilter('ignore')
    from engb_ros.fleet import processes
    from fuzz.cases import COMMANDS, make_case
    from fuzz.oracle import in_this_process, judge
    processes.run_processes = in_this_process
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    while True:
        seed = pipe.recv()
        folder = Path(tempfile.mkdtemp(prefix='engb-fuzz-'))
        try:
            case = make_case(seed, folder, tuple(commands or COMMANDS))
            wrong, ending = judge(case, folder)
            if wrong and keep:
                shutil.copytree(folder, keep / f'case_{seed}', dirs_exist_ok=True)
            pipe.send({'seed': seed, 'about': case.about, 'wrong': wrong, 'ending': ending})
        finally:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == '__main__':
    sys.exit(main())
