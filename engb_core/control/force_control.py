# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Clamp force of one brake: its estimate, and the angle at which a commanded force is reached."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.control.brake_settings import ControllerSettings, ForceSettings
from engb_core.control.clamp_force import ClampForceEstimator, ClampForceMap
from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.model import Model

__all__ = ['ForceControl', 'PreparedModel', 'force_control_of']

# The contact wanders slowly: more than this often needn't be looked [s].
ESTIMATE_EVERY = 0.0035


class ForceControl:
    """Turns forces into angles while it learns where contact begins.

    Args:
        model: identified.
        settings: geometry and what is believed.
        cutoff: of the disturbance observer [Hz].

    Attributes:
        command: the force that is commanded [N]; None: an angle is.
        estimator: the clamp force and the contact's shift.
        uncertain: angle and current disagree by more than wear explains.

    Raises:
        InputError: the model's load torque gives no force.
    """

    def __init__(self, model: Model, settings: ForceSettings, cutoff: float) -> None:
        table = ClampForceMap(model, settings.mechanism, settings.pad_friction)
        self.settings = settings
        self.estimator = ClampForceEstimator(table, settings.estimator)
        self.uncertain = False
        self._observer = DisturbanceObserver(model.motor, cutoff)
        self.reset()

    def reset(self) -> None:
        """Forget command and filter, but not what was learnt of the contact."""
        self.command: float | None = None
        self._observer.reset()
        self._disturbance = math.nan
        self._estimated = -math.inf

    def apply(self, settings: ForceSettings, cutoff: float) -> None:
        """Change settings while running; a new mechanism needs a new object."""
        self.settings = settings
        if cutoff != self._observer.cutoff:
            self._observer = DisturbanceObserver(self._observer.motor, cutoff)

    def learn_from(self, other: ForceControl) -> None:
        """Take over what another one knew of the contact."""
        self.estimator.shift = other.estimator.shift
        self.estimator.shift_std = other.estimator.shift_std

    def observe(self, stamp: float, velocity: float, effort: float) -> bool:
        """Take one sample; return whether an estimate is due."""
        self._disturbance = (self._observer.step(stamp, velocity, effort)
                             if math.isfinite(effort) else math.nan)
        return not 0.0 <= stamp - self._estimated < ESTIMATE_EVERY

    def estimate(self, stamp: float, position: float, velocity: float, disc_speed: float,
                 use_disturbance: bool) -> None:
        """Estimate the force from the angle and, if it may be used, the current."""
        self._estimated = stamp
        estimator = self.estimator
        estimator.step(stamp, position, velocity,
                       self._disturbance if use_disturbance else math.nan, disc_speed)
        self.uncertain = abs(estimator.shift) >= estimator.settings.largest_shift

    def angle_of(self, force: float) -> float:
        """Return where `force` [N] is reached [rad]; for none, the running clearance."""
        estimator = self.estimator
        if force > 0.0:
            return estimator.map.angle_of_force(force) + estimator.shift
        return estimator.contact_angle - self.settings.running_clearance


@dataclass(frozen=True)
class PreparedModel:
    """An identified model that was found plausible, with what a controller makes of it."""

    model: Model
    force: ForceControl | None


def force_control_of(model: Model, settings: ControllerSettings) -> ForceControl | None:
    """Return what turns forces into angles; None where the settings have no mechanism for it."""
    if settings.force is None:
        return None
    return ForceControl(model, settings.force, settings.loop.disturbance_cutoff)
