# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A small part of `run.py`: a hundred damaged cases, each ends in a result or in one line.

What is damaged within bags and models goes through `predict`, the quickest command, and a few
through `diagnose` and `identify`.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from engb_core.io.tables import apart
from engb_core.io.tables.open import open_table
from engb_ros.fleet import processes

from .cases import Case, COMMANDS, make_case
from .oracle import ForkedReader, in_this_process, judge
from .tables import make_table


@pytest.mark.parametrize('seed', range(0, 80, 20))
def test_predict(tmp_path, seed):
    findings = []
    for number in range(seed, seed + 20):
        folder = tmp_path / str(number)
        folder.mkdir()
        case = make_case(number, folder, ('predict',))
        wrong, _ = judge(case, folder)
        if wrong:
            findings.append((number, case.about, wrong))
    assert not findings


@pytest.mark.parametrize('seed', range(2000, 2080, 20))
def test_tables(tmp_path, seed):
    for package in ('asammdf', 'nptdms', 'pyarrow', 'h5py'):
        pytest.importorskip(package)
    findings = []
    for number in range(seed, seed + 20):
        folder = tmp_path / str(number)
        folder.mkdir()
        arguments, about = make_table(number, folder)
        out = str(folder / 'rec')
        case = Case([*arguments] if '--list' in arguments else [*arguments, '--out', out], out,
                    about)
        wrong, _ = judge(case, folder)
        if wrong:
            findings.append((number, about, wrong))
    assert not findings


def test_the_forked_reader_stands_in_for_the_real_one(tmp_path, monkeypatch):
    """It is what `run.py` reads tables with; no other test does."""
    monkeypatch.setattr(apart, 'start_process', ForkedReader)
    arrays = {'t': np.arange(50) / 100, 'position': np.arange(50.0), 'effort': np.ones(50)}
    savemat(tmp_path / 'bench.mat', arrays)
    table = open_table(tmp_path / 'bench.mat')
    names = [channel.name for channel in table.channels]
    assert np.array_equal(table.read([names.index('t')])[names.index('t')].value, arrays['t'])


@pytest.mark.parametrize('seed', range(1000, 1010))
def test_identify_and_diagnose(tmp_path, seed):
    case = make_case(seed, tmp_path, ('identify', 'diagnose'))
    wrong, _ = judge(case, tmp_path)
    assert not wrong, case.about


@pytest.mark.parametrize(('seed', 'commands'), [
    (200091, COMMANDS), (200618, COMMANDS), (300453, ('predict', 'identify'))])
def test_what_was_found_once(tmp_path, monkeypatch, seed, commands):
    monkeypatch.setattr(processes, 'run_processes', in_this_process)
    case = make_case(seed, tmp_path, commands)
    wrong, _ = judge(case, tmp_path)
    assert not wrong, case.about


def test_cases_follow_from_their_number(tmp_path):
    contents = []
    for name in 'ab':
        folder = tmp_path / name
        folder.mkdir()
        make_case(17, folder)
        contents.append({str(file.relative_to(folder)): file.read_bytes()
                         for file in sorted(Path(folder).rglob('*')) if file.is_file()})
    assert contents[0] == contents[1]
