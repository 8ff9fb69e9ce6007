# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb prove` of an installation: it draws and scores its cases without the source tree."""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path
import subprocess
import sys

import pytest

from engb_ros.commands import prove
from engb_ros.commands.main import main

from .conftest import ROOT


@pytest.fixture(scope='module')
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a wheel holds, in a folder."""
    folder = tmp_path_factory.mktemp('installed')
    made = subprocess.run(
        [sys.executable, 'setup.py', '-q', 'build', '--build-base', str(folder / 'base'),
         '--build-lib', str(folder / 'lib')], cwd=ROOT, capture_output=True, text=True,
        check=False)
    assert made.returncode == 0, made.stderr
    return folder / 'lib'


def run(installed: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the installed `engb`, far from the source tree."""
    return subprocess.run([sys.executable, '-m', 'engb_ros.commands.main', *arguments],
                          cwd=folder, capture_output=True, text=True, check=False,
                          env=os.environ | {'PYTHONPATH': str(installed)})


def test_an_installation_holds_what_draws_and_scores(installed: Path, tmp_path: Path) -> None:
    assert not list((installed / 'engb_proof').glob('test_*'))
    assert not (installed / 'tests').exists()
    where = subprocess.run(
        [sys.executable, '-c', 'from engb_ros.commands.prove import _proof\n'
         'print(_proof("prove").__file__, _proof("real").__file__, _proof("run").commit())'],
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env=os.environ | {'PYTHONPATH': str(installed)})
    assert where.returncode == 0, where.stderr
    prove_file, real_file, commit = where.stdout.split()
    assert prove_file == str(installed / 'engb_proof' / 'prove.py')
    assert real_file == str(installed / 'engb_proof' / 'real.py')
    assert commit == 'None'


@pytest.mark.slow
def test_a_small_proof_of_an_installation(installed: Path, tmp_path: Path) -> None:
    done = run(installed, tmp_path, 'prove', '--cases', '1', '--brief', '--strata', 'clean=1',
               '--seed', '3', '--out', 'out')
    assert done.returncode == 0, done.stderr
    assert 'digest' in done.stdout or 'sha256' in done.stdout
    assert json.loads((tmp_path / 'out' / 'scores.json').read_text())
    assert (tmp_path / 'out' / 'index.html').exists()


@pytest.mark.parametrize('arguments', [['--cases', '1'], ['--frozen'], ['--real', '.'],
                                       ['--cases-from', '.']])
def test_where_it_is_missing_one_line_says_so(
        arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    there = importlib.util.find_spec
    monkeypatch.setattr(prove, '__file__', str(tmp_path / 'engb_ros/commands/prove.py'))
    monkeypatch.setattr(importlib.util, 'find_spec', lambda name, package=None: (
        None if name == 'engb_proof' else there(name, package)))
    monkeypatch.chdir(tmp_path)
    assert main(['prove', *arguments, '--out', 'out']) == 2
    told = capsys.readouterr().err.strip()
    assert told.startswith('engb: engb prove needs the package engb_proof')
    assert '\n' not in told
    assert not Path('out').exists()
