# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Mutation testing of what stands between a wrong number and the brake: `make mutants`.

Each mutant of a module is imported in a process of its own, a copy of one that has already
loaded the libraries, and the module's quick tests run until one fails. No file is changed. What
survives is listed in survivors.yaml, each with the reason why no test can tell it.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
import gc
import importlib
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
import io
import os
from pathlib import Path
import resource
import signal
import sys
import tempfile
import time
from types import ModuleType

import yaml

from tests.mutants.mutations import Mutant, mutants

__all__ = ['Survivor', 'TARGETS', 'judge', 'main', 'outcome']

ROOT = Path(__file__).resolve().parents[2]
LIST = Path(__file__).with_name('survivors.yaml')
LEAST = 0.95
# Modules, and the tests that are run against their mutants, those of the module itself first.
TARGETS = {
    'engb_core/control/final_clamp.py': ('tests/control/test_final_clamp.py',),
    'engb_core/control/pid.py': ('tests/control/test_pid.py',),
    'engb_core/control/torque_watch.py': ('tests/control/test_torque_watch.py',),
    'engb_core/control/state_watch.py': ('tests/control/test_state_watch.py',),
    'engb_core/control/supervisor.py': (
        'tests/control/test_supervisor_alone.py', 'tests/control/test_supervisor.py'),
    'engb_ros/can/drive_watch.py': ('tests/can_bus/test_drive_watch.py',),
    'engb_ros/can/end_to_end.py': ('tests/can_bus/test_end_to_end.py',),
    'engb_ros/can/codec.py': ('tests/can_bus/test_codec.py', 'tests/can_bus/test_link.py'),
}
# Loaded before the copies are made: libraries, and nothing of the project.
LIBRARIES = ('numpy', 'scipy', 'yaml', 'hypothesis', 'pytest', 'cantools')
# pytest as plain as it goes: what these tests need of its plugins and of conftest.py is nothing.
OPTIONS = ('-x', '-q', '--tb=no', '--noconftest', '-c', os.devnull, f'--rootdir={ROOT}',
           '-p', 'no:cacheprovider', '-p', 'no:faulthandler')
LAST = 'out/mutants.yaml'
KILLED, SURVIVED = 'killed', 'survived'


@dataclass(frozen=True)
class Survivor:
    """A mutant by what it changes, as it is listed."""

    module: str
    place: str
    was: str
    becomes: str


class _Changed(SourceFileLoader, MetaPathFinder):
    """Imports one module from a text instead of its file."""

    def __init__(self, name: str, path: Path, source: str) -> None:
        super().__init__(name, str(path))
        self._source = source

    def find_spec(self, fullname: str, path: Sequence[str] | None = None,
                  target: ModuleType | None = None) -> ModuleSpec | None:
        """Answer for that one module."""
        if fullname != self.name:
            return None
        return spec_from_file_location(fullname, self.path, loader=self)

    def path_stats(self, path: str) -> dict[str, float]:
        """Have no compiled file."""
        raise OSError(path)

    def get_data(self, path: str) -> bytes:
        """Return the text."""
        return self._source.encode()


def load_libraries() -> None:
    """Load what each test would load anew; let hypothesis always draw the same few examples."""
    for name in LIBRARIES:
        importlib.import_module(name)
    import hypothesis
    import pytest
    # No deadline: a busy computer would fail tests that no mutant fails.
    hypothesis.settings.register_profile('mutants', derandomize=True, database=None,
                                         max_examples=40, deadline=None)
    hypothesis.settings.load_profile('mutants')
    os.environ['PYTEST_DISABLE_PLUGIN_AUTOLOAD'] = '1'
    # pytest loads its own parts as it goes: once here, instead of in every copy.
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
        empty = Path(folder, 'test_nothing.py')
        empty.write_text('def test_nothing(): assert True\n')
        pytest.main([*OPTIONS, str(empty)])
    gc.freeze()


def start(module: str, source: str, tests: Sequence[str], seconds: float) -> int:
    """Run tests against a changed module in a copy of this process; return its number.

    It ends with pytest's status, or by a signal after `seconds` of processor time: a mutant that
    never ends is found out.
    """
    child = os.fork()
    if child:
        return child
    status = 70
    try:
        used = int(sum(resource.getrusage(resource.RUSAGE_SELF)[:2]))
        limit = used + int(seconds) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(int(20 * seconds) + 60)      # it waits for something
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        path = ROOT / module
        name = module.removesuffix('.py').replace('/', '.')
        sys.meta_path.insert(0, _Changed(name, path, source))
        import pytest
        status = pytest.main([*OPTIONS, *(str(ROOT / test) for test in tests)])
    finally:
        os._exit(status)


