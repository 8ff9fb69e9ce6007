# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Forces of the brake: clamp force, torque and friction; (2) to (13) and (44), corrected.

With γ = β − θ_lv (the lever pushes at a right angle to its arm) and w = dy_p/dx_p the balances of
pad and gear (2)–(7) give

    F_M·(cos γ + w·sin γ) = (w − μ)·F_N                       (9), sign corrected
    F_M,bs = F_M·l₂′·cos²θ_lv/l₁                              (10)
    T_L = L/(2π·N_g·η)·F_M,bs                                 (11)

so that, without losses, T_L·dθ_M = F_N·(dy_p − μ·dx_p): virtual work. The paper prints μ − d/r in
(9) and (12), takes β for γ and d/r for w (small angles), and has no cos²θ_lv in (10): a nut that
moves straight, pushing a lever that turns, slides along it, so only the part of the force at a
right angle to the lever works. All of that vanishes at θ_lv = θ_g = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.errors import InputError
from engb_core.mechanism.kinematics import Mechanism, rising_root
from engb_core.model import EffectSetting, Friction, LoadTorque, Model

__all__ = ['back_efficiency', 'clamp_force', 'clamp_force_of_torque', 'coulomb_friction',
           'efficiency_load_gain', 'LoadPolynomial', 'load_polynomial', 'load_values',
           'mechanism_load', 'motor_angle', 'pad_friction', 'paper_torque', 'self_energizing_gain',
           'torque_of_clamp_force']

Array = NDArray[np.float64]


def clamp_force(mechanism: Mechanism, motor_angle: ArrayLike) -> Array:
    """Return F_N = f(θ) [N] at `motor_angle` [rad], any shape; 0 before the pads touch."""
    return _force(mechanism, mechanism.posture(motor_angle).pad_onto)


def motor_angle(mechanism: Mechanism, force: ArrayLike) -> Array:
    """Return the motor angle [rad] that gives clamp force `force` [N] (contact angle for 0).

    Raises:
        InputError: a force below 0, or more than the stroke gives.
    """
    wanted = np.asarray(force, float)
    highest = float(clamp_force(mechanism, mechanism.stroke))
    if not np.all((wanted >= 0.0) & (wanted <= highest)):
        raise InputError(f'mechanism: clamp force must lie within 0 and {highest:.4g} N, what the '
                         'stroke gives')
    largest = float(mechanism.posture(mechanism.stroke).pad_onto) - mechanism.clearance
    stiffness = np.array((0.0, *mechanism.clamp_stiffness))
    slope = np.polynomial.polynomial.polyder(stiffness)

    def difference(grip: Array) -> tuple[Array, Array]:
        return (np.asarray(np.polynomial.polynomial.polyval(grip, stiffness) - wanted, float),
                np.asarray(np.polynomial.polynomial.polyval(grip, slope), float))

    grip = rising_root(difference, np.zeros_like(wanted),
                       np.full_like(wanted, largest * (1.0 + 1e-12)),
                       'mechanism: clamp force outside the stroke')
    return mechanism.motor_angle_of_pad(mechanism.clearance + grip)


def torque_of_clamp_force(mechanism: Mechanism, force: ArrayLike, angle: ArrayLike,
                          pad_friction: float = 0.0, driving: ArrayLike = True) -> Array:
    """Return the motor torque T_L [N·m] that balances clamp force `force` at motor angle `angle`.

    Args:
        mechanism: the geometry.
        force: F_N [N].
        angle: θ_M [rad].
        pad_friction: μ [-], positive where the turning disc pulls the pad up the wedge, negative
            where it turns the other way, 0 where it stands.
        driving: True while the motor moves the load, False while the load moves the motor.

    Raises:
        InputError: μ ≥ w, so that the brake locks itself.
    """
    posture = mechanism.posture(angle)
    _refuse_self_locking(posture.wedge, pad_friction)
    lossless = (np.asarray(force, float) * posture.ratio
                * (posture.wedge - pad_friction) / posture.wedge)
    factor = np.where(driving, 1.0 / mechanism.efficiency, back_efficiency(mechanism))
    return lossless * factor


