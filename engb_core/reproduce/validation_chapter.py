"""Chapter 4: tracking with and without the model, what disturbance is left, offset under PD."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from engb_core.identify.paper_way import paper_way
from engb_core.identify.procedure import IdentifiedModel
from engb_core.identify.smoothing import motions
from engb_core.recording import Recording
from engb_core.reproduce.plan import PLAN

__all__ = ['analyse_validation', 'Left', 'Offset', 'Tracking', 'ValidationResult']

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
    """Chapter 4: `tracking` by experiment name, `left` of two runs, `offsets` under PD, and
    `sticking_offsets` on a brake that sticks."""

    tracking: dict[str, Tracking]
    left: list[Left]
    offsets: list[Offset]
    sticking_offsets: list[Offset]


def analyse_validation(recordings: Mapping[str, Recording],
                       identified: IdentifiedModel) -> ValidationResult:
    """Analyse the runs of chapter 4."""
    names = ('middle_pid', 'middle_feedforward', 'high_pid', 'high_feedforward', 'model_1',
             'model_2', 'pd_model', 'pd_sticking')
    tracking = {name: track(recordings[name]) for name in names}
    left = [left_over(recordings[name], identified) for name in ('model_1', 'model_2')]
    return ValidationResult(tracking, left, _offsets(tracking['pd_model']),
                            _offsets(tracking['pd_sticking']))


def track(recording: Recording) -> Tracking:
    """Compare position and reference.

    The reference is published every few cycles; between two messages it is the cubic of their
    positions and velocities.
    """
    reference = recording.reference
    spline = CubicHermiteSpline(reference.time, reference.position, reference.velocity)
    inside = ((recording.time >= reference.time[0]) & (recording.time <= reference.time[-1]))
    time = recording.time[inside]
    wanted = spline(time)
    error = wanted - recording.position[inside]
    moving = np.abs(spline(time, 1)) > 0.1
    part = error[moving] if moving.any() else error
    return Tracking(recording.name, time, wanted, recording.position[inside], error,
                    float(np.abs(part).max()), float(np.sqrt(np.mean(part**2))))


def left_over(recording: Recording, identified: IdentifiedModel) -> Left:
    """Part the disturbance that the model leaves into even and odd, as step 4 does."""
    model = identified.model
    pieces = motions(recording)
    before = paper_way(pieces, model)
    known = []
    for piece, observed in zip(pieces, before.disturbance, strict=True):
        torque = identified.load_torque(piece.position) + identified.friction_torque(
            piece.position, piece.velocity)
        known.append(observed + piece.kernel.apply(torque))
    after = paper_way(pieces, model, observed=known)
    load = identified.load_torque(after.parts.position)
    return Left(recording.name, after.parts.position, after.parts.even, after.parts.odd,
                before.parts.even, before.parts.odd, load)


def _offsets(tracking: Tracking) -> list[Offset]:
    table = next(entry.table for entry in PLAN if entry.name == 'pd_model')
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
