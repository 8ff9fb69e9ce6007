# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Readers of other people's formats that are missing, or that are there and do not start."""

from pathlib import Path

import pytest

from engb_core.errors import InputError
from engb_core.io.tables.needs import needed


def test_a_reader_that_is_missing():
    with pytest.raises(InputError, match=r'^a\.x: X is read by nowhere_at_all, which is not '
                                         r'installed; run pip install nowhere_at_all, or'):
        needed('nowhere_at_all.inside', Path('a.x'), 'X')


def test_a_reader_that_does_not_start_is_told_with_its_reason(tmp_path, monkeypatch):
    """Pyarrow beside a numpy that is too old for it was told as one that is not installed."""
    (tmp_path / 'too_new.py').write_text("raise ImportError('too_new requires NumPy 2.0')\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match=r'^a\.x: X is read by too_new, which is installed and '
                                         r'does not start \(too_new requires NumPy 2\.0\)'):
        needed('too_new', Path('a.x'), 'X')
