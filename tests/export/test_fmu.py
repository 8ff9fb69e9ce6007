# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The FMU of a model passes the standard's checks and gives what the simulation here gives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pytest

from engb_core.effect_check import MODEL
from engb_core.errors import InputError
from engb_core.export.fmu import compiler, write_fmu
from engb_core.model import Model
from engb_core.physics.simulation import BrakePlant

from .machines import differs, DISC, EFFORT, machines, simulated, STEP, TIME, WARMTH

fmpy = pytest.importorskip('fmpy', reason='fmpy is not installed (pip install fmpy)')
MACHINES = machines()
QUICK = ('rich',)


def unit_of(model: Model, folder: Path, version: int, binary: bool = True) -> Path:
    if binary and compiler() is None:
        pytest.skip('no C compiler (cc, gcc, clang)')
    path = folder / f'model{version}.fmu'
    write_fmu(model, path, version, binary=binary)
    return path


def problems(path: Path) -> list[str]:
    from fmpy.validation import validate_fmu
    return validate_fmu(str(path))


def run(path: Path, **start: float) -> np.ndarray:
    """Return position, velocity and load torque (n, 3) after each step of the drive."""
    given = np.zeros(TIME.size, dtype=[('time', float), ('effort', float), ('disc_speed', float),
                                       ('pad_temperature', float)])
    for name, values in (('time', TIME), ('effort', EFFORT), ('disc_speed', DISC),
                         ('pad_temperature', WARMTH)):
        given[name] = values
    names = ['position', 'velocity', 'load_torque']
    found = fmpy.simulate_fmu(str(path), stop_time=TIME[-1] + STEP, step_size=STEP,
                              output_interval=STEP, input=given, output=names,
                              start_values=start, fmi_type='CoSimulation')
    # The first row is the start, before any step.
    return np.column_stack([found[name][1:TIME.size] for name in names])


@pytest.mark.parametrize('version', [2, 3])
@pytest.mark.parametrize('name', [pytest.param(
    name, marks=() if name in QUICK else pytest.mark.slow) for name in MACHINES])
def test_the_unit_gives_what_the_simulation_gives(name, version, tmp_path):
    path = unit_of(MACHINES[name], tmp_path, version)
    assert problems(path) == []
    here = simulated(MACHINES[name])[:TIME.size - 1]
    assert differs(here, run(path)) <= 1e-6


@pytest.mark.parametrize('version', [2, 3])
def test_parameters_and_start_can_be_set(version, tmp_path):
    path = unit_of(MODEL, tmp_path, version)
    heavy = replace(MODEL, motor=replace(MODEL.motor, inertia=2e-4))
    plant = BrakePlant(heavy, position=3.0)
    rows = []
    for effort, disc, warmth in zip(EFFORT[:-1], DISC, WARMTH, strict=False):
        plant.advance(float(effort), STEP, float(disc), float(warmth))
        rows.append((plant.position, plant.velocity, plant.load_torque))
    found = run(path, **{'motor.inertia': 2e-4, 'initial_position': 3.0})
    assert differs(np.array(rows), found) <= 1e-6
    assert differs(simulated(MODEL)[:TIME.size - 1], found) > 1e-2


def test_a_state_is_kept_and_taken_up_again(tmp_path):
    path = unit_of(MACHINES['rich'], tmp_path, 2)
    folder = fmpy.extract(str(path))
    try:
        description = fmpy.read_model_description(folder)
        unit = fmpy.instantiate_fmu(folder, description, 'CoSimulation')
        unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        reference = {entry.name: entry.valueReference for entry in description.modelVariables}

        def advanced() -> list[float]:
            unit.setReal([reference['effort']], [0.1])
            for step in range(100):
                unit.doStep(step * STEP, STEP)
            return unit.getReal([reference['position'], reference['velocity']])

        advanced()
        kept = unit.getFMUState()
        once = advanced()
        assert advanced() != once
        unit.setFMUState(kept)
        assert advanced() == once
        unit.freeFMUState(kept)
        with pytest.raises(Exception, match='fmi2SetReal'):
            unit.setReal([reference['position']], [1.0])
        unit.terminate()
        unit.freeInstance()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.slow
@pytest.mark.parametrize('version', [2, 3])
def test_the_source_makes_the_same_unit_elsewhere(version, tmp_path):
    path = unit_of(MACHINES['rich'], tmp_path, version, binary=False)
    assert not [name for name in zipfile.ZipFile(path).namelist() if name.startswith('binaries')]
    assert problems(path) == []
    if compiler() is None or (shutil.which('cmake') is None):
        pytest.skip('no cmake or no C compiler')
    # By the program, as docs/export.md has it: the function behind it has moved within FMPy.
    shutil.copy(path, tmp_path / 'made.fmu')
    subprocess.run([sys.executable, '-m', 'fmpy', 'compile', 'made.fmu'], cwd=tmp_path,
                   check=True, capture_output=True)
    here = simulated(MACHINES['rich'])[:TIME.size - 1]
    assert differs(here, run(tmp_path / 'made.fmu')) <= 1e-6


def test_the_same_model_gives_the_same_bytes_and_another_one_another_token(tmp_path):
    one, two, other = (tmp_path / name for name in ('one.fmu', 'two.fmu', 'other.fmu'))
    write_fmu(MODEL, one, binary=False)
    write_fmu(MODEL, two, binary=False)
    write_fmu(MACHINES['rich'], other, binary=False)
    assert one.read_bytes() == two.read_bytes()
    tokens = {fmpy.read_model_description(str(path)).guid for path in (one, two, other)}
    assert len(tokens) == 2


def test_a_linear_axis_has_linear_units(tmp_path):
    model = replace(MODEL, joint=replace(MODEL.joint, type='prismatic'))
    write_fmu(model, tmp_path / 'axis.fmu', binary=False)
    description = fmpy.read_model_description(str(tmp_path / 'axis.fmu'))
    units = {entry.name: entry.unit for entry in description.modelVariables}
    assert units['position'] == 'm' and units['effort'] == 'N' and units['velocity'] == 'm/s'
    assert units['motor.inertia'] == 'kg' and units['motor.viscous_friction'] == 'N.s/m'
    assert units['controller.proportional'] == 'N/m'
    assert not [unit for unit in units.values() if unit and 'rad' in unit]


def test_without_a_compiler_the_source_is_left(tmp_path, monkeypatch):
    monkeypatch.setenv('CC', 'no-such-compiler')
    notes = write_fmu(MODEL, tmp_path / 'model.fmu')
    assert any('no C compiler' in note for note in notes)
    assert problems(tmp_path / 'model.fmu') == []


def test_a_compiler_that_fails_is_told_in_a_line(tmp_path, monkeypatch):
    compiler_ = tmp_path / 'cc'
    compiler_.write_text('#!/bin/sh\necho "wrong kind of thing" >&2\nexit 1\n', encoding='utf-8')
    compiler_.chmod(0o755)
    monkeypatch.setenv('CC', str(compiler_))
    with pytest.raises(InputError, match='wrong kind of thing.*CC='):
        write_fmu(MODEL, tmp_path / 'model.fmu')
