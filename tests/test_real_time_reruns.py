# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a busy machine excuses in a test in real time: that something came late, nothing else."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

from tests.conftest import RERUNS

HERE = Path(__file__).parent

LATE = {
    'assertion': 'assert False, "too late"',
    'timeout': 'raise TimeoutError("did not answer")',
    'runner': 'raise RunnerTimeout("waited 30 s")',
    'process': 'subprocess.run(["sleep", "9"], timeout=0.001)',
}
BROKEN = {
    'name': 'nobody_defined_this',
    'attribute': 'None.nothing',
    'node_ended': 'raise RunnerError("controller ended with status 1")',
    'handler': ('try:\n        raise TimeoutError\n'
                '    except TimeoutError:\n        nobody_defined_this'),
}
FIXTURES = {'in_setup': 'nobody_defined_this\n    yield', 'in_teardown': 'yield\n    None.nothing'}


@pytest.fixture(scope='module')
def outcomes(tmp_path_factory):
    """Run failing tests beside this project's conftest, on a machine that counts as busy; return
    how often each of them was run, and its last outcome."""
    root = tmp_path_factory.mktemp('busy')
    tests = root / 'tests' / 'ros'
    tests.mkdir(parents=True)
    (root / 'pytest.ini').write_text('[pytest]\nmarkers =\n    slow:\n    real_time:\n')
    (root / 'tests' / 'conftest.py').write_text((HERE / 'conftest.py').read_text())
    (root / 'tests' / 'machine.py').write_text(
        (HERE / 'machine.py').read_text() + '\nMOST = FULL = -1.0\n')
    lines = ['import subprocess', 'import pytest',
             'from engb_ros.processes.runner import RunnerError, RunnerTimeout',
             'def ran(name):\n    with open("ran", "a") as file:\n        print(name, file=file)']
    for name, statement in {**LATE, **BROKEN}.items():
        lines.append(f'def test_{name}():\n    ran("{name}")\n    {statement}')
    for name, body in FIXTURES.items():
        lines.append(f'@pytest.fixture\ndef {name}():\n    ran("{name}")\n    {body}')
        lines.append(f'def test_{name}({name}):\n    assert False, "too late"')
    (tests / 'test_it.py').write_text('\n\n'.join(lines) + '\n')
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-rA', '-p', 'no:cacheprovider', 'tests'],
        cwd=root, capture_output=True, text=True, check=False)
    told, ran = done.stdout + done.stderr, (root / 'ran').read_text().split()
    return {name: (ran.count(name),
                   set(re.findall(rf'^(FAILED|ERROR) tests/ros/test_it.py::test_{name}\b', told,
                                  re.MULTILINE)), told)
            for name in (*LATE, *BROKEN, *FIXTURES)}


@pytest.mark.parametrize('name', LATE)
def test_what_may_come_of_lateness_is_run_again_and_then_inconclusive(outcomes, name):
    count, failed, told = outcomes[name]
    assert count == RERUNS + 1, told
    assert not failed, told


@pytest.mark.parametrize('name', [*BROKEN, *FIXTURES])
def test_what_lateness_cannot_cause_fails_at_once(outcomes, name):
    count, failed, told = outcomes[name]
    assert count == 1, told
    assert failed, told
