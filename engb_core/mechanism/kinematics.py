# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Geometry of the brake: reduction gear, ball screw, lever, non-circular gear; (14) to (24).

Corrected where the paper is wrong: (14) is inverted there, θ_bs = θ_M/N_g. Forces are in
`engb_core.mechanism.statics`.

    motor θ_M → screw θ_bs → nut x_bs → lever θ_lv → gear θ_g → pad: x_p along, y_p onto the disc
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.errors import InputError

__all__ = ['CHOSEN', 'Mechanism', 'Posture']

Array = NDArray[np.float64]

# How far the motor may be behind its rest, as a part of the stroke: tracking overshoots.
OVERSHOOT = 0.1

# The gear may turn so far either way; the paper's stays within 5° [rad].
GEAR_LIMIT = math.radians(60.0)


@dataclass(frozen=True)
class Posture:
    """Where each part stands, all of the shape of the motor angle they were asked for.

    Attributes:
        lever_angle: θ_lv [rad].
        gear_angle: θ_g [rad].
        pad_along: x_p [m], along the disc.
        pad_onto: y_p [m], towards the disc.
        wedge: dy_p/dx_p [-], the slope on which the pad climbs; d/r at θ_g = 0.
        ratio: dy_p/dθ_M [m/rad].
    """

    lever_angle: Array
    gear_angle: Array
    pad_along: Array
    pad_onto: Array
    wedge: Array
    ratio: Array


