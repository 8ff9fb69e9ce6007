# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Clamp force without a force sensor: force ↔ angle on the identified model, wear, uncertainty."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, fields
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from engb_core.control.feedforward import Feedforward
from engb_core.errors import InputError
from engb_core.mechanism.kinematics import Mechanism
from engb_core.mechanism.statics import efficiency_load_gain
from engb_core.model import Model
from engb_core.text.yaml_text import load_yaml

__all__ = ['ClampForceEstimator', 'ClampForceMap', 'EstimatorSettings', 'read_mechanism']

# Points of the tables from contact to the end of the stroke.
_POINTS = 600


def read_mechanism(path: str | os.PathLike[str]) -> Mechanism:
    """Read a mechanism file: YAML with the names of `Mechanism` in
    `engb_core.mechanism.kinematics`, SI units.

    Raises:
        InputError: unreadable, a key missing or unknown, a value out of range.
    """
    path = Path(path)
    try:
        data = load_yaml(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, 'strerror', None) or 'not a text file'
        raise InputError(f'{path}: cannot be read ({reason}); give a mechanism file') from error
    except InputError as error:
        raise InputError(f'{path}: {error}') from error
    if not isinstance(data, dict):
        raise InputError(f'{path}: no mapping; a mechanism file names gear_ratio, screw_lead, …')
    known = {field.name: field for field in fields(Mechanism)}
    for name in data:
        if name not in known:
            raise InputError(f'{path}: unknown key {name}; known: {", ".join(known)}')
    for name in known:
        if name not in data and name != 'back_efficiency':
            raise InputError(f'{path}: {name} is missing')
    try:
        values: dict[str, Any] = {name: (tuple(float(item) for item in value)
                         if name == 'clamp_stiffness' else float(value))
                  for name, value in data.items() if value is not None}
        return Mechanism(**values)
    except (TypeError, ValueError) as error:
        raise InputError(f'{path}: every value must be a number in SI units ({error})') from error
    except InputError as error:
        raise InputError(f'{path}: {error}') from error


