# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`make types` holds every module to mypy's strict rules."""
from __future__ import annotations

import configparser
from pathlib import Path
import re

ROOT = Path(__file__).resolve().parents[2]


def test_no_module_is_left_out() -> None:
    settings = configparser.ConfigParser()
    settings.read(ROOT / 'mypy.ini', 'utf8')
    assert settings.get('mypy', 'strict') == 'True'
    ours = [name for name in settings.sections() if 'engb_' in name]
    assert not ours, f'{ours} have rules of their own'


def test_lines_that_are_left_out_only_get_fewer() -> None:
    left_out = [(f'{path.relative_to(ROOT)}:{number}', line)
                for room in ('engb_core', 'engb_ros') for path in (ROOT / room).rglob('*.py')
                for number, line in enumerate(path.read_text('utf8').splitlines(), 1)
                if re.search(r'#\s*(type|mypy):', line)]
    assert len(left_out) <= 6, left_out
    for place, line in left_out:
        assert re.search(r'# type: ignore\[[a-z-]+\]$', line), f'{place} says not what of'
