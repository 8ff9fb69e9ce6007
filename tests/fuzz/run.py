# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Damaged input at scale: each case must end in a result or in one clear line with status 2.

    .venv/bin/python tests/fuzz/run.py --count 10000
    .venv/bin/python tests/fuzz/run.py --seed 4711 --count 1 --keep out/case     # one again

Every case follows from its number (--seed counts up); of 100, 58 are tables, 40 bags and models,
2 files made to take memory or time. Each runs in a child of its own, forked from a worker that
has everything imported: a traceback, a signal, more than 60 s or more memory than 700 MB beside
what is imported is a finding. Time is processor time, so that a busy machine makes none; who does
nothing for ten times as long hangs. Status 1 if there is any.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable
import faulthandler
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

# What a case may take beside the 300 MB of a process that has everything imported [MB].
MEMORY = 700


def main() -> int:
    """Run the cases and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--count', type=int, default=10_000, help='cases (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0, help='number of the first case')
    parser.add_argument('--jobs', type=int, default=1, help='worker processes')
    parser.add_argument('--seconds', type=float, default=60,
                        help='of processor time that a case may take')
    parser.add_argument('--commands', nargs='+', default=None,
                        help='damaged bags and models only, through these commands')
    parser.add_argument('--keep', type=Path, help='keep the files of findings here')
    parser.add_argument('--log', type=Path, help='write each finding as a line of JSON here')
    arguments = parser.parse_args()
    arguments.most = {'memory': 0, 'seconds': 0.0}
    begin = time.monotonic()
    endings, findings = _all(arguments)
    print(f'\n{sum(endings.values())} cases in {time.monotonic() - begin:.0f} s, '
          f'{len(findings)} findings')
    print(f'at most {arguments.most["memory"]} MB beside what is imported, '
          f'{arguments.most["seconds"]:.1f} s of processor time')
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
            for what, most in arguments.most.items():
                arguments.most[what] = max(most, result.get(what, 0))
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
            other, self._arguments.commands, self._arguments.keep, self._arguments.seconds))
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


def _work(pipe: Connection, commands: list[str] | None, keep: Path | None,
          seconds: float) -> None:
    warnings.simplefilter('ignore')
    os.environ['ENGB_TRACEBACK'] = ''
    from engb_core.io.tables import apart
    from engb_ros.fleet import processes
    from fuzz.cases import make_any, warm_up
    from fuzz.oracle import ForkedReader, in_this_process, judge
    processes.run_processes = in_this_process
    apart.start_process = ForkedReader
    warm_up()
    while True:
        try:
            seed = pipe.recv()
        except EOFError:        # the run was broken off
            return
        folder = Path(tempfile.mkdtemp(prefix='engb-fuzz-'))
        try:
            result = _forked(lambda seed=seed, folder=folder: _judged(
                make_any(seed, folder, commands), folder, judge), seconds)
            if result['wrong'] and keep:
                shutil.copytree(folder, keep / f'case_{seed}', dirs_exist_ok=True)
            pipe.send({'seed': seed} | result)
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def _judged(case, folder: Path, judge) -> dict:
    before, since = _peak(), time.process_time()
    wrong, ending = judge(case, folder)
    readers = resource.getrusage(resource.RUSAGE_CHILDREN)
    memory = max(_peak(), readers.ru_maxrss // 1024) - before
    used = time.process_time() - since + readers.ru_utime + readers.ru_stime
    if not wrong and memory > MEMORY:
        wrong = f'takes {memory} MB'
    return {'about': case.about, 'wrong': wrong, 'ending': ending, 'memory': memory,
            'seconds': used}


def _peak() -> int:
    """Return the largest size of this process since the last call [MB]."""
    with open('/proc/self/status', encoding='ascii') as lines:
        peak = next(int(line.split()[1]) for line in lines if line.startswith('VmHWM:'))
    Path('/proc/self/clear_refs').write_text('5')
    return peak // 1024


def _forked(action: Callable[[], dict], seconds: float) -> dict:
    """Run `action` in a child; return what it returns, or how it died."""
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        os.close(reader)
        # Making the case's files is no part of what the case may take.
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 30, int(seconds) + 31))
        _peak()
        # What only waits is given up after ten times as long: by then it has said where.
        faulthandler.dump_traceback_later(9.0 * seconds)
        try:
            text = json.dumps(action())
        except BaseException as error:      # a fault of the fuzzing itself
            text = json.dumps({'about': '', 'wrong': f'fuzz: {error!r}', 'ending': 'fuzz'})
        os.write(writer, text.encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, 'rb') as pipe:
        text = pipe.read()
    _, status = os.waitpid(child, 0)
    if not text:
        return {'about': '', 'wrong': f'ended with wait status {status}', 'ending': 'lost'}
    result = json.loads(text)
    if not result['wrong'] and result['seconds'] > seconds:
        result['wrong'] = f'takes {result["seconds"]:.0f} s'
    return result


if __name__ == '__main__':
    sys.exit(main())