class ClampForceMap:
    """Force ↔ angle ↔ load torque of one brake.

    The identified load torque T_L(θ), measured with the disc standing, and the geometry give the
    force by virtual work, F_N = T_L/(ε·dy_p/dθ), with ε the even part of the losses (statics).
    At equal angle the force is the same whether the disc turns or not; the load torque is
    P(disc)·T_L, equations (43), (44) corrected.

    Args:
        model: identified with the disc standing; a `self_energizing` effect gives P.
        mechanism: the geometry.
        pad_friction: μ, which gives P where the model has no such effect; 0: the disc has no say.

    Raises:
        InputError: the load torque doesn't rise with the angle, so the force has no inverse.
    """

    def __init__(self, model: Model, mechanism: Mechanism, pad_friction: float = 0.0) -> None:
        if model.load_torque.form == 'sinusoid':
            raise InputError('load_torque.form is sinusoid; a clamp force needs a load that rises '
                             'with the angle (form: polynomial)')
        self.model = model
        self.mechanism = mechanism
        torque = Feedforward(model).load_torque
        stroke = mechanism.stroke
        highest = torque(stroke)
        if highest <= 0.0:
            raise InputError('load_torque is not above 0 at the end of the stroke; identify the '
                             'model before commanding forces')
        contact = model.load_torque.contact_angle
        if contact is None:
            angles = np.linspace(0.0, stroke, 2000)
            low = [angle for angle in angles if torque(angle) <= 0.01 * highest]
            contact = float(low[-1]) if low else 0.0
        self.contact_angle = float(contact)
        grid = np.linspace(self.contact_angle, stroke, _POINTS)
        posture = mechanism.posture(grid)
        loads = np.array([torque(angle) for angle in grid])
        loads = np.maximum(loads - loads[0], 0.0)
        scale, _ = efficiency_load_gain(mechanism)
        forces = loads / (scale * posture.ratio)
        if not np.all(np.diff(forces) > 0.0):
            where = grid[1:][np.diff(forces) <= 0.0][0]
            raise InputError(f'the load torque falls at {where:.3g} rad; between contact and the '
                             'end of the stroke it must rise for a force to be commanded')
        self._step = float(grid[1] - grid[0])
        self._forces = forces.tolist()
        self._loads = loads.tolist()
        self.highest_force = self._forces[-1]
        wedge = float(posture.wedge[0])
        gain = next((entry.parameters.get('load_ratio') for entry in model.effects
                     if entry.effect == 'self_energizing'), None)
        self.gain = float(gain) if gain is not None else (wedge - pad_friction) / wedge
        if not 0.02 < self.gain < 1.98:
            raise InputError(f'the self-energizing gain is {self.gain:.3g}; outside 0.02 to 1.98 '
                             'the brake locks itself in one direction')

    def force_of_angle(self, angle: float) -> float:
        """Return F_N [N] at motor angle `angle` [rad]; 0 before contact, held at the end."""
        return self._interpolated(self._forces, angle)

    def stiffness_at(self, angle: float) -> float:
        """Return dF_N/dθ [N/rad]; 0 before contact."""
        place = (angle - self.contact_angle) / self._step
        if place < 0.0:
            return 0.0
        index = min(int(place), _POINTS - 2)
        return float((self._forces[index + 1] - self._forces[index]) / self._step)

    def angle_of_force(self, force: float) -> float:
        """Return the motor angle [rad] for F_N [N]: contact for 0, the stroke's end at most."""
        return self._inverse(self._forces, force)

    def load_of_angle(self, angle: float) -> float:
        """Return the standing load torque [N·m] from contact on at `angle` [rad]."""
        return self._interpolated(self._loads, angle)

    def load_ratio(self, disc_speed: float) -> float:
        """Return P [-]: load torque over that with the disc standing, by speed [rad/s] and sign.

        Forwards the pad's friction helps (P), backwards it hinders (2 − P).
        """
        return 1.0 + (self.gain - 1.0) * math.tanh(disc_speed / 0.5)

    def _interpolated(self, table: list[float], angle: float) -> float:
        place = (angle - self.contact_angle) / self._step
        if place <= 0.0:
            return 0.0
        index = int(place)
        if index >= _POINTS - 1:
            return table[-1]
        low = table[index]
        return low + (place - index) * (table[index + 1] - low)

    def _inverse(self, table: list[float], value: float) -> float:
        if value <= 0.0:
            return self.contact_angle
        index = min(max(bisect_left(table, value), 1), _POINTS - 1)
        low, high = table[index - 1], table[index]
        part = min((value - low) / (high - low), 1.0)
        return self.contact_angle + (index - 1 + part) * self._step


@dataclass(frozen=True)
class EstimatorSettings:
    """What the estimator believes of its sources.

    Attributes:
        cutoff: low-pass on torque and angle [Hz]; as the observer's.
        torque_noise: standard deviation of the filtered load torque [N·m].
        friction_error: of the model's friction, as a part of it [-].
        force_error: of the identified force curve, as a part of the force [-].
        contact_error: standard deviation of the contact angle at the start [rad].
        wear_rate: how far the contact angle may wander [rad/√s].
        largest_shift: beyond this a shift of the contact is a fault, not wear [rad].
    """

    cutoff: float = 20.0
    torque_noise: float = 0.004
    friction_error: float = 0.15
    force_error: float = 0.03
    contact_error: float = 1.0
    wear_rate: float = 0.01
    largest_shift: float = 6.0


