# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Beyond the paper: wear tracked online, force against a load cell, the residual named."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.bench.settings import BenchSettings
from engb_core.control.clamp_force import (
    ClampForceEstimator,
    ClampForceMap,
    EstimatorSettings,
)
from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.diagnose.diagnosis import Diagnosis
from engb_core.diagnose.engine import diagnose
from engb_core.errors import InputError
from engb_core.identify.causal_observer import drive_velocity
from engb_core.identify.online import StrokeTracker, StrokeUpdate
from engb_core.mechanism.kinematics import Mechanism
from engb_core.mechanism.statics import clamp_force, efficiency_load_gain, self_energizing_gain
from engb_core.model import EffectSetting, Model
from engb_core.recording import Recording
from engb_core.reproduce import chosen
from engb_core.reproduce.in_process import Replay, replay
from engb_core.reproduce.plan import Experiment

__all__ = ['analyse_wear', 'BeyondResult', 'diagnose_residual', 'ForceComparison', 'in_torque',
           'WearResult']

Array = NDArray[np.float64]

# The force is compared where the clamp is closed [N].
LEAST_FORCE = 200.0


@dataclass(frozen=True)
class ForceComparison:
    """The estimated clamp force beside the load cell's.

    Attributes:
        time: (n,) [s].
        estimate, deviation, cell: (n,) [N].
        rms: of estimate − cell where the clamp is closed [N].
        largest: the largest force that the cell reads [N].
        inside: part of those samples at which the cell lies within two deviations.
        narrow: the same with the estimator's own belief, in which a force has no loop.
        loop: what of C₁ gear and screw do not explain, and so lies in the caliper [-].
    """

    time: Array
    estimate: Array
    deviation: Array
    cell: Array
    rms: float
    largest: float
    inside: float
    narrow: float
    loop: float


@dataclass(frozen=True)
class WearResult:
    """The run in which the pads wear and heat.

    Attributes:
        updates: of each stroke.
        time: (k,) [s] of the truth.
        true_shift, true_gain, temperature: (k,) [rad], [-], [°C], of the simulated brake.
        force: the estimate beside the load cell.
    """

    updates: list[StrokeUpdate]
    time: Array
    true_shift: Array
    true_gain: Array
    temperature: Array
    force: ForceComparison

    def errors(self) -> tuple[Array, Array]:
        """Return gain and shift less the truth (strokes,) [-], [rad]."""
        at = np.array([entry.time for entry in self.updates])
        gain = np.array([entry.gain for entry in self.updates])
        shift = np.array([entry.shift for entry in self.updates])
        return (gain - np.interp(at, self.time, self.true_gain),
                shift - np.interp(at, self.time, self.true_shift))

    def scatter(self) -> tuple[float, float]:
        """Return the standard deviations of those errors [-], [rad]: how well a change is seen."""
        gain, shift = self.errors()
        return float(np.std(gain, ddof=1)), float(np.std(shift, ddof=1))


@dataclass(frozen=True)
class BeyondResult:
    """`wear`, and the diagnosis of the residual of chapter 4 (None: not asked for)."""

    wear: WearResult
    diagnosis: Diagnosis | None


def analyse_wear(recording: Recording, experiment: Experiment, model: Model, gain: float,
                 torque_constant: float) -> WearResult:
    """Track P, contact and force through the run 'wear'.

    Args:
        recording: of the run.
        experiment: the same, for the truth: it is run again in this process.
        model: identified with the disc standing, in the drive's units; the loop's, too.
        gain: P as chapter 5 found it, for the force.
        torque_constant: K_T as found [N·m/A].
    """
    settings = experiment.brake
    if isinstance(settings, Model):
        raise InputError(f'{experiment.name}: needs a bench brake')
    velocity = drive_velocity(recording, recording.time)
    tracker = StrokeTracker(model)
    updates = [found for sample in zip(recording.time.tolist(), recording.position.tolist(),
                                       velocity.tolist(), recording.effort.tolist(), strict=True)
               if (found := tracker.step(*sample)) is not None]
    truth = replay(experiment, model)
    return WearResult(updates, truth.time, *_true_numbers(settings, truth), truth.temperature,
                      _force(recording, velocity, model, settings.mechanism, gain,
                             torque_constant))


