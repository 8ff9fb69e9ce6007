# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Dry friction, compiled: how it grows with load, and what it does within a step of time, where it
can stop a mass but never turn it back."""

from __future__ import annotations

from engb_core.physics.compiled import compiled
from engb_core.physics.nominal_torque import load_friction_gain

__all__ = ['friction_beyond', 'friction_gain', 'slowed_rate']

friction_gain = compiled(load_friction_gain)


@compiled
def friction_beyond(coulomb: float, level: float, of_constant: float, of_loaded: float) -> float:
    """Return the dry friction [N·m] that acts beyond a gap or a shaft.

    Args:
        coulomb: the constant part of the friction [N·m].
        level: all of it, with what load adds [N·m]; where it drifts below the constant part, load
            adds none.
        of_constant, of_loaded: parts (0 to 1) of either that are beyond.
    """
    constant = min(coulomb, level)
    return of_constant * constant + of_loaded * (level - constant)


@compiled
def slowed_rate(rate: float, speed: float, most: float, saturation: float) -> float:
    """Return a mass' rate against a support after friction, which is proportional to the sum of
    both below the speed of saturation, has acted on that for a step; solved for the step's end.

    Args:
        rate: of the mass against its support [rad/s].
        speed: of the support [rad/s].
        most: what friction can take away within the step [rad/s].
        saturation: speed from which on friction is full [rad/s].
    """
    beyond = speed + rate
    if beyond > most + saturation:
        return rate - most
    if beyond < -most - saturation:
        return rate + most
    return beyond * saturation / (most + saturation) - speed
