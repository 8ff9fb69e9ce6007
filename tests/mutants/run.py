"""Mutation testing of what stands between a wrong number and the brake: `make mutants`.

Each mutant of a module is imported in a process of its own, a copy of one that has already
loaded the libraries, and the module's quick tests run until one fails. No file is changed. What
survives is listed in survivors.yaml, each with the reason why no test can tell it.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
import importlib
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
import os
from pathlib import Path
import resource
import signal
import sys
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
}
# Loaded before the copies are made: libraries, and nothing of the project.
LIBRARIES = ('numpy', 'scipy', 'yaml', 'hypothesis', 'pytest', 'cantools')
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
    """Load what each test would load anew, and make hypothesis draw the same examples always."""
    for name in LIBRARIES:
        importlib.import_module(name)
    import hypothesis
    hypothesis.settings.register_profile('mutants', derandomize=True, database=None)
    hypothesis.settings.load_profile('mutants')


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
        status = pytest.main([
            '-x', '-q', '--tb=no', '-p', 'no:cacheprovider',
            '-p', 'no:xdist', '-p', 'no:faulthandler', f'--rootdir={ROOT}',
            *(str(ROOT / test) for test in tests)])
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Try the mutants of the modules that are asked for; say what survives."""
    parser = argparse.ArgumentParser(prog='make mutants', description=__doc__.splitlines()[0])
    parser.add_argument('modules', nargs='*', help='parts of names; all by default')
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument('--listed', action='store_true',
                        help='try only those that are listed as survivors')
    options = parser.parse_args(arguments)
    os.chdir(ROOT)
    load_libraries()
    reasons = listed()
    totals: Counter[str] = Counter()
    complaints = []
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
        every = [mutant for mutant in mutants(source) if not options.listed
                 or _survivor(module, mutant) in reasons]
        results = judge(module, every, tests, options.jobs, seconds)
        count = Counter(result for _, result in results)
        totals += count
        print(f'\r{_rate(count)}  {module}  ({time.monotonic() - begin[0]:.0f} s, '
              f'{_children() - begin[1]:.0f} s of processor time)', flush=True)
        survivors = {_survivor(module, mutant) for mutant, result in results
                     if result == SURVIVED}
        for survivor in sorted(survivors, key=str):
            if not reasons.get(survivor):
                complaints.append(survivor)
                print(yaml.safe_dump([{name: getattr(survivor, name) for name in (
                    'place', 'was', 'becomes')}], sort_keys=False, width=200), end='', flush=True)
        for survivor in reasons:
            if survivor.module == module and survivor not in survivors:
                complaints.append(survivor)
                print(f'  listed, yet killed or gone; delete it: {survivor}')
    if not totals:
        print(f'no module is called so; there are {", ".join(TARGETS)}')
        return 2
    print(f'{_rate(totals)}  all; {len(complaints)} to be listed in {LIST.name}, or deleted there')
    rate = totals[KILLED] / totals.total()
    return 0 if (rate >= LEAST or options.listed) and not complaints else 1


def _survivor(module: str, mutant: Mutant) -> Survivor:
    return Survivor(module, mutant.place, mutant.was, mutant.becomes)


def _rate(count: Counter[str]) -> str:
    return f'{100.0 * count[KILLED] / count.total():5.1f} % of {count.total():4d} killed'


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == '__main__':
    sys.exit(main())
