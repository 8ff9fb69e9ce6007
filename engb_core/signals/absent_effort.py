# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings without torque: hobby servos and many drives log what was asked of them, no current.

What stands for effort then is what the position loop asks for,

    effort = clip(proportional · e + derivative · ė + feedforward, −limit, limit),  e = θ_d − θ,

with the controller of the model file. Where that names none, the loop is taken as proportional,
and its gain is the one with which it asks for the torque that the model needs for the recorded
motion: all torques then hang on the model's numbers. What the drive makes of such a command (late,
at a limited speed) is told as of any effort that is a command (command_law.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.model import Controller, Model
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording
from engb_core.signals.filtering import slowest_speed
from engb_core.signals.motion import motion_of
from engb_core.signals.motion_band import COMPARED, told_up_to
from engb_core.signals.plausibility import MOST
from engb_core.signals.position_error import effort_of_recording

__all__ = ['with_effort']

Array = NDArray[np.float64]

# Part of the variance of the torque that the model needs which a proportional loop has to explain
# before its gain is believed: as much as a model file has to explain of a recording before its
# units are (plausibility.py).
EXPLAINED = 1.0 - MOST ** 2
# How late a drive may act on its set-point: three servo periods of 20 ms, and as much again [s].
LATEST = 0.12
# Parts of the time in which the drive is not at its limit that are tried.
LIMITS = (0.4, 0.55, 0.7, 0.85, 1.0)
# What nobody can tell without a measured torque.
NOT_TOLD = ('torque ripple, loss of torque at high current, a late measurement of torque and a '
            'wrong torque constant cannot be told so')


def with_effort(recordings: Sequence[Recording], model: Model) -> list[Recording]:
    """Return the recordings, those without effort with what the position loop asked for instead;
    a note of each says so.

    Args:
        recordings: with or without effort.
        model: tells the controller, or the motion's torque from which a gain follows.

    Raises:
        InputError: a recording has neither effort nor a reference position, or no gain of a
            proportional loop makes up the torque that its motion needs.
    """
    return [recording if recording.effort_recorded else _with_command(recording, model)
            for recording in recordings]


def _with_command(recording: Recording, model: Model) -> Recording:
    controller = model.controller
    if recording.reference is None:
        raise InputError(
            f'{recording.name}: has no effort (torque, current), and no reference position from '
            'which a position loop would tell it; record joint_states.effort, or reference')
    error = _error(recording)
    if controller is not None and (controller.proportional or controller.derivative):
        effort = _asked(recording, controller, error)
        how = 'the controller of the model file'
    else:
        loop = _loop(recording, model)
        effort = loop.asked(error)
        limit = loop.gain * loop.largest
        within = f' within ±{limit:.3g} N·m' if math.isfinite(limit) else ''
        how = (f'a proportional loop of {loop.gain:.4g} N·m/rad{within}, with which it is the '
               'torque that the model needs (model file: controller.proportional and '
               'effort_limit, if known)')
    return replace(recording, effort=effort, notes=(
        *recording.notes, f'no effort was recorded: it is taken from reference and position by '
        f'{how}; {NOT_TOLD}'))


def _asked(recording: Recording, controller: Controller, error: Array) -> Array:
    """Return the effort (n,) [N·m] that the controller asks for at an error (n,) [rad]."""
    if controller.integral:
        raise InputError(
            f'{recording.name}: has no effort, and controller.integral of the model file is not '
            '0: what the integral held at the begin is not known; record joint_states.effort')
    reference = recording.reference
    assert reference is not None
    effort = controller.proportional * error
    if controller.derivative:
        effort = effort + controller.derivative * np.gradient(error, recording.time)
    if reference.effort is not None:
        effort = effort + np.interp(recording.time, reference.time, reference.effort)
    limit = controller.effort_limit
    return np.clip(effort, -limit, limit) if math.isfinite(limit) else effort


@dataclass(frozen=True)
class _Loop:
    """A proportional loop: `gain` [N·m/rad], the `largest` error [rad] before its drive's limit,
    and which part of the variance of the torque it leaves."""

    left: float
    gain: float
    largest: float

    def asked(self, error: Array) -> Array:
        """Return the effort (n,) [N·m] at an error (n,) [rad]."""
        return self.gain * np.clip(error, -self.largest, self.largest)


def _loop(recording: Recording, model: Model) -> _Loop:
    """Return the proportional loop that asks for what the model needs, be it some time later:
    drives act on their set-point late."""
    loop = _fitted(recording, model, COMPARED)
    # Once more in the band in which coarse counts do not drown the torque of the inertia.
    asked = replace(recording, effort=loop.asked(_error(recording)))
    loop = _fitted(recording, model, min(COMPARED, told_up_to(asked, model.motor.inertia)))
    if not loop.gain > 0.0 or loop.left > 1.0 - EXPLAINED:
        raise InputError(
            f'{recording.name}: has no effort, and no gain of a position loop makes up the torque '
            'that the model needs; give controller.proportional (and effort_limit) in the model '
            'file, or record joint_states.effort')
    return loop


def _fitted(recording: Recording, model: Model, band: float) -> _Loop:
    """Return the loop that fits best up to `band` [Hz]. Set-point and motion are smoothed alike:
    the one jumps, the other never does."""
    motion = motion_of(replace(recording, effort=_error(recording)), band)
    moving = np.abs(motion.velocity) >= slowest_speed(
        [motion], model.friction.saturation_velocity, motion.speed)
    needed = effort_of_recording(recording, motion, motion.samples(), physics_of(model),
                                 moving)[moving]
    whole = max(float(np.var(needed)), 1e-300)
    found = []
    for late in np.arange(0.0, LATEST, recording.interval):
        error = _error(recording, late)
        for largest in np.quantile(np.abs(error), LIMITS):
            clipped = np.clip(error, -largest, largest)
            smooth = motion_of(replace(recording, effort=clipped), band).effort
            design = np.stack([smooth, np.ones_like(smooth)], axis=1)[moving]
            solution, *_ = np.linalg.lstsq(design, needed, rcond=None)
            left = float(np.var(needed - design @ solution)) / whole
            found.append(_Loop(left, float(solution[0]), float(largest)))
    best = min(found, key=lambda loop: loop.left)
    if best.largest >= float(np.max(np.abs(_error(recording)))):
        return replace(best, largest=math.inf)
    return best


def _error(recording: Recording, late: float = 0.0) -> Array:
    """Return the error (n,) [rad] of the loop that tracks the reference so much later [s]."""
    reference = recording.reference
    assert reference is not None
    return np.interp(recording.time - late, reference.time, reference.position) \
        - recording.position