def diagnose_residual(recordings: Mapping[str, Recording], paper: Model,
                      tell: Callable[[str], None]) -> Diagnosis:
    """Return what the diagnosis says of the paper's own residual (Figs 19 to 21): which physics
    the model that was identified the paper's way leaves out."""
    return diagnose([recordings['model_1']], paper, [recordings['model_2']], tell)


def in_torque(model: Model, scale: float) -> Model:
    """Return `model` with every torque in it multiplied by `scale`."""
    motor, friction, load = model.motor, model.friction, model.load_torque
    return replace(
        model,
        motor=replace(motor, inertia=scale * motor.inertia,
                      viscous_friction=scale * motor.viscous_friction),
        load_torque=replace(load, coefficients=tuple(
            scale * value for value in load.coefficients)),
        friction=replace(friction, coulomb=scale * friction.coulomb),
        cogging=tuple(replace(wave, amplitude=scale * wave.amplitude) for wave in model.cogging))


def _true_numbers(settings: BenchSettings, truth: Replay) -> tuple[Array, Array]:
    """Return the contact's shift [rad] and P [-] over the replay's time (k,)."""
    mechanism = settings.mechanism
    contact = mechanism.motor_angle_of_pad(mechanism.clearance + truth.wear)
    # Each moment's μ, where the stroke presses; P in the mean over it, as it is identified.
    angles = np.linspace(4.0, mechanism.stroke - 3.0, 60)
    wedge, load = mechanism.posture(angles).wedge, clamp_force(mechanism, angles)
    mean = float(wedge @ load**2 / (load @ load))
    friction = np.where(truth.force > LEAST_FORCE, truth.pad_friction, np.nan)
    known = np.isfinite(friction)
    friction = np.interp(truth.time, truth.time[known], friction[known])
    width = max(1, round(1.5 / float(np.median(np.diff(truth.time)))))
    smooth = np.convolve(np.pad(friction, width, mode='edge'), np.full(2 * width + 1, 1.0)
                         / (2 * width + 1), mode='valid')
    gain = self_energizing_gain(mean, 0.0) - smooth / mean
    return contact - contact[0], np.asarray(gain)


def _force(recording: Recording, velocity: Array, model: Model, mechanism: Mechanism,
           gain: float, torque_constant: float) -> ForceComparison:
    scale = torque_constant / chosen.NOMINAL.motor.torque_constant
    # P is of the disc at the speed of chapter 5; it stands during the first strokes.
    known = replace(in_torque(model, scale), effects=(
        EffectSetting('self_energizing', {'load_ratio': gain}),))
    # Torque that is lost between motor and pads takes no force away; what gear and screw do not
    # explain of it is lost in the caliper, whose force then has a loop as wide.
    loop = max(model.friction.load_gain - efficiency_load_gain(mechanism)[1], 0.0)
    belief = EstimatorSettings()
    wide = replace(belief, force_error=float(np.hypot(belief.force_error, loop)))
    cell = recording.signals['load_cell'].at(recording.time)
    closed = cell > LEAST_FORCE
    inside = {}
    for settings in (belief, wide):
        estimate, deviation = _estimate(recording, velocity, ClampForceEstimator(
            ClampForceMap(known, mechanism), settings), scale)
        error = (estimate - cell)[closed]
        inside[settings] = float(np.mean(np.abs(error) <= 2.0 * deviation[closed]))
    return ForceComparison(
        recording.time, estimate, deviation, cell, float(np.sqrt(np.mean(error**2))),
        float(cell.max()), inside[wide], inside[belief], loop)


def _estimate(recording: Recording, velocity: Array, estimator: ClampForceEstimator,
              scale: float) -> tuple[Array, Array]:
    """Return the force and its deviation (n,) [N]; `scale` makes N·m of the effort."""
    observer = DisturbanceObserver(estimator.map.model.motor, estimator.settings.cutoff)
    disc = recording.signals['disc_speed'].at(recording.time)
    rows = []
    for time, position, speed, effort, turning in zip(
            recording.time.tolist(), recording.position.tolist(), velocity.tolist(),
            (scale * recording.effort).tolist(), disc.tolist(), strict=True):
        estimator.step(time, position, speed, observer.step(time, speed, effort), turning)
        rows.append((estimator.force, estimator.force_std))
    estimate, deviation = np.array(rows).T
    return estimate, deviation