@dataclass(frozen=True)
class Mechanism:
    """The numbers between motor and disc, SI units.

    Attributes:
        gear_ratio: N_g [-], motor turns per screw turn.
        screw_lead: L [m].
        lever_input: l₁ [m], hinge to nut with the lever at rest.
        lever_output: l₂ [m], hinge to pad with the lever at rest.
        lever_bend: β [rad].
        gear_radius: r [m] of each of the two overlapping circles.
        gear_offset: d [m], half the distance of their centres.
        efficiency: η [-] while the motor drives.
        back_efficiency: while the load drives; None: 2 − 1/η, which follows when as much torque
            is lost one way as the other.
        clearance: y_p [m] at which the pads touch.
        clamp_stiffness: F_N = Σ clamp_stiffness[i]·s^(i+1) [N/m, N/m², …] of the pads' and the
            caliper's compression s = y_p − clearance.
        stroke: the motor's largest angle [rad].
    """

    gear_ratio: float
    screw_lead: float
    lever_input: float
    lever_output: float
    lever_bend: float
    gear_radius: float
    gear_offset: float
    efficiency: float
    clearance: float
    clamp_stiffness: tuple[float, ...]
    stroke: float
    back_efficiency: float | None = None

    def __post_init__(self) -> None:
        for name in ('gear_ratio', 'screw_lead', 'lever_input', 'lever_output', 'gear_radius',
                     'gear_offset', 'stroke'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f'mechanism: {name} is {value}; it must be above 0')
        if not 0.0 <= self.lever_bend < math.radians(80.0):
            raise InputError(f'mechanism: lever_bend is {self.lever_bend} rad; it must lie '
                             'within 0 and 1.39 (80°)')
        if not 0.0 < self.efficiency <= 1.0:
            raise InputError(f'mechanism: efficiency is {self.efficiency}; it must lie above 0 '
                             'and not above 1')
        if self.back_efficiency is not None and not self.back_efficiency <= 1.0:
            raise InputError(f'mechanism: back_efficiency is {self.back_efficiency}; it must not '
                             'be above 1')
        if not self.clearance >= 0.0:
            raise InputError(f'mechanism: clearance is {self.clearance} m; it must not be below 0')
        if self.gear_offset >= self.gear_radius:
            raise InputError(
                f'mechanism: gear_offset {self.gear_offset} m is not below gear_radius '
                f'{self.gear_radius} m: the two circles would not overlap at the contact')
        grip = np.linspace(0.0, self.posture(self.stroke).pad_onto.item(), 50)
        slope = np.polynomial.polynomial.polyval(
            grip, [(power + 1) * value
                   for power, value in enumerate(self.clamp_stiffness)] or [0.0])
        if not (slope >= 0.0).all() or not slope.any():
            raise InputError('mechanism: clamp_stiffness gives a force that falls, or none, '
                             'within the stroke; it must rise with compression')

    def screw_angle(self, motor_angle: ArrayLike) -> Array:
        """Return θ_bs = θ_M/N_g [rad], (14) corrected."""
        return self._within_stroke(motor_angle) / self.gear_ratio

    def nut_travel(self, motor_angle: ArrayLike) -> Array:
        """Return x_bs [m], (15)."""
        return self.screw_lead / (2.0 * math.pi) * self.screw_angle(motor_angle)

    def lever_angle(self, motor_angle: ArrayLike) -> Array:
        """Return θ_lv [rad], (16)."""
        return np.arctan(self.nut_travel(motor_angle) / self.lever_input)

    def posture(self, motor_angle: ArrayLike) -> Posture:
        """Return where everything stands at `motor_angle` [rad], exactly: (18) to (22).

        Raises:
            InputError: an angle outside the stroke, or geometry that jams before its end.
        """
        lever = self.lever_angle(motor_angle)
        gear = self._gear_angle(lever)
        r, d = self.gear_radius, self.gear_offset
        along = 2.0 * (d * (1.0 - np.cos(gear)) + r * gear)
        onto = 2.0 * d * np.sin(gear)
        wedge = d * np.cos(gear) / (r + d * np.sin(gear))
        # (18) by θ_lv: dx_p + tan γ·dy_p = (l₂cos β + y_p)/cos²γ·dθ_lv, with γ = β − θ_lv.
        bend = self.lever_bend - lever
        reach = self.lever_output * math.cos(self.lever_bend) + onto
        per_lever = reach / np.cos(bend)**2 / (1.0 + wedge * np.tan(bend))
        per_motor = (np.cos(lever)**2 / self.lever_input * self.screw_lead
                     / (2.0 * math.pi * self.gear_ratio))
        return Posture(lever, gear, along, onto, wedge, wedge * per_lever * per_motor)

    def small_angle_posture(self, motor_angle: ArrayLike) -> Posture:
        """Return the same with sin θ_g ≈ θ_g, cos θ_g ≈ 1, (23) and (24): θ_g in closed form.

        (18) then gives θ_g = (l₂·sin β − l₂·cos β·t)/(2(r + d·t)) with t = tan(β − θ_lv).
        """
        lever = self.lever_angle(motor_angle)
        r, d = self.gear_radius, self.gear_offset
        tangent = np.tan(self.lever_bend - lever)
        height = self.lever_output * math.cos(self.lever_bend)
        width = self.lever_output * math.sin(self.lever_bend)
        gear = (width - height * tangent) / (2.0 * (r + d * tangent))
        slope = -(1.0 + tangent**2)
        by_lever = ((-height * (r + d * tangent) - (width - height * tangent) * d) * slope
                    / (2.0 * (r + d * tangent)**2))
        per_motor = (np.cos(lever)**2 / self.lever_input * self.screw_lead
                     / (2.0 * math.pi * self.gear_ratio))
        return Posture(lever, gear, 2.0 * r * gear, 2.0 * d * gear, np.full_like(gear, d / r),
                       2.0 * d * by_lever * per_motor)

    def motor_angle_of_pad(self, pad_onto: ArrayLike) -> Array:
        """Return θ_M [rad] at which the pad has moved `pad_onto` y_p [m]: the chain backwards.

        Backwards everything is closed: θ_g from (20), x_p from (19), θ_lv from (18).

        Raises:
            InputError: the pad can't come so far.
        """
        sine = np.asarray(pad_onto, float) / (2.0 * self.gear_offset)
        if not np.all(np.abs(sine) <= math.sin(GEAR_LIMIT)):
            raise InputError('mechanism: the pad travel asked for lies outside what the gear can '
                             f'do (±{2e3 * self.gear_offset * math.sin(GEAR_LIMIT):.3g} mm)')
        gear = np.arcsin(sine)
        along = 2.0 * (self.gear_offset * (1.0 - np.cos(gear)) + self.gear_radius * gear)
        width = self.lever_output * math.sin(self.lever_bend) - along
        height = self.lever_output * math.cos(self.lever_bend) + np.asarray(pad_onto, float)
        lever = self.lever_bend - np.arctan(width / height)
        travel = self.lever_input * np.tan(lever)
        return self._within_stroke(travel * 2.0 * math.pi * self.gear_ratio / self.screw_lead)

    def _within_stroke(self, motor_angle: ArrayLike) -> Array:
        angle = np.asarray(motor_angle, float)
        low, high = -OVERSHOOT * self.stroke, self.stroke * (1.0 + 1e-9)
        if not np.all((angle >= low) & (angle <= high)):
            finite = angle[np.isfinite(angle)]
            beyond = finite[(finite < low) | (finite > high)]
            told = f'{beyond.flat[0]:.4g} rad' if beyond.size else 'not finite'
            raise InputError(f'mechanism: a motor angle is {told}; its stroke goes from '
                             f'{low:.4g} to {high:.4g} rad')
        return angle

    def _gear_angle(self, lever: Array) -> Array:
        r, d = self.gear_radius, self.gear_offset
        width = self.lever_output * math.sin(self.lever_bend)
        height = self.lever_output * math.cos(self.lever_bend)
        tangent = np.tan(self.lever_bend - lever)
        # (18) less its left side rises with θ_g as long as r + d·(sin θ_g + cos θ_g·tan γ) > 0.
        if not np.all(np.cos(self.lever_bend - lever) > 0.1) or not np.all(
                r + d * (tangent - 1.0) > 0.0):
            raise InputError('mechanism: lever and gear jam within the stroke (the lever turns '
                             'past its bend); shorten the stroke or lengthen lever_input')

        def difference(gear: Array) -> tuple[Array, Array]:
            value = (2.0 * (d * (1.0 - np.cos(gear)) + r * gear) - width
                     + (height + 2.0 * d * np.sin(gear)) * tangent)
            return value, 2.0 * (d * np.sin(gear) + r + d * np.cos(gear) * tangent)

        return rising_root(difference, np.full_like(lever, -GEAR_LIMIT),
                           np.full_like(lever, GEAR_LIMIT),
                           'mechanism: the stroke turns the non-circular gear by more than '
                           f'{math.degrees(GEAR_LIMIT):.0f}°; shorten it or choose a larger '
                           'gear_radius')


