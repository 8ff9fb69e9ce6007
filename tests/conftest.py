"""What every test process needs."""

import signal

import pytest

# A shell that starts the tests in the background leaves SIGINT ignored, and what they start in
# turn would ignore it, too.
signal.signal(signal.SIGINT, signal.default_int_handler)
# So with SIGHUP where they are started to outlive the terminal.
signal.signal(signal.SIGHUP, signal.SIG_DFL)

# Files and tests that take more than a few seconds of processor time, or real time (nodes, buses);
# `make check` leaves them out. Found by `pytest --durations=80`.
SLOW = (
    'tests/ros/', 'tests/can_bus/', 'tests/fleet/test_survey.py', 'tests/fleet/test_dask.py',
    'tests/core/test_code_cache.py', 'tests/diagnose/test_side_by_side.py',
    'tests/diagnose/test_load_cause.py', 'tests/diagnose/test_unseen.py',
    'tests/diagnose/test_beyond_the_search.py', 'tests/diagnose/test_curved_friction.py',
    'tests/diagnose/test_experiment.py::test_the_experiment_settles',
    'tests/diagnose/test_findings.py::test_a_wave_is_one_that_repeats',
    'tests/fuzz/test_fuzz.py', 'tests/laws/test_find_law.py',
    'tests/proof/test_effects.py::test_size_comes_out_as_asked',
    'tests/proof/test_prove.py::test_no_crash', 'tests/proof/test_prove.py::test_scores_and_page',
    'tests/proof/test_prove.py::test_second_start', 'tests/proof/test_prove.py::test_baselines',
    'tests/reproduce/',
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow."""
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker('slow')
