# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The same recording fitted by this package, pysindy, mujoco.sysid and BAM: accuracy and seconds.

    .venv/bin/python benchmarks/fits.py [--trials 200]

A pendulum on a servo motor, the one machine that all of them describe: inertia, viscous drag,
friction that falls with speed (Stribeck), 20 s at 500 Hz from a simulation of its own (fine
steps, smooth friction curve, encoder counts, noise), and a second run with another reference
that no fit sees. What a tool finds is held against both:
  held-out    rms of the effort that its model says the second run's motion needs, minus the
              measured effort, moving samples through one and the same 20 Hz low-pass
  inertia, friction
              error of the inertia, and rms error of the friction torque from 0.2 to 6 rad/s
Tools that are not installed are left out, with the command that installs them:
    pip install pysindy "mujoco[sysid]" better-actuator-models optuna cmaes
BAM needs Python 3.12. Its own fit runs 100 000 trials of CMA-ES; here --trials of them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import contextlib
from dataclasses import dataclass, replace
import io
import logging
import math
import time
import warnings

import bench  # noqa: F401  (finds the package)
import numpy as np

from engb_core.diagnose.engine import diagnose
from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording
from engb_core.signals.filtering import comparison_of
from engb_core.signals.motion import Motion, motion_of

# The truth. The gravity torque is known to all tools (BAM and MuJoCo take mass and length).
MASS, LENGTH, GRAVITY = 0.5, 0.15, 9.80665
WEIGHT = MASS * GRAVITY * LENGTH            # N·m
ARMATURE = 0.004                            # kg·m²
INERTIA = MASS * LENGTH ** 2 + ARMATURE
VISCOUS, COULOMB, BREAKAWAY, STRIBECK = 0.03, 0.08, 1.6, 0.8
RATE = 500.0
SEGMENT = 0.5                               # s; simulations start anew from the record that often
SPEEDS = np.linspace(0.2, 6.0, 60)

START = Model(Motor(inertia=1.4 * INERTIA, viscous_friction=2.0 * VISCOUS),
              LoadTorque('sinusoid', amplitude=WEIGHT), Friction(0.5 * COULOMB, 0.0, 0.05))


@dataclass(frozen=True)
class Found:
    """What a tool found: inertia [kg·m²], friction(speed) [N·m] for speeds > 0, the effort that
    a motion needs, and a remark."""

    inertia: float
    friction: Callable[[np.ndarray], np.ndarray]
    effort: Callable[[Motion], np.ndarray]
    remark: str = ''


class Missing(Exception):
    """A tool is not installed; the message says how to install it."""


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=200, help='of BAM (default: %(default)s)')
    arguments = parser.parse_args()
    logging.disable(logging.WARNING)
    warnings.simplefilter('ignore')
    train, test = recorded(1), recorded(2)
    diagnose([train], START)                    # compiles, or loads what is compiled
    tools = {'file as it starts': lambda: nominal(START),
             'engb diagnose': lambda: by_diagnosis(train),
             'pysindy STLSQ': lambda: by_pysindy(train),
             'mujoco.sysid': lambda: by_mujoco(train),
             f'BAM m2, {arguments.trials} trials': lambda: by_bam(train, arguments.trials)}
    print(f'{"tool":<24}{"processor s":>12}{"held-out mN·m":>15}{"inertia %":>11}'
          f'{"friction mN·m":>15}  remark')
    for name, tool in tools.items():
        begin = time.process_time()
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                found = tool()
        except Missing as error:
            print(f'{name:<24}not installed: {error}')
            continue
        seconds = time.process_time() - begin
        print(f'{name:<24}{seconds:12.2f}{1e3 * held_out(found, test):15.2f}'
              f'{100.0 * (found.inertia / INERTIA - 1.0):11.1f}'
              f'{1e3 * rms(found.friction(SPEEDS) - friction(SPEEDS)):15.2f}  {found.remark}',
              flush=True)


def friction(speed: np.ndarray | float) -> np.ndarray | float:
    """Return the true friction torque without its sign [N·m]."""
    return COULOMB * (1.0 + (BREAKAWAY - 1.0) * np.exp(-(speed / STRIBECK) ** 2)) + VISCOUS * speed


def recorded(seed: int, seconds: float = 20.0, inner: int = 20) -> Recording:
    """Return a run of the true pendulum behind a PD controller that follows a sum of sines."""
    rng = np.random.default_rng(seed)
    time_ = np.arange(round(seconds * RATE)) / RATE
    pace = np.array([0.11, 0.23, 0.47, 0.9]) * rng.uniform(0.9, 1.1, 4)
    size, phase = np.array([1.2, 0.8, 0.4, 0.15]), rng.uniform(0, 2 * math.pi, 4)
    turn = 2 * math.pi * pace * time_[:, None] + phase
    wanted = np.sin(turn) @ size
    speed = (np.cos(turn) * 2 * math.pi * pace) @ size
    position, velocity = float(wanted[0]), 0.0
    step = 1.0 / RATE / inner
    count = 2 * math.pi / 16384
    rows = np.empty((time_.size, 2))
    for row in range(time_.size):
        seen = round(position / count) * count
        effort = (12.0 * (float(wanted[row]) - seen) + 0.5 * (float(speed[row]) - velocity)
                  + WEIGHT * math.sin(seen))
        effort = min(3.0, max(-3.0, effort))
        rows[row] = seen, effort
        for _ in range(inner):
            size_now = abs(velocity)
            rubbing = (COULOMB * (1.0 + (BREAKAWAY - 1.0) * math.exp(-(size_now / STRIBECK) ** 2))
                       * math.tanh(velocity / 0.01) + VISCOUS * velocity)
            velocity += step * (effort - rubbing - WEIGHT * math.sin(position)) / INERTIA
            position += step * velocity
    effort = rows[:, 1] + rng.normal(0.0, 0.01, time_.size)
    return Recording.from_samples(f'run_{seed}', time_, rows[:, 0], effort)


