# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How far recordings go, by the model that they are held against: what effects are scaled by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from engb_core.effects.base import Scene
from engb_core.model import Model
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques
from engb_core.recording import Recording
from engb_core.signals.motion import Motion

__all__ = ['scene_of']

Array = NDArray[np.float64]

# Parts of the highest speed and load from which shaft or disc move, and the pad is in contact.
MOVES, IN_CONTACT = 0.02, 0.1
# Powers of travel that a load goes with.
POWERS = (1.0, 4.0)
# Every so many samples the load's slope is taken, over this part of the stroke on both sides.
EVERY, WAY = 20, 1e-3
# Part of a value that sums of its terms may miss by how numbers are kept.
ROUNDING = 1e-9


def scene_of(recordings: Sequence[Recording], motions: Sequence[Motion], model: Model) -> Scene:
    """Return the scene of recordings.

    Args:
        recordings: of one machine.
        motions: of them.
        model: what they are held against.
    """
    low = min(float(motion.position.min()) for motion in motions)
    high = max(float(motion.position.max()) for motion in motions)
    nominal = nominal_vector(model)
    along = load_torques(nominal, np.linspace(low, high, 200))
    # One that is the same everywhere acts as an offset: nothing that goes with load shows.
    load = float(np.abs(along).max()) if np.ptp(along) > 0.0 else 0.0
    loads = np.concatenate([np.abs(load_torques(nominal, motion.position[_moves(motion)]))
                            for motion in motions])
    disc = [motion.disc_speed for motion in motions if motion.has_disc]
    warm = [motion.pad_temperature for motion in motions if motion.has_temperature]

    def span(parts: list[Array]) -> tuple[float, float] | None:
        if not parts:
            return None
        return (min(float(part.min()) for part in parts), max(float(part.max()) for part in parts))

    return Scene(
        duration=max(motion.time[-1] for motion in motions),
        largest_effort=max(float(np.max(np.abs(recording.effort)))
                           for recording in recordings),
        largest_load=load,
        speed=max(motion.speed for motion in motions),
        middle_speed=_middle_speed(np.concatenate([
            np.abs(motion.velocity[_moves(motion)]) for motion in motions])),
        load_slope=_load_slope(motions, nominal, load),
        load_power=_load_power(nominal, low, high),
        load_span=float(np.ptp(along)),
        loaded_share=_loaded_share(loads, model),
        reference_load=_reference_load(loads),
        effective_load=float(np.sum(loads ** 3) / max(np.sum(loads ** 2), 1e-30)),
        sampling=max(motion.recorded_step for motion in motions),
        position_range=(low, high), disc_speed_range=span(disc), temperature_range=span(warm),
        joint_type=model.joint.type,
        commanded=all(motion.commanded is not None for motion in motions),
        load_is_straight=_is_straight(along))


def _is_straight(along: Array) -> bool:
    """Return whether values (n,) at even steps lie on a straight line but for rounding."""
    straight = np.linspace(along[0], along[-1], along.size)
    return bool(np.max(np.abs(along - straight)) <= ROUNDING * float(np.max(np.abs(along))))


def _moves(motion: Motion) -> NDArray[np.bool_]:
    return np.abs(motion.velocity) > MOVES * motion.speed


def _middle_speed(speeds: Array) -> float:
    """Return the speed m [rad/s] for which (|ω| − m)/(|ω| + m) is none on average."""
    most = float(speeds.max())
    return float(brentq(lambda middle: np.mean(speeds / (speeds + middle)) - 0.5,
                        1e-9 * most, most))


def _reference_load(loads: Array) -> float:
    """Return the load at which friction that is curved over the load crosses the straight line of
    the same mean friction over these loads (n,), ΣL²/ΣL; 0 where there is one load only.

    A file whose friction is a straight line, and a machine, are compared by the friction that they
    have on the whole; a best line with an offset would put a part of that into Coulomb friction.
    """
    if not loads.size or float(np.ptp(loads)) == 0.0:
        return 0.0
    return float(np.sum(loads ** 2) / np.sum(loads))


def _loaded_share(loads: Array, model: Model) -> float:
    """Return the part of the model's dry friction that goes with load, while the shaft moves."""
    loaded = model.friction.load_gain * float(loads.mean()) if loads.size else 0.0
    whole = model.friction.coulomb + loaded
    return loaded / whole if whole > 0.0 else 0.0


def _load_slope(motions: Sequence[Motion], nominal: Array, largest: float) -> float:
    """Return the root mean square of the load's slope in contact [N·m/rad], while the disc turns
    where there is one; 0 without contact."""
    squares = []
    way = WAY * max(float(np.ptp(motion.position)) for motion in motions)
    for motion in motions:
        rows = slice(None, None, EVERY)
        position = motion.position[rows]
        if motion.has_disc:
            turning = np.abs(motion.disc_speed[rows])
            position = position[turning > MOVES * turning.max()]
        position = position[np.abs(load_torques(nominal, position)) > IN_CONTACT * largest]
        ahead, behind = (load_torques(nominal, position + side) for side in (way, -way))
        squares.append(((ahead - behind) / (2.0 * way)) ** 2)
    together = np.concatenate(squares)
    return float(np.sqrt(np.mean(together))) if together.size else 0.0


def _load_power(nominal: Array, low: float, high: float) -> float:
    """Return the power of travel that the load roughly goes with, by its value at half the way."""
    half, whole = load_torques(nominal, np.array([low + 0.5 * (high - low), high]))
    if max(half, whole) < 0.0:
        half, whole = -half, -whole
    if half <= 0.0 or whole <= half:
        return POWERS[1] if whole > 0.0 >= half else POWERS[0]
    return float(np.clip(np.log2(whole / half), *POWERS))
