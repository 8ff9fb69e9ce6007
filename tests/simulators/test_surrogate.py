# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A real machine diagnosed against somebody's simulator: what the simulator lacks is named."""

from __future__ import annotations

import json
from pathlib import Path
import re

import numpy as np
import pytest

from engb_core.model import Model
from engb_ros.commands.main import BAD_INPUT, FINE, main

from .mujoco_pairs import drawn_pair, LATE, Pair, RATE, table

pytest.importorskip('mujoco', reason='mujoco is not installed (pip install mujoco)')


def diagnosed(pair: Pair, folder: Path, route: str) -> list[str]:
    """Return the names that are likely, in order."""
    table(folder / 'real.csv', pair.real)
    table(folder / 'simulation.csv', pair.simulated)
    given = folder / 'simulation.csv'
    if route == '--model':
        given = folder / 'machine.xml'
        given.write_text(pair.machine.mjcf(), encoding='utf-8')
    assert main(['diagnose', str(folder / 'real.csv'), route, str(given), '--out',
                 str(folder / 'out'), '--quiet']) == FINE
    found = json.loads((folder / 'out' / 'diagnosis.json').read_text(encoding='utf-8'))
    return [entry['effect'] for entry in found['effects'] if entry['probability'] >= 0.5]


@pytest.mark.slow
@pytest.mark.parametrize('seed', [0, 1, 5])
def test_what_the_simulator_lacks_is_named(seed, tmp_path, capsys):
    pair = drawn_pair(seed)
    assert diagnosed(pair, tmp_path, '--simulated')[:1] == [pair.effect]
    told = ' '.join(capsys.readouterr().out.split())
    assert 'your simulator is described by surrogate.yaml' in told
    assert 'a surrogate), which misses' in told
    # The motion is compared: with what hides in it the real machine follows later, or sooner.
    offset = float(re.search(r'simulation begins ([-+\d.]+) ±', told)[1])
    assert offset == pytest.approx(-LATE / RATE, abs=0.01)
    # The surrogate has the simulator's numbers, whatever the real machine does.
    surrogate = Model.read(tmp_path / 'out' / 'surrogate.yaml')
    assert surrogate.motor.inertia == pytest.approx(pair.machine.inertia, rel=0.05)
    assert surrogate.friction.coulomb == pytest.approx(pair.machine.friction, rel=0.15)


@pytest.mark.slow
def test_a_joint_of_mujoco_is_a_nominal_model(tmp_path):
    pair = drawn_pair(1)
    assert diagnosed(pair, tmp_path, '--model')[:1] == [pair.effect]


@pytest.fixture
def real(tmp_path) -> Path:
    path = tmp_path / 'real.csv'
    time = np.arange(0.0, 2.0, 1e-3)
    np.savetxt(path, np.column_stack([time, np.sin(time), np.cos(time)]), delimiter=',',
               header='time [s],position [rad],effort [N·m]', comments='', encoding='utf-8')
    return path


@pytest.mark.parametrize(('arguments', 'words'), [
    (['--simulated', 'gone.csv'], 'gone.csv'), (['--fmu', 'gone.fmu'], 'gone.fmu'),
    (['--model', 'gone.xml'], 'gone.xml'),
    (['--model', 'a.yaml', '--simulated', 'b.csv'], 'not allowed with'),
    (['--fmu', 'gone.fmu', '--fmu-variable', 'speed=x'], 'effort=NAME or position=NAME')])
def test_bad_input_is_told_in_one_line(arguments, words, real, capsys):
    out = real.parent / 'out'
    assert main(['diagnose', str(real), *arguments, '--out', str(out)]) == BAD_INPUT
    error = capsys.readouterr().err
    assert words in error and error.count('\n') == 1
    assert not out.exists()