def outcome(status: int) -> str:
    """Return what a wait status says: no test failed, or one did."""
    return SURVIVED if os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0 else KILLED


def judge(module: str, changed: Sequence[Mutant], tests: Sequence[str], jobs: int,
          seconds: float) -> list[tuple[Mutant, str]]:
    """Try mutants, so many at a time; return each with its outcome."""
    running: dict[int, Mutant] = {}
    found = []
    todo = iter(changed)
    try:
        while True:
            while len(running) < jobs and (mutant := next(todo, None)) is not None:
                running[start(module, mutant.source, tests, seconds)] = mutant
            if not running:
                return found
            child, status = os.wait()
            found.append((running.pop(child), outcome(status)))
            if sys.stderr.isatty():
                print(f'\r{module}: {len(found)} of {len(changed)}', end='', file=sys.stderr)
    finally:
        for child in running:
            os.kill(child, signal.SIGKILL)


def listed(path: Path = LIST) -> dict[Survivor, str]:
    """Return the list of survivors, each with its reason."""
    entries = yaml.safe_load(path.read_text('utf8')) if path.exists() else {}
    return {Survivor(module, entry['place'], entry['was'], entry['becomes']): entry['reason']
            for module, of_module in (entries or {}).items() for entry in of_module}


def write(path: Path, module: str, survivors: dict[Survivor, str]) -> None:
    """Put one module's survivors into a file like the list; the other modules' stay."""
    whole = yaml.safe_load(path.read_text('utf8')) if path.exists() else {}
    whole[module] = [
        {'place': entry.place, 'was': entry.was, 'becomes': entry.becomes, 'reason': reason}
        for entry, reason in sorted(survivors.items(), key=str)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(whole, sort_keys=False, width=1000, allow_unicode=True), 'utf8')


def main(arguments: Sequence[str] | None = None) -> int:
    """Try the mutants of the modules that are asked for; say what survives."""
    parser = argparse.ArgumentParser(prog='make mutants', description=__doc__.splitlines()[0])
    parser.add_argument('modules', nargs='*', help='parts of names; all by default')
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument('--only', type=Path, metavar='FILE', help=(
        f'try only those that stand in a file: {LIST.name}, or {LAST}, where a run leaves what '
        'survived'))
    options = parser.parse_args(arguments)
    os.chdir(ROOT)
    load_libraries()
    reasons, only = listed(), options.only and listed(options.only)
    totals: Counter[str] = Counter()
    complaints = []
    enough = True
    for module, tests in TARGETS.items():
        if options.modules and not any(part in module for part in options.modules):
            continue
        source = (ROOT / module).read_text('utf8')
        begin = time.monotonic(), _children()
        _, status = os.waitpid(start(module, source, tests, 600.0), 0)
        if outcome(status) != SURVIVED:
            print(f'{module}: its tests fail without any change (wait status {status})')
            return 1
        seconds = 10.0 + 5.0 * (_children() - begin[1])
        every = [mutant for mutant in mutants(source)
                 if only is None or _survivor(module, mutant) in only]
        if not every:
            continue
        results = judge(module, every, tests, options.jobs, seconds)
        count = Counter(result for _, result in results)
        totals += count
        enough = enough and count[KILLED] >= LEAST * count.total()
        print(f'\r{_rate(count)}  {module}  ({time.monotonic() - begin[0]:.0f} s, '
              f'{_children() - begin[1]:.0f} s of processor time)', flush=True)
        survivors = {_survivor(module, mutant) for mutant, result in results
                     if result == SURVIVED}
        write(ROOT / LAST, module, {entry: reasons.get(entry, '') for entry in survivors})
        unlisted = sorted((entry for entry in survivors if not reasons.get(entry)), key=str)
        complaints += unlisted
        for survivor in unlisted:
            print(f'  {survivor.place}\n    - {survivor.was}\n    + {survivor.becomes}')
        for survivor in reasons:
            if survivor.module == module and survivor not in survivors and not options.only:
                complaints.append(survivor)
                print(f'  listed, yet killed or gone; delete it: {survivor}')
    if not totals:
        print(f'no module is called so; there are {", ".join(TARGETS)}')
        return 2
    print(f'{_rate(totals)}  all; {len(complaints)} to be listed in {LIST.name}, or deleted there')
    return 0 if (enough or options.only) and not complaints else 1


def _survivor(module: str, mutant: Mutant) -> Survivor:
    return Survivor(module, mutant.place, mutant.was, mutant.becomes)


def _rate(count: Counter[str]) -> str:
    return f'{100.0 * count[KILLED] / count.total():5.1f} % of {count.total():4d} killed'


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == '__main__':
    sys.exit(main())
