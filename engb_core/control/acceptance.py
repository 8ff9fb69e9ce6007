# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether an identified model may enter a running controller."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.control.feedforward import Feedforward
from engb_core.control.trajectory import Setpoint
from engb_core.errors import InputError
from engb_core.model import Model

__all__ = ['AcceptanceBounds', 'check_candidate', 'check_computable']


@dataclass(frozen=True)
class AcceptanceBounds:
    """What a plausible brake may be.

    Attributes:
        inertia_ratio, viscous_ratio: largest factor, either way, from the model in use.
        torque_constant_ratio: likewise; magnets lose a fifth when hot, no more.
        load_ratio: likewise, of the load at equal distance from the contact: a force is reached
            at an angle, so the force is wrong by as much as the load is. Worn pads are stiffer
            than new ones by less than this.
        largest_shift: of the contact angle [rad]; more is a fault, not wear (EstimatorSettings).
        highest_load_gain: C₁ [-].
        highest_cogging: sum of the amplitudes [N·m].
        most_cogging: harmonics; each is computed in every control cycle.
        highest_order: cycles per revolution; half the counts of an encoder of 8192.
        highest_torque: of load and friction together within `low` and `high` [N·m].
        low, high: motor angles that are looked at [rad].
    """

    inertia_ratio: float = 2.0
    viscous_ratio: float = 2.0
    torque_constant_ratio: float = 1.25
    load_ratio: float = 1.5
    largest_shift: float = 6.0
    highest_load_gain: float = 0.6
    highest_cogging: float = 0.05
    most_cogging: int = 32
    highest_order: float = 4096.0
    highest_torque: float = 0.75
    low: float = 0.0
    high: float = 36.0

    def angles(self) -> list[float]:
        """Return the angles that are looked at [rad]."""
        return [self.low + (self.high - self.low) * index / 200.0 for index in range(201)]


def check_candidate(candidate: Model, present: Model, bounds: AcceptanceBounds) -> None:
    """Raise InputError where an identified model is implausible beside the one in use."""
    if candidate.joint != present.joint:
        raise InputError(f'the model is for joint {candidate.joint.name!r} '
                         f'({candidate.joint.type}), the controller drives '
                         f'{present.joint.name!r} ({present.joint.type})')
    for name, unit, widest in (('inertia', 'kg·m²', bounds.inertia_ratio),
                               ('viscous_friction', 'N·m·s/rad', bounds.viscous_ratio),
                               ('torque_constant', 'N·m/A', bounds.torque_constant_ratio)):
        new, old = getattr(candidate.motor, name), getattr(present.motor, name)
        if old > 0.0 and not old / widest <= new <= old * widest:
            raise InputError(f'{name} {new:.4g} {unit} is not within a factor of {widest:g} of '
                             f'{old:.4g}; identify again, or restart with this model on purpose')
    friction = candidate.friction
    if friction.coulomb < 0.0 or not 0.0 <= friction.load_gain <= bounds.highest_load_gain:
        raise InputError(f'friction: coulomb {friction.coulomb:.4g} N·m must not be below 0, '
                         f'load_gain {friction.load_gain:.4g} must lie within 0 and '
                         f'{bounds.highest_load_gain:g}')
    check_computable(candidate, bounds)
    cogging = sum(abs(entry.amplitude) for entry in candidate.cogging)
    if not cogging <= bounds.highest_cogging:
        raise InputError(f'cogging amplitudes add up to {cogging:.4g} N·m; at most '
                         f'{bounds.highest_cogging:g} is plausible')
    torques = Feedforward(candidate)
    for angle in bounds.angles():
        load = torques.load_torque(angle)
        total = abs(load) + torques.friction_torque(load, math.inf)
        if not total <= bounds.highest_torque:
            raise InputError(f'load and friction make {total:.4g} N·m at {angle:.4g} rad, beyond '
                             f'the effort limit of {bounds.highest_torque:g} N·m')
    _check_load(torques, Feedforward(present), bounds)


def check_computable(model: Model, bounds: AcceptanceBounds) -> None:
    """Raise InputError where a model's torque is too long to compute in every cycle, or cannot
    be computed at all."""
    if len(model.cogging) > bounds.most_cogging:
        raise InputError(f'cogging holds {len(model.cogging)} harmonics; a control cycle has time '
                         f'for {bounds.most_cogging}')
    for entry in model.cogging:
        if not abs(entry.order) <= bounds.highest_order:
            raise InputError(f'cogging order {entry.order:.4g} is beyond '
                             f'{bounds.highest_order:g}, which no encoder resolves')
    torques = Feedforward(model)
    for angle in bounds.angles():
        for speed in (-1.0, 0.0, 1.0):
            try:
                total = torques.torque(Setpoint(angle, speed, 0.0))
            except (ArithmeticError, ValueError):
                total = math.nan
            if not math.isfinite(total):
                raise InputError(f'the model gives no finite torque at {angle:.4g} rad')


def _check_load(new: Feedforward, old: Feedforward, bounds: AcceptanceBounds) -> None:
    """Compare two load curves, each from its contact on; none to compare with: nothing."""
    angles = bounds.angles()
    highest = max(abs(old.load_torque(angle)) for angle in angles)
    if highest <= 0.0:
        return
    form, before = new.model.load_torque.form, old.model.load_torque.form
    if form != before:
        raise InputError(f'load_torque.form is {form}, that of the model in use {before}; '
                         'restart with this model on purpose')
    contact, contact_before = _contact(new, angles), _contact(old, angles)
    if abs(contact - contact_before) > bounds.largest_shift:
        raise InputError(f'contact begins at {contact:.3g} rad, with the model in use at '
                         f'{contact_before:.3g} rad; more than {bounds.largest_shift:g} rad is '
                         'no wear')
    for angle in angles:
        load_before = old.load_torque(angle)
        # Below a tenth of the highest load a factor says little: friction is as large.
        if abs(load_before) < 0.1 * highest:
            continue
        ratio = new.load_torque(angle + contact - contact_before) / load_before
        if not 1.0 / bounds.load_ratio <= ratio <= bounds.load_ratio:
            raise InputError(f'the load at {angle:.3g} rad is {ratio:.3g} times that of the model '
                             f'in use; not within a factor of {bounds.load_ratio:g}, so a clamp '
                             'force would be wrong by as much')


def _contact(torques: Feedforward, angles: list[float]) -> float:
    """Return where the load begins [rad]."""
    contact = torques.model.load_torque.contact_angle
    if contact is not None:
        return contact
    loads = [abs(torques.load_torque(angle)) for angle in angles]
    threshold = 0.01 * max(loads)
    return next((angle for angle, load in zip(angles, loads, strict=True) if load > threshold),
                angles[0])
