# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What `make types` leaves out only gets less."""
from __future__ import annotations

import configparser
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
AT_FIRST = 65      # modules, 2026-11-23


def test_modules_that_are_not_checked() -> None:
    settings = configparser.ConfigParser()
    settings.read(ROOT / 'mypy.ini', 'utf8')
    left_out = [name.removeprefix('mypy-') for name in settings.sections()
                if settings.get(name, 'ignore_errors', fallback='') == 'True']
    assert len(left_out) <= AT_FIRST
    gone = [name for name in left_out
            if not (ROOT / (name.replace('.', '/') + '.py')).exists()]
    assert not gone, f'{gone} are no more: delete their entries in mypy.ini'
