# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The loop round an exported brake: its set-point, its controller, and what is recorded of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from engb_core.effect_check import MODEL, TICK
from engb_core.export.c_model import c_model
from engb_core.export.fmu import compiler, write_fmu
from engb_core.model import Model
from engb_core.physics.simulation import BrakePlant, simulate_closed_loop
from engb_core.recording import Recording, Reference, Signal
from tests.core.loops import reference

from .machines import compiled_library, differs, EFFORT, machines, PlantInC, STEP

MACHINES = machines()
# Effects on the set-point and on the recorded effort, and what the loop feeds back.
LOOPED = ('nominal', 'command_delay', 'command_rate_limit', 'effort_measurement_lag',
          'actuation_lag', 'back_emf', 'backlash')
DURATION = 2.0


def tracked() -> Recording:
    """Return what a loop is told: strokes, with feedforward, a disc that turns, a warm pad."""
    angle = reference(DURATION)
    time = np.arange(angle.size) * TICK
    speed = np.gradient(angle, TICK)
    push = np.gradient(speed, TICK) * MODEL.motor.inertia + speed * MODEL.motor.viscous_friction
    return Recording('loop', time, angle.copy(), np.zeros(time.size),
                     reference=Reference(time, angle, speed, push),
                     signals={'disc_speed': Signal(time, 20.0 * time),
                              'pad_temperature': Signal(time, 20.0 + 60.0 * time)})


def columns(recording: Recording) -> np.ndarray:
    """Return time and what a cycle is given: reference, its speed, feedforward, disc, warmth."""
    told = recording.reference
    return np.column_stack([told.time, told.position, told.velocity, told.effort,
                            recording.signals['disc_speed'].value,
                            recording.signals['pad_temperature'].value])


def here(model: Model) -> np.ndarray:
    """Return position and velocity (n, 2) at the end of each cycle but the last, as simulated
    here."""
    return np.column_stack(simulate_closed_loop(tracked(), model))[1:]


@pytest.mark.parametrize('name', LOOPED)
def test_the_loop_in_c_gives_what_the_loop_here_gives(name, tmp_path):
    model = MACHINES[name]
    made = c_model(model)
    assert made.beside == ()
    plant = PlantInC(compiled_library(tmp_path, made), made, model)
    plant.begin(tracked().position[0])
    found = []
    for _, angle, speed, push, disc, warmth in columns(tracked())[:-1]:
        plant.advance(plant.loop(angle, speed, push), 1.0 / model.controller.rate, disc, warmth)
        found.append((plant.position, plant.velocity))
    assert differs(here(model), np.array(found)) < 1e-9


@pytest.mark.parametrize('name', ['command_delay', 'command_rate_limit'])
def test_the_effects_on_the_set_point_do_something(name):
    assert differs(here(MODEL), here(MACHINES[name])) > 1e-3


def test_what_is_recorded_of_the_effort(tmp_path):
    model = MACHINES['effort_measurement_lag']
    made = c_model(model)
    plant, brake = PlantInC(compiled_library(tmp_path, made), made, model), BrakePlant(model)
    plant.begin(0.0)
    rows = []
    for effort in EFFORT:
        brake.advance(float(effort), STEP)
        plant.advance(effort, STEP, 0.0, 20.0)
        rows.append((brake.measured_effort(float(effort), STEP), plant.recorded(effort, STEP)))
    one, other = np.array(rows).T
    assert np.abs(one - other).max() <= 1e-12
    assert np.abs(one - EFFORT).max() > 1e-3


def unit(model: Model, folder: Path, version: int) -> Path:
    if compiler() is None:
        pytest.skip('no C compiler (cc, gcc, clang)')
    path = folder / f'loop{version}.fmu'
    write_fmu(model, path, version)
    return path


