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
    by_nearest_neighbour,
    by_sample_number,
    reference_grid,
    Resampled,
)
from engb_core.identify.smoothing import Motion
from engb_core.identify.strokes import find_strokes, Stroke
from engb_core.model import Friction, LoadTorque, Model

__all__ = ['load_degree', 'paper_way', 'PaperResult', 'stroke_data']

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


def stroke_data(piece: Motion, stroke: Stroke, values: Array) -> tuple[
        tuple[Array, Array, Array], tuple[Array, Array, Array]]:
    """Return position, `values`, velocity of the stroke's clamp and of its release."""
    def of(samples: NDArray[np.int64]) -> tuple[Array, Array, Array]:
        return piece.position[samples], values[samples], piece.smooth_velocity[samples]
    return of(stroke.clamp), of(stroke.release)


def paper_way(pieces: Sequence[Motion], start: Model, resampling: str = 'nearest',
              points: int = GRID_POINTS, observed: list[Array] | None = None) -> PaperResult:
    """Do steps 2 to 6 as the paper has them.

    Args:
        pieces: the motions.
        start: the nominal model, for J, B and known cogging.
        resampling: 'nearest' (the paper), 'interpolated', or 'sample' (no step 3).
        points: M, the size of a stroke's grid θ_R.
        observed: d̂ of each motion (n,) [N·m], in place of step 2.

    Raises:
        InputError: no strokes.
    """
    strokes = find_strokes(pieces)
    if observed is None:
        observed = [disturbance(piece, start.motor.inertia, start.motor.viscous_friction)
                    + _known_cogging(piece, start) for piece in pieces]
    resampled = []
    for stroke in strokes:
        clamp, release = stroke_data(pieces[stroke.motion], stroke, observed[stroke.motion])
        size = min(points, min(clamp[0].size, release[0].size) - 1)
        if resampling == 'sample':
            resampled.append(by_sample_number(size, clamp, release))
            continue
        grid = reference_grid(clamp[0], release[0], size)
        way = by_interpolation if resampling == 'interpolated' else by_nearest_neighbour
        resampled.append(way(grid, clamp, release))
    parts = join([decompose(data) for data in resampled])
    load = fit_load(parts, load_degree(start))
    return PaperResult(strokes, observed, resampled, parts, load,
                       fit_friction(parts, load, saturated=False), fit_friction(parts, load))


def _known_cogging(piece: Motion, start: Model) -> Array:
    # d̂ holds −T_cog; what the start model knows of it is taken out before load and friction.
    wave = np.zeros(piece.time.size)
    for entry in start.cogging:
        wave += entry.amplitude * np.sin(entry.order * piece.position + entry.phase)
    return piece.kernel.apply(wave)


def load_degree(start: Model) -> int:
    """Return the degree of the load's polynomial: the paper's cubic, or the start model's."""
    return min(max(3, len(start.load_torque.coefficients) - 1), 6)
