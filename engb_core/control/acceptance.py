"""Whether an identified model may enter a running controller."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.control.feedforward import Feedforward
from engb_core.errors import InputError
from engb_core.model import Model

__all__ = ['AcceptanceBounds', 'check_candidate']


@dataclass(frozen=True)
class AcceptanceBounds:
    """What a plausible brake may be.

    Attributes:
        inertia_ratio, viscous_ratio: largest factor, either way, from the model in use.
        highest_load_gain: C₁ [-].
        highest_cogging: sum of the amplitudes [N·m].
        highest_torque: of load and friction together within `low` and `high` [N·m].
        low, high: motor angles that are looked at [rad].
    """

    inertia_ratio: float = 2.0
    viscous_ratio: float = 2.0
    highest_load_gain: float = 0.6
    highest_cogging: float = 0.05
    highest_torque: float = 0.75
    low: float = 0.0
    high: float = 36.0


def check_candidate(candidate: Model, present: Model, bounds: AcceptanceBounds) -> None:
    """Raise InputError where an identified model is implausible beside the one in use."""
    if candidate.joint != present.joint:
        raise InputError(f'the model is for joint {candidate.joint.name!r} '
                         f'({candidate.joint.type}), the controller drives '
                         f'{present.joint.name!r} ({present.joint.type})')
    for name, unit, widest in (('inertia', 'kg·m²', bounds.inertia_ratio),
                               ('viscous_friction', 'N·m·s/rad', bounds.viscous_ratio)):
        new, old = getattr(candidate.motor, name), getattr(present.motor, name)
        if old > 0.0 and not old / widest <= new <= old * widest:
            raise InputError(f'{name} {new:.4g} {unit} is not within a factor of {widest:g} of '
                             f'{old:.4g}; identify again, or restart with this model on purpose')
    friction = candidate.friction
    if friction.coulomb < 0.0 or not 0.0 <= friction.load_gain <= bounds.highest_load_gain:
        raise InputError(f'friction: coulomb {friction.coulomb:.4g} N·m must not be below 0, '
                         f'load_gain {friction.load_gain:.4g} must lie within 0 and '
                         f'{bounds.highest_load_gain:g}')
    cogging = sum(abs(entry.amplitude) for entry in candidate.cogging)
    if not cogging <= bounds.highest_cogging:
        raise InputError(f'cogging amplitudes add up to {cogging:.4g} N·m; at most '
                         f'{bounds.highest_cogging:g} is plausible')
    torques = Feedforward(candidate)
    for index in range(201):
        angle = bounds.low + (bounds.high - bounds.low) * index / 200.0
        load = torques.load_torque(angle)
        total = abs(load) + torques.friction_torque(load, math.inf)
        if not total <= bounds.highest_torque:
            raise InputError(f'load and friction make {total:.4g} N·m at {angle:.4g} rad, beyond '
                             f'the effort limit of {bounds.highest_torque:g} N·m')
