# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What `make types` leaves out only gets less."""
from __future__ import annotations

import configparser
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
AT_FIRST = 0        # modules that are not checked at all, 2026-11-26; 54 a day before
NOT_STRICT = 60     # modules that only the plain rules hold for


def test_modules_that_are_not_checked() -> None:
    settings = configparser.ConfigParser()
    settings.read(ROOT / 'mypy.ini', 'utf8')
    left_out = [name.removeprefix('mypy-') for name in settings.sections()
                if settings.get(name, 'ignore_errors', fallback='') == 'True']
    assert len(left_out) <= AT_FIRST
    gone = [name for name in left_out
            if not (ROOT / (name.replace('.', '/') + '.py')).exists()]
    assert not gone, f'{gone} are no more: delete their entries in mypy.ini'


def test_modules_that_are_not_strict() -> None:
    settings = configparser.ConfigParser()
    settings.read(ROOT / 'mypy.ini', 'utf8')
    lists = [name.removeprefix('mypy-').split(',') for name in settings.sections()
             if settings.get(name, 'disallow_untyped_defs', fallback='') == 'False']
    names = [name for entry in lists for name in entry if name != 'engb_core.effects.*']
    assert len(names) <= NOT_STRICT
    gone = [name for name in names
            if not (ROOT / (name.replace('.', '/') + '.py')).exists()
            and not (ROOT / name.replace('.', '/') / '__init__.py').exists()]
    assert not gone, f'{gone} are no more: delete their names in mypy.ini'