def rising_root(function: Callable[[Array], tuple[Array, Array]], low: Array, high: Array,
                message: str) -> Array:
    """Return the root of a rising function, element by element, by Newton within a bracket.

    Args:
        function: returns value and slope at its argument (n,).
        low, high: bracket (n,).
        message: InputError's, where the bracket holds no root.
    """
    low, high = np.array(low, float), np.array(high, float)
    if not (np.all(function(low)[0] <= 0.0) and np.all(function(high)[0] >= 0.0)):
        raise InputError(message)
    point = 0.5 * (low + high)
    for _ in range(80):
        value, slope = function(point)
        low = np.where(value <= 0.0, point, low)
        high = np.where(value >= 0.0, point, high)
        with np.errstate(divide='ignore', invalid='ignore'):
            following = point - value / slope
        inside = (following >= low) & (following <= high)
        following = np.where(inside, following, 0.5 * (low + high))
        if np.all(np.abs(following - point) <= 1e-15 + 4e-16 * np.abs(point)):
            return following
        point = following
    return point


# CHOSEN, every number but the ratio d/r: the paper gives no geometry and no clamp-force curve.
# They keep θ_g below 5° over the stroke, as the paper says of its gear, and load the motor with
# 0.14 N·m at 22 rad. By the corrected (44) the paper's P = 0.421 and μ = 0.249 ask for a wedge
# slope of 0.430, which is the mean over the stroke (each angle counted by the square of its load):
# the slope falls as the gear turns, so d/r, which it has at rest, is 0.4414.
CHOSEN = Mechanism(
    gear_ratio=4.0,
    screw_lead=4e-3,
    lever_input=70e-3,
    lever_output=35e-3,
    lever_bend=math.radians(20.0),
    gear_radius=10.5e-3,
    gear_offset=0.4414 * 10.5e-3,
    efficiency=0.90,
    clearance=0.05e-3,
    clamp_stiffness=(1.2e6, 8.0e9),
    stroke=22.0,
)
