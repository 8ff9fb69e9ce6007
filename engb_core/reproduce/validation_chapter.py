# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Chapter 4: tracking with and without the model, what disturbance is left, offset under PD."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from engb_core.control.feedforward import Feedforward
from engb_core.errors import InputError
from engb_core.identify.paper_way import observe, paper_way
from engb_core.identify.smoothing import moving_pieces
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.reproduce.plan import Experiment, OBSERVER_CUTOFFS

__all__ = ['analyse_validation', 'compensated_share', 'Left', 'Offset', 'Tracking',
           'ValidationResult', 'worst_offset']

Array = NDArray[np.float64]

# At the end of each rest so much is averaged for the steady offset [s].
SETTLED = 0.2


@dataclass(frozen=True)
class Tracking:
    """One run's tracking: `time` [s], `wanted`, `position`, `error` = wanted − position (n,)
    [rad]; `largest`, `rms` [rad] of the error while the reference moves."""

    name: str
    time: Array
    wanted: Array
    position: Array
    error: Array
    largest: float
    rms: float


@dataclass(frozen=True)
class Left:
    """What disturbance is left in one run once the model is taken off.

    Attributes:
        name: of the run.
        position: (m,) [rad].
        even, odd: (m,) [N·m] with the sign of d̂; `even_before`, `odd_before` before the model's
            torque is taken off.
        load: (m,) [N·m] the model's load, for the abscissa.
    """

    name: str
    position: Array
    even: Array
    odd: Array
    even_before: Array
    odd_before: Array
    load: Array

    def rms(self, part: str) -> float:
        """Return the rms of 'even', 'odd', 'even_before' or 'odd_before' [N·m]."""
        return float(np.sqrt(np.mean(getattr(self, part)**2)))


@dataclass(frozen=True)
class Offset:
    """Steady offset at one stop: `angle` [rad] wanted, `error` [rad]."""

    angle: float
    error: float


@dataclass(frozen=True)
class ValidationResult:
    """Chapter 4.

    Attributes:
        tracking: by experiment name.
        left: of two runs once the paper's model is taken off, `joint_left` the joint one.
        offsets: under PD with the paper's model, `joint_offsets` with the joint one.
    """

    tracking: dict[str, Tracking]
    left: list[Left]
    joint_left: list[Left]
    offsets: list[Offset]
    joint_offsets: list[Offset]

    def ratio(self, load: str, way: str, kind: str) -> float:
        """Return rms error with PID alone over that with a model.

        Args:
            load: 'middle' or 'high'.
            way: 'paper' or 'joint'.
            kind: of gains, 'poor' or 'good'.
        """
        return (self.tracking[f'{load}_pid_{kind}'].rms
                / self.tracking[f'{load}_{way}_{kind}'].rms)


def analyse_validation(recordings: Mapping[str, Recording], experiments: Mapping[str, Experiment],
                       paper: Model, joint: Model) -> ValidationResult:
    """Analyse the runs of chapter 4.

    Args:
        recordings, experiments: by name.
        paper, joint: the model identified the paper's way and by joint regression.
    """
    names = [f'{load}_{way}_{kind}' for load in ('middle', 'high')
             for way in ('pid', 'paper', 'joint') for kind in ('poor', 'good')]
    names += [f'observer_{cutoff:g}' for cutoff in OBSERVER_CUTOFFS]
    names += ['model_1', 'model_2', 'pd_paper', 'pd_joint']
    tracking = {name: track(recordings[name]) for name in names}
    left, joint_left = ([left_over(recordings[name], model) for name in ('model_1', 'model_2')]
                        for model in (paper, joint))
    offsets, joint_offsets = (_offsets(tracking[name], experiments[name])
                              for name in ('pd_paper', 'pd_joint'))
    return ValidationResult(tracking, left, joint_left, offsets, joint_offsets)


def track(recording: Recording) -> Tracking:
    """Compare position and reference.

    The reference is published every few cycles; between two messages it is the cubic of their
    positions and velocities.
    """
    reference = recording.reference
    if reference is None or reference.velocity is None:
        raise InputError(f'{recording.name}: no reference recorded; record the topic reference')
    spline = CubicHermiteSpline(reference.time, reference.position, reference.velocity)
    inside = ((recording.time >= reference.time[0]) & (recording.time <= reference.time[-1]))
    time = recording.time[inside]
    wanted = spline(time)
    error = wanted - recording.position[inside]
    moving = np.abs(spline(time, 1)) > 0.1
    part = error[moving] if moving.any() else error
    return Tracking(recording.name, time, wanted, recording.position[inside], error,
                    float(np.abs(part).max()), float(np.sqrt(np.mean(part**2))))


def left_over(recording: Recording, model: Model) -> Left:
    """Part the disturbance that the model leaves into even and odd, as step 4 does."""
    pieces = moving_pieces([recording])
    observed = [observe(piece, model) for piece in pieces]
    before = paper_way(pieces, model, observed=observed)
    torques = Feedforward(model)
    known = []
    for piece, seen in zip(pieces, observed, strict=True):
        loads = np.array([torques.load_torque(angle) for angle in piece.position.tolist()])
        friction = np.array([torques.friction_torque(*pair) for pair in zip(
            loads.tolist(), piece.velocity.tolist(), strict=True)])
        known.append(replace(seen, disturbance=seen.disturbance
                             + piece.kernel.apply(loads + friction)))
    after = paper_way(pieces, model, observed=known)
    load = np.array([torques.load_torque(angle) for angle in after.parts.position.tolist()])
    return Left(recording.name, after.parts.position, after.parts.even, after.parts.odd,
                before.parts.even, before.parts.odd, load)


def _offsets(tracking: Tracking, experiment: Experiment) -> list[Offset]:
    table = experiment.table
    if table is None:
        raise InputError(f'{experiment.name}: has no table of stops')
    still = np.flatnonzero(np.abs(np.gradient(table.position, table.time)) < 1e-9)
    groups = np.split(still, np.flatnonzero(np.diff(still) > 1) + 1)
    # The recording's reference starts a moment after its first sample; both rests are known.
    begin = tracking.time[np.flatnonzero(np.abs(tracking.wanted - tracking.wanted[0]) > 1e-6)[0]]
    moved = table.time[np.flatnonzero(np.abs(table.position - table.position[0]) > 1e-6)[0]]
    shift = begin - moved
    offsets = []
    for group in groups[1:]:
        end = table.time[group[-1]] + shift
        part = (tracking.time > end - SETTLED) & (tracking.time < end)
        if part.any():
            offsets.append(Offset(float(tracking.wanted[part].mean()),
                                  float(tracking.error[part].mean())))
    return offsets


def compensated_share(left: Left) -> tuple[float, float]:
    """Return which part of the even and the odd disturbance is left, rms over rms."""
    return left.rms('even') / left.rms('even_before'), left.rms('odd') / left.rms('odd_before')


def worst_offset(offsets: list[Offset]) -> float:
    """Return the largest steady offset [rad]."""
    return max(abs(entry.error) for entry in offsets)
