# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a position sensor does wrong acts through the controller as well: simulated loop, plant,
recordings without effort."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.bench.sensors import SensorSettings
from engb_core.bench.virtual_brake import DriveSettings, VirtualBrake
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.laws.judgement import find_law, Found
from engb_core.model import Controller, EffectSetting, Friction, LoadTorque, Model
from engb_core.physics.simulation import BrakePlant, simulate_closed_loop
from engb_core.recording import Recording, Reference
from engb_core.signals.absent_effort import with_effort

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4)),
              friction=Friction(0.012, 0.1, 0.5),
              controller=Controller(0.3, 1.0, 0.004, 0.75, 1000.0))
STEP = 1e-3
INSIDE = {'position': (-5.0, 40.0), 'velocity': (-80.0, 80.0)}


def with_law(formula: str, acts_as: str, **values: float) -> Model:
    return replace(MODEL, effects=(EffectSetting('law', values, formula, acts_as, INSIDE),))


def reference(duration: float) -> Reference:
    time = np.arange(0.0, duration, STEP)
    position = 12.0 + 8.0 * np.sin(2.0 * time) + 2.0 * np.sin(5.3 * time)
    velocity = 16.0 * np.cos(2.0 * time) + 10.6 * np.cos(5.3 * time)
    return Reference(time, position, velocity, np.zeros(time.size))


def blank(duration: float) -> Recording:
    time = np.arange(0.0, duration, STEP)
    return Recording('loop', time, np.full(time.size, 12.0), np.zeros(time.size),
                     reference=reference(duration))


def driven(duration: float, seen: object, gains: Controller = MODEL.controller,
           ) -> tuple[np.ndarray, ...]:
    """Return time, what the sensor says, and the effort of a loop written here, whose brake is the
    plain one and whose sensor is the function `seen` of true positions so far."""
    plant = BrakePlant(MODEL, position=12.0)
    wanted = reference(duration)
    true: list[float] = []
    rows = []
    integrated, before = 0.0, None
    for row in range(wanted.time.size):
        true.append(plant.position)
        position = seen(true)
        speed = 0.0 if before is None else (position - before) / STEP
        error = wanted.position[row] - position
        effort = float(np.clip(gains.proportional * error + integrated
                               + gains.derivative * (wanted.velocity[row] - speed), -0.75, 0.75))
        integrated += gains.integral * error * STEP
        rows.append((row * STEP, position, effort))
        before = position
        plant.advance(effort, STEP)
    return tuple(np.array(rows).T)


def late(delay: float):
    steps = round(delay / STEP)
    return lambda true: true[max(len(true) - 1 - steps, 0)]


def off(amplitude: float, order: float):
    """Return a sensor that says θ_m where the shaft stands at θ_m + a·sin(order·θ_m)."""
    def seen(true: list[float]) -> float:
        found = true[-1]
        for _ in range(30):
            found = true[-1] - amplitude * np.sin(order * found)
        return found
    return seen


@pytest.mark.parametrize(('sensor', 'model'), [
    (late(0.008), with_law('a', 'position_delay', a=0.008)),
    (off(0.15, 3.0), with_law('a * sin(3 * position)', 'position_shift', a=0.15))])
def test_the_simulated_loop_sees_what_the_sensor_says(sensor, model):
    """Against a loop that is written here; the plain model's is another one."""
    _, seen, _ = driven(6.0, sensor)
    simulated, _ = simulate_closed_loop(blank(6.0), model)
    plain, _ = simulate_closed_loop(blank(6.0), MODEL)
    assert np.std(plain - seen) > 2e-3
    assert np.std(simulated - seen) < 0.15 * np.std(plain - seen)


def test_a_delay_between_two_cycles_is_that_long():
    """A ramp that is seen late lags by speed times delay, however it lies to the ring."""
    for delay in (0.0004, 0.003, 0.0171, 0.06):
        plant = BrakePlant(with_law('a', 'position_delay', a=delay), position=0.0)
        seen, true = [], []
        for _ in range(400):
            plant.advance(0.25, STEP)
            seen.append(plant.measured_position(STEP))
            true.append(plant.position)
        time = STEP * np.arange(400)
        wanted = np.interp(time - delay, time, true)
        assert np.abs(np.array(seen) - wanted)[100:].max() < 2e-3 * np.ptp(true)


def test_the_plant_reports_a_late_position():
    """What the node plant publishes is what the sensor says, not where the shaft stands."""
    def measured(model: Model) -> tuple[float, float]:
        brake = VirtualBrake(model, DriveSettings(), SensorSettings(counts_per_revolution=0))
        for _ in range(300):
            brake.command(0.1)
            said = brake.advance()
        return said.position, brake.plant.position

    assert measured(MODEL)[0] == measured(MODEL)[1]
    said, true = measured(with_law('a', 'position_delay', a=0.01))
    assert true - said > 0.01


def test_the_sensors_error_is_found_where_effort_was_not_recorded():
    """The controller acted on what the sensor said, so effort is told by that."""
    duration = 40.0
    model = replace(MODEL, controller=replace(MODEL.controller, integral=0.0))
    time, seen, effort = driven(duration, off(0.15, 3.0), model.controller)
    noise = np.random.default_rng(3).normal(0.0, 1e-4, seen.size)
    (told,) = with_effort([Recording('run', time, seen + noise, np.full(seen.size, np.nan),
                                     reference=reference(duration))], model)
    moving = slice(100, None)
    assert np.std((told.effort - effort)[moving]) < 0.1 * np.std(effort[moving])
    fitter = Fitter(problem_of([told], model), 1)
    found = find_law(fitter, fitter.finish(fitter.refine(fitter.base())), lambda text: None)
    assert isinstance(found, Found)
    assert found.candidate.form.acts_as == 'position_shift'
    assert found.parameters['a'].value == pytest.approx(0.15, rel=0.15)
