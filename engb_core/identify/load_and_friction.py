# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Least squares of the load on a cubic and of friction on the load (steps 5, 6; (41), (42))."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from engb_core.identify.even_odd import EvenOdd
from engb_core.identify.smoothing import Motion

__all__ = ['FrictionFit', 'LoadFit', 'disturbance', 'fit_friction', 'fit_load']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LoadFit:
    """T_L(θ) = Σ coefficients[i]·θ^i [N·m]; `rms` [N·m] of what is left of the even part."""

    coefficients: tuple[float, ...]
    rms: float

    def torque(self, position: Array) -> Array:
        """Return T_L [N·m] at `position` [rad], any shape."""
        return np.asarray(np.polynomial.polynomial.polyval(position, self.coefficients), float)


@dataclass(frozen=True)
class FrictionFit:
    """T_C = (coulomb + load_gain·|T_L|)·sat(ω/saturation_velocity).

    `saturation_velocity` is 0 for the sign function of (42); `rms` [N·m] of what is left.
    """

    coulomb: float
    load_gain: float
    saturation_velocity: float
    rms: float


def disturbance(motion: Motion, inertia: float, viscous_friction: float) -> Array:
    """Return d̂ = q ∗ (Jω̇ + Bω − u) (n,) [N·m], equation (30), at the motion's samples.

    The low-pass q is the motion's own kernel, without phase shift: offline the observer need not
    lag behind the positions that its output is drawn over.

    Args:
        inertia: J [kg·m²].
        viscous_friction: B [N·m·s/rad].
    """
    return (inertia * motion.smooth_acceleration + viscous_friction * motion.smooth_velocity
            - motion.kernel.apply(motion.effort))


def fit_load(parts: EvenOdd, degree: int = 3) -> LoadFit:
    """Fit −d̂_even by a polynomial in θ, equation (41) with its powers and square mended."""
    scale = max(float(np.abs(parts.position).max()), 1e-12)
    design = (parts.position / scale)[:, None] ** np.arange(degree + 1)
    found = np.linalg.lstsq(design, -parts.even, rcond=None)[0]
    rms = float(np.sqrt(np.mean((parts.even + design @ found)**2)))
    return LoadFit(tuple((found / scale ** np.arange(degree + 1)).tolist()), rms)


def fit_friction(parts: EvenOdd, load: LoadFit, saturated: bool = True) -> FrictionFit:
    """Fit −d̂_odd by (C₀ + C₁·|T̂_L|)·sgn ω, equation (42), or with sat(ω/ω_s) for the sign.

    Args:
        parts: even and odd disturbance.
        load: the fit of step 5.
        saturated: search ω_s too (Figs. 15, 16); else the sign as printed (Fig. 14).
    """
    torque = np.abs(load.torque(parts.position))

    def fit(width: float) -> tuple[Array, float]:
        shape = (np.sign(parts.velocity) if width == 0.0
                 else np.clip(parts.velocity / width, -1.0, 1.0))
        design = np.column_stack([shape, shape * torque])
        found: Array = np.linalg.lstsq(design, -parts.odd, rcond=None)[0].astype(float)
        return found, float(np.sqrt(np.mean((parts.odd + design @ found)**2)))

    width = 0.0
    if saturated:
        fastest = float(np.abs(parts.velocity).max())
        slowest = max(float(np.abs(parts.velocity).min()), 1e-4 * fastest)
        trial = np.geomspace(slowest, 0.7 * fastest, 40)
        best = int(np.argmin([fit(value)[1] for value in trial]))
        bounds = np.log(trial[max(best - 1, 0)]), np.log(trial[min(best + 1, trial.size - 1)])
        width = float(np.exp(minimize_scalar(
            lambda value: fit(np.exp(value))[1], bounds=bounds, method='bounded').x))
    found, rms = fit(width)
    return FrictionFit(float(found[0]), float(found[1]), width, rms)
