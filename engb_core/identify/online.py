# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The self-energizing gain and the contact's shift, stroke by stroke, while the brake works.

Of each clamp stroke and the release after it the even disturbance is fitted by

    −d̂_even(θ) = P·T_L(θ − δ)

(43) with a contact that moves. T_L is the cubic (41) of the first strokes, from the contact on
that fits them best, with the disc standing: caliper and pads that lag and creep do so in it as
they do later. P is 1 and δ is 0 then. Observer and position pass the same low-pass, so neither
lags behind the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.feedforward import Feedforward
from engb_core.errors import InputError
from engb_core.identify.confidence import coloured_covariance
from engb_core.identify.even_odd import decompose, EvenOdd, join
from engb_core.identify.resampling import by_nearest_neighbour, reference_grid
from engb_core.model import Model

__all__ = ['StrokeTracker', 'StrokeUpdate']

Array = NDArray[np.float64]

# Points at which clamp and release are compared.
POINTS = 200

# Of the curve; and the contacts that are tried over the strokes.
DEGREE, CONTACTS = 3, 60

# Steps of Gauss and Newton from the numbers of the stroke before; the problem is nearly linear.
STEPS = 8


@dataclass(frozen=True)
class StrokeUpdate:
    """What one stroke tells.

    Attributes:
        time: at the release's end [s].
        gain, gain_std: P [-].
        shift, shift_std: δ [rad], positive: contact comes later.
        rms: of what is left of the even disturbance [N·m].
    """

    time: float
    gain: float
    gain_std: float
    shift: float
    shift_std: float
    rms: float


@dataclass(frozen=True)
class _Curve:
    """A load that begins at `contact` [rad]: Σ coefficients[k]·s^(k+1) [N·m] beyond it."""

    contact: float
    coefficients: Array

    def __call__(self, angle: Array) -> Array:
        beyond = np.maximum(angle - self.contact, 0.0)
        torque: Array = np.polynomial.polynomial.polyval(beyond, [0.0, *self.coefficients])
        return torque

    def slope(self, angle: Array) -> Array:
        """Return dT_L/dθ [N·m/rad] at `angle` (n,) [rad]."""
        rise = self.coefficients * np.arange(1, self.coefficients.size + 1)
        beyond = angle - self.contact
        return np.where(beyond > 0.0, np.polynomial.polynomial.polyval(beyond, rise), 0.0)


def _learnt(parts: EvenOdd) -> _Curve:
    """Return the curve of the even part, at the contact that leaves least over."""
    low, high = float(parts.position.min()), float(parts.position.max())

    def curve(contact: float) -> tuple[float, _Curve]:
        design = np.maximum(parts.position - contact, 0.0)[:, None] ** np.arange(1, DEGREE + 1)
        found = np.asarray(np.linalg.lstsq(design, -parts.even, rcond=None)[0], np.float64)
        return float(np.sum((parts.even + design @ found)**2)), _Curve(contact, found)

    return min((curve(contact) for contact in np.linspace(low, high, CONTACTS)[:-1].tolist()),
               key=lambda entry: entry[0])[1]


