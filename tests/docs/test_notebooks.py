# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The notebooks run from the first cell to the last, and find what they say."""

from __future__ import annotations

import json
from pathlib import Path
import subprocess
import sys

import pytest

NOTEBOOKS = Path(__file__).resolve().parents[2] / 'docs' / 'notebooks'
# Notebook → the effect that its last diagnosis has to name first.
FOUND = {'from-a-table': 'stribeck_friction', 'from-a-bag': None,
         'your-simulator': 'cogging_torque', 'an-effect-of-your-own': 'cable_drag'}


def cells(name: str) -> list[str]:
    notebook = json.loads((NOTEBOOKS / f'{name}.ipynb').read_text(encoding='utf-8'))
    return [''.join(cell['source']) for cell in notebook['cells'] if cell['cell_type'] == 'code']


def test_all_are_run_and_none_has_output():
    assert {path.stem for path in NOTEBOOKS.glob('*.ipynb')} == set(FOUND)
    for name in FOUND:
        notebook = json.loads((NOTEBOOKS / f'{name}.ipynb').read_text(encoding='utf-8'))
        assert notebook['nbformat'] == 4
        assert not any(cell.get('outputs') for cell in notebook['cells'])
        for number, text in enumerate(cells(name)):
            compile(text, f'{name}, cell {number}', 'exec')


@pytest.mark.slow
@pytest.mark.parametrize('name', FOUND)
def test_it_runs_and_finds_it(name):
    check = ('\nnames = [one.effect for one in diagnosis.effects if one.probability >= 0.5]\n'
             'print("NAMED", names)\n')
    done = subprocess.run([sys.executable, '-'], input='\n\n'.join(cells(name)) + check,
                          cwd=NOTEBOOKS, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    named = next(line for line in done.stdout.splitlines() if line.startswith('NAMED'))
    if FOUND[name] is not None:
        assert named.startswith(f"NAMED ['{FOUND[name]}'"), done.stdout
