# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a simulated brake really is, in the drive's units, for whoever judges an identification."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.bench.apparent import apparent_model
from engb_core.bench.brake import mean_load_torque, pad_friction_at
from engb_core.bench.settings import BenchSettings
from engb_core.mechanism.statics import clamp_force
from engb_core.model import Model

__all__ = ['ANGLES', 'Truth', 'truth_of']

Array = NDArray[np.float64]

# Where loads are compared [rad]: the strokes' range but for its ends.
ANGLES = np.linspace(0.5, 19.5, 191)


@dataclass(frozen=True)
class Truth:
    """A brake's true numbers.

    Attributes:
        settings: the brake itself.
        model: the same in the model's form and the drive's units (assumed K_T × current).
        load: T_L (191,) [N·m] at ANGLES, the disc standing, in the drive's units.
    """

    settings: BenchSettings
    model: Model
    load: Array

    @property
    def scale(self) -> float:
        """A torque in the drive's units over the same in N·m."""
        return self.settings.assumed_torque_constant / self.settings.torque_constant

    def turning_load(self, disc_speed: float) -> Array:
        """Return T_L (191,) [N·m] at ANGLES with the disc at `disc_speed` [rad/s], cold pads."""
        return self.scale * mean_load_torque(self.settings, ANGLES, disc_speed)

    def gain(self, disc_speed: float) -> float:
        """Return P [-]: the turning load over the standing one, in least squares over ANGLES."""
        return float(self.load @ self.turning_load(disc_speed) / (self.load @ self.load))

    def pad_friction(self, disc_speed: float) -> float:
        """Return μ [-] in the mean over ANGLES, each counted by the square of its load."""
        force = clamp_force(self.settings.mechanism, ANGLES)
        friction = pad_friction_at(self.settings, force, disc_speed)
        return float(self.load**2 @ friction / (self.load @ self.load))

    @property
    def mean_wedge(self) -> float:
        """The wedge's slope [-] over ANGLES, each counted by the square of its load."""
        wedge = self.settings.mechanism.posture(ANGLES).wedge
        return float(self.load**2 @ wedge / (self.load @ self.load))


def truth_of(settings: BenchSettings) -> Truth:
    """Return the truth of a bench brake."""
    scale = settings.assumed_torque_constant / settings.torque_constant
    return Truth(settings, apparent_model(settings), scale * mean_load_torque(settings, ANGLES))
