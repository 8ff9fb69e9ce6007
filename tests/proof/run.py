# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Run the tool on a case as a stranger would: separate processes on copies without truth."""
from __future__ import annotations

import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile
import time

import engb_ros

from .score import CaseScore, CaseTruth, score

__all__ = ['call', 'commit', 'commits_in', 'recordings_of', 'run_tool', 'score_all', 'TOOL']

TOOL = [sys.executable, '-m', 'engb_ros.commands.main']
_TIMEOUT = 600.0
# The folder of the program that is judged, in a source tree or as it is installed.
_ROOT = Path(engb_ros.__file__).resolve().parents[1]


def commit() -> str | None:
    """The commit of the source tree, with a + where files were changed; None outside of git."""
    if not (_ROOT / 'setup.py').exists():
        return None     # installed, maybe below somebody else's repository

    def git(*arguments: str) -> str:
        return subprocess.run(['git', '-C', str(_ROOT), *arguments], capture_output=True,
                              text=True, check=True).stdout.strip()

    try:
        changed = git('status', '--porcelain', '--untracked-files=no')
        return git('rev-parse', '--short=7', 'HEAD') + ('+' if changed else '')
    except (OSError, subprocess.CalledProcessError):
        return None


def commits_in(folder: Path) -> list[str]:
    """The commits at which the runs below `folder` were made, as far as they tell."""
    told = (json.loads(path.read_text('utf8')).get('commit')
            for path in folder.glob('**/run.json'))
    return sorted({one for one in told if one})


def recordings_of(folder: Path, name: str) -> list[Path]:
    """The recordings `name`, or `name_1`, `name_2`, … in order; as folders or files."""
    found = [path for path in (folder / name, folder / f'{name}.mcap') if path.exists()]
    if found:
        return found[:1]
    several = [path for path in folder.glob(f'{name}_*') if path.is_dir()
               or path.suffix == '.mcap']
    if not several:
        raise FileNotFoundError(f'{folder / name}: no such recording')
    return sorted(several, key=lambda path: int(path.stem.rpartition('_')[2]))


def _copy(source: Path, folder: Path) -> Path:
    """Copy into `folder`, with fresh times: the old ones tell how long a case took to draw."""
    target = folder / source.name
    if source.is_dir():
        shutil.copytree(source, target)
        for path in (target, *target.rglob('*')):
            os.utime(path)
    else:
        shutil.copyfile(source, target)
    return target


def run_tool(case: Path, results: Path, tool: list[str] = TOOL, other_motion: bool = False,
             ) -> str | None:
    """Diagnose a copy of `case`, predict its test run; returns what failed, or None.

    The diagnosis sees the training recordings and the nominal model, nothing else; of the `test`
    run in place of the training recordings where another motion is asked for, which leaves nothing
    to predict.
    """
    if results.exists():
        shutil.rmtree(results)
    results.mkdir(parents=True)
    with tempfile.TemporaryDirectory(prefix='case_') as scratch:
        given, asked = Path(scratch) / 'given', Path(scratch) / 'asked'
        given.mkdir()
        asked.mkdir()
        trains = [_copy(path, given).name
                  for path in recordings_of(case, 'test' if other_motion else 'train')]
        _copy(case / 'nominal.yaml', given)
        start = time.monotonic()
        failure = call(['diagnose', *trains, '--model', 'nominal.yaml', '--out', 'out'], tool,
                       given)
        seconds = time.monotonic() - start
        out = given / 'out'
        test = _copy(recordings_of(case, 'test')[0], asked).name
        for model, name in ((out / 'model.yaml', 'corrected'),
                            (given / 'nominal.yaml', 'nominal')):
            # The nominal model's own prediction stands beside a diagnosis that failed, too.
            if model.exists() and not other_motion:
                failed = call(['predict', test, '--model', str(model), '--out', f'{name}.npz'],
                              tool, asked)
                failure = failure or failed
        for path in (out / 'diagnosis.json', out / 'model.yaml', out / 'report.html',
                     asked / 'corrected.npz', asked / 'nominal.npz'):
            if path.exists():
                shutil.copy(path, results / path.name)
    (results / 'run.json').write_text(json.dumps(
        {'seconds': seconds, 'failure': failure, 'commit': commit()}), 'utf8')
    return failure


def call(arguments: list[str], tool: list[str] = TOOL, folder: Path | None = None,
         patience: float = _TIMEOUT) -> str | None:
    """Run the tool as a process of its own, in `folder`, for `patience` [s] at most; returns what
    failed, or None."""
    path = os.pathsep.join([str(_ROOT), os.environ.get('PYTHONPATH', '')]).rstrip(os.pathsep)
    try:
        done = subprocess.run([*tool, *arguments], capture_output=True, text=True, cwd=folder,
                              timeout=patience, env={**os.environ, 'PYTHONPATH': path})
    except subprocess.TimeoutExpired:
        return f'{arguments[0]}: over {patience:.0f} s'
    if done.returncode == 0:
        return None
    last = (done.stderr.strip() or 'no message').splitlines()[-1]
    return f'{arguments[0]}: exit {done.returncode}: {last}'


def score_all(truths: list[CaseTruth], results: Path) -> list[CaseScore]:
    """Score every case that has been run."""
    return [score(truth, results / truth.name) for truth in truths
            if (results / truth.name / 'run.json').exists()]
