# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""PID controller, equation (28), with the parameter names of ros-controls/control_toolbox."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.errors import InputError

__all__ = ['ANTIWINDUP_STRATEGIES', 'Pid', 'PidGains']

# Beyond these a number is not a measurement but a fault (and could overflow).
LARGEST = 1e9
LONGEST_STEP = 1.0

ANTIWINDUP_STRATEGIES = ('none', 'back_calculation', 'conditional_integration')


@dataclass(frozen=True)
class PidGains:
    """Gains and limits.

    Attributes:
        p: proportional gain [N·m/rad].
        i: integral gain [N·m/(rad·s)].
        d: derivative gain [N·m·s/rad].
        u_clamp_max, u_clamp_min: limits of the whole output, feedforward included [N·m].
        i_clamp_max, i_clamp_min: limits of the integral part [N·m].
        antiwindup_strategy: one of ANTIWINDUP_STRATEGIES.
        tracking_time_constant: of the back-calculation [s]; 0: √(T_i·T_d), or T_i without d.
        error_deadband: errors smaller than this are not integrated [rad].
        save_i_term: keep the integral part over a reset.
        derivative_filter_time: low-pass on the measured velocity [s]; 0: unfiltered.
    """

    p: float = 0.0
    i: float = 0.0
    d: float = 0.0
    u_clamp_max: float = math.inf
    u_clamp_min: float = -math.inf
    i_clamp_max: float = math.inf
    i_clamp_min: float = -math.inf
    antiwindup_strategy: str = 'back_calculation'
    tracking_time_constant: float = 0.0
    error_deadband: float = 0.0
    save_i_term: bool = False
    derivative_filter_time: float = 0.0

    def __post_init__(self) -> None:
        for name in ('p', 'i', 'd', 'tracking_time_constant', 'error_deadband',
                     'derivative_filter_time'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise InputError(f'{name} is {value}; it must be finite and not below 0')
        for name in ('u_clamp', 'i_clamp'):
            low, high = getattr(self, f'{name}_min'), getattr(self, f'{name}_max')
            if not low <= 0.0 <= high:
                raise InputError(f'{name}_min is {low}, {name}_max is {high}; 0 must lie between')
        if self.antiwindup_strategy not in ANTIWINDUP_STRATEGIES:
            raise InputError(f'antiwindup_strategy is {self.antiwindup_strategy!r}; it must be '
                             f'one of {", ".join(ANTIWINDUP_STRATEGIES)}')


class Pid:
    """u = clamp(u_ff + p·e + i·∫e dt + d·(ω_d − ω_f)), with e = θ_d − θ.

    Equation (28) with the sign that positive gains need ((29) defines e the other way round).
    The derivative is taken on the measurement: ω_f is the measured velocity through a low-pass,
    and ω_d is what the trajectory states (0 for a mere set-point, so a step never kicks).

    Back-calculation (Åström and Hägglund, Advanced PID Control, section 3.5): the integral part
    follows di/dt = i·e + (u_clamped − u)/tracking_time_constant. The integral part is kept in
    N·m, and a change of gains is absorbed in it: the output doesn't jump.

    A value that is not finite or beyond LARGEST, or a dt not within 0 and LONGEST_STEP, changes
    no state; the output is held.

    Attributes:
        i_term: the integral part [N·m].
        output: of the last sample [N·m].
        saturated: it was limited.
        frozen: the integral part stays: the drive doesn't give what is asked.
        rejected: samples that were not used.
    """

    def __init__(self, gains: PidGains) -> None:
        self._gains = gains
        self._set_times(gains)
        self.i_term = 0.0
        self.output = 0.0
        self.saturated = False
        self.frozen = False
        self.rejected = 0
        self._error = 0.0
        self._error_rate = 0.0
        self._velocity: float | None = None

    @property
    def gains(self) -> PidGains:
        """The gains in use."""
        return self._gains

    def set_gains(self, gains: PidGains) -> None:
        """Change the gains; the integral part takes up the difference, so the output is smooth."""
        old = self._gains
        self.i_term += (old.p - gains.p) * self._error + (old.d - gains.d) * self._error_rate
        self._gains = gains
        self._set_times(gains)
        self.i_term = min(max(self.i_term, gains.i_clamp_min), gains.i_clamp_max)

    def reset(self, output: float = 0.0) -> None:
        """Forget the past; `output` [N·m], what the drive holds now, is taken up smoothly."""
        gains = self._gains
        if not (gains.save_i_term and output == 0.0):
            self.i_term = min(max(float(output), gains.i_clamp_min), gains.i_clamp_max)
        self.output = min(max(self.i_term, gains.u_clamp_min), gains.u_clamp_max)
        self.saturated = False
        self._error = self._error_rate = 0.0
        self._velocity = None

    def shift_integral(self, torque: float) -> None:
        """Add to the integral part [N·m], within its limits: it takes up another part's jump."""
        gains = self._gains
        self.i_term = min(max(self.i_term + torque, gains.i_clamp_min), gains.i_clamp_max)

    def step(self, error: float, velocity: float, dt: float, velocity_setpoint: float = 0.0,
             feedforward: float = 0.0) -> float:
        """Return the torque [N·m] for this sample.

        Args:
            error: θ_d − θ [rad].
            velocity: measured [rad/s].
            dt: since the last sample [s].
            velocity_setpoint: ω_d [rad/s].
            feedforward: u_ff [N·m], limited together with the feedback.
        """
        if not (abs(error) + abs(velocity) + abs(velocity_setpoint) + abs(feedforward) < LARGEST
                and 0.0 < dt <= LONGEST_STEP):
            self.rejected += 1
            return self.output
        gains = self._gains
        filtered = self._velocity
        if filtered is None:
            filtered = velocity
        else:
            filtered += (velocity - filtered) * dt / (dt + gains.derivative_filter_time)
        self._velocity = filtered
        error_rate = velocity_setpoint - filtered
        self._error = error
        self._error_rate = error_rate
        raw = feedforward + gains.p * error + self.i_term + gains.d * error_rate
        output = min(max(raw, gains.u_clamp_min), gains.u_clamp_max)
        self.saturated = output != raw
        self._integrate(error, output - raw, dt)
        self.output = output
        return output

    def _integrate(self, error: float, excess: float, dt: float) -> None:
        gains = self._gains
        if self.frozen:
            return
        if gains.i == 0.0:
            # What a change of gains left behind fades out instead of staying as an offset.
            self.i_term *= max(0.0, 1.0 - dt / self._fade_time)
            return
        rate = 0.0 if abs(error) < gains.error_deadband else gains.i * error
        if gains.antiwindup_strategy == 'back_calculation':
            # Not further than to the edge within one sample, however short the time constant.
            rate += excess / max(self._tracking_time, dt)
        elif (gains.antiwindup_strategy == 'conditional_integration'
                and excess * rate < 0.0):
            rate = 0.0
        self.i_term = min(max(self.i_term + rate * dt, gains.i_clamp_min), gains.i_clamp_max)

    def _set_times(self, gains: PidGains) -> None:
        time = gains.tracking_time_constant
        if time <= 0.0 and gains.i > 0.0:
            time = (math.sqrt(gains.d / gains.i) if gains.d > 0.0
                    else gains.p / gains.i if gains.p > 0.0 else 0.1)
        self._tracking_time = time
        self._fade_time = max(gains.tracking_time_constant, 0.5)