def rms(values: np.ndarray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values ** 2)))


def held_out(found: Found, recording: Recording) -> float:
    """Return the rms of needed minus measured effort [N·m]."""
    motion = motion_of(recording)
    comparison = comparison_of(motion, 20.0, 0.15)
    return rms(comparison(found.effort(motion)) - comparison(motion.effort))


def needed(inertia: float, rubbing: Callable, motion: Motion) -> np.ndarray:
    """Return the effort of a pendulum of known weight."""
    return (inertia * motion.acceleration + WEIGHT * np.sin(motion.position)
            + np.sign(motion.velocity) * rubbing(np.abs(motion.velocity)))


def nominal(model: Model, remark: str = '') -> Found:
    """Return what a model of this package says."""
    def effort(motion: Motion) -> np.ndarray:
        return effort_of_motion(motion.samples(), motion.step, physics_of(model))

    def rubbing(speed: np.ndarray) -> np.ndarray:
        samples = np.zeros((speed.size, motion_columns()))
        samples[:, 0], samples[:, 3] = 1e-3, speed
        bare = replace(model, load_torque=replace(model.load_torque, amplitude=0.0))
        return effort_of_motion(samples, 1e-3, physics_of(bare))

    return Found(model.motor.inertia, rubbing, effort, remark)


def motion_columns() -> int:
    """Return how many columns a sample has; time step and velocity are 0 and 3."""
    from engb_core.effects.base import SAMPLE_SIZE, TIME_STEP, VELOCITY
    assert (TIME_STEP, VELOCITY) == (0, 3)
    return SAMPLE_SIZE


def by_diagnosis(train: Recording) -> Found:
    """Let this package find what the file leaves out."""
    result = diagnose([train], START)
    return nominal(result.model, ', '.join(
        f'{effect.effect} {effect.probability:.2f}' for effect in result.effects)
        or result.verdict)


def by_pysindy(train: Recording) -> Found:
    """Regress the acceleration on a library, sparsely; it gets this package's smoothed motion."""
    try:
        import pysindy
    except ImportError:
        raise Missing('pip install pysindy') from None
    motion = motion_of(train)
    comparison = comparison_of(motion, 20.0, 0.15)
    moving = comparison.weight > 0.0
    terms = [lambda p, v, e: e, lambda p, v, e: np.sin(p), lambda p, v, e: v,
             lambda p, v, e: np.sign(v), lambda p, v, e: np.sign(v) * np.exp(-(v / 0.5) ** 2),
             lambda p, v, e: np.sign(v) * np.exp(-v ** 2), lambda p, v, e: v * np.abs(v),
             lambda p, v, e: np.cos(p), lambda p, v, e: p]
    names = ['effort', 'sin', 'drag', 'sign', 'Stribeck 0.5', 'Stribeck 1', 'v|v|', 'cos', 'p']
    columns = np.stack([term(motion.position, motion.velocity, motion.effort)
                        for term in terms], axis=1)[moving]
    optimizer = pysindy.STLSQ(threshold=1.0, alpha=1e-3)
    optimizer.fit(columns, motion.acceleration[moving][:, None])
    weights = np.asarray(optimizer.coef_).ravel()
    inertia = 1.0 / weights[0]

    def rest(position: np.ndarray, velocity: np.ndarray, which: range) -> np.ndarray:
        return -inertia * sum(weights[index] * terms[index](position, velocity, 0.0 * velocity)
                              for index in which)

    def effort(motion: Motion) -> np.ndarray:
        return inertia * motion.acceleration + rest(motion.position, motion.velocity,
                                                    range(1, len(terms)))

    return Found(inertia, lambda speed: rest(0.0 * speed, speed, range(2, 7)), effort,
                 ', '.join(name for name, weight in zip(names, weights, strict=True) if weight))


def segments(train: Recording) -> tuple[list[slice], np.ndarray]:
    """Return stretches of the recording, each simulated from its first sample, and velocity."""
    size = round(SEGMENT * RATE)
    motion = motion_of(train)
    velocity = np.interp(train.time, motion.time, motion.velocity)
    return [slice(first, first + size) for first in
            range(0, train.time.size - size + 1, size)], velocity


