# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The gate on processor time: what fails it, and that it runs a tree of its own."""

from __future__ import annotations

import importlib.util
from pathlib import Path
import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / 'benchmarks' / 'against.py'


@pytest.fixture(scope='module')
def against() -> ModuleType:
    spec = importlib.util.spec_from_file_location('against', FILE)
    module = importlib.util.module_from_spec(spec)
    sys.modules['against'] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(('slower', 'fails'), [
    (0.5, False), (1.0, False), (1.15, False), (1.16, True), (3.0, True)])
def test_more_than_15_percent_in_the_median_fails(against, slower, fails):
    others = np.linspace(1.0, 4.0, 11)           # a machine that becomes slower meets both
    ratio = against.compared(slower * others, others)
    assert ratio.median == pytest.approx(slower)
    assert ratio.fails is fails


def test_single_rounds_that_were_disturbed_do_not_fail_it(against):
    mine, others = np.ones(11), np.ones(11)
    mine[:5] = 9.0
    assert not against.compared(mine, others).fails
    mine[5] = 9.0
    assert against.compared(mine, others).fails


def test_what_is_no_tree_is_told():
    done = subprocess.run([sys.executable, FILE, 'no-such-tag', '--only', 'control'],
                          capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert 'no-such-tag is neither a tree nor a tag or commit' in done.stderr


@pytest.mark.slow
def test_a_tree_against_itself(tmp_path):
    (tmp_path / 'engb_core').symlink_to(ROOT / 'engb_core')
    (tmp_path / 'engb_ros').symlink_to(ROOT / 'engb_ros')
    done = subprocess.run([sys.executable, FILE, str(tmp_path), '--rounds', '3', '--only',
                           'control'], capture_output=True, text=True, check=False)
    assert 'control' in done.stdout, done.stderr
    assert done.returncode == ('FAILS' in done.stdout)
