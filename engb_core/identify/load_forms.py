# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The forms that a load may have: columns of the linear torque balance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.model import Joint, LoadTorque
from engb_core.signals.filtering import Comparison
from engb_core.signals.motion import Motion

__all__ = ['FilteredColumns', 'LoadForm', 'contact_form', 'load_forms']

Array = NDArray[np.float64]

DEGREES = (1, 2, 3, 4, 5)


@dataclass(frozen=True)
class FilteredColumns:
    """The filtered columns of all recordings, (m,) each, and the block of each value."""

    acceleration: Array
    velocity: Array
    direction: Array
    position: Array
    effort: Array
    time: Array
    noise: float
    block: NDArray[np.int64]
    runs: tuple[tuple[Motion, Comparison], ...]
    slowest: float


@dataclass(frozen=True)
class LoadForm:
    """A form of the load: its columns, and the load torque that coefficients make of them."""

    name: str
    columns: Array              # (m, k), filtered
    load: Callable[[Array], LoadTorque]
    names: tuple[str, ...]
    extra: int = 0              # numbers beside the linear ones (a contact angle)
    # (m, 1), filtered: friction per load, for weighing the form beside friction that grows with it
    beside: Array | None = None

    @property
    def has_load(self) -> bool:
        """Whether it is more than nothing or an offset."""
        return bool(set(self.names) - {'offset'})


def load_forms(data: FilteredColumns, joint: Joint) -> list[LoadForm]:
    """Return the forms that need no search: none, offset, polynomials, sinusoid."""
    position = data.position
    middle, reach = 0.5 * (position.min() + position.max()), max(0.5 * np.ptp(position), 1e-12)

    def raised(power: int, values: Array) -> Array:
        scaled: Array = (values - middle) / reach
        return scaled ** power

    powers = [_filtered(data, partial(raised, power)) for power in range(max(DEGREES) + 1)]
    ones = np.ones_like(position)
    found = [LoadForm('none', np.zeros((position.size, 0)),
                   lambda values: LoadTorque(coefficients=(0.0,)), ()),
             LoadForm('offset', ones[:, None],
                   lambda values: LoadTorque(coefficients=(float(values[0]),)), ('offset',))]
    for degree in DEGREES:
        columns = np.stack(powers[:degree + 1], axis=1)

        def polynomial(values: Array) -> LoadTorque:
            series = np.polynomial.Polynomial(values, domain=[middle - reach, middle + reach])
            return LoadTorque(coefficients=tuple(map(float, series.convert().coef)))

        found.append(LoadForm(f'polynomial of degree {degree}', columns, polynomial,
                           ('offset', *(f'load_{power}' for power in range(1, degree + 1)))))
    if joint.type == 'revolute':
        found.append(LoadForm(
            'sinusoid', np.stack([_filtered(data, np.sin), _filtered(data, np.cos)], axis=1),
            lambda values: LoadTorque('sinusoid', (0.0,), None,
                                      float(np.hypot(*values)),
                                      float(math.atan2(values[1], values[0]))),
            ('load_sine', 'load_cosine')))
    return found


def _filtered(data: FilteredColumns, function: Callable[[Array], Array]) -> Array:
    return np.concatenate([comparison(function(motion.position))
                           for motion, comparison in data.runs])


def contact_form(data: FilteredColumns, contact: float, degree: int) -> LoadForm:
    """Return a polynomial without constant from `contact` [rad] on, nothing before."""
    reach = max(data.position.max() - contact, 1e-12)

    def column(power: int) -> Array:
        return _filtered(data, lambda position: np.maximum(
            (position - contact) / reach, 0.0) ** power)

    def load(values: Array) -> LoadTorque:
        coefficients = [0.0] + [float(value) / reach ** (power + 1)
                                for power, value in enumerate(values)]
        return LoadTorque(coefficients=tuple(map(float, coefficients)),
                          contact_angle=float(contact))

    return LoadForm(f'contact, then a polynomial of degree {degree}',
                 np.stack([column(power + 1) for power in range(degree)], axis=1), load,
                 tuple(f'load_{power + 1}' for power in range(degree)), 1)
