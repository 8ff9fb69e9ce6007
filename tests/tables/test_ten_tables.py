# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The benchmark of ten tables takes the names that there are."""

from __future__ import annotations

import pytest

from benchmarks import ten_tables


def test_a_table_that_is_not_there_is_told(capsys):
    with pytest.raises(SystemExit) as ended:
        ten_tables.main(['2', 'geer.dat'])
    assert ended.value.code == 2
    said = capsys.readouterr()
    assert 'there is no table geer.dat' in said.err and 'gear.dat' in said.err
    assert not said.out


def test_a_seed_that_is_none_is_told(capsys):
    with pytest.raises(SystemExit) as ended:
        ten_tables.main(['gear.dat'])
    assert ended.value.code == 2
    assert 'invalid int value' in capsys.readouterr().err
