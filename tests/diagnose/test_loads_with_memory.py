# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Loads with memory, by formulas of their own: a spring that rubs in its guide, a pad that was
held before the recording, a load that swings from a hook, a disc that drags the pad along."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.recording import Recording, Signal

NOISE = 1e-3
SPRING = Model(load_torque=LoadTorque(coefficients=(-0.15, 0.015)),
               friction=Friction(0.012, 0.0, 0.5))
HOIST = Model(motor=Motor(inertia=2e-3), load_torque=LoadTorque(coefficients=(0.03,)),
              friction=Friction(0.012, 0.0, 0.5))
STEP = 2e-3


def walk(seed: int, duration: float = 40.0, low: float = 0.0, high: float = 20.0):
    """Return times, positions, velocities and accelerations (n,) of moves between random places,
    each a part of a cosine, with holds."""
    generator = np.random.default_rng(seed)
    acceleration, at = [], 0.5 * (low + high)
    while STEP * sum(part.size for part in acceleration) < duration:
        to, takes = generator.uniform(low, high), generator.uniform(0.4, 2.0)
        time = np.arange(0.0, takes, STEP)
        rate = np.pi / takes
        acceleration += [0.5 * (to - at) * rate ** 2 * np.cos(rate * time),
                         np.zeros(int(generator.uniform(0.1, 0.8) / STEP))]
        at = to
    joined = np.concatenate(acceleration)
    velocity = np.cumsum(joined) * STEP
    position = 0.5 * (low + high) + np.cumsum(velocity) * STEP
    return STEP * np.arange(joined.size), position, velocity, joined


def needed(model: Model, motion) -> np.ndarray:
    """Return the torque that a model without load friction needs for a motion."""
    _, position, velocity, acceleration = motion
    load = np.polynomial.Polynomial(model.load_torque.coefficients)(position)
    return (model.motor.inertia * acceleration + model.motor.viscous_friction * velocity + load
            + model.friction.coulomb * np.clip(
                velocity / model.friction.saturation_velocity, -1.0, 1.0))


def recorded(motion, effort: np.ndarray, seed: int = 1) -> Recording:
    time, position, velocity, _ = motion
    count = 2.0 * np.pi / 8192.0
    noise = NOISE * np.random.default_rng(seed).standard_normal(time.size)
    return Recording.from_samples('run', time, np.round(position / count) * count, effort + noise,
                                  velocity)


def rubbing(load: np.ndarray, widths: tuple[float, ...]) -> np.ndarray:
    """Return the mean of elements that stick to the load until it has gone by a width."""
    held = np.zeros(len(widths))
    limits, found = np.array(widths), np.empty_like(load)
    for place, step in enumerate(np.diff(load, prepend=load[0])):
        held = np.clip(held + step, -limits, limits)
        found[place] = held.mean()
    return found


def test_a_hysteresis_that_goes_with_the_load_is_named_on_a_spring_of_both_signs():
    motion = walk(3)
    load = np.polynomial.Polynomial(SPRING.load_torque.coefficients)(motion[1])
    extra = 0.1 * rubbing(load, (0.02, 0.05, 0.11))
    diagnosis = diagnose([recorded(motion, needed(SPRING, motion) + extra)], SPRING)
    (first,) = (entry for entry in diagnosis.effects if entry.probability > 0.5)
    assert first.effect == 'load_hysteresis'
    # Half of the slow loop's width, over the peak load.
    up = np.linspace(load.min(), load.max(), 1000)
    loop = 0.1 * rubbing(np.concatenate([up, up[::-1]] * 2), (0.02, 0.05, 0.11))[2000:]
    width = 0.5 * np.abs(loop[:1000] - loop[:999:-1]).max()
    assert first.parameters['hysteresis_ratio'].value == pytest.approx(
        width / np.abs(load).max(), rel=0.15)


CALIPER = Model(load_torque=LoadTorque(coefficients=(0.0, 0.006, 6e-4), contact_angle=5.0),
                friction=Friction(0.012, 0.0, 0.5))


def test_what_rubs_alike_everywhere_is_no_offset_beside_a_loop():
    """A guide that is dragged along with the load keeps what it was dragged to, also where there
    is none, and rubs no less where there is little: no load exponent does that."""
    motion = walk(9, duration=50.0)
    load = np.polynomial.Polynomial(CALIPER.load_torque.coefficients)(
        np.maximum(motion[1] - 5.0, 0.0))
    widths = load.max() * np.array([0.06, 0.18, 0.4])
    extra = 0.09 * load.max() * sum(part * rubbing(load, (width,)) / width for part, width in zip(
        (0.4, 0.35, 0.25), widths, strict=True))
    extra += 0.1 * load * np.clip(motion[2] / CALIPER.friction.saturation_velocity, -1.0, 1.0)
    plain = replace(CALIPER, load_torque=LoadTorque(coefficients=(0.0,)))
    model = replace(CALIPER, friction=replace(CALIPER.friction, load_gain=0.1))
    diagnosis = diagnose([recorded(motion, needed(plain, motion) + load + extra)], model)
    assert [entry.effect for entry in diagnosis.effects if entry.probability > 0.5] == [
        'load_hysteresis']


