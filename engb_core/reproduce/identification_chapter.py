"""Section 3.1: the strokes identified the paper's way and jointly, and how far each is off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.identify.load_and_friction import FrictionFit
from engb_core.identify.paper_way import paper_way, PaperResult
from engb_core.identify.procedure import IdentifiedModel, identify
from engb_core.identify.smoothing import Motion, motions
from engb_core.model import Friction
from engb_core.recording import Recording
from engb_core.reproduce import chosen
from engb_core.reproduce.nominal_chapter import NominalResult

__all__ = ['analyse_strokes', 'Bias', 'biases', 'StrokesResult', 'tracking_mismatch']

Array = NDArray[np.float64]

# Encoder and clock of the "low precision" that the paper complains of.
COARSE_COUNTS = 100
COARSE_INTERVAL = 0.01


@dataclass(frozen=True)
class Bias:
    """How far a way of identifying is from the truth, on one recording.

    Attributes:
        recording: what it was fed with.
        way: how it was identified.
        load: rms of T̂_L − T_L over the stroke [N·m].
        coulomb: Ĉ₀ − C₀ [N·m].
        load_gain: Ĉ₁ − C₁ [-].
        mismatch: rms distance between paired positions [rad]; NaN where nothing is paired.
    """

    recording: str
    way: str
    load: float
    coulomb: float
    load_gain: float
    mismatch: float


@dataclass(frozen=True)
class StrokesResult:
    """The identification of the good and of the poorly tracked strokes.

    Attributes:
        good, poor: identified from 'strokes' and 'strokes_poor'.
        true_load: T_L of the simulated brake at `angles` [N·m].
        angles: [rad].
        biases: of each way on each recording.
    """

    good: IdentifiedModel
    poor: IdentifiedModel
    angles: Array
    true_load: Array
    biases: list[Bias]


def analyse_strokes(recordings: Mapping[str, Recording], nominal: NominalResult) -> StrokesResult:
    """Identify from 'strokes' and 'strokes_poor', starting from the nominal plant."""
    good = identify([recordings['strokes']], nominal.nominal, prior=nominal.prior)
    poor = identify([recordings['strokes_poor']], nominal.nominal, prior=nominal.prior)
    angles = np.linspace(0.5, 19.5, 300)
    found = []
    for recording in (recordings['strokes'], recordings['strokes_poor'],
                      coarse(recordings['strokes_poor'])):
        found.extend(biases(recording, nominal, angles))
    return StrokesResult(good, poor, angles, true_load(angles), found)


def true_load(angles: Array) -> Array:
    """Return the simulated brake's T_L [N·m] with the disc standing."""
    load = chosen.true_brake().load_torque
    beyond = np.maximum(angles - load.contact_angle, 0.0)
    return np.polynomial.polynomial.polyval(beyond, load.coefficients)


def coarse(recording: Recording) -> Recording:
    """Return the recording as a coarse encoder and a slow clock would have given it."""
    every = max(1, round(COARSE_INTERVAL / recording.interval))
    count = 2.0 * np.pi / COARSE_COUNTS
    position = np.round(recording.position[::every] / count) * count
    return replace(recording, name=f'{recording.name}, {1.0 / COARSE_INTERVAL:.0f} Hz and '
                   f'{COARSE_COUNTS} counts', time=recording.time[::every], position=position,
                   effort=recording.effort[::every], velocity=None)


def biases(recording: Recording, nominal: NominalResult, angles: Array) -> list[Bias]:
    """Return the bias of each way on one recording, against the simulated brake's truth."""
    pieces = motions(recording)
    expected = true_load(angles)
    found = []
    for label, way, points, start in (
            ('samples paired by number', 'sample', 400, nominal.nominal),
            ('nearest neighbour, 400 points', 'nearest', 400, nominal.nominal),
            ('nearest neighbour, 40 points', 'nearest', 40, nominal.nominal),
            ('nearest neighbour, J and B of the classical step test', 'nearest', 400,
             nominal.classical),
            ('interpolated, 400 points', 'interpolated', 400, nominal.nominal)):
        result = paper_way(pieces, start, way, points)
        mismatch = np.concatenate([data.position_mismatch for data in result.resampled])
        found.append(_bias(recording.name, label, result.load.torque(angles) - expected,
                           result.friction, _rms(mismatch)))
    for label, start, prior in (
            ('joint regression, alone', nominal.classical, None),
            ('joint regression, J, B and cogging known from the free motor', nominal.nominal,
             nominal.prior)):
        joint = identify([recording], start, prior=prior)
        found.append(_bias(recording.name, label, joint.load_torque(angles) - expected,
                           joint.model.friction, np.nan))
    return found


def _bias(recording: str, way: str, load: Array, friction: FrictionFit | Friction,
          mismatch: float) -> Bias:
    truth = chosen.true_brake().friction
    return Bias(recording, way, _rms(load), friction.coulomb - truth.coulomb,
                friction.load_gain - truth.load_gain, mismatch)


def tracking_mismatch(pieces: list[Motion], result: PaperResult,
                      stroke: int) -> tuple[Array, Array]:
    """Return clamp positions and reversed release positions of a stroke by sample number (Fig. 7),
    both (n,) [rad]."""
    entry = result.strokes[stroke]
    motion = pieces[entry.motion]
    if not entry.clamp.size:
        raise InputError('the stroke holds no sample')
    size = min(entry.clamp.size, entry.release.size)
    return motion.position[entry.clamp[:size]], motion.position[entry.release[::-1][:size]]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
