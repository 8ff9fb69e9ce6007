# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What an identification of a first model gives: the model, and how far it can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from engb_core.model import Model

__all__ = ['FirstModel', 'FormScore', 'Number']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Number:
    """A number with its standard deviation; `determined` tells whether it differs from none."""

    value: float
    std: float
    unit: str
    determined: bool


@dataclass(frozen=True)
class FormScore:
    """How a form of the load predicts blocks that it has not seen.

    `behind` is by which part of the best form's mean square its own is larger, and `error` the
    standard error of that over the blocks; `numbers` is how many it has; `rms` are its errors
    [N·m].
    """

    form: str
    numbers: int
    behind: float
    error: float
    rms: float


@dataclass(frozen=True)
class FirstModel:
    """A first model and how far it can be trusted.

    Attributes:
        model: the model.
        numbers: name → value with uncertainty, as the model file has them: coefficients p0, p1, …
            [N·m, N·m/rad, …], contact_angle, amplitude, phase.
        scores: the forms of the load that were weighed, the chosen one first.
        not_told: what could not be told, a sentence each.
        rms, noise: of what is left and of the noise [N·m].
        position, velocity, acceleration, effort, predicted: (m,) filtered, for pictures.
    """

    model: Model
    numbers: dict[str, Number]
    scores: tuple[FormScore, ...]
    not_told: tuple[str, ...]
    rms: float
    noise: float
    position: Array = field(repr=False)
    velocity: Array = field(repr=False)
    acceleration: Array = field(repr=False)
    effort: Array = field(repr=False)
    predicted: Array = field(repr=False)
    time: Array = field(repr=False)

    def summary(self) -> str:
        """Return the numbers and what could not be told, a line each."""
        lines = []
        for name, number in self.numbers.items():
            doubt = '' if number.determined else '   (not determined)'
            lines.append(f'{name:<22}{number.value:12.4g} ± {number.std:<10.2g}{number.unit}'
                         f'{doubt}')
        chosen = self.scores[0]
        unit = 'N' if self.model.joint.type == 'prismatic' else 'N·m'
        lines.append(f'load: {chosen.form}; of stretches that were left out of the fit effort is '
                     f'predicted to {chosen.rms:.3g} {unit} rms, noise {self.noise:.3g} {unit}')
        lines += [f'could not be told: {text}' for text in self.not_told]
        return '\n'.join(lines)
