# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One control cycle: equations (26)–(28), with the observer's compensation on request."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.bench.sensors import VelocityFromPosition
from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.feedforward import Feedforward
from engb_core.control.pid import Pid, PidGains
from engb_core.control.trajectory import Setpoint
from engb_core.model import Model

__all__ = ['LoopSettings', 'PositionLoop']

# Between two samples farther apart than this the loop doesn't integrate [s].
LONGEST_STEP = 0.1

# Low-pass of the velocity where the drive gives none [Hz].
VELOCITY_CUTOFF = 100.0


@dataclass(frozen=True)
class LoopSettings:
    """What the loop does besides PID.

    Attributes:
        gains: of the PID; its u_clamp limits hold for the whole torque.
        load_feedforward, friction_feedforward, cogging_feedforward: add that torque of the model.
        disturbance_compensation: take off what the observer sees beyond the model.
        disturbance_cutoff: the observer's low-pass [Hz].
    """

    gains: PidGains = PidGains()
    load_feedforward: bool = True
    friction_feedforward: bool = True
    cogging_feedforward: bool = True
    disturbance_compensation: bool = False
    disturbance_cutoff: float = 20.0


class PositionLoop:
    """u = u_ff + u_fb (26), and − d̂ of what the model doesn't hold, if asked.

    The compensating observer sees the torque less the model's load, friction and cogging
    torque, so feedforward and observer don't both pay for the same thing. It is frozen while
    the output saturates.

    Attributes:
        output: the torque of the last cycle [N·m].
        feedforward: its feedforward part [N·m].
        disturbance: the observer's estimate of what the model doesn't hold [N·m], sign of (30).
    """

    def __init__(self, model: Model, settings: LoopSettings) -> None:
        self.model = model
        self.pid = Pid(settings.gains)
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self.output = self.feedforward = self.disturbance = 0.0
        self._time: float | None = None
        self._setpoint = Setpoint(0.0)
        self.observer = DisturbanceObserver(model.motor, settings.disturbance_cutoff)
        self._apply(settings)

    @property
    def settings(self) -> LoopSettings:
        """The settings in use."""
        return self._settings

    def set_settings(self, settings: LoopSettings) -> None:
        """Change settings while running; the integral part takes up what they change."""
        self.pid.set_gains(settings.gains)
        self._change(self.model, settings)

    def set_model(self, model: Model) -> None:
        """Change the model while running; the integral part takes up what it changes."""
        self._change(model, self._settings)

    def reset(self, output: float = 0.0, setpoint: Setpoint | None = None) -> None:
        """Start anew, from torque `output` [N·m]; with `setpoint`, its feedforward included."""
        self.pid.reset(output)
        self.observer.reset()
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self.output = self.pid.output
        self.feedforward = self.disturbance = 0.0
        self._time = None
        if setpoint is not None:
            self.pid.shift_integral(-self._feedforward.torque(setpoint))

    @property
    def torques(self) -> Feedforward:
        """The feedforward, whose load curve may be shifted and scaled."""
        return self._feedforward

    def step(self, time: float, position: float, velocity: float, effort: float,
             setpoint: Setpoint) -> float:
        """Return the torque demanded of the drive [N·m] for one sample.

        A sample that is not finite, or whose stamp doesn't advance, leaves the output as it was;
        NaN where the model gives no finite torque.

        Args:
            time: the sample's stamp [s].
            position, velocity, effort: measured [rad, rad/s, N·m]; a velocity of NaN is derived
                from the position.
            setpoint: what to track.
        """
        if velocity != velocity:   # the drive gives none
            velocity = self._derived.step(time, position)
        if not math.isfinite(time + position + velocity):
            self.pid.rejected += 1
            return self.output
        dt = math.inf if self._time is None else time - self._time
        if -LONGEST_STEP < dt <= 0.0:
            return self.output
        self._time = time
        if not 0.0 < dt <= LONGEST_STEP:
            # The first sample, or a jump of the clock: act on the error, integrate nothing.
            dt = 1e-6
        feedforward = self._feedforward.torque(setpoint)
        if not math.isfinite(feedforward):
            return math.nan   # no torque of before may stand for it
        self.feedforward = feedforward
        self._setpoint = setpoint
        if self._settings.disturbance_compensation:
            self._observe(time, position, velocity, effort)
            feedforward -= self.disturbance
        self.output = self.pid.step(setpoint.position - position, velocity, dt,
                                    setpoint.velocity, feedforward)
        return self.output

    def held_torque(self, position: float) -> float:
        """Return what of the torque holds the load at `position` [rad], not below 0 [N·m]: all
        but what speeds the motor up and what damps it."""
        held = self.pid.i_term - self.disturbance
        if self._settings.load_feedforward:
            held += self._feedforward.load_torque(position)
        return max(held, 0.0) if math.isfinite(held) else 0.0

    def _observe(self, time: float, position: float, velocity: float, effort: float) -> None:
        if self.pid.saturated or not math.isfinite(effort):
            return
        torques = self._feedforward
        load = torques.load_torque(position)
        known = (load + torques.friction_torque(load, velocity)
                 + torques.cogging_torque(position))
        self.disturbance = self.observer.step(time, velocity, effort - known)

    def _change(self, model: Model, settings: LoopSettings) -> None:
        before = self.feedforward - self.disturbance
        self.model = model
        self._apply(settings)
        if self._time is not None:   # it runs
            self.feedforward = self._feedforward.torque(self._setpoint)
            after = self.feedforward - self.disturbance
            if math.isfinite(before - after):
                self.pid.shift_integral(before - after)

    def _apply(self, settings: LoopSettings) -> None:
        before = getattr(self, '_feedforward', None)
        self._settings = settings
        self._feedforward = Feedforward(
            self.model, settings.load_feedforward, settings.friction_feedforward,
            settings.cogging_feedforward)
        if before is not None:
            self._feedforward.shift = before.shift
            self._feedforward.load_ratio = before.load_ratio
        if (before is None or before.model is not self.model
                or self.observer.cutoff != settings.disturbance_cutoff):
            self.observer = DisturbanceObserver(self.model.motor, settings.disturbance_cutoff)
            self.disturbance = 0.0
        if not settings.disturbance_compensation:
            self.disturbance = 0.0
