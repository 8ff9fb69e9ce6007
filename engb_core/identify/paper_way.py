# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Steps 2 to 6 of the identification as the paper has them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.even_odd import decompose, EvenOdd, join
from engb_core.identify.load_and_friction import (
    disturbance,
    fit_friction,
    fit_load,
    FrictionFit,
    LoadFit,
)
from engb_core.identify.resampling import (
    by_interpolation,
    by_mirrored_time,
    by_nearest_neighbour,
    reference_grid,
    Resampled,
)
from engb_core.identify.smoothing import Motion
from engb_core.identify.strokes import find_strokes, Stroke
from engb_core.model import Friction, LoadTorque, Model

__all__ = ['known_cogging', 'load_degree', 'observe', 'Observed', 'paper_way', 'PaperResult']

Array = NDArray[np.float64]

# M of equation (32): far fewer than a stroke's samples, far more than a cubic's wiggles.
GRID_POINTS = 400


@dataclass(frozen=True)
class PaperResult:
    """Steps 2 to 6 as the paper has them; lists are one entry per stroke.

    `sign_friction` is (42) as printed, `friction` with the saturation for the sign (Fig. 16).
    """

    strokes: list[Stroke]
    disturbance: list[Array]
    resampled: list[Resampled]
    parts: EvenOdd
    load: LoadFit
    sign_friction: FrictionFit
    friction: FrictionFit

    def model(self, start: Model) -> Model:
        """Return `start` with the paper's way's load and friction."""
        velocity = self.friction.saturation_velocity
        return replace(
            start, load_torque=LoadTorque('polynomial', self.load.coefficients),
            friction=Friction(self.friction.coulomb, self.friction.load_gain, velocity))


@dataclass(frozen=True)
class Observed:
    """One motion's lumped disturbance and what it is drawn over, (n,) each at its samples.

    `disturbance` d̂ [N·m]; `position` [rad] and `velocity` [rad/s].
    """

    disturbance: Array
    position: Array
    velocity: Array

    def at(self, samples: NDArray[np.int64]) -> tuple[Array, Array, Array]:
        """Return position, d̂ and velocity of these samples."""
        return self.position[samples], self.disturbance[samples], self.velocity[samples]


def observe(piece: Motion, start: Model) -> Observed:
    """Do step 2 without phase shift: d̂ through the motion's own kernel, over its positions.

    Offline the observer need not lag behind the positions that its output is drawn over; the
    paper's does (`causal_observer`).
    """
    return Observed(disturbance(piece, start.motor.inertia, start.motor.viscous_friction)
                    + piece.kernel.apply(known_cogging(piece, start)),
                    piece.position, piece.smooth_velocity)


def paper_way(pieces: Sequence[Motion], start: Model, resampling: str = 'nearest',
              points: int = GRID_POINTS, observed: Sequence[Observed] | None = None,
              centres: Sequence[float] = ()) -> PaperResult:
    """Do steps 2 to 6 as the paper has them.

    Args:
        pieces: the motions.
        start: the nominal model, for J, B and known cogging.
        resampling: 'nearest' (the paper), 'interpolated', or 'mirrored': no step 3, samples are
            paired by the reference's time.
        points: M, the size of a stroke's grid θ_R.
        observed: each motion's d̂, in place of step 2.
        centres: for 'mirrored', the time of each stroke about which its reference mirrors [s].

    Raises:
        InputError: no strokes.
    """
    strokes = find_strokes(pieces)
    if observed is None:
        observed = [observe(piece, start) for piece in pieces]
    resampled = []
    for number, stroke in enumerate(strokes):
        seen = observed[stroke.motion]
        clamp, release = seen.at(stroke.clamp), seen.at(stroke.release)
        size = min(points, min(clamp[0].size, release[0].size) - 1)
        if resampling == 'mirrored':
            everything = seen.at(np.arange(seen.position.size))
            resampled.append(by_mirrored_time(size, pieces[stroke.motion].time, stroke.clamp,
                                              everything, centres[number]))
            continue
        grid = reference_grid(clamp[0], release[0], size)
        way = by_interpolation if resampling == 'interpolated' else by_nearest_neighbour
        resampled.append(way(grid, clamp, release))
    parts = join([decompose(data) for data in resampled])
    load = fit_load(parts, load_degree(start))
    return PaperResult(strokes, [entry.disturbance for entry in observed], resampled, parts, load,
                       fit_friction(parts, load, saturated=False), fit_friction(parts, load))


def known_cogging(piece: Motion, start: Model) -> Array:
    """Return the start model's T_cog (n,) [N·m] at the motion's samples.

    d̂ holds −T_cog; what is known of it is taken out before load and friction.
    """
    wave = np.zeros(piece.time.size)
    for entry in start.cogging:
        wave += entry.amplitude * np.sin(entry.order * piece.position + entry.phase)
    return wave


def load_degree(start: Model) -> int:
    """Return the degree of the load's polynomial: the paper's cubic, or the start model's."""
    return min(max(3, len(start.load_torque.coefficients) - 1), 6)
