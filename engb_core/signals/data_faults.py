# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is wrong with a recording itself: found, told, and kept out of what is judged.

A fault of the data is no physics that a model leaves out. Each test here rests on what a machine
can do (no shaft jumps away and back within a sample or two, since that needs more torque than the
drive has) or on what noise does, and none looks at how well a model fits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.stats import norm

from engb_core.model import Model
from engb_core.physics.command_law import command_law
from engb_core.recording import Recording, Signal
from engb_core.signals.count_edges import quantum_of
from engb_core.signals.filtering import mostly_white
from engb_core.signals.held_effort import effort_as_taken, EFFORT_TAKEN, time_between_polls
from engb_core.signals.mains_hum import mains_hum
from engb_core.signals.motion import CUT_OFF
from engb_core.signals.sampling_noise import sampling_noise, SamplingNoise
from engb_core.signals.spread import robust_deviation
from engb_core.signals.stale_samples import stale_samples
from engb_core.signals.stamps import evenly_timed, stamps_vary, VARY

__all__ = ['DataFault', 'cleaned', 'without_motion']

Array = NDArray[np.float64]

# Samples in a row that a glitch lasts at most: more would be a motion, or lost samples.
LONGEST_GLITCH = 3
# Part of a glitch that the values before and after it may differ by: what stays is none.
STAYS = 0.25
# Chance of taking noise for a glitch anywhere in a recording.
CHANCE = 0.01
# Part of a recording at a value that no sample goes beyond, from which on it is a limit: noise
# alone leaves a single sample at its largest value.
CLIPPED_LEAST = 10
# A limit crowds: it has more than so many times the samples of the values beside it.
CROWDS = 3


@dataclass(frozen=True)
class DataFault:
    """A fault of a recording: its name, where [s], and a sentence with the remedy."""

    fault: str
    recording: str
    begin: float
    end: float
    statement: str


def cleaned(recording: Recording, model: Model) -> tuple[Recording, list[DataFault]]:
    """Return the recording without samples that cannot be true, at the times at which they were
    taken, and what is wrong with it."""
    repeated = _repeated(recording)
    recording, faults = (recording, []) if repeated else _without_stale(recording)
    # What is repeated has the stamps of the log, not of its source.
    timed = recording if repeated else evenly_timed(recording)
    noise = sampling_noise(timed)
    faults += [] if repeated else _jitter(recording, timed, noise)
    recording = timed if repeated else effort_as_taken(timed)
    held = EFFORT_TAKEN in recording.signals
    faults += _held(recording) if held else []
    if not (held or repeated):
        recording, hum = _without_hum(recording, model)
        faults += hum
    # Among values that stand for several samples each, neighbours tell no spike and no limit.
    effort_bad = np.zeros(recording.effort.size, bool) if held else _spikes(recording.effort)
    most = float(np.max(np.abs(recording.effort[~effort_bad]), initial=0.0))
    position_bad = _impossible(recording, model, noise, most)
    for bad, what in ((position_bad, 'position'), (effort_bad, 'effort')):
        if bad.any():
            times = recording.time[bad]
            faults.append(DataFault(
                f'{what}_glitch', recording.name, float(times[0]), float(times[-1]),
                f'{int(bad.sum())} samples of {what} jump away and back within '
                f'{LONGEST_GLITCH} samples (first at {times[0]:.3f} s); they are left out. '
                'Look at the encoder line and its shield.' if what == 'position' else
                f'{int(bad.sum())} samples of effort are spikes '
                f'(first at {times[0]:.3f} s); they are left out. Look at the current '
                'sensor and at the bus.'))
    faults += _lost(recording)
    faults += [] if held else _aliased(recording)
    keep = ~(position_bad | effort_bad)
    computed = _computed(recording)
    # A command is cut off by its own law, which is no fault.
    cut_off = [] if computed or held else _clipped(recording, model, ~effort_bad)
    faults += computed or [fault for fault, _ in cut_off]
    if cut_off:
        beyond = np.any([rows for _, rows in cut_off], axis=0)
        recording = replace(recording, signals={
            **recording.signals, CUT_OFF: Signal(recording.time, beyond.astype(float))})
    if repeated:
        faults += repeated
        keep &= np.append(True, (np.diff(recording.position) != 0.0)
                          | (np.diff(recording.effort) != 0.0))
    return _kept(recording, keep), faults


