# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How far each way of identifying is from the truth, on one recording and over noise seeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.causal_observer import observe_causally
from engb_core.identify.load_and_friction import FrictionFit
from engb_core.identify.paper_way import observe, paper_way
from engb_core.identify.procedure import identify
from engb_core.identify.smoothing import Motion, moving_pieces
from engb_core.identify.strokes import find_strokes, Stroke
from engb_core.model import Friction, Model
from engb_core.recording import Recording
from engb_core.reproduce.in_process import run_experiment
from engb_core.reproduce.nominal_chapter import NominalResult
from engb_core.reproduce.plan import Experiment
from engb_core.reproduce.truth import ANGLES, Truth

__all__ = ['Bias', 'biases', 'coarse', 'CUTOFFS', 'mirror_centres', 'over_seeds', 'Spread']

Array = NDArray[np.float64]

# Encoder and clock of the "low precision" that the paper complains of.
COARSE_COUNTS = 100
COARSE_INTERVAL = 0.01

# −3 dB points over which the causal observer is swept [Hz]; 20 is the node's.
CUTOFFS = (20.0, 10.0, 5.0)


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
class Spread:
    """The biases of one way on recordings that differ in their noise only.

    Attributes:
        recording, way: as in `Bias`.
        each: one Bias a seed.
    """

    recording: str
    way: str
    each: tuple[Bias, ...]

    def mean(self, name: str) -> float:
        """Return the mean of one of Bias' numbers over the seeds."""
        return float(np.mean([getattr(entry, name) for entry in self.each]))

    def deviation(self, name: str) -> float:
        """Return its standard deviation over the seeds; 0 of one seed."""
        values = [getattr(entry, name) for entry in self.each]
        return float(np.std(values, ddof=1)) if len(values) > 1 else 0.0


def coarse(recording: Recording) -> Recording:
    """Return the recording as a coarse encoder and a slow clock would have given it."""
    every = max(1, round(COARSE_INTERVAL / recording.interval))
    count = 2.0 * np.pi / COARSE_COUNTS
    position = np.round(recording.position[::every] / count) * count
    return replace(recording, name=f'{recording.name}, {1.0 / COARSE_INTERVAL:.0f} Hz and '
                   f'{COARSE_COUNTS} counts', time=recording.time[::every], position=position,
                   effort=recording.effort[::every], velocity=None)


def mirror_centres(recording: Recording, pieces: Sequence[Motion],
                   strokes: Sequence[Stroke]) -> list[float]:
    """Return for each stroke the time about which its reference mirrors [s]: the middle of the
    stop between clamping and releasing. A recording without reference has none."""
    reference = recording.reference
    if reference is None:
        return []
    centres = []
    for stroke in strokes:
        piece = pieces[stroke.motion]
        inside = ((reference.time >= piece.time[stroke.clamp[0]])
                  & (reference.time <= piece.time[stroke.release[-1]]))
        time, position = reference.time[inside], reference.position[inside]
        top = time[position >= position.max() - 1e-6]
        centres.append(0.5 * float(top[0] + top[-1]))
    return centres


def biases(recording: Recording, nominal: NominalResult, truth: Truth) -> list[Bias]:
    """Return the bias of each way on one recording.

    Args:
        recording: strokes.
        nominal: of the same brake's free motor.
        truth: the brake.
    """
    pieces = moving_pieces([recording])
    classical = nominal.classical
    causal = {(cutoff, delayed): [observe_causally(piece, classical, recording, cutoff, delayed)
                                  for piece in pieces]
              for cutoff in CUTOFFS for delayed in (False, True)}
    ways: list[tuple[str, dict[str, Any], Model]] = [
        (f'causal observer, {cutoff:g} Hz', {'observed': causal[cutoff, False]}, classical)
            for cutoff in CUTOFFS]
    ways += [(f'causal observer, {cutoff:g} Hz, position through q too',
              {'observed': causal[cutoff, True]}, classical) for cutoff in CUTOFFS]
    ways += [('no phase shift', {}, classical),
             ('no phase shift, 40 grid points', {'points': 40}, classical),
             ('no phase shift, interpolated', {'resampling': 'interpolated'}, classical),
             ('no phase shift, J and B of the joint regression', {}, nominal.nominal)]
    centres = mirror_centres(recording, pieces, find_strokes(pieces))
    if centres:
        ways.insert(0, ('no phase shift, paired by the reference’s time',
                        {'resampling': 'mirrored', 'centres': centres}, classical))
    found = []
    for label, options, start in ways:
        options.setdefault('observed', [observe(piece, start) for piece in pieces])
        result = paper_way(pieces, start, **options)
        mismatch = np.concatenate([data.position_mismatch for data in result.resampled])
        found.append(_bias(recording.name, label, result.load.torque(ANGLES), result.friction,
                           truth, _rms(mismatch)))
    for label, start, prior in (
            ('joint regression, alone', classical, None),
            ('joint regression, J, B and cogging known from the free motor', nominal.nominal,
             nominal.prior)):
        joint = identify([recording], start, prior=prior)
        found.append(_bias(recording.name, label, joint.load_torque(ANGLES),
                           joint.model.friction, truth, np.nan))
    return found


def over_seeds(experiments: Sequence[Experiment], recorded: Sequence[Recording],
               nominal: NominalResult, truth: Truth, seeds: int,
               tell: Callable[[str], None]) -> list[Spread]:
    """Return the biases of each way on each experiment over several noise seeds.

    Args:
        experiments: runs of strokes; the last one is looked at as a coarse encoder has it, too.
        recorded: their recordings, the first seed.
        nominal: of the same brake's free motor; the loop's model is its classical one.
        truth: the brake.
        seeds: how many in all; those after the first are run in this process.
        tell: called with one line of text per seed.
    """
    each: dict[tuple[str, str], list[Bias]] = {}
    for seed in range(seeds):
        tell(f'each way on noise seed {seed + 1} of {seeds}')
        runs = list(recorded) if seed == 0 else [
            run_experiment(experiment, nominal.classical, 1000 + seed)
            for experiment in experiments]
        for recording in (*runs, coarse(runs[-1])):
            for entry in biases(recording, nominal, truth):
                each.setdefault((entry.recording, entry.way), []).append(entry)
    return [Spread(recording, way, tuple(entries))
            for (recording, way), entries in each.items()]


def _bias(recording: str, way: str, load: Array, friction: FrictionFit | Friction, truth: Truth,
          mismatch: float) -> Bias:
    true = truth.model.friction
    return Bias(recording, way, _rms(load - truth.load), friction.coulomb - true.coulomb,
                friction.load_gain - true.load_gain, mismatch)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
