# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Somebody's own FMU, written by hand in C, in place of a model file."""

from __future__ import annotations

import json
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest

from engb_core.export.fmu import compiler
from engb_core.prediction import predict_effort
from engb_core.simulated.fmu_drive import recording_of_fmu
from tests.core.bench import Bench, strokes

from .hand_made import hand_made_unit
from .mujoco_pairs import drawn_pair, HIDDEN, Machine, table

fmpy = pytest.importorskip('fmpy', reason='fmpy is not installed (pip install fmpy)')
pytestmark = pytest.mark.skipif(compiler() is None, reason='no C compiler (cc, gcc, clang)')
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope='module')
def unit(tmp_path_factory):
    return hand_made_unit(Machine(), tmp_path_factory.mktemp('fmu') / 'by_hand.fmu')


def test_it_is_a_unit_by_the_standard(unit):
    from fmpy.validation import validate_fmu
    assert validate_fmu(str(unit)) == []


def test_what_it_needs_for_a_motion_is_its_own_physics(unit):
    real = Bench(noise=2e-3).run(strokes((20.0, 12.0)))
    found = recording_of_fmu(unit, real)
    later = found.time > 1.0
    assert np.ptp(found.position[later]) > 0.9 * np.ptp(real.position)
    needed, slow = predict_effort(found, Machine().model()), np.ones(25) / 25.0
    missed = np.convolve((needed - found.effort)[later], slow, 'valid')
    assert np.sqrt(np.mean(missed ** 2)) < 0.1 * np.std(found.effort[later])


@pytest.mark.slow
@pytest.mark.parametrize('seed', [12, 13])
def test_a_machine_is_diagnosed_against_it(tmp_path, seed):
    """The effect that the real machine has more is found as with the machine's own model file."""
    pytest.importorskip('mujoco', reason='mujoco is not installed (pip install mujoco)')
    pair = drawn_pair(seed)
    assert pair.effect in {make(np.random.default_rng(0)).name for make in HIDDEN}
    hand_made_unit(pair.machine, tmp_path / 'by_hand.fmu')
    table(tmp_path / 'real.csv', pair.real)
    done = subprocess.run(
        [sys.executable, '-m', 'engb_ros.commands.main', 'diagnose', str(tmp_path / 'real.csv'),
         '--fmu', str(tmp_path / 'by_hand.fmu'), '--out', str(tmp_path / 'out'), '--quiet'],
        cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    effects = json.loads((tmp_path / 'out/diagnosis.json').read_text(encoding='utf-8'))['effects']
    assert effects[0]['effect'] == pair.effect
