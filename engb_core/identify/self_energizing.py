# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Self-energizing gain and pad friction from runs with the disc standing and turning (ch. 5).

P is the even disturbance with the disc turning over that with it standing, at equal motor angle
and so at equal clamp force (43). (44) is printed upside down: torques stand as
P = ((d/r) − μ)/(d/r), so μ = (d/r)·(1 − P).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.identify.confidence import Estimate
from engb_core.identify.contact import fit_contacts
from engb_core.identify.even_odd import EvenOdd
from engb_core.identify.load_and_friction import LoadFit
from engb_core.identify.procedure import IdentifiedModel
from engb_core.identify.regression import fit
from engb_core.mechanism.kinematics import Mechanism
from engb_core.mechanism.statics import pad_friction

__all__ = ['compare_paper_way', 'fit_together', 'SelfEnergizing']

Array = NDArray[np.float64]

# The mean slope dy_p/dx_p of the wedge is known to about this part of itself: tolerances of the
# gear, and its change over the stroke that one number can't follow.
WEDGE_TOLERANCE = 0.01

# Over so many angles, evenly, a ratio of loads is taken.
ANGLES = 200

# The slope falls nearly in a straight line over the stroke.
WEDGE_DEGREE = 3


@dataclass(frozen=True)
class SelfEnergizing:
    """P [-] and pad friction μ [-]; μ > 0 where the disc helps, < 0 where it hinders."""

    gain: Estimate
    pad_friction: Estimate


def compare_paper_way(standing: LoadFit, turning: EvenOdd, wedge: float,
                      samples_per_pair: float = 1.0) -> SelfEnergizing:
    """Fit (43): the standing disc's cubic times P to the turning disc's even disturbance.

    Args:
        standing: the load fit with the disc at rest.
        turning: even and odd disturbance with the disc turning.
        wedge: d/r [-].
        samples_per_pair: resampled points that hold one independent value; the intervals widen
            by its square root.
    """
    shape = standing.torque(turning.position)
    gain = float(shape @ -turning.even / (shape @ shape))
    misfit = -turning.even - gain * shape
    variance = float(misfit @ misfit) / max(misfit.size - 1, 1) / float(shape @ shape)
    return _result(gain, float(np.sqrt(variance * samples_per_pair)), wedge,
                   misfit.size / samples_per_pair - 1)


def fit_together(standing: IdentifiedModel, turning: IdentifiedModel, mechanism: Mechanism,
                 prior: Mapping[str, Estimate] | None = None,
                 tolerance: float = WEDGE_TOLERANCE) -> SelfEnergizing:
    """Return P and μ from one regression of both runs: one load curve T_L, and

        T_L(θ)·(w(θ) − μ)/w(θ)

    with the disc turning, (44) corrected for the wedge's slope w(θ). Two fits would each miss a
    real caliper's curve in their own way, by more than their ratio may be off, and would each have
    to find the contact. P stands at the wedge's mean slope, each angle counted by the square of
    its load, as (43) fits it.

    Args:
        standing, turning: identified from runs whose recordings have different names.
        mechanism: whose wedge presses.
        prior: as in `identify`.
        tolerance: of the wedge's slope, as a part of itself.

    Raises:
        InputError: a load that is no polynomial, or recordings of one name.
    """
    name = turning.pieces[0].name
    first = standing.regression
    if first.form.load != 'polynomial':
        raise InputError('the self-energizing gain needs a load of form polynomial')
    if any(piece.name == name for piece in standing.pieces):
        raise InputError(f'both recordings are called {name}; name them differently')
    # A pad touches somewhere, whether or not the curve calls for it; where, is then part of what
    # is not known.
    if not first.form.contact:
        first = fit_contacts(standing.pieces, first)[0]
    covered = turning.paper.parts.position
    angles = np.linspace(float(covered.min()), float(covered.max()), ANGLES)
    load = first.load(angles)[0]
    wedge = mechanism.posture(angles).wedge
    mean = float(load @ load / (load**2 @ (1.0 / wedge)))
    slope = np.polynomial.polynomial.polyfit(angles, mean / wedge, WEDGE_DEGREE)
    ratio = float(load @ turning.load_torque(angles) / (load @ load))
    found = fit([*standing.pieces, *turning.pieces],
                replace(first.form, turning=name, slope=tuple(slope.tolist())),
                first.values | {'load_ratio': ratio}, prior)
    gain = found.estimates['load_ratio']
    return _result(gain.value, gain.std, mean, gain.degrees_of_freedom, tolerance)


def _result(gain: float, deviation: float, wedge: float, freedom: float,
            tolerance: float = WEDGE_TOLERANCE) -> SelfEnergizing:
    friction, by_gain = pad_friction(gain, wedge, deviation)
    uncertainty = float(np.hypot(by_gain, tolerance * friction))
    return SelfEnergizing(Estimate(gain, deviation, '-', True, max(freedom, 1.0)),
                          Estimate(friction, uncertainty, '-', True, max(freedom, 1.0)))
