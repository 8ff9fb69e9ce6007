# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where the pads touch: the fit's minima over the contact angle, all of them.

    g∗u = J·(g″∗θ) + B·(g′∗θ) + g∗[Σ p_k·s^k + (C₀ + Σ c_k·s^k)·sat(ω/ω_s) + T_cog],
    s = max(θ − θ_c, 0)

With θ_c and ω_s held this is linear in everything else (c_k = C₁·p_k is let go free), so the
smallest sum of squares over θ_c costs one small least-squares problem an angle. As a function of
θ_c it has several minima: a load that begins early and rises late looks much like one that begins
late, and the waves of cogging add their own. A nonlinear fit that starts at one angle finds one
of them; here each minimum is a start (variable projection: Golub and Pereyra, 1973).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from engb_core.identify.confidence import Estimate
from engb_core.identify.giving_up import look_whether_to_give_up
from engb_core.identify.regression import Fit, fit
from engb_core.identify.regression_problem import Form, Problem
from engb_core.identify.smoothing import Motion

__all__ = ['contact_estimate', 'contact_profile', 'ContactProfile', 'fit_contacts']

Array = NDArray[np.float64]

# So many angles over the range; between two minima of a fit lie several strides of the samples.
ANGLES = 96

# The deepest minima are starts; the rest lies above them by more than a fit gains.
STARTS = 6

# A contact is told as found where the strokes give it to this part of the way from the lowest
# position to it: so exactly a clearance is set and a worn pad is noticed.
TOLERANCE = 0.02

# … and where of a hundred contacts told as found ninety-nine lie within that.
CONFIDENCE = 0.99


@dataclass(frozen=True)
class ContactProfile:
    """The smallest sum of squares at each contact angle.

    Attributes:
        angles: (k,) θ_c [rad], rising, even.
        squares: (k,) [(N·m)²].
        numbers: per angle the other numbers, by name.
    """

    angles: Array
    squares: Array
    numbers: list[dict[str, float]]

    def minima(self) -> list[int]:
        """Return the places of the local minima, the deepest first."""
        padded = np.concatenate([[np.inf], self.squares, [np.inf]])
        inner = padded[1:-1]
        places = np.flatnonzero((inner <= padded[:-2]) & (inner < padded[2:]))
        found: list[int] = places[np.argsort(self.squares[places])].tolist()
        return found


def fit_contacts(pieces: Sequence[Motion], plain: Fit) -> list[Fit]:
    """Return the fits with a contact angle, one a minimum, the best first.

    Args:
        pieces: the motions.
        plain: the fit without a contact; its form and ω_s are where these begin.
    """
    profile = contact_profile(pieces, plain.form, plain.values)
    form = replace(plain.form, contact=True)
    found: list[Fit] = []
    for place in profile.minima()[:STARTS]:
        new = fit(pieces, form, profile.numbers[place])
        # Several starts may end in one minimum.
        if all(abs(new.values['contact_angle'] - other.values['contact_angle'])
               > 0.1 * TOLERANCE * np.ptp(profile.angles) for other in found):
            found.append(new)
    return sorted(found, key=lambda entry: entry.rms)


def contact_estimate(fits: Sequence[Fit], lowest: float) -> Estimate:
    """Return the contact angle of the best of `fits`, told as determined or not.

    It is not where another minimum fits as well (χ² of one number), or where the interval is
    wider than TOLERANCE; `remark` then says which, and the deviation takes the rival in.

    Args:
        fits: of `fit_contacts`, the best first.
        lowest: the lowest position of the motions [rad], where the clearance is counted from.
    """
    best, *others = fits
    estimate = best.estimates['contact_angle']
    allowed = TOLERANCE * abs(estimate.value - lowest)
    limit = stats.chi2.ppf(CONFIDENCE, 1)
    rivals = [other.values['contact_angle'] for other in others
              if 2.0 * best.effective_samples * np.log(other.rms / best.rms) < limit
              and abs(other.values['contact_angle'] - estimate.value) > allowed]
    if rivals:
        farthest = max(rivals, key=lambda angle: abs(angle - estimate.value))
        told = ' and '.join(f'{angle:.3g}' for angle in rivals)
        return replace(estimate, std=float(np.hypot(estimate.std, farthest - estimate.value)),
                       determined=False, remark=f'not determined: {told} rad fits as well')
    low, high = estimate.interval(CONFIDENCE)
    if not 0.5 * (high - low) <= allowed:
        return replace(estimate, determined=False, remark='not determined to '
                       f'{100 * TOLERANCE:.0f} %: {low:.3g} … {high:.3g} at 99 %')
    return estimate


