# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A brake for the bench that is *more* than the model which is identified from it.

It shares no formula with the library's effects and none with the fit, but for the geometry of
chapter 2. Per step:

    L·di/dt = v − R·i − K_T·ω,  v = PI(demand/K_assumed − i) within ±voltage
    J·ω̇    = K_T·i − B·ω − T_even − T_C − T_cog(θ)
    T_even  = ½(1/η + η_b)·F_N·(dy_p/dθ)·(w − μ)/w            (9)–(12) corrected, statics.py
    T_C     by (13): stick while |ω| < ε and |net| ≤ T_sf + C₁·T_even, else sliding with
              (C₀ + (T_sf − C₀)·exp(−(ω/ω_st)²) + C₁·T_even)·(1 + κ·sin(θ/N_g))·sgn ω
    F_N     = F(s − c)·(1 + h·z),  s = y_p(θ) − clearance − wear − run-out·sin φ_disc
              dz = (ds/δ)·(1 − z·sgn ds)                       hysteresis (Dahl, 1968)
              ċ = (ρ·s − c)/τ                                  creep (standard linear solid)
    μ       = μ₀·(1 − k_v·ln(1 + |ω_disc|/ω₁))·(1 − k_p·(F_N/F₀ − 1))·(1 − k_T·(T − T₀)₊)
    Ṫ       = (|μ|·F_N·|v_disc| − H·(T − T₀))/C,   wear' = k_w·|μ|·F_N·|v_disc|

and a load cell reads F_N with a gain error, a lag and noise: the paper has none. With a
saturation velocity T_C is (C₀ + C₁·T_even)·sat(ω/ω_s) instead, the form that the fit has.
"""

from __future__ import annotations

import math
import random

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.bench.settings import BenchSettings
from engb_core.mechanism.kinematics import Mechanism, OVERSHOOT
from engb_core.mechanism.statics import efficiency_load_gain
from engb_core.physics.compiled import compiled, kernel, Numbers

__all__ = ['BenchBrake', 'mean_load_torque', 'pad_friction_at']

Array = NDArray[np.float64]

# Of the integration [s]: a tenth of the current loop's time constant.
STEP = 2.5e-5
TABLE_POINTS = 4000

# Up to this speed the disc's friction turns round with its direction; ω₁ of its fall [rad/s].
DISC_REVERSAL, DISC_SLOW = 0.5, 5.0

# Places in the state.
(CURRENT, INTEGRAL, ANGLE, SPEED, MEMORY, CREEP, DISC_ANGLE, TEMPERATURE, WEAR, FORCE, CELL,
 LOAD_TORQUE, FRICTION_TORQUE, COMPRESSION, PAD_FRICTION) = range(15)
STATES = 15

# Places in the numbers.
(P_J, P_B, P_KT, P_KA, P_R, P_L, P_V, P_KP, P_KI, P_C0, P_SF, P_ST, P_EPS, P_C1, P_WAVE, P_NG,
 P_H, P_DELTA, P_RHO, P_TAU, P_MU, P_KV, P_KF, P_KT_HEAT, P_F0, P_RUN, P_RADIUS, P_HEAT, P_COOL,
 P_T0, P_WEAR, P_CELL, P_CUT, P_CLEAR, P_SCALE, P_SAT, P_K1, P_K2, P_K3) = range(39)


def mean_load_torque(settings: BenchSettings, angle: ArrayLike, disc_speed: float = 0.0,
                     temperature: float | None = None) -> Array:
    """Return the even part of the load torque [N·m] at `angle` [rad], any shape.

    As long as neither hysteresis nor creep, run-out nor wear acts.

    Args:
        settings: the brake.
        angle: motor angle.
        disc_speed: [rad/s], positive where the turning disc helps.
        temperature: of the pads [°C]; None: the ambient one.
    """
    mechanism = settings.mechanism
    posture = mechanism.posture(angle)
    grip = np.maximum(posture.pad_onto - mechanism.clearance, 0.0)
    force = np.polynomial.polynomial.polyval(grip, (0.0, *mechanism.clamp_stiffness))
    friction = pad_friction_at(settings, force, disc_speed, temperature)
    return (efficiency_load_gain(mechanism)[0] * force * posture.ratio
            * (posture.wedge - friction) / posture.wedge)


def pad_friction_at(settings: BenchSettings, force: ArrayLike, disc_speed: float,
                    temperature: float | None = None) -> Array:
    """Return μ [-] at clamp force `force` [N], any shape, signed by the disc's direction.

    Args:
        settings: the brake.
        force: F_N.
        disc_speed: [rad/s].
        temperature: of the pads [°C]; None: the ambient one.
    """
    numbers = _numbers(settings, 0.0, False)
    heat = settings.ambient if temperature is None else temperature
    force = np.asarray(force, float)
    return np.array([_pad_friction(numbers, value, float(disc_speed), float(heat))
                     for value in force.ravel().tolist()]).reshape(force.shape)


class BenchBrake:
    """The bench brake, run forward in time.

    Args:
        settings: its numbers.
        added_inertia: a known disc on the motor's shaft [kg·m²].
        unloaded: the caliper is taken off.
        seed: of the load cell's noise.
    """

    def __init__(self, settings: BenchSettings, added_inertia: float = 0.0,
                 unloaded: bool = False, seed: int = 1) -> None:
        self.settings = settings
        self._numbers = _numbers(settings, added_inertia, unloaded)
        self._cogging = np.array(settings.cogging, float).reshape(-1, 3)
        self._table, self._low, self._spacing = _table(settings.mechanism)
        self._state = np.zeros(STATES)
        self._state[TEMPERATURE] = settings.ambient
        self._random = random.Random(f'load cell {seed}')

    def advance(self, torque: float, duration: float, disc_speed: float = 0.0,
                pad_temperature: float = 20.0) -> None:
        """Run on for `duration` [s] with `torque` [N·m] demanded and the disc at `disc_speed`.

        The pad heats by its own work; `pad_temperature` is not listened to.
        """
        steps = max(1, math.ceil(duration / STEP - 1e-9))
        _advance(self._numbers, self._cogging, self._table, self._low, self._spacing, self._state,
                 float(torque), float(disc_speed), duration / steps, steps)

    @property
    def position(self) -> float:
        """Motor angle [rad]."""
        return float(self._state[ANGLE])

    @property
    def velocity(self) -> float:
        """Motor speed [rad/s]."""
        return float(self._state[SPEED])

    @property
    def effort(self) -> float:
        """What the drive reports, without its noise: assumed K_T × current [N·m]."""
        return float(self.settings.assumed_torque_constant * self._state[CURRENT])

    @property
    def load_torque(self) -> float:
        """The even part of what the load asks of the motor [N·m]."""
        return float(self._state[LOAD_TORQUE])

    @property
    def friction_torque(self) -> float:
        """T_C [N·m], with its sign."""
        return float(self._state[FRICTION_TORQUE])

    @property
    def clamp_force(self) -> float:
        """True F_N [N]."""
        return float(self._state[FORCE])

    @property
    def pad_temperature(self) -> float:
        """[°C]."""
        return float(self._state[TEMPERATURE])

    @property
    def pad_friction(self) -> float:
        """μ [-] as it is now, signed by the disc's direction."""
        return float(self._state[PAD_FRICTION])

    @property
    def wear(self) -> float:
        """Of the pads [m]."""
        return float(self._state[WEAR])

    def load_cell(self) -> float:
        """Return what the load cell reads [N], noise and all."""
        return float(self._state[CELL] + self._random.gauss(0.0, self.settings.cell_noise))


