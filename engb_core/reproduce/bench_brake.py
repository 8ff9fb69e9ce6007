"""A brake for the bench that is *more* than the model which is identified from it.

It shares no formula with the library's effects and none with the fit, but for the geometry of
chapter 2. Per step:

    L·di/dt = v − R·i − K_T·ω,  v = PI(demand/K_assumed − i) within ±voltage
    J·ω̇    = K_T·i − B·ω − T_even(θ, μ) − T_C − T_cog(θ)
    T_even  = ½(1/η + η_b)·F_N·(dy_p/dθ)·(w − μ)/w            (9)–(12) corrected, statics.py
    T_C     by (13): stick while |ω| < ε and |net| ≤ T_sf + C₁·T_even, else sliding with
              (C₀ + (T_sf − C₀)·exp(−(ω/ω_st)²) + C₁·T_even)·(1 + κ·sin(θ/N_g))·sgn ω
    F_N     = F(s − c)·(1 + h·z),  s = y_p(θ) − clearance − wear − run-out·sin φ_disc
              ż = (ṡ/δ)·(1 − z·sgn ṡ)                          hysteresis (Dahl, 1968)
              ċ = (ρ·s − c)/τ                                  creep (standard linear solid)
    μ       = μ₀·(1 − k_v·ln(1 + |ω_disc|/ω₀))·(1 − k_p·(F_N/F₀ − 1))·(1 − k_T·(T − T₀)₊)
    Ṫ       = (|μ|·F_N·|v_disc| − H·(T − T₀))/C,   ẇear = k_w·|μ|·F_N·|v_disc|

and a load cell reads F_N with a gain error, a lag and noise: the paper has none.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
import math
import os
from pathlib import Path
import random
from typing import Any

import numpy as np
from numpy.typing import NDArray
import yaml

from engb_core.compiled import kernel
from engb_core.errors import InputError
from engb_core.kinematics import CHOSEN, Mechanism, OVERSHOOT
from engb_core.statics import efficiency_load_gain

__all__ = ['BenchBrake', 'BenchSettings']

Array = NDArray[np.float64]

STEP = 2.5e-5
TABLE_POINTS = 2000

# Places in the state.
(CURRENT, INTEGRAL, ANGLE, SPEED, MEMORY, CREEP, DISC_ANGLE, TEMPERATURE, WEAR, FORCE, CELL,
 LOAD_TORQUE, FRICTION_TORQUE, COMPRESSION) = range(14)
STATES = 14


@dataclass(frozen=True)
class BenchSettings:
    """The bench brake's numbers, SI units; 0 takes an effect out.

    Attributes:
        mechanism: the geometry, clearance and stiffness.
        inertia, viscous_friction: J [kg·m²], B [N·m·s/rad].
        torque_constant: K_T [N·m/A], the true one.
        resistance, inductance, voltage: of the phase [Ω, H], of the supply [V].
        current_bandwidth: of the current loop [Hz].
        coulomb, breakaway, stribeck_velocity: C₀, T_sf [N·m], ω_st [rad/s].
        standstill: ε of (13) [rad/s].
        friction_waviness: κ of the screw's friction over its turn [-].
        cogging: rows of order [1/rev], amplitude [N·m], phase [rad].
        hysteresis, hysteresis_distance: h [-], δ [m].
        creep, creep_time: ρ [-], τ [s].
        pad_friction: μ₀ [-] at rest speed, F₀ and T₀; sign by the disc's direction.
        friction_by_speed, friction_by_force, friction_by_heat: k_v [-], k_p [-], k_T [1/K].
        reference_force: F₀ [N].
        runout: [m] either way, once per turn of the disc.
        friction_radius: of the pads on the disc [m].
        heat_capacity, cooling, ambient: C [J/K], H [W/K], T₀ [°C].
        wear_rate: k_w [m/J].
        cell_gain, cell_noise, cell_cutoff: of the load cell [-], [N], [Hz].
    """

    mechanism: Mechanism = CHOSEN
    inertia: float = 5.62e-5
    viscous_friction: float = 9.3e-4
    torque_constant: float = 0.0174
    resistance: float = 0.12
    inductance: float = 6.0e-5
    voltage: float = 12.0
    current_bandwidth: float = 400.0
    coulomb: float = 0.012
    breakaway: float = 0.018
    stribeck_velocity: float = 2.0
    standstill: float = 0.02
    friction_waviness: float = 0.03
    cogging: tuple[tuple[float, float, float], ...] = ((12.0, 4.0e-3, 0.7), (4.0, 1.5e-3, -1.1))
    hysteresis: float = 0.06
    hysteresis_distance: float = 6.0e-5
    creep: float = 0.08
    creep_time: float = 0.8
    pad_friction: float = 0.30
    friction_by_speed: float = 0.06
    friction_by_force: float = 0.05
    friction_by_heat: float = 4.0e-4
    reference_force: float = 2000.0
    runout: float = 1.0e-5
    friction_radius: float = 0.11
    heat_capacity: float = 900.0
    cooling: float = 12.0
    ambient: float = 20.0
    wear_rate: float = 0.0
    cell_gain: float = 1.01
    cell_noise: float = 8.0
    cell_cutoff: float = 150.0

    def __post_init__(self) -> None:
        for entry in fields(self):
            if entry.name in ('mechanism', 'cogging'):
                continue
            value = getattr(self, entry.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise InputError(f'bench brake: {entry.name} is {value}; it must not be below 0')
        for name in ('inertia', 'torque_constant', 'resistance', 'inductance', 'voltage',
                     'current_bandwidth', 'stribeck_velocity', 'standstill', 'creep_time',
                     'hysteresis_distance', 'heat_capacity', 'reference_force', 'cell_cutoff'):
            if getattr(self, name) <= 0.0:
                raise InputError(f'bench brake: {name} must be above 0')

    @property
    def load_gain(self) -> float:
        """C₁ [-], from the efficiencies."""
        return efficiency_load_gain(self.mechanism)[1]

    @classmethod
    def read(cls, path: str | os.PathLike) -> BenchSettings:
        """Read a file that `write` made; InputError names what is wrong."""
        path = Path(path)
        try:
            data: Any = yaml.safe_load(path.read_text(encoding='utf-8'))
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise InputError(f'{path}: cannot be read; give a bench brake file') from error
        known = {entry.name for entry in fields(cls)}
        if not isinstance(data, dict) or not set(data) <= known:
            wrong = sorted(set(data) - known) if isinstance(data, dict) else 'no mapping'
            raise InputError(f'{path}: unknown {wrong}; a bench brake file holds '
                             f'{", ".join(sorted(known))}')
        try:
            mechanism = dict(data.pop('mechanism'))
            mechanism['clamp_stiffness'] = tuple(mechanism['clamp_stiffness'])
            cogging = tuple(tuple(float(item) for item in row) for row in data.pop('cogging'))
            return cls(Mechanism(**mechanism), cogging=cogging,
                       **{name: float(value) for name, value in data.items()})
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f'{path}: not a bench brake file ({error})') from error

    def write(self, path: str | os.PathLike) -> None:
        """Write the numbers as YAML."""
        data = asdict(self)
        data['mechanism']['clamp_stiffness'] = list(self.mechanism.clamp_stiffness)
        data['cogging'] = [list(row) for row in self.cogging]
        Path(path).write_text(yaml.safe_dump(data, sort_keys=False), encoding='utf-8')


class BenchBrake:
    """The bench brake, run forward in time.

    Args:
        settings: its numbers.
        assumed_torque_constant: by which the drive turns torque into current and back [N·m/A].
        added_inertia: a known disc on the motor's shaft [kg·m²].
        unloaded: the caliper is taken off.
        seed: of the load cell's noise.
    """

    def __init__(self, settings: BenchSettings, assumed_torque_constant: float = 0.0174,
                 added_inertia: float = 0.0, unloaded: bool = False, seed: int = 1) -> None:
        self.settings = settings
        self.assumed_torque_constant = assumed_torque_constant
        self._numbers = _numbers(settings, assumed_torque_constant, added_inertia, unloaded)
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
        return float(self.assumed_torque_constant * self._state[CURRENT])

    @property
    def load_torque(self) -> float:
        """The even part of what the load asks of the motor [N·m]."""
        return float(self._state[LOAD_TORQUE])

    @property
    def clamp_force(self) -> float:
        """True F_N [N]."""
        return float(self._state[FORCE])

    @property
    def pad_temperature(self) -> float:
        """[°C]."""
        return float(self._state[TEMPERATURE])

    @property
    def wear(self) -> float:
        """Of the pads [m]."""
        return float(self._state[WEAR])

    def load_cell(self) -> float:
        """Return what the load cell reads [N], noise and all."""
        return float(self._state[CELL] + self._random.gauss(0.0, self.settings.cell_noise))


# Places in the numbers.
(P_J, P_B, P_KT, P_KA, P_R, P_L, P_V, P_KP, P_KI, P_C0, P_SF, P_ST, P_EPS, P_C1, P_WAVE, P_NG,
 P_H, P_DELTA, P_RHO, P_TAU, P_MU, P_KV, P_KF, P_KT_HEAT, P_F0, P_RUN, P_RADIUS, P_HEAT, P_COOL,
 P_T0, P_WEAR, P_CELL, P_CUT, P_CLEAR, P_SCALE, P_K1, P_K2, P_K3) = range(38)


def _numbers(settings: BenchSettings, assumed: float, added: float, unloaded: bool) -> Array:
    mechanism = settings.mechanism
    scale, gain = efficiency_load_gain(mechanism)
    stiffness = [*mechanism.clamp_stiffness, 0.0, 0.0, 0.0][:3]
    if unloaded:
        stiffness = [0.0, 0.0, 0.0]
    # Pole of the plant cancelled: the closed current loop is a first-order lag.
    omega = 2.0 * math.pi * settings.current_bandwidth
    s = settings
    return np.array([
        s.inertia + added, s.viscous_friction, s.torque_constant, assumed, s.resistance,
        s.inductance, s.voltage, omega * s.inductance, omega * s.resistance, s.coulomb,
        max(s.breakaway, s.coulomb), s.stribeck_velocity, s.standstill, gain,
        s.friction_waviness, mechanism.gear_ratio, s.hysteresis, s.hysteresis_distance, s.creep,
        s.creep_time, s.pad_friction, s.friction_by_speed, s.friction_by_force,
        s.friction_by_heat, s.reference_force, s.runout, s.friction_radius, s.heat_capacity,
        s.cooling, s.ambient, s.wear_rate, s.cell_gain, 2.0 * math.pi * s.cell_cutoff,
        mechanism.clearance, scale, *stiffness])


def _table(mechanism: Mechanism) -> tuple[Array, float, float]:
    """Return y_p, dy_p/dθ and w over the stroke (n, 3), its first angle and spacing [rad]."""
    angles = np.linspace(-OVERSHOOT * mechanism.stroke, mechanism.stroke, TABLE_POINTS)
    posture = mechanism.posture(angles)
    table = np.column_stack([posture.pad_onto, posture.ratio, posture.wedge])
    return np.ascontiguousarray(table), float(angles[0]), float(angles[1] - angles[0])


@kernel
def _advance(p, cogging, table, low, spacing, state, demand, disc_speed, step, steps):
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
        # The mechanism's posture.
        theta = state[ANGLE]
        place = (theta - low) / spacing
        index = int(min(max(math.floor(place), 0.0), table.shape[0] - 2.0))
        part = min(max(place - index, 0.0), 1.0)
        onto = table[index, 0] + part * (table[index + 1, 0] - table[index, 0])
        ratio = table[index, 1] + part * (table[index + 1, 1] - table[index, 1])
        wedge = table[index, 2] + part * (table[index + 1, 2] - table[index, 2])
        # The caliper: compression with run-out and wear, creep, hysteresis.
        state[DISC_ANGLE] += step * disc_speed
        grip = onto - p[P_CLEAR] - state[WEAR] - p[P_RUN] * math.sin(state[DISC_ANGLE])
        grip = max(grip, 0.0)
        change = grip - state[COMPRESSION]
        state[COMPRESSION] = grip
        state[CREEP] += step * (p[P_RHO] * grip - state[CREEP]) / p[P_TAU]
        moved = change / p[P_DELTA]
        state[MEMORY] += moved - abs(moved) * state[MEMORY]
        pressed = max(grip - state[CREEP], 0.0)
        elastic = pressed * (p[P_K1] + pressed * (p[P_K2] + pressed * p[P_K3]))
        force = elastic * (1.0 + p[P_H] * state[MEMORY])
        state[FORCE] = force
        state[CELL] += step * p[P_CUT] * (p[P_CELL] * force - state[CELL])
        # Pads on the disc.
        heat = max(state[TEMPERATURE] - p[P_T0], 0.0)
        mu = (p[P_MU] * math.tanh(disc_speed / 0.5)
              * (1.0 - p[P_KV] * math.log(1.0 + abs(disc_speed) / 5.0))
              * (1.0 - p[P_KF] * (force / p[P_F0] - 1.0))
              * (1.0 - p[P_KT_HEAT] * heat))
        rubbed = abs(mu) * force * abs(disc_speed) * p[P_RADIUS]
        state[TEMPERATURE] += step * (rubbed - p[P_COOL] * (state[TEMPERATURE] - p[P_T0])
                                      ) / p[P_HEAT]
        state[WEAR] += step * p[P_WEAR] * rubbed
        load = p[P_SCALE] * force * ratio * (wedge - mu) / wedge
        state[LOAD_TORQUE] = load
        waves = 0.0
        for row in range(cogging.shape[0]):
            waves += cogging[row, 1] * math.sin(cogging[row, 0] * theta + cogging[row, 2])
        # (13).
        net = torque - load - waves
        carried = p[P_C1] * abs(load)
        wavy = 1.0 + p[P_WAVE] * math.sin(theta / p[P_NG])
        if abs(omega) < p[P_EPS] and abs(net) <= (p[P_SF] + carried) * wavy:
            state[FRICTION_TORQUE] = net
            state[SPEED] = 0.0
            continue
        sense = math.copysign(1.0, omega) if abs(omega) >= p[P_EPS] else math.copysign(1.0, net)
        level = (p[P_C0] + (p[P_SF] - p[P_C0]) * math.exp(-(omega / p[P_ST]) ** 2)
                 + carried) * wavy
        state[FRICTION_TORQUE] = level * sense
        fresh = omega + step * (net - level * sense - p[P_B] * omega) / p[P_J]
        if fresh * omega < 0.0:
            # Through zero: whether it stays there is the next step's to say.
            fresh = 0.0
        state[ANGLE] = theta + 0.5 * step * (omega + fresh)
        state[SPEED] = fresh
