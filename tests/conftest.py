# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What every test process needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import resource
import signal
import subprocess
from typing import Any

import pytest

from tests.machine import Watch

# A shell that starts the tests in the background leaves SIGINT ignored, and what they start in
# turn would ignore it, too.
signal.signal(signal.SIGINT, signal.default_int_handler)
# So with SIGHUP where they are started to outlive the terminal.
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# No example has to end in 0.2 s, hypothesis' deadline: a busy computer lets any of them wait, and
# it is none of what they test.
with contextlib.suppress(ImportError):   # where it is not installed its tests are left out
    from hypothesis import settings

    # Another profile that was chosen (tests/mutants) stays.
    settings.register_profile('default', settings.get_profile('default'), deadline=None)

BEGIN = pytest.StashKey[float]()
WATCH = pytest.StashKey[Watch]()
BROKEN = pytest.StashKey[bool]()

# Nodes and buses as they are, in real time. One that failed is run again, and both outcomes are
# told: a stall of a second, of which the load of a whole test shows nothing, lets watchdogs find
# what nobody injected. Where a busy machine was late they are run again more often, and where
# others took it to the end the outcome is not known. Only what lateness can cause is excused: that
# something was not as expected, or did not come in time. Any other exception fails at once.
REAL_TIME = ('tests/ros/', 'tests/can_bus/test_bus.py',
             'tests/can_bus/test_four_drives.py::test_four_drives_over_a_real_bus')
RERUNS = 3
OF_LATENESS = (AssertionError, TimeoutError, subprocess.TimeoutExpired)

# Files and tests that take more than a few seconds of processor time, or real time (nodes, buses);
# `make check` leaves them out. Found by `pytest --durations=80`.
SLOW = (
    *REAL_TIME, 'tests/fleet/test_survey.py', 'tests/fleet/test_dask.py',
    'tests/core/test_code_cache.py', 'tests/diagnose/test_parallel_map.py',
    'tests/diagnose/test_load_cause.py', 'tests/diagnose/test_unseen.py',
    'tests/diagnose/test_beyond_the_search.py', 'tests/diagnose/test_curved_friction.py',
    'tests/diagnose/test_experiment.py::test_the_experiment_settles',
    'tests/diagnose/test_findings.py::test_a_wave_is_one_that_repeats',
    'tests/fuzz/test_fuzz.py', 'tests/laws/test_find_law.py',
    'tests/proof/test_effects.py::test_size_comes_out_as_asked',
    'tests/proof/test_prove.py::test_no_crash', 'tests/proof/test_prove.py::test_scores_and_page',
    'tests/proof/test_prove.py::test_second_start', 'tests/proof/test_prove.py::test_baselines',
    'tests/proof/test_prove.py::test_a_part',
    'tests/reproduce/', 'tests/commands/test_reproduce.py::test_offline',
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow, and what is run again where the machine was busy."""
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker('slow')
        if item.nodeid.startswith(REAL_TIME):
            item.add_marker('real_time')
            item.add_marker(pytest.mark.flaky(reruns=RERUNS, condition=_may_be_late(item)))


def _may_be_late(item: pytest.Item) -> Callable[[], bool]:
    return lambda: not item.stash[BROKEN] and (
        getattr(item, 'execution_count', 1) <= 1 or item.stash[WATCH].may_be_late())


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let `--processor-time=25` list what takes most, whatever else the machine does."""
    parser.addoption('--processor-time', type=int, default=0, metavar='N', help=(
        'list the N tests that take most processor time, their fixtures and processes included'))


def _processor_time() -> float:
    """Return what this process and its children that have ended have used [s]."""
    return sum(used.ru_utime + used.ru_stime for used in map(
        resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Note a test's processor time, its fixtures' included, where the report finds it."""
    item.stash[BEGIN] = _processor_time()
    return (yield)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Watch what others take, from each attempt's beginning."""
    item.stash[WATCH] = Watch()
    item.stash[BROKEN] = False


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item,
                              call: pytest.CallInfo[None]) -> Iterator[None]:
    """Say where a failure in real time proves nothing. Hand the processor time on with the report
    of the teardown, the last one (also by pytest-xdist)."""
    if call.excinfo is not None and not isinstance(
            call.excinfo.value, (*OF_LATENESS, pytest.skip.Exception)):
        item.stash[BROKEN] = True
    report = yield
    if (report.failed and item.nodeid.startswith(REAL_TIME) and not item.stash[BROKEN]
            and getattr(item, 'execution_count', 1) > RERUNS and item.stash[WATCH].inconclusive()):
        report.outcome = 'skipped'
        report.longrepr = (str(item.path), item.location[1] or 0, (
            f'inconclusive: others took {item.stash[WATCH].used()[0]:.0%} of the machine; it '
            f'failed {RERUNS + 1} times, last with: {str(report.longrepr)[-300:]}'))
    if report.when == 'teardown':
        report.user_properties.append(('processor time', _processor_time() - item.stash[BEGIN]))
    return report


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print what failed before it was run again, and the list that `--processor-time` asks for."""
    for report in terminalreporter.getreports('rerun'):
        crash = getattr(report.longrepr, 'reprcrash', None)
        told = crash.message if crash is not None else str(report.longrepr)
        terminalreporter.write_line(f'run again: {report.nodeid}: {told.splitlines()[0][:300]}')
    count = config.getoption('--processor-time')
    used = [(dict(report.user_properties).get('processor time', 0.0), report.nodeid)
            for report in terminalreporter.getreports('') if report.when == 'teardown']
    if not count or not used:
        return
    terminalreporter.section(f'processor time, {sum(seconds for seconds, _ in used):.0f} s in all')
    for seconds, name in sorted(used, reverse=True)[:count]:
        terminalreporter.write_line(f'{seconds:7.1f} s  {name}')