MUJOCO = f'''<mujoco><option timestep="{1 / RATE}" integrator="implicitfast"/>
<worldbody><body name="arm"><joint name="pivot" type="hinge" axis="0 1 0" armature="0.01"
damping="0.06" frictionloss="0.04"/><inertial pos="0 0 {-LENGTH}" mass="{MASS}"
diaginertia="1e-9 1e-9 1e-9"/></body></worldbody>
<actuator><motor joint="pivot"/></actuator>
<sensor><jointpos name="position" joint="pivot"/></sensor></mujoco>'''


def by_mujoco(train: Recording) -> Found:
    """Fit armature, damping and friction loss by simulation; MuJoCo knows no Stribeck friction."""
    try:
        import mujoco
        from mujoco import sysid
        from mujoco.sysid import ModelSequences, optimize
    except ImportError:
        raise Missing('pip install "mujoco[sysid]"') from None
    spec = mujoco.MjSpec.from_string(MUJOCO)
    model = spec.compile()
    data = mujoco.MjData(model)
    stretches, velocity = segments(train)
    starts, controls, sensors = [], [], []
    for stretch in stretches:
        data.qpos[:], data.qvel[:] = train.position[stretch][0], velocity[stretch][0]
        starts.append(sysid.create_initial_state(model, data.qpos, data.qvel, data.act))
        time_ = train.time[stretch] - train.time[stretch][0]
        controls.append(sysid.TimeSeries(time_, train.effort[stretch][:, None]))
        sensors.append(sysid.TimeSeries.from_names(time_, train.position[stretch][:, None],
                                                   model))

    def put(joint: object, name: str, value: float) -> None:
        # Damping became a polynomial of the speed in MuJoCo 4.
        several = np.size(getattr(joint, name)) > 1
        setattr(joint, name, np.array([value, 0.0, 0.0]) if several else value)

    parameters = sysid.ParameterDict()
    for name, start, most in (('armature', 0.01, 0.1), ('damping', 0.06, 1.0),
                              ('frictionloss', 0.04, 1.0)):
        parameters.add(sysid.Parameter(
            name, nominal=start, min_value=1e-5, max_value=most,
            modifier=lambda spec, parameter, name=name: put(spec.joint('pivot'), name,
                                                           float(parameter.value[0]))))
    sequences = ModelSequences('pendulum', spec, [f's{index}' for index in range(len(starts))],
                               starts, controls, sensors)
    fitted, _ = optimize(initial_params=parameters, optimizer='mujoco', verbose=False,
                         residual_fn=sysid.build_residual_fn(models_sequences=[sequences]))
    armature, damping, loss = (float(np.ravel(fitted[name].value)[0])
                               for name in ('armature', 'damping', 'frictionloss'))
    inertia = MASS * LENGTH ** 2 + armature

    def rubbing(speed: np.ndarray) -> np.ndarray:
        return loss + damping * speed

    return Found(inertia, rubbing, lambda motion: needed(inertia, rubbing, motion),
                 'no Stribeck friction in MuJoCo')


def by_bam(train: Recording, trials: int) -> Found:
    """Fit BAM's model m2 (Coulomb and Stribeck) by its own simulator and CMA-ES."""
    try:
        from bam.model import models
        from bam.simulate import Simulator
        from bam.testbench import Pendulum
        from bam.unitree.actuator import UnitreeGo1Actuator
        import optuna
    except ImportError as error:
        raise Missing(f'pip install better-actuator-models optuna cmaes, on Python 3.12 ({error})'
                      ) from None
    stretches, velocity = segments(train)
    entries = [{'position': position, 'speed': speed, 'control': effort, 'torque_enable': True}
               for position, speed, effort in zip(train.position, velocity, train.effort,
                                                  strict=True)]
    log = {'mass': MASS, 'arm_mass': 0.0, 'length': LENGTH, 'kp': 0.0, 'dt': 1.0 / RATE,
           'entries': entries[:stretches[-1].stop]}

    def made() -> object:
        model = models['m2']()
        model.set_actuator(UnitreeGo1Actuator(Pendulum))
        for name in ('ratio', 'max_torque', 'q_offset'):
            getattr(model, name).optimize = False
        model.armature.max = 0.1            # its default, 2 kg·m², would be kept for servos
        return model

    def objective(trial: object) -> float:
        model = made()
        for name, parameter in model.get_parameters().items():
            if parameter.optimize:
                parameter.value = trial.suggest_float(name, parameter.min, parameter.max)
        positions, _, _ = Simulator(model).rollout_log(log, reset_period=SEGMENT)
        return float(np.mean(np.abs(np.ravel(positions) - train.position[:len(positions)])))

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(sampler=optuna.samplers.CmaEsSampler(seed=1))
    study.optimize(objective, n_trials=trials)
    model = made()
    model.load_parameters_from_dict(study.best_params)
    inertia = MASS * LENGTH ** 2 + model.armature.value

    def rubbing(speed: np.ndarray) -> np.ndarray:
        loss, damping = model.compute_frictions(0.0, 0.0, speed)
        return loss + damping * speed

    return Found(inertia, rubbing, lambda motion: needed(inertia, rubbing, motion),
                 'Coulomb and Stribeck friction given beforehand')


if __name__ == '__main__':
    main()
