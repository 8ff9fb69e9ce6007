# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The truth plant: an ENGB brake in closed loop, run forward in one compiled loop.

Motor side: J·dω/dt = T - B·ω - T_L - friction - everything that an effect adds. Friction is
set-valued: the velocity after a step is found implicitly, so that the shaft truly sticks.
Steps are symplectic; the controller is a PID with feedforward J·α_d + B·ω_d, held for 1 ms.
"""
from __future__ import annotations

from dataclasses import dataclass
from math import floor, sin

from numba import njit
import numpy as np

from .effects_drive import cogging_torque, delivered, RING
from .effects_friction import advance_bristle, capacity, drag_torque
from .effects_load import curve, load_torque
from .effects_outside import odd_drag, odd_drive, odd_friction, odd_inertia, odd_shift, STATES
from .effects_train import shaft_torque
from .references import DiscProfile, Reference

__all__ = ['Run', 'TICK', 'simulate']

TICK = 1e-3
_SUBSTEPS = 20


@dataclass(frozen=True)
class Run:
    """What happened, free of noise, at each 1 ms tick.

    `effort` is the measured torque (K_T times current, with its offset) averaged over ±0.5 ms
    around the tick, `acceleration` the mean over the same window; `position`, `velocity` are
    those of the encoder's frame; `command` the controller's; `work` holds the energy terms
    [J]: supplied, viscous, friction, load, kinetic, other.
    """

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    effort: np.ndarray
    command: np.ndarray
    disc_angle: np.ndarray
    work: np.ndarray

    @property
    def time(self) -> np.ndarray:
        """Ticks in seconds."""
        return np.arange(self.position.size) * TICK

    @property
    def steady(self) -> bool:
        """Whether the run stayed finite and within a sane range."""
        return bool(np.all(np.isfinite(self.position)) and np.abs(self.velocity).max() < 500.0)


@njit(cache=True)
def _implicit(free, limit, soft):
    """Velocity after friction: `limit` = dt·F/J; `soft` the saturation velocity (0: stick)."""
    if soft > 0.0 and abs(free) <= soft + limit:
        return free / (1.0 + limit / soft)
    if abs(free) <= limit:
        return 0.0
    return free - limit if free > 0.0 else free + limit


@njit(cache=True)
def _loop(plant, switch, ref_p, ref_v, ref_a, disc, temperature, substeps, tick):
    p = plant[0]
    n = ref_p.size
    dt = tick / substeps
    out = np.zeros((6, n))
    half = np.zeros((3, n))
    work = np.zeros(6)
    bristle, far_bristle = np.zeros(6), np.zeros(6)
    hyst, creep, face, lag = np.zeros(5), np.zeros(6), np.zeros(1), np.zeros(2)
    ring, odd = np.zeros(RING), np.zeros(STATES)
    load = changing = 0.0
    creep[5] = curve(p, 0.0)
    theta = omega = far_theta = far_omega = angle = 0.0
    previous = rested = slipped = heated = 0.0
    quantum = 2.0 * np.pi / p.counts
    last_count = filtered = 0.0
    integral = curve(p, 0.0) / max(p.ki, 1e-9)   # it held the load before the recording began
    two = p.train_kind > 0
    motor_inertia = p.inertia - p.far_inertia if two else p.inertia
    index = 0
    for k in range(n):
        if k == switch:
            p = plant[1]
        seen = theta + p.ecc * sin(p.ecc_order * theta + p.ecc_phase)
        count = floor(seen / quantum + 0.5) * quantum
        filtered += (1.0 - p.filter_pole) * ((count - last_count) / tick - filtered)
        last_count = count
        error = ref_p[k] - count
        command = (p.ff_inertia * ref_a[k] + p.ff_viscous * ref_v[k] + p.kp * error
                   + p.kd * (ref_v[k] - filtered) + p.ki * integral)
        if abs(command) < p.limit or command * error < 0.0:
            integral += error * tick
        command = min(p.limit, max(-p.limit, command))
        out[0, k] = seen
        out[1, k] = command
        out[2, k] = angle
        current = command - p.offset
        for i in range(substeps):
            if 2 * i == substeps:
                turn = p.ecc_order * theta + p.ecc_phase
                half[0, k] = theta + p.ecc * sin(turn)
                half[1, k] = omega * (1.0 + p.ecc * p.ecc_order * np.cos(turn))
            t = k * tick + i * dt
            angle += disc[k] * dt
            drive = delivered(p, lag, ring, index, current, theta, heated, dt)
            drive = odd_drive(p, odd, drive, omega, t, dt)
            index += 1
            heated += ((current / 0.2) ** 2 - heated) * dt / p.heat_time
            spot = far_theta if two else theta
            if p.odd_kind > 14:
                spot -= odd_shift(p, odd, load, omega, temperature[k], dt)
            load = load_torque(p, hyst, creep, face, spot, previous, t, disc[k], angle,
                               temperature[k], dt)
            previous = spot
            other = drag_torque(p, omega) + cogging_torque(p, theta, t)
            inertia = motor_inertia
            if p.odd_kind == 12 or p.odd_kind == 13:
                slope = (curve(p, theta + 0.01) - curve(p, theta - 0.01)) / 0.02
                other += odd_drag(p, odd, omega, slope, dt)
            elif p.odd_kind == 14:
                share, bend = odd_inertia(p, theta)
                inertia = motor_inertia * share
                other += motor_inertia * bend * omega * omega
            shaft = shaft_torque(p, theta - far_theta, omega - far_omega) if two else load
            free = omega + dt * (drive - p.viscous * omega - other - shaft) / inertia
            sign = 1.0 if free > 0.0 else -1.0
            gain = p.gain - p.far_gain if two else p.gain
            coulomb = p.coulomb - p.far_coulomb if two else p.coulomb
            level = capacity(p, coulomb, gain, load, theta, omega, sign, t, rested, slipped)
            if p.odd_kind > 6:
                level = odd_friction(p, odd, level, omega, changing, load, disc[k], dt)
            if p.bristle_kind > 0:
                after = free - dt * level * advance_bristle(p, bristle, omega, dt) / inertia
            else:
                after = _implicit(free, dt * level / inertia, p.saturation)
            rub = (free - after) * inertia / dt
            changing = (after - omega) / dt
            middle = 0.5 * (omega + after)
            work[0] += drive * middle * dt
            work[1] += p.viscous * omega * middle * dt
            work[2] += rub * middle * dt
            work[5] += other * middle * dt
            if two:
                free = far_omega + dt * (shaft - load) / p.far_inertia
                sign = 1.0 if free > 0.0 else -1.0
                level = capacity(p, p.far_coulomb, p.far_gain, load, far_theta, far_omega, sign,
                                 t, rested, slipped)
                if p.bristle_kind > 0:
                    press = level * advance_bristle(p, far_bristle, far_omega, dt)
                    far_after = free - dt * press / p.far_inertia
                else:
                    far_after = _implicit(free, dt * level / p.far_inertia, p.saturation)
                far_middle = 0.5 * (far_omega + far_after)
                work[2] += (free - far_after) * p.far_inertia * far_middle
                work[3] += load * far_middle * dt
                work[5] += shaft * (middle - far_middle) * dt
                far_omega = far_after
                far_theta += far_omega * dt
            else:
                work[3] += load * middle * dt
            if abs(after) < 1e-3:
                if slipped > 0.0:
                    rested = rested if slipped < 3.0 * p.age_slip else 0.0
                    slipped = 0.0
                rested += dt
            else:
                slipped += abs(after) * dt
            omega = after
            theta += omega * dt
        half[2, k] = command
    for k in range(1, n):
        out[3, k] = 0.5 * (half[2, k - 1] + half[2, k])
        out[4, k] = (half[0, k] - half[0, k - 1]) / tick
        out[5, k] = (half[1, k] - half[1, k - 1]) / tick
    out[3, 0] = half[2, 0]
    work[4] = 0.5 * motor_inertia * omega ** 2
    if two:
        work[4] += 0.5 * p.far_inertia * far_omega ** 2
    return out, work


def simulate(plant: np.ndarray, reference: Reference, disc: DiscProfile | None = None,
             substeps: int = _SUBSTEPS, switch: int = -1) -> Run:
    """Run the plant along a reference sampled at 1 kHz; the disc stands where none is given.

    From tick `switch` on, the second record of `plant` holds (an effect that begins).
    """
    if disc is None:
        still = np.zeros(reference.position.size)
        disc = DiscProfile(still, still + 25.0)
    out, work = _loop(plant, switch, reference.position, reference.velocity,
                      reference.acceleration, disc.speed, disc.temperature, substeps, TICK)
    return Run(position=out[0], velocity=out[4], acceleration=out[5], effort=out[3],
               command=out[1], disc_angle=out[2], work=work)
