"""Whether an identified model may enter a running controller: bounds, and a step at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engb_core.errors import InputError
from engb_core.model import LoadTorque, Model

__all__ = ['AcceptanceBounds', 'check_model', 'refuse_implausible']


@dataclass(frozen=True)
class AcceptanceBounds:
    """What a plausible brake may be.

    Attributes:
        inertia_ratio, viscous_ratio: largest factor, either way, between identified and present.
        highest_load: |T_L| over the range [N·m].
        highest_friction: T_C over the range [N·m].
        highest_load_gain: C₁ [-].
        highest_cogging: sum of the amplitudes [N·m].
        steepest_change: |T_L| may not differ from the present model's by more [N·m].
        low, high: motor angles that are looked at [rad].
    """

    inertia_ratio: float = 3.0
    viscous_ratio: float = 5.0
    highest_load: float = 0.75
    highest_friction: float = 0.3
    highest_load_gain: float = 0.6
    highest_cogging: float = 0.05
    steepest_change: float = np.inf
    low: float = 0.0
    high: float = 36.0


def check_model(model: Model, present: Model, bounds: AcceptanceBounds) -> list[str]:
    """Return what speaks against `model`, a sentence each; nothing: it is plausible.

    Args:
        model: the candidate.
        present: the model in use, against which inertia and viscous friction are held.
        bounds: what is plausible.
    """
    against = []
    for name, widest in (('inertia', bounds.inertia_ratio),
                         ('viscous_friction', bounds.viscous_ratio)):
        new, old = getattr(model.motor, name), getattr(present.motor, name)
        if old > 0.0 and not old / widest <= new <= old * widest:
            against.append(f'{name} {new:.4g} is not within a factor of {widest:g} of {old:.4g}')
    if model.joint != present.joint:
        against.append(f'joint {model.joint.name} ({model.joint.type}) is not '
                       f'{present.joint.name} ({present.joint.type})')
    friction = model.friction
    if not 0.0 <= friction.load_gain <= bounds.highest_load_gain:
        against.append(f'load_gain {friction.load_gain:.4g} is not within 0 and '
                       f'{bounds.highest_load_gain:g}')
    if friction.coulomb < 0.0:
        against.append(f'coulomb {friction.coulomb:.4g} N·m is below 0')
    angle = np.linspace(bounds.low, bounds.high, 400)
    load = _load(model.load_torque, angle)
    if not np.abs(load).max() <= bounds.highest_load:
        against.append(f'the load torque reaches {np.abs(load).max():.4g} N·m within '
                       f'{bounds.low:g} and {bounds.high:g} rad; allowed are '
                       f'{bounds.highest_load:g}')
    level = friction.coulomb + friction.load_gain * np.abs(load).max()
    if not level <= bounds.highest_friction:
        against.append(f'friction reaches {level:.4g} N·m; allowed are '
                       f'{bounds.highest_friction:g}')
    cogging = sum(abs(entry.amplitude) for entry in model.cogging)
    if cogging > bounds.highest_cogging:
        against.append(f'cogging amounts to {cogging:.4g} N·m; allowed are '
                       f'{bounds.highest_cogging:g}')
    change = np.abs(load - _load(present.load_torque, angle)).max()
    if not change <= bounds.steepest_change:
        against.append(f'the load torque changes by {change:.4g} N·m; allowed are '
                       f'{bounds.steepest_change:g}')
    return against


def refuse_implausible(model: Model, present: Model, bounds: AcceptanceBounds) -> None:
    """Raise InputError with the reasons where `check_model` finds any."""
    against = check_model(model, present, bounds)
    if against:
        raise InputError('model refused: ' + '; '.join(against))


def _load(load: LoadTorque, angle: np.ndarray) -> np.ndarray:
    if load.form == 'sinusoid':
        return load.amplitude * np.sin(angle + load.phase)
    if load.contact_angle is None:
        return np.polynomial.polynomial.polyval(angle, load.coefficients)
    beyond = angle - load.contact_angle
    return np.where(beyond > 0.0, np.polynomial.polynomial.polyval(beyond, load.coefficients), 0.0)
