# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Section 3.2 and the cogging: the nominal plant from steps, a sweep and slow strokes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.bench.sensors import SensorSettings
from engb_core.bench.virtual_brake import DriveSettings, VirtualBrake
from engb_core.errors import InputError
from engb_core.identify.cogging import order_spectrum
from engb_core.identify.confidence import Estimate
from engb_core.identify.nominal_plant import (
    fit_free_motor,
    fit_response,
    fit_steps,
    frequency_response,
    FrequencyResponse,
    LinearFit,
    StepFit,
    torque_constant,
)
from engb_core.identify.output_error import fit_output_error
from engb_core.identify.regression import Fit, Form
from engb_core.identify.regression import fit as fit_jointly
from engb_core.identify.smoothing import motions
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.reproduce import chosen

__all__ = ['analyse_nominal', 'CoggingEffect', 'compare_cogging', 'NominalResult']

Array = NDArray[np.float64]

# How long a turn disturbs the tracking [s].
SETTLING = 1.2


@dataclass(frozen=True)
class NominalResult:
    """What the free motor's runs gave.

    Attributes:
        steps: the classical fits, one a step; `linear_steps` their summary.
        response: torque to velocity, measured by the sweep; `linear_sweep` fitted to it.
        simulated: the same of the joint model run forward under the sweep's measured torque,
            friction and cogging included, through the same estimator.
        output_error_steps, output_error_sweep: the linear motor fitted by output error.
        joint: all runs at once, with friction and cogging.
        torque_constant: from the added inertia.
        orders, spectrum: the order spectrum of what friction leaves over in the slow strokes.
        nominal: what the joint regression starts from: J, B, cogging.
    """

    steps: list[StepFit]
    linear_steps: LinearFit
    response: FrequencyResponse
    linear_sweep: LinearFit
    simulated: FrequencyResponse
    output_error_steps: LinearFit
    output_error_sweep: LinearFit
    joint: Fit
    torque_constant: Estimate
    orders: Array
    spectrum: Array
    nominal: Model

    @property
    def prior(self) -> dict[str, Estimate]:
        """What the strokes' joint regression may rely on: J, B and the cogging, by name."""
        return {name: estimate for name, estimate in self.joint.estimates.items()
                if name in ('inertia', 'viscous_friction')
                or name.startswith(('sine', 'cosine'))}

    @property
    def classical(self) -> Model:
        """The nominal model as the paper has it: J and B of the classical step test. Controllers
        and the paper's way rest on it."""
        motor = replace(self.nominal.motor, inertia=self.linear_steps.inertia.value,
                        viscous_friction=self.linear_steps.viscous_friction.value)
        return replace(self.nominal, motor=motor)


@dataclass(frozen=True)
class CoggingEffect:
    """Tracking error of the slow strokes in motion, without and with compensation [rad]."""

    time: Array
    before: Array
    after: Array
    rms_before: float
    rms_after: float


def analyse_nominal(recordings: Mapping[str, Recording]) -> NominalResult:
    """Analyse the runs 'steps', 'steps_added', 'sweep' and 'cogging'."""
    steps, linear_steps = fit_steps(recordings['steps'])
    response = frequency_response([recordings['sweep']])
    slow = fit_free_motor([recordings['cogging']], chosen.NOMINAL)
    known = slow.model(chosen.NOMINAL)
    joint = fit_free_motor([recordings['cogging'], recordings['steps'], recordings['sweep']],
                           known)
    loaded = fit_free_motor([recordings['steps_added']], known)
    bare = fit_free_motor([recordings['steps']], known)
    constant = torque_constant(bare.estimates['inertia'], loaded.estimates['inertia'],
                               chosen.ADDED_INERTIA, chosen.NOMINAL.motor.torque_constant)
    orders, spectrum = _spectrum(recordings['cogging'], slow)
    found = joint.model(chosen.NOMINAL)
    # Friction and load are for the strokes to find; the nominal plant has none (25).
    nominal = replace(chosen.NOMINAL, motor=found.motor, cogging=found.cogging)
    return NominalResult(
        steps, linear_steps, response, fit_response(response),
        frequency_response([_run_forward(found, recordings['sweep'])]),
        fit_output_error([recordings['steps']]), fit_output_error([recordings['sweep']]),
        joint, constant, orders, spectrum, nominal)


def compare_cogging(before: Recording, after: Recording) -> CoggingEffect:
    """Compare the tracking of the slow strokes without and with cogging compensation."""
    errors = []
    for recording in (before, after):
        motion, = motions(recording)[:1]
        reference = recording.reference
        if reference is None or reference.velocity is None:
            raise InputError(f'{recording.name}: no reference recorded; record the topic '
                             'reference')
        wanted = np.interp(motion.time, reference.time, reference.position)
        speed = np.interp(motion.time, reference.time, reference.velocity)
        # At steady slow speed, the integral part settled: a turn's own error is not the cogging's.
        steady = (np.abs(speed) > 1.5) & (np.abs(speed) < 4.5)
        for begin in np.flatnonzero(np.diff(steady.astype(int)) == 1):
            steady[begin:begin + round(SETTLING / motion.interval)] = False
        error = np.where(steady, motion.kernel.apply(wanted - motion.position), np.nan)
        # The steady part of the error is friction's; cogging's changes with the angle.
        for sign in (-1.0, 1.0):
            part = steady & (np.sign(speed) == sign)
            error[part] -= np.mean(error[part])
        errors.append((motion.time, error))
    size = min(errors[0][0].size, errors[1][0].size)
    one, two = errors[0][1][:size], errors[1][1][:size]
    return CoggingEffect(errors[0][0][:size], one, two, float(np.sqrt(np.nanmean(one**2))),
                         float(np.sqrt(np.nanmean(two**2))))


def _run_forward(model: Model, recording: Recording) -> Recording:
    """Return what `model` does under the recorded torque, measured without error."""
    brake = VirtualBrake(model, DriveSettings(rate=1.0 / recording.interval),
                         SensorSettings(counts_per_revolution=0, velocity_cutoff=0.0,
                                        effort_noise=0.0, effort_resolution=0.0))
    rows = []
    for torque in recording.effort.tolist():
        brake.command(torque)
        measured = brake.advance()
        rows.append((measured.time, measured.position, measured.velocity, measured.effort))
    time, position, velocity, effort = np.array(rows).T
    return Recording.from_samples(recording.name, time, position, effort, velocity)


def _spectrum(recording: Recording, slow: Fit) -> tuple[Array, Array]:
    """Return orders (k,) and the amplitude [N·m] that each would have, cogging not fitted."""
    pieces = [piece for piece in motions(recording) if piece.rows.size]
    plain = fit_jointly(pieces, Form('polynomial', 0, held=frozenset({'load_gain'})), slow.values)
    orders = np.arange(1.0, 40.0, 0.05)
    power = order_spectrum(pieces, plain.residual, orders)
    # A wave of amplitude a that passes whole explains a²/2 a sample.
    return orders, np.sqrt(2.0 * power / plain.residual.size)