def clamp_force_of_torque(mechanism: Mechanism, torque: ArrayLike, angle: ArrayLike,
                          pad_friction: float = 0.0, driving: ArrayLike = True) -> Array:
    """Return F_N [N] from the motor torque, the inverse of `torque_of_clamp_force`.

    Raises:
        InputError: the brake locks itself, or the screw holds any load (back_efficiency ≤ 0), so
            that the torque says nothing of the force.
    """
    if not np.all(driving) and back_efficiency(mechanism) <= 0.0:
        raise InputError('mechanism: with an efficiency of '
                         f'{mechanism.efficiency} the load cannot drive the screw back; while '
                         'releasing, the torque says nothing of the clamp force')
    unit = torque_of_clamp_force(mechanism, 1.0, angle, pad_friction, driving)
    return np.asarray(torque, float) / unit


def paper_torque(mechanism: Mechanism, force: ArrayLike, angle: ArrayLike,
                 pad_friction: float = 0.0) -> Array:
    """Return T_L [N·m] by (9)–(12) with small angles, the sign of (9) corrected, nothing else."""
    posture = mechanism.small_angle_posture(angle)
    _refuse_self_locking(posture.wedge, pad_friction)
    bend, slope = mechanism.lever_bend, mechanism.gear_offset / mechanism.gear_radius
    pushing = (slope - pad_friction) / (np.cos(bend) + slope * np.sin(bend)) * np.asarray(force)
    arm = ((mechanism.lever_output * np.cos(bend) + posture.pad_onto)
           / np.cos(bend - posture.lever_angle))
    screw = pushing * arm / mechanism.lever_input
    torque: Array = (mechanism.screw_lead
                     / (2.0 * np.pi * mechanism.gear_ratio * mechanism.efficiency) * screw)
    return torque


def self_energizing_gain(wedge: ArrayLike, pad_friction: float) -> Array:
    """Return P = (w − μ)/w, load torque with the disc turning over standing, (44) corrected.

    Raises:
        InputError: μ ≥ w.
    """
    wedge = np.asarray(wedge, float)
    _refuse_self_locking(wedge, pad_friction)
    ratio: Array = (wedge - pad_friction) / wedge
    return ratio


def pad_friction(gain: float, wedge: float, gain_std: float = 0.0) -> tuple[float, float]:
    """Return μ = w·(1 − P) and its standard deviation from the gain P, (44) corrected."""
    return wedge * (1.0 - gain), abs(wedge) * gain_std


def back_efficiency(mechanism: Mechanism) -> float:
    """Return the efficiency with the load driving; ≤ 0: the screw holds by itself."""
    if mechanism.back_efficiency is not None:
        return mechanism.back_efficiency
    return 2.0 - 1.0 / mechanism.efficiency


def efficiency_load_gain(mechanism: Mechanism) -> tuple[float, float]:
    """Return what an identification makes of the mechanism's losses: (scale, load_gain).

    Torque applying is T/η, releasing T·η_b, with T without losses; its even part is scale·T and
    its odd part load_gain·(even part): the C₁ of (42).
    """
    drive, back = 1.0 / mechanism.efficiency, back_efficiency(mechanism)
    return 0.5 * (drive + back), (drive - back) / (drive + back)


@dataclass(frozen=True)
class LoadPolynomial:
    """The chain as a model file's load and friction, and its largest error [N·m]."""

    load_torque: LoadTorque
    load_gain: float
    error: float

    def friction(self, coulomb: float, saturation_velocity: float) -> Friction:
        """Return the friction section: `coulomb` C₀ [N·m], C₁ from the efficiencies."""
        return Friction(coulomb, self.load_gain, saturation_velocity)


