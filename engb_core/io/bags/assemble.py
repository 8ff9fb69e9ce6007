# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""From raw columns with two clocks to a Recording."""

from __future__ import annotations

from collections.abc import Mapping
import dataclasses

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.bags.clock import ClockMap, usable_stamps, wild
from engb_core.io.bags.joints import JointTrack
from engb_core.recording import Recording, Reference, Signal

__all__ = ['assemble']

Times = NDArray[np.int64]
Values = NDArray[np.float64]

_NANO = 1e-9
_LATEST = 4 * 10**18        # [ns] the year 2096: later is a damaged clock
_HUGE = 1e12                # no angle, speed or torque is that large: damaged bytes
_MARGIN = 60 * 10**9        # [ns] how far a signal may reach beyond the samples
_BREAK = 60 * 10**9         # [ns] a longer pause may be a clock that was set, or a forgotten
_BREAK_SHARE = 10           # recorder: if it also lasts that many times what was sampled
_FASTEST, _SLOWEST = 1e-5, 1.0      # [s] between samples
_MISSING_LIMIT = 0.1        # a velocity that is missing in more samples than this isn't used
_NOTES = 20


def assemble(name: str, source: str, states: JointTrack, reference: JointTrack | None,
             signals: Mapping[str, tuple[Times, Values]], notes: list[str],
             effort_optional: bool = False) -> Recording:
    """Put columns as recorded onto one clock and clean them.

    Args:
        name, source: the recording's name, and what messages call it.
        states: joint_states.
        reference: the reference topic, or None.
        signals: name → log time (k,) [ns], value (k,).
        notes: what was repaired so far.
        effort_optional: a recording without effort will do.

    Raises:
        InputError: no position or effort, or too few samples.
    """
    notes = list(notes)
    log_time = np.clip(states.log_time, -_LATEST, _LATEST)
    stamp = states.stamp
    if not usable_stamps(stamp):
        stamp = log_time
        notes.append('header.stamp is not filled in: the recorder\'s log times were used')
    near = ~wild(stamp)
    good = _same_clock(stamp, near)
    if not near.all():
        notes.append(f'{int((~near).sum())} samples with a stamp far from their neighbours\' '
                     'left out')
    if good.sum() < near.sum():
        notes.append(f'{int(near.sum() - good.sum())} samples before or behind a pause of minutes '
                     'left out; record such stretches apart')
    position, velocity = (_sound(column)[good] for column in (states.position, states.velocity))
    effort: Values | None = None
    needed = [(position, 'position', 'rad')]
    measured = _sound(states.effort)[good]
    if not effort_optional or np.isfinite(measured).any():
        effort = measured
        needed.append((measured, 'effort', 'N·m'))
    for column, field, unit in needed:
        if not np.isfinite(column).any():
            raise InputError(f'{source}: joint_states of joint {states.joint!r} has no finite '
                             f'{field}; publish it [{unit}] and record again')
    stamp, log_time = stamp[good], log_time[good]
    base, last = int(stamp.min()), int(stamp.max())
    steady = ~wild(log_time)
    clock = ClockMap.fit(stamp[steady], log_time[steady]) if steady.any() else ClockMap.fit(
        stamp, log_time)
    recording = Recording.from_samples(
        name, (stamp - base) * _NANO, position, effort, _velocity(velocity, notes),
        reference=_reference(reference, clock, base, last),
        signals=_signals(signals, clock, base, last, notes),
        joint=states.joint, notes=tuple(notes), source=source)
    if not _FASTEST <= recording.interval <= _SLOWEST:
        raise InputError(f'{source}: samples are {recording.interval:.3g} s apart by their stamps;'
                         f' between {_FASTEST:.3g} s and {_SLOWEST:.3g} s can be judged; fill in '
                         'header.stamp with the time of sampling, in s (of a table in ms or ns '
                         'use --scale time=0.001 or time=1e-9)')
    told = recording.notes
    if len(told) > _NOTES:
        told = (*told[:_NOTES], f'… and {len(told) - _NOTES} more repairs')
    # The float of a whole date is good for 0.2 µs only: it is added last, for information.
    return dataclasses.replace(recording, start=recording.start + base * _NANO, notes=told)


def _same_clock(stamp: Times, good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the samples (n,) of the longest stretch without an endless pause."""
    order = np.flatnonzero(good)
    order = order[np.argsort(stamp[order], kind='stable')]
    step = np.diff(stamp[order])
    if not step.size or step.max() <= _BREAK or np.median(step) > _BREAK:
        return good
    sampled = step[step <= _BREAK].sum()
    parts = np.split(order, np.flatnonzero((step > _BREAK) & (step > _BREAK_SHARE * sampled)) + 1)
    chosen = np.zeros(stamp.size, bool)
    chosen[max(parts, key=len)] = True
    return chosen


def _sound(values: Values) -> Values:
    """Return `values` with NaN where a number can only be damaged bytes."""
    with np.errstate(invalid='ignore'):
        return np.where(np.abs(values) < _HUGE, values, np.nan)


def _velocity(velocity: Values, notes: list[str]) -> Values | None:
    missing = 1.0 - np.isfinite(velocity).mean()
    if missing > _MISSING_LIMIT:
        if missing < 1.0:
            notes.append(f'velocity is missing in {missing:.0%} of the samples: not used')
        return None
    return velocity


def _reference(track: JointTrack | None, clock: ClockMap, base: int, last: int,
               ) -> Reference | None:
    if track is None:
        return None
    stamp = track.stamp
    if not usable_stamps(stamp):
        stamp = clock.stamps(np.clip(track.log_time, -_LATEST, _LATEST))
    near = (stamp > base - _MARGIN) & (stamp < last + _MARGIN)
    position = _sound(track.position)[near]
    if not np.isfinite(position).any():
        return None

    def optional(values: Values) -> Values | None:
        values = _sound(values)[near]
        return values if np.isfinite(values).any() else None

    return Reference(np.asarray((stamp[near] - base) * _NANO, np.float64), position,
                     optional(track.velocity), optional(track.effort))


def _signals(signals: Mapping[str, tuple[Times, Values]], clock: ClockMap, base: int, last: int,
             notes: list[str]) -> dict[str, Signal]:
    found = {}
    for name, (log_time, value) in signals.items():
        stamp = clock.stamps(np.clip(log_time, -_LATEST, _LATEST))
        value = _sound(value)
        good = np.isfinite(value) & (stamp > base - _MARGIN) & (stamp < last + _MARGIN)
        if (lost := int((~good).sum())):
            notes.append(f'{name}: {lost} values that are not finite or out of the recording\'s '
                         'time left out')
        if good.any():
            time, value = stamp[good], value[good]
            if (np.diff(time) <= 0).any():
                time, keep = np.unique(time, return_index=True)
                value = value[keep]
            found[name] = Signal(np.asarray((time - base) * _NANO, np.float64), value)
    return found