class ClampForceEstimator:
    """Fuses angle and current into a clamp force, its uncertainty, and the contact's shift.

    The angle gives the force with little noise, if one knows where contact begins; the current
    gives the load torque with all of friction's uncertainty, but no memory of wear. A Kalman
    filter of one state, the contact's shift δ, joins them: each load torque T̂_L = −d̂ − T_C says
    δ = θ − θ(T̂_L/P) with the variance that the curve's slope makes of the torque's. The force is
    F(θ − δ).

    Attributes:
        force: [N].
        force_std: its standard deviation [N].
        shift: δ [rad], positive: contact comes later (pad wear).
        shift_std: [rad].
        innovation: the last load torque's disagreement, in standard deviations.
    """

    def __init__(self, force_map: ClampForceMap, settings: EstimatorSettings | None = None,
                 ) -> None:
        self.map = force_map
        self.settings = settings or EstimatorSettings()
        self._torques = Feedforward(force_map.model)
        self.reset()

    def reset(self) -> None:
        """Forget what was learnt of the contact."""
        self.shift = 0.0
        self.shift_std = self.settings.contact_error
        self.force = self.force_std = self.innovation = 0.0
        self._time: float | None = None
        self._still = 0.0

    @property
    def contact_angle(self) -> float:
        """Where the pads touch now [rad]."""
        return self.map.contact_angle + self.shift

    def step(self, time: float, position: float, velocity: float, disturbance: float,
             disc_speed: float = 0.0) -> float:
        """Take one sample and return the force [N].

        Args:
            time: [s].
            position, velocity: θ [rad], ω [rad/s].
            disturbance: the observer's d̂ [N·m], sign of (30); not finite: angle alone.
            disc_speed: [rad/s].
        """
        if not math.isfinite(time + position + velocity):
            return self.force
        dt = 0.0 if self._time is None else min(max(time - self._time, 0.0), 1.0)
        self._time = time
        settings, table = self.settings, self.map
        variance = self.shift_std * self.shift_std + settings.wear_rate**2 * dt
        if math.isfinite(disturbance) and math.isfinite(disc_speed):
            variance = self._correct(position, velocity, disturbance, disc_speed, dt, variance)
        limit = settings.contact_error
        self.shift_std = min(math.sqrt(variance), limit)
        angle = position - self.shift
        self.force = table.force_of_angle(angle)
        slope = table.stiffness_at(max(angle, table.contact_angle))
        self.force_std = math.hypot(slope * self.shift_std, settings.force_error * self.force)
        return self.force

    def _correct(self, position: float, velocity: float, disturbance: float, disc_speed: float,
                 dt: float, variance: float) -> float:
        """Use one load torque; return δ's variance after it."""
        settings, table = self.settings, self.map
        # The observer lags by its filter: only a steady direction makes friction's sign known.
        moving = abs(velocity) > 2.0 * table.model.friction.saturation_velocity
        self._still = 0.0 if not moving else self._still + dt
        if self._still < 1.0 / settings.cutoff:
            return variance
        ratio = table.load_ratio(disc_speed)
        angle = position - self.shift
        expected = ratio * table.load_of_angle(angle)
        friction = self._torques.friction_torque(expected, velocity)
        if self._torques.cogging:
            friction += self._torques.cogging_torque(position)
        load = -disturbance - friction
        # dT/dδ = −slope; noise of the torque, correlated over the observer's memory.
        slope = ratio * (table.load_of_angle(angle + 0.5) - table.load_of_angle(angle - 0.5))
        lag = 0.16 / settings.cutoff * abs(velocity) * slope
        sigma = math.sqrt(settings.torque_noise**2 + (settings.friction_error * friction)**2
                          + (settings.force_error * expected)**2 + lag * lag)
        self.innovation = (load - expected) / sigma
        if slope < 1e-5 and abs(self.innovation) < 3.0:
            return variance   # before contact, as expected: says nothing of where contact is
        slope = max(slope, 1e-3)
        # Samples within the filter's memory count once: information per second, not per sample.
        noise = sigma * sigma / max(dt * settings.cutoff, 1e-6)
        gain = variance * -slope / (slope * slope * variance + noise)
        self.shift += gain * (load - expected)
        self.shift = min(max(self.shift, -settings.largest_shift), settings.largest_shift)
        return variance * (1.0 + gain * slope)