def _numbers(settings: BenchSettings, added: float, unloaded: bool) -> Array:
    mechanism = settings.mechanism
    scale, gain = efficiency_load_gain(mechanism)
    stiffness = [*mechanism.clamp_stiffness, 0.0, 0.0, 0.0][:3]
    if unloaded:
        stiffness = [0.0, 0.0, 0.0]
    # Pole of the plant cancelled: the closed current loop is a first-order lag.
    omega = 2.0 * math.pi * settings.current_bandwidth
    s = settings
    return np.array([
        s.inertia + added, s.viscous_friction, s.torque_constant, s.assumed_torque_constant,
        s.resistance, s.inductance, s.voltage, omega * s.inductance, omega * s.resistance,
        s.coulomb, max(s.breakaway, s.coulomb), s.stribeck_velocity, s.standstill, gain,
        s.friction_waviness, mechanism.gear_ratio, s.hysteresis, s.hysteresis_distance, s.creep,
        s.creep_time, s.pad_friction, s.friction_by_speed, s.friction_by_force,
        s.friction_by_heat, s.reference_force, s.runout, s.friction_radius, s.heat_capacity,
        s.cooling, s.ambient, s.wear_rate, s.cell_gain, 2.0 * math.pi * s.cell_cutoff,
        mechanism.clearance, scale, s.saturation_velocity, *stiffness])


def _table(mechanism: Mechanism) -> tuple[Array, float, float]:
    """Return y_p, dy_p/dθ and w over the stroke (n, 3), its first angle and spacing [rad]."""
    angles = np.linspace(-OVERSHOOT * mechanism.stroke, mechanism.stroke, TABLE_POINTS)
    posture = mechanism.posture(angles)
    table = np.column_stack([posture.pad_onto, posture.ratio, posture.wedge])
    return np.ascontiguousarray(table), float(angles[0]), float(angles[1] - angles[0])


