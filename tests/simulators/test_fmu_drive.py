# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""An FMU driven along a real motion: what it needs for it is its own physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.effect_check import MODEL
from engb_core.errors import InputError
from engb_core.export.fmu import compiler, write_fmu
from engb_core.model import Friction
from engb_core.prediction import predict_effort
from engb_core.simulated.fmu_drive import recording_of_fmu
from tests.core.bench import Bench, strokes

pytest.importorskip('fmpy', reason='fmpy is not installed (pip install fmpy)')


@pytest.fixture(scope='module')
def unit(tmp_path_factory):
    if compiler() is None:
        pytest.skip('no C compiler (cc, gcc, clang)')
    path = tmp_path_factory.mktemp('fmu') / 'simulator.fmu'
    write_fmu(SIMULATED, path)
    return path


SIMULATED = replace(MODEL, friction=Friction(0.02, 0.05, 0.3))
REAL = Bench(noise=2e-3).run(strokes((20.0, 12.0)))


def test_the_unit_follows_and_needs_what_its_model_says(unit):
    found = recording_of_fmu(unit, REAL)
    reference = np.interp(found.time, found.reference.time, found.reference.position)
    assert np.sqrt(np.mean((found.position - reference) ** 2)) < 0.02 * np.ptp(reference)
    # From where the real recording begins.
    assert np.ptp(found.position[found.time > 1.0]) > 0.9 * np.ptp(REAL.position)
    needed = predict_effort(found, SIMULATED)
    plain = predict_effort(found, MODEL)
    slow = np.ones(25) / 25.0

    def missed(effort):
        return np.sqrt(np.mean(np.convolve(effort - found.effort, slow, 'valid') ** 2))
    assert missed(needed) < 0.15 * missed(plain)


def test_which_variable_is_what_can_be_said(unit):
    named = recording_of_fmu(unit, REAL, {'effort': 'effort', 'position': 'position'})
    assert named.position.size > REAL.position.size
    with pytest.raises(InputError, match='which output is the position.*load_torque'):
        recording_of_fmu(unit, REAL, {'position': 'angle'})
    with pytest.raises(InputError, match='pad_temperature is in degC'):
        recording_of_fmu(unit, REAL, {'effort': 'pad_temperature'})


def test_what_is_no_unit_is_told(tmp_path):
    bad = tmp_path / 'bad.fmu'
    bad.write_bytes(b'no zip')
    with pytest.raises(InputError, match='is no FMU'):
        recording_of_fmu(bad, REAL)
    with pytest.raises(InputError, match='no such file'):
        recording_of_fmu(tmp_path / 'gone.fmu', REAL)
    source = tmp_path / 'source.fmu'
    write_fmu(SIMULATED, source, binary=False)
    with pytest.raises(InputError, match='cannot be run.*fmpy compile'):
        recording_of_fmu(source, REAL)