def run(path: Path, step: float, outputs: list[str], **start: float) -> np.ndarray:
    """Return the outputs (n, …) of the closed loop after each of its steps."""
    fmpy = pytest.importorskip('fmpy', reason='fmpy is not installed (pip install fmpy)')
    names = ['time', 'reference', 'reference_velocity', 'reference_effort', 'disc_speed',
             'pad_temperature']
    given = np.zeros(tracked().time.size, dtype=[(name, float) for name in names])
    for name, values in zip(names, columns(tracked()).T, strict=True):
        given[name] = values
    found = fmpy.simulate_fmu(str(path), stop_time=float(given['time'][-1]), step_size=step,
                              output_interval=step, input=given, output=outputs,
                              start_values={'closed_loop': 1.0, **start},
                              fmi_type='CoSimulation')
    return np.column_stack([found[name][1:] for name in outputs])


@pytest.mark.parametrize('version', [2, 3])
@pytest.mark.parametrize('name', LOOPED)
def test_the_unit_closes_the_loop_as_here(name, version, tmp_path):
    validation = pytest.importorskip('fmpy.validation',
                                     reason='fmpy is not installed (pip install fmpy)')
    path = unit(MACHINES[name], tmp_path, version)
    assert validation.validate_fmu(str(path)) == []
    found = run(path, TICK, ['position', 'velocity'], initial_position=tracked().position[0])
    assert differs(here(MACHINES[name]), found) <= 1e-6


def test_the_loop_keeps_its_own_cycle(tmp_path):
    """Asked to go on by a fifth of a cycle, the controller still runs once a cycle; the set-point
    then comes interpolated, as a master gives it."""
    path = unit(MACHINES['command_delay'], tmp_path, 2)
    start = {'initial_position': tracked().position[0]}
    fine = run(path, TICK / 5.0, ['position', 'velocity'], **start)[4::5]
    assert differs(here(MACHINES['command_delay']), fine) <= 1e-6


def test_the_unit_tells_the_set_point_that_is_acted_on_and_the_effort_that_is_recorded(tmp_path):
    path = unit(MACHINES['command_delay'], tmp_path, 2)
    acted, = run(path, TICK, ['acted_reference']).T
    given = tracked().reference.position
    late = np.interp(tracked().time - MACHINES['command_delay'].effects[0].parameters['delay'],
                     tracked().time, given)
    assert np.abs(acted - late[:-1]).max() < 0.05 * np.abs(acted - given[:-1]).max()
    path = unit(MACHINES['effort_measurement_lag'], tmp_path, 3)
    asked, = run(unit(MODEL, tmp_path, 2), TICK, ['recorded_effort']).T
    recorded, = run(path, TICK, ['recorded_effort']).T
    lag = MACHINES['effort_measurement_lag'].effects[0].parameters['lag']
    filtered, late = [], 0.0
    for effort in asked:
        late += (1.0 - np.exp(-TICK / lag)) * (effort - late)
        filtered.append(late)
    np.testing.assert_allclose(recorded, filtered, atol=1e-9)


def test_a_loop_needs_a_controller_and_a_set_point_an_effect(tmp_path):
    fmpy = pytest.importorskip('fmpy', reason='fmpy is not installed (pip install fmpy)')
    from dataclasses import replace

    def names(model: Model) -> set[str]:
        write_fmu(model, tmp_path / 'unit.fmu', binary=False)
        return {entry.name for entry in
                fmpy.read_model_description(str(tmp_path / 'unit.fmu')).modelVariables}

    without = names(replace(MODEL, controller=None))
    assert not without & {'reference', 'closed_loop', 'recorded_effort', 'controller.cycle'}
    assert names(MODEL) >= {'reference', 'closed_loop', 'recorded_effort', 'controller.cycle'}
    commanded = names(replace(MACHINES['command_delay'], controller=None))
    assert commanded - without == {'reference', 'acted_reference', 'command_delay.delay'}
    measured = names(replace(MACHINES['effort_measurement_lag'], controller=None))
    assert measured - without == {'recorded_effort', 'effort_measurement_lag.lag'}

