# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The nominal plant T_M = J·ω̇ + B·ω (25): step tests and sine sweeps of the unloaded motor.

Both the classical readings, which take the motor for linear (what the paper did, Fig. 6), and
the joint regression, which knows Coulomb friction. Position and current can give J/K_T and B/K_T
only; K_T itself takes a second run with a known inertia added (`torque_constant`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.optimize import curve_fit

from engb_core.errors import InputError
from engb_core.identify.cogging import find_orders
from engb_core.identify.confidence import Estimate
from engb_core.identify.regression import Fit, fit, Form
from engb_core.identify.smoothing import Motion, motions, moving_pieces
from engb_core.model import Model
from engb_core.recording import Recording

__all__ = ['fit_free_motor', 'fit_response', 'fit_steps', 'frequency_response',
           'FrequencyResponse', 'LinearFit', 'StepFit', 'torque_constant']

Array = NDArray[np.float64]

# Below this coherence a frequency says more of noise and friction than of the plant.
LEAST_COHERENCE = 0.8

# A step of the effort is at least this part of its range.
LEAST_STEP = 0.2

# A step must be held this long to show a time constant [s].
SHORTEST_STEP = 0.15


@dataclass(frozen=True)
class StepFit:
    """One step of the torque and the first-order response fitted to it.

    Attributes:
        time: (n,) [s] from the step.
        velocity, fitted: (n,) [rad/s] measured and ω(t) = ω_∞ + (ω_0 − ω_∞)·exp(−t·B/J).
        effort: [N·m] held after the step.
        inertia, viscous_friction: J [kg·m²], B [N·m·s/rad] of this step.
        time_constant: J/B [s].
    """

    time: Array
    velocity: Array
    fitted: Array
    effort: float
    inertia: float
    viscous_friction: float
    time_constant: float


@dataclass(frozen=True)
class LinearFit:
    """J and B of a linear motor with their uncertainties."""

    inertia: Estimate
    viscous_friction: Estimate


@dataclass(frozen=True)
class FrequencyResponse:
    """Torque to velocity: `frequency` (k,) [Hz], `response` (k,) complex [rad/s per N·m],
    `coherence` (k,), `segments` averaged."""

    frequency: Array
    response: NDArray[np.complex128]
    coherence: Array
    segments: float

    def deviation(self) -> Array:
        """Return the relative standard deviation of the response (k,) (Bendat and Piersol)."""
        coherence = np.clip(self.coherence, 1e-6, 1.0)
        return np.sqrt((1.0 - coherence) / (2.0 * coherence * self.segments))


def fit_steps(recording: Recording) -> tuple[list[StepFit], LinearFit]:
    """Fit each step of a step test by the classical first-order response.

    Coulomb friction, which the linear motor lacks, is not told from viscous friction here: B
    comes out too large, the more so the smaller the step. `fit_free_motor` tells them apart.

    Raises:
        InputError: no steps with motion.
    """
    fits = []
    for motion in motions(recording):
        fits.extend(_steps(motion))
    if not fits:
        raise InputError(f'{recording.name}: no steps of the torque found; hold each level for '
                         f'at least {SHORTEST_STEP} s')
    estimates = []
    for name, unit in (('inertia', 'kg·m²'), ('viscous_friction', 'N·m·s/rad')):
        values = np.array([getattr(entry, name) for entry in fits])
        spread = values.std(ddof=1) / np.sqrt(values.size) if values.size > 1 else np.inf
        estimates.append(Estimate(float(np.median(values)), float(spread), unit, True,
                                  max(values.size - 1, 1)))
    return fits, LinearFit(*estimates)


def frequency_response(recordings: Sequence[Recording], resolution: float = 0.25,
                       highest: float = 12.0) -> FrequencyResponse:
    """Estimate the response from torque to velocity (H₁, Welch) with its coherence.

    Velocity is the derivative of the position through the kernel; torque passes the same kernel.

    Args:
        recordings: runs with a sweep.
        resolution: [Hz].
        highest: [Hz].
    """
    cross: Array | float = 0.0
    power: Array | float = 0.0
    output: Array | float = 0.0
    segments, frequency = 0.0, None
    for motion in (piece for recording in recordings for piece in motions(recording)):
        length = round(1.0 / (resolution * motion.interval))
        if motion.time.size < 1.5 * length:
            continue
        velocity = motion.smooth_velocity
        effort = motion.kernel.apply(motion.effort)
        options = {'fs': 1.0 / motion.interval, 'nperseg': length, 'detrend': False}
        grid, pxy = signal.csd(effort, velocity, **options)
        if frequency is None:
            frequency = grid
        elif grid.size != frequency.size:
            continue
        weight = motion.time.size / length
        cross = cross + weight * pxy
        power = power + weight * signal.welch(effort, **options)[1]
        output = output + weight * signal.welch(velocity, **options)[1]
        # Half-overlapping Hann windows: 11/9 as many averages as windows that don't overlap.
        segments += 1.22 * weight
    if frequency is None:
        raise InputError('no run is long enough for a frequency response of '
                         f'{resolution} Hz resolution; record at least {1.5 / resolution:.0f} s')
    keep = (frequency > 0.5 * resolution) & (frequency <= highest)
    coherence = np.abs(cross)**2 / np.maximum(power * output, 1e-300)
    response = np.asarray(cross / power)
    return FrequencyResponse(frequency[keep], response[keep], coherence[keep], segments)


def fit_response(data: FrequencyResponse) -> LinearFit:
    """Fit 1/(J·s + B) to the measured response, weighted by its coherence.

    Linear in J and B: the weighted misfit of H·(jωJ + B) = 1.

    Raises:
        InputError: no frequency with coherence above 0.8.
    """
    good = data.coherence > LEAST_COHERENCE
    if good.sum() < 3:
        raise InputError('the sweep shows no coherent response; excite the motor more strongly')
    response = data.response[good]
    weight = 1.0 / np.maximum(data.deviation()[good], 1e-3)
    omega = 2.0 * np.pi * data.frequency[good]
    rows = np.column_stack([1j * omega * response, response]) * weight[:, None]
    design = np.concatenate([rows.real, rows.imag])
    wanted = np.concatenate([weight, np.zeros(weight.size)])
    found = np.linalg.lstsq(design, wanted, rcond=None)[0]
    misfit = wanted - design @ found
    freedom = misfit.size - 2
    covariance = np.linalg.inv(design.T @ design) * float(misfit @ misfit) / freedom
    deviation = np.sqrt(np.diag(covariance))
    return LinearFit(Estimate(float(found[0]), float(deviation[0]), 'kg·m²', True, freedom),
                     Estimate(float(found[1]), float(deviation[1]), 'N·m·s/rad', True, freedom))


def fit_free_motor(recordings: Sequence[Recording], start: Model | None = None) -> Fit:
    """Fit J, B, Coulomb friction, a torque offset and cogging to runs of the unloaded motor.

    Args:
        recordings: slow strokes show the cogging, fast motion J and B; any mixture will do.
        start: J, B to start from, and cogging that is known: its orders are kept, and others
            that stand out of the residual join them.

    Raises:
        InputError: nothing moves.
    """
    model = start or Model()
    pieces = moving_pieces(recordings)
    if not pieces:
        raise InputError('the motor does not move in any of these runs')
    known = tuple(entry.order for entry in model.cogging)
    form = Form('polynomial', 0, orders=known, held=frozenset({'load_gain'}))
    fastest = max(piece.top_speed for piece in pieces)
    guess = {'inertia': model.motor.inertia, 'viscous_friction': model.motor.viscous_friction,
             'coulomb': 0.01}
    best = min((fit(pieces, form, guess | {'saturation_velocity': part * fastest})
                for part in (0.005, 0.03)), key=lambda found: found.rms)
    new = tuple(order for order in find_orders(pieces, best.residual)
                if all(abs(order - other) > 0.05 for other in known))
    if new:
        best = fit(pieces, replace(form, orders=known + new), best.values)
    return best


def torque_constant(bare: Estimate, loaded: Estimate, added_inertia: float,
                    assumed: float) -> Estimate:
    """Return K_T [N·m/A] from the inertias seen without and with a known inertia added.

    Torque is recorded as `assumed`·current, so an inertia comes out as J·assumed/K_T, and the
    difference of the two as added_inertia·assumed/K_T.

    Args:
        bare, loaded: apparent inertia without and with the added one [kg·m²].
        added_inertia: [kg·m²].
        assumed: the torque constant that the recordings were made with [N·m/A].

    Raises:
        InputError: the added inertia is not seen.
    """
    difference = loaded.value - bare.value
    deviation = float(np.hypot(loaded.std, bare.std))
    if not difference > 3.0 * deviation:
        raise InputError('the added inertia cannot be told from none; add a larger one')
    value = assumed * added_inertia / difference
    return Estimate(value, value * deviation / difference, 'N·m/A', True,
                    min(bare.degrees_of_freedom, loaded.degrees_of_freedom))


def _steps(motion: Motion) -> list[StepFit]:
    effort = motion.kernel.apply(motion.effort)
    # Levels by difference over a kernel's length: noise and drift stay below, steps don't.
    span = motion.kernel.half
    change = np.abs(effort[2 * span:] - effort[:-2 * span])
    jumps = change > LEAST_STEP * np.ptp(effort)
    edges = np.flatnonzero(np.diff(jumps.astype(int)))
    bounds = np.concatenate([[0], edges + span, [effort.size - 1]])
    found = []
    for begin, end in zip(bounds, bounds[1:], strict=False):
        inner = slice(begin + span, end - span)
        held = effort[inner]
        if held.size * motion.interval < SHORTEST_STEP or np.ptp(held) > 0.2 * np.ptp(effort):
            continue
        level = float(np.median(held))
        entry = _one_step(motion, inner, level)
        if entry is not None and abs(level) > 0.1 * np.abs(effort).max():
            found.append(entry)
    return found


def _one_step(motion: Motion, part: slice, level: float) -> StepFit | None:
    time = motion.time[part] - motion.time[part][0]
    velocity = motion.smooth_velocity[part]
    if np.ptp(velocity) < 0.2 * motion.top_speed:
        return None

    def response(t: Array, last: float, first: float, constant: float) -> Array:
        return last + (first - last) * np.exp(-t / constant)

    try:
        (last, first, constant), _ = curve_fit(
            response, time, velocity, [velocity[-1], velocity[0], 0.3 * time[-1]],
            bounds=([-np.inf, -np.inf, 1e-4], [np.inf, np.inf, 100.0]))
    except RuntimeError:
        return None
    viscous = level / last
    if not viscous > 0.0 or constant > 3.0 * time[-1]:
        return None
    return StepFit(time, velocity, response(time, last, first, constant), level,
                   viscous * constant, viscous, constant)
