# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Settings of a brake's controller, and what it reports of a cycle."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.control.clamp_force import EstimatorSettings
from engb_core.control.loop import LoopSettings
from engb_core.control.reference import ReferenceSettings
from engb_core.control.supervisor_settings import SupervisorSettings
from engb_core.control.trajectory import ReferenceBounds
from engb_core.mechanism.kinematics import Mechanism
from engb_core.model import Model

__all__ = ['ControllerSettings', 'ForceSettings', 'Report']


@dataclass(frozen=True)
class ForceSettings:
    """What force commands need.

    Attributes:
        mechanism: the geometry.
        pad_friction: μ [-].
        running_clearance: how far the released motor stands before contact [rad].
        estimator: what is believed of the sources.
    """

    mechanism: Mechanism
    pad_friction: float = 0.0
    running_clearance: float = 2.0
    estimator: EstimatorSettings = EstimatorSettings()


@dataclass(frozen=True)
class ControllerSettings:
    """All settings of a controller.

    Attributes:
        loop, reference, supervisor: of its parts.
        force: None: no force commands.
        position_min, position_max: range of position commands [rad].
        force_max: highest force command [N].
        stale_value: set-point of stale_action ramp_to_value [rad, or N in force mode].
    """

    loop: LoopSettings = LoopSettings()
    reference: ReferenceSettings = ReferenceSettings()
    supervisor: SupervisorSettings = SupervisorSettings()
    force: ForceSettings | None = None
    position_min: float = -5.0
    position_max: float = 50.0
    force_max: float = math.inf
    stale_value: float = 0.0

    def reference_bounds(self, model: Model) -> ReferenceBounds:
        """Return which trajectories a brake can follow.

        Until the whole torque has sped its motor up to v it lags by v²/(2a), which may be no more
        than `largest_error`; and angles that move faster than `largest_speed` are not believed.
        """
        limits = self.supervisor
        torque = min(limits.effort_limit, self.loop.gains.u_clamp_max)
        speed = math.sqrt(2.0 * torque / model.motor.inertia * limits.largest_error)
        return ReferenceBounds(self.position_min, self.position_max,
                               min(limits.largest_speed, speed))


@dataclass
class Report:
    """Input, command and output of the last cycle, in angle [rad] and torque [N·m].

    `input` is what was asked (a force as its angle), `command` what was tracked or sent after
    all limits, `output` what was measured.
    """

    position_input: float = math.nan
    position_command: float = math.nan
    position_output: float = math.nan
    effort_input: float = 0.0
    effort_command: float = 0.0
    effort_output: float = math.nan