@pytest.mark.parametrize('either_way', [True, False])
def test_the_disc_drags_the_pad_along_either_way_or_by_its_direction(either_way):
    ratio = 1.12
    motion = walk(7, duration=50.0)
    load = np.polynomial.Polynomial(CALIPER.load_torque.coefficients)(
        np.maximum(motion[1] - 5.0, 0.0))
    turns = np.interp(motion[0], [0.0, 12.0, 13.0, 25.0, 26.0, 38.0, 39.0, 60.0],
                      [-18.0, -18.0, 0.0, 0.0, 25.0, 25.0, 1.5, 1.5])
    acts = np.tanh((np.abs(turns) if either_way else turns) / 2.0)
    plain = replace(CALIPER, load_torque=LoadTorque(coefficients=(0.0,)))
    effort = needed(plain, motion) + load * (1.0 + (ratio - 1.0) * acts)
    run = replace(recorded(motion, effort), signals={'disc_speed': Signal(motion[0], turns)})
    (first,) = (entry for entry in diagnose([run], CALIPER).effects if entry.probability > 0.5)
    assert first.effect == 'self_energizing'
    assert first.parameters['load_ratio'].value == pytest.approx(ratio, abs=0.01)


def relaxed(load: np.ndarray, constant: float, held: float) -> np.ndarray:
    """Return a load through a first-order lag that begins at a part of it."""
    state, found = held * load[0], np.empty_like(load)
    for place, value in enumerate(load):
        state += STEP / constant * (value - state)
        found[place] = state
    return found


@pytest.mark.parametrize('held', [0.0, 1.0], ids=['fresh', 'long'])
def test_a_load_that_was_held_before_the_recording_creeps_all_the_same(held):
    motion = walk(4)
    load = np.polynomial.Polynomial(SPRING.load_torque.coefficients)(motion[1] + 6.0)
    model = Model(load_torque=LoadTorque(coefficients=(-0.06, 0.015)),
                  friction=SPRING.friction)
    effort = needed(model, motion) - 0.2 * relaxed(load, 1.3, held)
    diagnosis = diagnose([recorded(motion, effort)], model)
    named = [entry for entry in diagnosis.effects if entry.probability > 0.5]
    assert [entry.effect for entry in named] == ['pad_creep']
    assert named[0].parameters['relaxed_fraction'].value == pytest.approx(0.2, rel=0.1)
    assert named[0].parameters['time_constant'].value == pytest.approx(1.3, rel=0.1)


def test_a_file_of_the_relaxed_load_has_no_wrong_stiffness():
    """A spring and a dashpot beside the load: a fourth more at once, nothing in the end."""
    motion = walk(4)
    load = np.polynomial.Polynomial(SPRING.load_torque.coefficients)(motion[1] + 6.0)
    model = Model(load_torque=LoadTorque(coefficients=(-0.06, 0.015)),
                  friction=SPRING.friction)
    effort = needed(model, motion) + 0.25 * (load - relaxed(load, 1.3, 0.0))
    diagnosis = diagnose([recorded(motion, effort)], model)
    assert diagnosis.verdict == 'explained'
    (creep,) = diagnosis.effects
    assert creep.effect == 'pad_creep'
    assert creep.share > 0.9
    assert creep.statement.endswith("the model file's load is the relaxed one.")
    assert creep.parameters['relaxed_fraction'].value == pytest.approx(0.2, rel=0.1)


def swung(acceleration: np.ndarray, frequency: float, damping: float) -> np.ndarray:
    """Return how much more or less than with the shaft [rad/s²] a mass on a hook is moved."""
    rate, place, speed = 2.0 * np.pi * frequency, 0.0, 0.0
    found = np.empty_like(acceleration)
    for at, driven in enumerate(acceleration):
        more = -driven - 2.0 * damping * rate * speed - rate ** 2 * place
        speed += STEP * more
        place += STEP * speed
        found[at] = more
    return found


def test_a_load_that_swings_is_a_resonance_below_a_hertz():
    motion = walk(5, duration=50.0)
    hanging = 0.2 * HOIST.motor.inertia
    extra = hanging * (motion[3] + swung(motion[3], 0.8, 0.03))
    diagnosis = diagnose([recorded(motion, needed(HOIST, motion) + extra)], HOIST)
    first = diagnosis.effects[0]
    assert first.effect == 'drivetrain_resonance'
    assert first.probability > 2.0 / 3.0
    assert first.statement.startswith('A part of the load swings at 0.')