@compiled
def _pad_friction(p: Numbers, force: float, disc_speed: float, temperature: float) -> float:
    heat = max(temperature - p[P_T0], 0.0)
    return (p[P_MU] * math.tanh(disc_speed / DISC_REVERSAL)
            * (1.0 - p[P_KV] * math.log(1.0 + abs(disc_speed) / DISC_SLOW))
            * (1.0 - p[P_KF] * (force / p[P_F0] - 1.0))
            * (1.0 - p[P_KT_HEAT] * heat))


@kernel
def _advance(p: Array, cogging: Array, table: Array, low: float, spacing: float, state: Array,
             demand: float, disc_speed: float, step: float, steps: int) -> None:
    wanted = demand / p[P_KA]
    for _ in range(steps):
        # The drive.
        error = wanted - state[CURRENT]
        volts = p[P_KP] * error + state[INTEGRAL]
        limited = min(p[P_V], max(-p[P_V], volts))
        if limited == volts:
            state[INTEGRAL] += step * p[P_KI] * error
        omega = state[SPEED]
        state[CURRENT] += step * (limited - p[P_R] * state[CURRENT]
                                  - p[P_KT] * omega) / p[P_L]
        torque = p[P_KT] * state[CURRENT]
        # The mechanism's posture; beyond the table it goes on straight.
        theta = state[ANGLE]
        place = (theta - low) / spacing
        index = int(min(max(math.floor(place), 0.0), table.shape[0] - 2.0))
        part = place - index
        onto = table[index, 0] + part * (table[index + 1, 0] - table[index, 0])
        part = min(max(part, 0.0), 1.0)
        ratio = table[index, 1] + part * (table[index + 1, 1] - table[index, 1])
        wedge = table[index, 2] + part * (table[index + 1, 2] - table[index, 2])
        # The caliper: compression with run-out and wear, creep, hysteresis.
        state[DISC_ANGLE] += step * disc_speed
        grip = onto - p[P_CLEAR] - state[WEAR] - p[P_RUN] * math.sin(state[DISC_ANGLE])
        grip = max(grip, 0.0)
        moved = (grip - state[COMPRESSION]) / p[P_DELTA]
        state[COMPRESSION] = grip
        state[CREEP] += step * (p[P_RHO] * grip - state[CREEP]) / p[P_TAU]
        state[MEMORY] += moved - abs(moved) * state[MEMORY]
        pressed = max(grip - state[CREEP], 0.0)
        elastic = pressed * (p[P_K1] + pressed * (p[P_K2] + pressed * p[P_K3]))
        force = elastic * (1.0 + p[P_H] * state[MEMORY])
        state[FORCE] = force
        state[CELL] += step * p[P_CUT] * (p[P_CELL] * force - state[CELL])
        # Pads on the disc.
        mu = _pad_friction(p, force, disc_speed, state[TEMPERATURE])
        state[PAD_FRICTION] = mu
        rubbed = abs(mu) * force * abs(disc_speed) * p[P_RADIUS]
        state[TEMPERATURE] += step * (rubbed - p[P_COOL] * (state[TEMPERATURE] - p[P_T0])
                                      ) / p[P_HEAT]
        state[WEAR] += step * p[P_WEAR] * rubbed
        load = p[P_SCALE] * force * ratio * (wedge - mu) / wedge
        state[LOAD_TORQUE] = load
        waves = 0.0
        for row in range(cogging.shape[0]):
            waves += cogging[row, 1] * math.sin(cogging[row, 0] * theta + cogging[row, 2])
        net = torque - load - waves
        carried = p[P_C1] * abs(load)
        if p[P_SAT] > 0.0:
            friction = (p[P_C0] + carried) * min(1.0, max(-1.0, omega / p[P_SAT]))
            state[FRICTION_TORQUE] = friction
            fresh = omega + step * (net - friction - p[P_B] * omega) / p[P_J]
        else:
            # (13).
            wavy = 1.0 + p[P_WAVE] * math.sin(theta / p[P_NG])
            if abs(omega) < p[P_EPS] and abs(net) <= (p[P_SF] + carried) * wavy:
                state[FRICTION_TORQUE] = net
                state[SPEED] = 0.0
                continue
            sense = math.copysign(1.0, omega if abs(omega) >= p[P_EPS] else net)
            level = (p[P_C0] + (p[P_SF] - p[P_C0]) * math.exp(-(omega / p[P_ST]) ** 2)
                     + carried) * wavy
            state[FRICTION_TORQUE] = level * sense
            fresh = omega + step * (net - level * sense - p[P_B] * omega) / p[P_J]
            if fresh * omega < 0.0:
                # Through zero: whether it stays there is the next step's to say.
                fresh = 0.0
        state[ANGLE] = theta + 0.5 * step * (omega + fresh)
        state[SPEED] = fresh