def without_motion(recording: Recording) -> DataFault:
    """Return the fault of a recording in which the shaft never moves fast enough to be judged."""
    return DataFault(
        'no_motion', recording.name, 0.0, float(recording.time[-1]),
        'The shaft never moves fast enough to be judged; nothing of this recording is used. '
        'Record strokes.')


def _kept(recording: Recording, keep: NDArray[np.bool_]) -> Recording:
    if keep.all():
        return recording
    return replace(
        recording, time=recording.time[keep], position=recording.position[keep],
        effort=recording.effort[keep],
        velocity=None if recording.velocity is None else recording.velocity[keep])


def _without_stale(recording: Recording) -> tuple[Recording, list[DataFault]]:
    stale = stale_samples(recording)
    if not stale.any():
        return recording, []
    times = recording.time[stale]
    return _kept(recording, ~stale), [DataFault(
        'stale_samples', recording.name, float(times[0]), float(times[-1]),
        f'{int(stale.sum())} of {stale.size} samples tell all values of the one before once more, '
        'while the shaft moves on; they are left out. Stamp each message once, as it comes, or '
        'poll no faster than the drive answers.')]


def _without_hum(recording: Recording, model: Model) -> tuple[Recording, list[DataFault]]:
    hum = mains_hum(recording, model.motor.inertia)
    if hum is None:
        return recording, []
    return replace(recording, effort=recording.effort - hum.values), [DataFault(
        'mains_hum', recording.name, 0.0, recording.duration,
        f'Effort holds a hum of ±{hum.amplitude:.3g} at {hum.frequency:.4g} Hz, the mains, which '
        'the shaft does not follow: it is measured, no torque, and taken out. Look at the ground '
        'and the shield of the current sensor.')]


def _away_and_back(values: Array, count: int, when: Array | None = None) -> tuple[Array, Array]:
    """Return how far each block of `count` values stands off the line between its neighbours, the
    least of the block with its sign, and the step between those neighbours: (n − count − 1,).
    The line is drawn over `when` (n,) [s], or over the samples, as many to each."""
    before, after = values[:-count - 1], values[count + 1:]
    when = np.arange(values.size, dtype=float) if when is None else when
    first, last = when[:-count - 1], when[count + 1:]
    shares = np.stack([(when[1 + place:values.size - count + place] - first) / (last - first)
                       for place in range(count)])
    inner = np.stack([values[1 + place:values.size - count + place] for place in range(count)])
    off = inner - (before + shares * (after - before))
    least = np.where((off > 0).all(axis=0), off.min(axis=0),
                     np.where((off < 0).all(axis=0), off.max(axis=0), 0.0))
    return least, after - before


def _impossible(recording: Recording, model: Model, noise: SamplingNoise, effort: float,
                ) -> NDArray[np.bool_]:
    """Return which positions (n,) a shaft cannot have had: the drive's whole torque and as much
    load, for and against it, would not bring it there and back in the time, nor is it the noise
    of the encoder or of the times at which it is read. `effort` is the largest recorded one
    [N·m] that is no spike."""
    position, interval = recording.position, recording.interval
    most = 4.0 * effort / model.motor.inertia
    quantum = quantum_of(position)
    bad = np.zeros(position.size, bool)
    if most == 0.0:
        # Without a torque nothing bounds what the shaft can have done.
        return bad
    speed = np.abs(np.gradient(position, recording.time)) if position.size > 1 else position
    by_noise = float(norm.isf(0.5 * CHANCE / max(position.size, 2))) * noise.of(
        median_filter(speed, 2 * LONGEST_GLITCH + 3))
    for count in range(1, LONGEST_GLITCH + 1):
        if position.size < count + 4:
            break
        off, between = _away_and_back(position, count)
        # Stamps that jitter may be those of the samples, or of a queue behind even ones.
        by_stamps, _ = _away_and_back(position, count, recording.time)
        off = np.where(np.abs(by_stamps) < np.abs(off), by_stamps, off)
        reach = (0.125 * most * ((count + 1) * interval) ** 2 + 2.0 * quantum
                 + by_noise[1:off.size + 1])
        # Beside it the motion goes on as if nothing were: a step that stays is no glitch.
        stays = _beyond_motion(position, between, count)
        found = np.flatnonzero((np.abs(off) > reach) & (stays < STAYS * np.abs(off)))
        for place in found:
            bad[place + 1:place + 1 + count] = True
    return bad