def load_polynomial(mechanism: Mechanism, pad_friction: float = 0.0,
                    degree: int = 7) -> LoadPolynomial:
    """Return the whole chain as a polynomial from the contact angle, for the model file.

    So the plant runs the mechanism, not only the paper's cubic: at degree 7 the difference lies
    far below any measurement.
    """
    contact = float(motor_angle(mechanism, 0.0))
    angle = np.linspace(contact, mechanism.stroke, 400)
    scale, gain = efficiency_load_gain(mechanism)
    lossless = torque_of_clamp_force(mechanism, clamp_force(mechanism, angle), angle,
                                     pad_friction) * mechanism.efficiency
    torque = scale * lossless
    travel = (angle - contact) / (mechanism.stroke - contact)
    powers = np.arange(1, degree + 1)
    found = np.linalg.lstsq(travel[:, None]**powers, torque, rcond=None)[0]
    error = float(np.abs(travel[:, None]**powers @ found - torque).max())
    coefficients = found / (mechanism.stroke - contact)**powers
    return LoadPolynomial(LoadTorque('polynomial', (0.0, *coefficients.tolist()), contact), gain,
                          error)


def load_values(load: LoadTorque, angle: ArrayLike) -> Array:
    """Return T_L [N·m] of a polynomial `load` at `angle` [rad], any shape; 0 before contact."""
    angle = np.asarray(angle, float)
    beyond = angle if load.contact_angle is None else angle - load.contact_angle
    torque = np.polynomial.polynomial.polyval(beyond, load.coefficients)
    return np.asarray(torque if load.contact_angle is None
                      else np.where(beyond > 0.0, torque, 0.0), float)


def mechanism_load(model: Model, mechanism: Mechanism, pad_friction: float = 0.0) -> Model:
    """Return `model` with the mechanism's load torque and load-dependent friction.

    Args:
        model: its motor, Coulomb friction and cogging stay.
        mechanism: the geometry.
        pad_friction: μ [-]; above 0 the effect `self_energizing` is added, with the wedge's mean
            slope over the stroke (each angle counted by the square of its load).

    Raises:
        InputError: the brake locks itself.
    """
    chain = load_polynomial(mechanism)
    effects = model.effects
    if pad_friction > 0.0:
        angle = np.linspace(0.0, mechanism.stroke, 200)
        wedge = mechanism.posture(angle).wedge
        load = torque_of_clamp_force(mechanism, clamp_force(mechanism, angle), angle)
        mean = float(wedge @ load**2 / (load @ load))
        gain = float(self_energizing_gain(mean, pad_friction))
        effects += (EffectSetting('self_energizing', {'load_ratio': gain}),)
    return replace(model, load_torque=chain.load_torque, effects=effects, friction=replace(
        model.friction, load_gain=chain.load_gain))


def coulomb_friction(velocity: ArrayLike, net_torque: ArrayLike, level: ArrayLike,
                     static_level: ArrayLike, standstill: float) -> Array:
    """Return T_C [N·m], equation (13), with its stick phase.

    Args:
        velocity: ω [rad/s].
        net_torque: T_M − T_L [N·m]; what friction has to hold while it sticks.
        level: C₀ + C₁(F_N) [N·m], sliding.
        static_level: T_sf + C₁(F_N) [N·m]; the paper's F_cl in this bracket is F_N.
        standstill: ε [rad/s], below which the shaft counts as standing.
    """
    velocity, net = np.asarray(velocity, float), np.asarray(net_torque, float)
    static_level = np.asarray(static_level, float)
    sticking = np.clip(net, -static_level, static_level)
    torque: Array = np.where(np.abs(velocity) > standstill, np.asarray(level) * np.sign(velocity),
                             sticking)
    return torque


def _force(mechanism: Mechanism, pad_onto: Array) -> Array:
    grip = np.maximum(pad_onto - mechanism.clearance, 0.0)
    return np.asarray(np.polynomial.polynomial.polyval(grip, (0.0, *mechanism.clamp_stiffness)),
                      float)


def _refuse_self_locking(wedge: ArrayLike, pad_friction: float) -> None:
    smallest = float(np.min(wedge))
    if pad_friction >= smallest:
        raise InputError(
            f'mechanism: pad friction {pad_friction:.3g} is not below the wedge slope d/r '
            f'({smallest:.3g} at its least): the turning disc would pull the pad in by itself and '
            'the motor could not release it (self-locking); choose a larger gear_offset or a '
            'smaller gear_radius')
