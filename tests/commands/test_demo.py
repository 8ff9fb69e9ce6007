# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The demo's last part: a recording that came with the package, by the program's own command."""

import pytest

from engb_ros.commands import diagnose
from engb_ros.commands.demo import _diagnose, BAGS


@pytest.mark.slow
def test_the_concealed_recording_is_diagnosed_and_unsealed(tmp_path, capsys):
    out = tmp_path / 'diagnosis'
    _diagnose(BAGS / 'brake_1', out)
    assert (out / diagnose.REPORT).exists()
    printed = capsys.readouterr().out
    assert '1. pad_creep' in printed
    assert 'it was pad_creep' in printed
