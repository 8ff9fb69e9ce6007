# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb prove` of an installation, which holds no tests: one line says what it needs."""

from __future__ import annotations

from pathlib import Path

import pytest

from engb_ros.commands import prove
from engb_ros.commands.main import main


@pytest.mark.parametrize('arguments', [['--cases', '1'], ['--frozen'], ['--real', '.'],
                                       ['--cases-from', '.']])
def test_without_the_source_tree_it_says_so_in_one_line(
        arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(prove, '__file__', str(tmp_path / 'engb_ros/commands/prove.py'))
    monkeypatch.chdir(tmp_path)
    assert main(['prove', *arguments, '--out', 'out']) == 2
    told = capsys.readouterr().err.strip()
    assert told.startswith('engb: engb prove needs the source tree')
    assert '\n' not in told
    assert not Path('out').exists()