def contact_profile(pieces: Sequence[Motion], form: Form, values: Mapping[str, float],
                    angles: Array | None = None) -> ContactProfile:
    """Return the fit's sum of squares over the contact angle.

    Args:
        pieces: the motions.
        form: polynomial; its degree and cogging orders count.
        values: of a fit without contact; its ω_s ('saturation_velocity') is kept.
        angles: (k,) [rad]; None: even over what the motions cover.

    Returns:
        The profile; its numbers start the nonlinear fit at an angle.
    """
    problem = Problem(pieces, form)
    used = problem.pieces
    if angles is None:
        low = min(float(piece.position.min()) for piece in used)
        high = max(float(piece.position.max()) for piece in used)
        # At either end nothing lies beyond the contact, or nothing before it.
        angles = np.linspace(low, high, ANGLES + 2)[1:-1]
    width = values['saturation_velocity']
    shapes = [np.clip(piece.velocity / width, -1.0, 1.0) for piece in used]
    fixed = np.concatenate([
        np.column_stack([inertial, viscous, change, *piece.smooth(
            np.vstack([shape, *problem.waves(piece)]))])
        for piece, inertial, viscous, change, shape in zip(
            used, problem.inertial, problem.viscous, problem.change, shapes, strict=True)])
    measured = np.concatenate(problem.measured)
    axes, triangle = np.linalg.qr(fixed)
    target = measured - axes @ (axes.T @ measured)
    names = ('inertia', 'viscous_friction', 'lag', 'coulomb', *form.names[form.names.index(
        'saturation_velocity') + 1:])
    squares, numbers = np.empty(angles.size), []
    for place, angle in enumerate(angles.tolist()):
        look_whether_to_give_up()
        table = np.concatenate([_load_columns(piece, shape, angle, form.degree)
                                for piece, shape in zip(used, shapes, strict=True)])
        reach = np.abs(table).max(axis=0)
        reach[reach == 0.0] = 1.0
        scaled = table / reach
        rest = scaled - axes @ (axes.T @ scaled)
        found = np.linalg.lstsq(rest, target, rcond=1e-10)[0]
        if found[0] < 0.0:
            # A caliper pushes back from the first touch on: the best with p₁ ≥ 0 has p₁ = 0.
            found = np.r_[0.0, np.linalg.lstsq(rest[:, 1:], target, rcond=1e-10)[0]]
        left = target - rest @ found
        squares[place] = left @ left
        load = found / reach
        others = np.linalg.lstsq(triangle, axes.T @ (measured - table @ load), rcond=1e-12)[0]
        numbers.append(_numbers(load, others, names, table, form.degree, angle, width))
    return ContactProfile(angles, squares, numbers)


def _load_columns(piece: Motion, shape: Array, angle: float, degree: int) -> Array:
    """Return s^k and s^k·sat(ω/ω_s), k = 1…degree, through the kernel (m, 2·degree)."""
    beyond = np.maximum(piece.position - angle, 0.0)
    powers = np.cumprod(np.broadcast_to(beyond, (degree, beyond.size)), axis=0)
    return piece.smooth(np.concatenate([powers, powers * shape])).T


def _numbers(load: Array, others: Array, names: tuple[str, ...], table: Array, degree: int,
             angle: float, width: float) -> dict[str, float]:
    """Return one angle's numbers as the nonlinear fit starts from them."""
    found = dict(zip(names, others.tolist(), strict=True))
    found |= {f'p{power + 1}': float(load[power]) for power in range(degree)}
    # C₁ is what makes C₁·Σ p_k·s^k·sat nearest to Σ c_k·s^k·sat.
    wanted, unit = table[:, degree:] @ load[degree:], table[:, degree:] @ load[:degree]
    gain = float(wanted @ unit) / max(float(unit @ unit), 1e-300)
    return found | {'contact_angle': angle, 'load_gain': min(max(gain, 0.0), 1.0),
                    'coulomb': max(found['coulomb'], 0.0), 'saturation_velocity': width}