class StrokeTracker:
    """Takes samples one by one; each finished stroke gives an update, once the curve is learnt.

    Args:
        model: J, B and cogging, in the units of the effort.
        learn: the curve is that of so many strokes; the disc must stand meanwhile.
        excursion: a stroke covers at least this [rad].
        cutoff: of the observer's low-pass [Hz].

    Raises:
        InputError: an argument out of range.
    """

    def __init__(self, model: Model, learn: int = 3, excursion: float = 5.0,
                 cutoff: float = 20.0) -> None:
        if learn < 1:
            raise InputError(f'learn is {learn}; the curve takes at least 1 stroke')
        if not excursion > 0.0:
            raise InputError(f'excursion is {excursion}; it must be above 0 rad')
        self.excursion = excursion
        self._learn = learn
        self._first: list[EvenOdd] = []
        self._curve = _Curve(0.0, np.zeros(DEGREE))
        self._torques = Feedforward(model)
        self._observer = DisturbanceObserver(model.motor, cutoff)
        self._gain, self._shift = 1.0, 0.0
        self.reset()

    def reset(self) -> None:
        """Forget the stroke under way."""
        self._observer.reset()
        self._delayed: list[float] = []
        self._rows: list[tuple[float, float, float, float]] = []
        self._top = 0
        self._rising = True
        self._time: float | None = None

    def step(self, time: float, position: float, velocity: float, effort: float,
             ) -> StrokeUpdate | None:
        """Take one sample; return what the stroke that it ends tells, else None.

        Args:
            time: [s].
            position, velocity, effort: measured [rad, rad/s, N·m].
        """
        if not np.isfinite(time + position + velocity + effort):
            return None
        if self._time is not None and time <= self._time:
            return None
        waves = self._torques.cogging_torque(position) if self._torques.cogging else 0.0
        found = self._observer.step(time, velocity, effort - waves)
        row = (time, *self._through_q(time, position, velocity), found)
        self._time = time
        self._rows.append(row)
        return self._turned()

    def _through_q(self, time: float, position: float, velocity: float) -> tuple[float, float]:
        """Return position and velocity as late as d̂ is."""
        fresh = [position, velocity]
        if self._time is None:
            self._delayed = [position, velocity] * (self._observer.order + 1)
            return position, velocity
        tau, dt = self._observer.time_constant, time - self._time
        keep, gain = (2.0 * tau - dt) / (2.0 * tau + dt), dt / (2.0 * tau + dt)
        stages = self._delayed
        for place in (0, 1):
            before, stages[place] = stages[place], fresh[place]
            for stage in range(1, self._observer.order + 1):
                index = 2 * stage + place
                last = stages[index]
                stages[index] = keep * last + gain * (stages[index - 2] + before)
                before = last
        return stages[-2], stages[-1]

    def _turned(self) -> StrokeUpdate | None:
        """Look for the end of a release; keep no more than the stroke under way."""
        rows, here = self._rows, self._rows[-1]
        if self._rising:
            if here[1] >= rows[self._top][1]:
                self._top = len(rows) - 1
            elif rows[self._top][1] - here[1] >= self.excursion:
                self._rising = False
            elif here[1] < rows[0][1]:
                self._rows, self._top = [here], 0
            return None
        # Back down and turning: the stroke is over once the speed changes sign.
        if here[2] < 0.0:
            return None
        update = self._fitted()
        self._rows, self._top, self._rising = [here], 0, True
        return update

    def _fitted(self) -> StrokeUpdate | None:
        table = np.array(self._rows)
        clamp, release = table[:self._top + 1], table[self._top:]
        clamp, release = clamp[clamp[:, 2] > 0.0], release[release[:, 2] < 0.0]
        if min(len(clamp), len(release)) < 20:
            return None
        one, two = ((part[:, 1], part[:, 3], part[:, 2]) for part in (clamp, release))
        size = min(POINTS, len(clamp) - 1, len(release) - 1)
        try:
            parts = decompose(by_nearest_neighbour(reference_grid(one[0], two[0], size), one,
                                                   two))
        except InputError:
            return None
        if len(self._first) < self._learn:
            self._first.append(parts)
            if len(self._first) == self._learn:
                self._curve = _learnt(join(self._first))
            return None
        return self._compared(float(table[-1, 0]), parts)

    def _compared(self, time: float, parts: EvenOdd) -> StrokeUpdate | None:
        """Fit P and δ to one stroke's even part."""
        slope = self._curve.slope
        numbers = np.array([self._gain, self._shift])
        for _ in range(STEPS):
            angle = parts.position - numbers[1]
            load = self._curve(angle)
            design = np.column_stack([load, -numbers[0] * slope(angle)])
            misfit = -parts.even - numbers[0] * load
            numbers = numbers + np.linalg.lstsq(design, misfit, rcond=None)[0]
        if not np.isfinite(numbers).all():
            return None
        self._gain, self._shift = float(numbers[0]), float(numbers[1])
        misfit = -parts.even - self._gain * self._curve(parts.position - self._shift)
        covariance, _ = coloured_covariance(design, misfit, np.arange(misfit.size))
        deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return StrokeUpdate(time, self._gain, float(deviation[0]), self._shift,
                            float(deviation[1]), float(np.sqrt(np.mean(misfit**2))))