def _beyond_motion(position: Array, between: Array, count: int) -> Array:
    """Return by how much at least (n − count − 1,) each step `between` the neighbours of a block
    of `count` positions exceeds a motion that goes on as it came, or comes as it goes on."""
    step = np.diff(position)
    came = np.concatenate([step[:1], step[:between.size - 1]])
    goes = np.concatenate([step[count + 1:], step[-1:]])[:between.size]
    left: Array = np.abs([between, between - (count + 1) * came, between - (count + 1) * goes])
    return np.asarray(left.min(axis=0), float)


def _spikes(effort: Array) -> NDArray[np.bool_]:
    """Return which efforts (n,) are spikes: off the line between their neighbours by more than
    noise of this size ever is in so many samples, and by more than effort moves anywhere else in
    the same time; while the neighbours stand where they would without it."""
    bad = np.zeros(effort.size, bool)
    if effort.size < 50:
        return bad
    level = float(norm.isf(0.5 * CHANCE / effort.size))
    blocks, suspect = [], bad.copy()
    for count in range(1, LONGEST_GLITCH + 1):
        off, between = _away_and_back(effort, count)
        moved = off[off != 0.0]
        typical = robust_deviation(moved) if moved.size else 0.0
        alone = (np.abs(off) > level * typical) & (np.abs(between) < STAYS * np.abs(off))
        blocks.append((count, off, between, alone))
        for within in range(1, count + 1):
            suspect[np.flatnonzero(alone) + within] = True
    for count, off, between, alone in blocks:
        # How effort moves is told where there is no spike of any length: one of two samples that
        # are not alike had hidden all others.
        clean = ~maximum_filter1d(suspect, count + 2)[(count + 2) // 2:][:between.size]
        if not clean.any():
            continue
        usual = float(np.max(np.abs(between[clean])))
        for place in np.flatnonzero(alone & (np.abs(off) > usual)):
            bad[place + 1:place + 1 + count] = True
    return bad


def _lost(recording: Recording) -> list[DataFault]:
    step = np.diff(recording.time)
    gaps = np.flatnonzero(step > 4.5 * recording.interval)
    if not gaps.size:
        return []
    missing = float(np.sum(step[gaps]) - gaps.size * recording.interval)
    return [DataFault(
        'samples_lost', recording.name, float(recording.time[gaps[0]]),
        float(recording.time[gaps[-1] + 1]),
        f'Samples are missing in {gaps.size} stretches, {missing:.3g} s together; nothing is '
        'judged there. Look at the recorder and its queue.')]


def _jitter(recording: Recording, timed: Recording, noise: SamplingNoise) -> list[DataFault]:
    """Of a recording as it is stamped and as it was taken, with the noise of the latter."""
    spread = stamps_vary(recording)
    if spread == 0.0:
        jitter = noise.jitter
        return [] if jitter < VARY * recording.interval else [DataFault(
            'jittering_stamps', recording.name, 0.0, recording.duration,
            f'The stamps are {recording.interval * 1e3:.3g} ms apart, but the samples are taken '
            f'{jitter * 1e3:.2g} ms before or after them (standard deviation, by the positions). '
            'Stamp the samples where they are taken.')]
    even = '' if timed is recording else \
        'The positions say that the samples were taken evenly: they are used so. '
    return [DataFault(
        'jittering_stamps', recording.name, 0.0, recording.duration,
        f'The time between samples varies by {spread * 1e3:.2g} ms about '
        f'{recording.interval * 1e3:.3g} ms. {even}Stamp the samples where they are taken.')]


def _repeated(recording: Recording) -> list[DataFault]:
    """A log that repeats each value of a slower source: positions and efforts change together and
    only every few samples, although the shaft moves."""
    changed = (np.diff(recording.position) != 0.0) | (np.diff(recording.effort) != 0.0)
    places = np.flatnonzero(changed)
    if places.size < 20:
        return []
    between = np.diff(places)
    usual = int(np.median(between))
    if usual < 2 or np.mean(between == 1) > 0.01:
        return []
    return [DataFault(
        'repeated_values', recording.name, 0.0, recording.duration,
        f'Each value stands for {usual} samples: the source is {usual} times slower than the log. '
        'Only the samples at which the values change are used. Record the source itself.')]


def _held(recording: Recording) -> list[DataFault]:
    taken, every = recording.signals[EFFORT_TAKEN].time, time_between_polls(recording)
    return [DataFault(
        'held_effort', recording.name, float(taken[0]), float(taken[-1]),
        f'Effort is taken every {every * 1e3:.3g} ms only and stands in between, while the '
        f'position comes every {recording.interval * 1e3:.3g} ms: it is judged at the instants at '
        'which it was taken. Poll the current as fast as the position.')]


def _aliased(recording: Recording) -> list[DataFault]:
    if not mostly_white(recording):
        return []
    rate = 1.0 / recording.interval
    return [DataFault(
        'aliased_effort', recording.name, 0.0, recording.duration,
        f'Most of the effort changes from one sample to the next: noise, or a current faster than '
        f'{0.5 * rate:.3g} Hz that {rate:.3g} samples a second fold onto what is slower. It is '
        'taken for noise. Record faster, or low-pass the current before it is sampled.')]


def _clipped(recording: Recording, model: Model, rows: NDArray[np.bool_],
             ) -> list[tuple[DataFault, NDArray[np.bool_]]]:
    """Effort that stands at its largest value again and again: the sensor or the drive's limit.
    Of the samples (n,) that are no spikes (`rows`); each fault with the samples (n,) that only say
    that there was at least so much."""
    effort = recording.effort
    faults = []
    for sign, side in ((1.0, 'above'), (-1.0, 'below')):
        most = float(np.max(sign * effort[rows]))
        beyond = rows & (sign * effort >= most - 1e-9 * abs(most))
        at_most = np.flatnonzero(beyond)
        limit = model.controller.effort_limit if model.controller is not None else None
        if most <= 0.0 or at_most.size < CLIPPED_LEAST or (
                limit is not None and most > 0.98 * limit):
            continue
        # A source of few counts also stands at one value often: only a limit crowds there.
        step = quantum_of(effort)
        next_below = int(np.sum(rows & (sign * effort < most - 0.5 * step)
                                & (sign * effort >= most - 1.5 * step))) if step > 0.0 else 0
        if at_most.size <= CROWDS * max(next_below, 1) or _in_steps(effort, beyond):
            continue
        faults.append((DataFault(
            'clipped_effort', recording.name, float(recording.time[at_most[0]]),
            float(recording.time[at_most[-1]]),
            f'Effort is cut off {side} {sign * most:.4g} ({at_most.size} samples); nothing is '
            "judged there. Widen the current sensor's range, or give the drive's limit in the "
            'model file (controller.effort_limit).'), beyond))
    return faults


def _in_steps(effort: Array, extreme: NDArray[np.bool_]) -> bool:
    """Whether an effort (n,) comes to its `extreme` (n,) from values that it holds about as long,
    as one that is commanded in steps does; what is cut off comes there through values between."""
    begins = np.concatenate([[0], np.flatnonzero(np.diff(effort) != 0.0) + 1])
    lasts = np.diff(np.concatenate([begins, [effort.size]]))
    around = np.concatenate([[0], lasts, [0]])
    beside = np.maximum(around[:-2], around[2:])
    held = (beside >= CLIPPED_LEAST) & (lasts <= CROWDS * beside)
    return bool(np.mean(np.repeat(held, lasts)[extreme]) > 0.5)


def _computed(recording: Recording) -> list[DataFault]:
    """Effort that follows from reference and position alone is a command, no measurement."""
    law = command_law(recording)
    if law is None:
        return []
    return [DataFault(
        'effort_is_command', recording.name, 0.0, recording.duration,
        f'Effort is {law.gain:.4g} times the deviation from the reference: a command, not a '
        'measurement. What the drive itself does to it (delay, limits, back-EMF) is in the '
        'mismatch.')]
