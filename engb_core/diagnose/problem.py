# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a diagnosis works on: recordings as motions, filtered measurements, noise, folds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import CHANCE
from engb_core.diagnose.effort_rounding import rounding_noise
from engb_core.diagnose.onset import Onset
from engb_core.diagnose.parallel_map import OwnSamples
from engb_core.diagnose.position_noise import position_noise
from engb_core.diagnose.scene import scene_of
from engb_core.effects.base import Scene
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.nominal_torque import N_INERTIA
from engb_core.physics.plant import Physics, physics_of
from engb_core.recording import Recording
from engb_core.signals.filtering import (
    ABOVE_BAND,
    Comparison,
    comparison_of,
    judgeable,
    low_passed_noise,
    mostly_white,
    noise_in_motion,
    noise_of_polled,
    slowest_speed,
    turns_nowhere,
)
from engb_core.signals.gaussian import filtered, gaussian_kernel
from engb_core.signals.held_effort import EFFORT_TAKEN
from engb_core.signals.motion import MOST_OF_RATE, Motion, MOTION_BANDWIDTH, motion_of
from engb_core.signals.motion_band import (
    COMPARED,
    count_of,
    outweighed_from,
    position_variance,
    told_up_to,
)
from engb_core.signals.order_periodogram import line_amplitude, order_periodogram
from engb_core.signals.position_error import effort_of_recording
from engb_core.signals.sampling_noise import sampling_noise, SamplingNoise
from engb_core.signals.sharp_motion import sharp_motion_of

__all__ = ['Problem', 'holding', 'Run', 'problem_of', 'sharper', 'with_less_noise']

Array = NDArray[np.float64]

# Corner of the comparison, at most this part of the sampling rate: nearer to that, what is between
# the samples shows more than what the model lacks.
OF_RATE = 0.1
# Step of a motion that is fitted as sharp as it is told [s].
SHARP_STEP = 1e-3
# Share of a recording's duration that is kept out of every fit, in stretches.
KEPT_OUT = 0.2
STRETCHES = 4
LEAST_POINTS = 40
# Stamps, holds and read-out make position and effort differ in time by an unknown part of a
# sample: where effort changes fast, that is the larger part of what can't be known.
TIMING = 4e-4
TIMING_OF_SAMPLE = 0.2
# Positions of a shaft that rests lie within two counts, and within so many deviations of their
# noise, which is what hundreds of Gaussian values range over.
RESTING_COUNTS, RANGE_OF_NOISE = 2.0, 6.0


@dataclass(frozen=True)
class Run:
    """One recording, ready: its motion, its filter, its filtered effort and noise.

    `measured` (m,) filtered effort; `noise` (m,) the noise of the difference between it and what
    the motion needs: the effort's own and what position counts make of the motion (`counts`
    (m,)); `sigma` (m,) noise and uncertainty of timing together; `rate` (m,) how fast effort
    changes [N·m/s]; `fitted` (m,) True where a fit may look; the rest, and all of a held-out
    recording, is only judged; `sampling_noise` is the position's own; `coarse` counts tell nothing
    above the band of its motion; `told` is up to which frequency [Hz] the position tells the
    torque.
    """

    recording: Recording
    motion: Motion
    own: OwnSamples
    comparison: Comparison
    measured: Array
    noise: Array
    counts: Array
    sigma: Array
    rate: Array
    fitted: NDArray[np.bool_]
    held_out: bool
    sampling_noise: SamplingNoise
    coarse: bool = False
    told: float = math.inf

    @property
    def samples(self) -> Array:
        """The motion's samples (n, SAMPLE_SIZE), this thread's own, to read and to write."""
        self.own.walk.forget()
        return self.own.table

    @property
    def time(self) -> Array:
        """When the filtered effort was measured, (m,) [s] from the first sample."""
        return self.motion.time[self.comparison.grid]

    def predicted(self, physics: Physics) -> Array:
        """Return the filtered effort (m,) that `physics` says this motion needs."""
        return self.comparison(effort_of_recording(self.recording, self.motion, self.own.table,
                                                   physics, walk=self.own.walk,
                                                   told=self.told))


@dataclass(frozen=True)
class Problem:
    """Recordings, the model they are held against, and what they can show.

    `bandwidth` [Hz] is the comparison's, lower in a run with coarse counts; `settled` are effects
    that are decided elsewhere and not looked for; `before_stop` [s] is how long before each stop
    nothing is judged; `onsets` says which effects of a model begin within the recordings (id,
    onset); `sampled_together` says that effort and position were, so that what is late is physics;
    `noise_part` (0 to 1) is which part of the effort's noise's mean square is noise.
    """

    runs: tuple[Run, ...]
    held_out: tuple[Run, ...]
    model: Model
    scene: Scene
    noise_floor: float
    bandwidth: float
    before_stop: float = 0.0
    settled: tuple[str, ...] = ()
    onsets: tuple[tuple[str, Onset], ...] = ()
    sampled_together: bool = False
    noise_part: float = 1.0

    @property
    def coarse(self) -> bool:
        """Whether coarse counts tell nothing above some run's band: no sharper motion either."""
        return any(run.coarse for run in self.runs)

    @property
    def times(self) -> list[Array]:
        """When the filtered effort of each fitted run was measured, [(m_r,)…] [s]."""
        return [run.time for run in self.runs]

    @property
    def measured(self) -> Array:
        """Filtered effort of all fitted runs, (m,)."""
        return np.concatenate([run.measured for run in self.runs])

    @property
    def rate(self) -> Array:
        """How fast the filtered effort changes, (m,) [N·m/s], never negative."""
        return np.concatenate([run.rate for run in self.runs])

    def predicted(self, run: Run, model: Model) -> Array:
        """Return the filtered effort (m,) that a model says the motion of one run needs. An effect
        that begins within the recordings acts from there on; all of them in what is held out."""
        whole = run.predicted(physics_of(model))
        place = next((index for index, own in enumerate(self.runs) if own is run), None)
        for effect, onset in self.onsets:
            if place is None or not any(entry.effect == effect for entry in model.effects):
                continue
            without = replace(model, effects=tuple(
                entry for entry in model.effects if entry.effect != effect))
            whole = np.where(run.time < onset.begins[place],
                             replace(self, onsets=()).predicted(run, without), whole)
        return whole

    def split(self, values: Array) -> list[Array]:
        """Return values (m,) of all fitted runs, run by run."""
        return np.split(values, np.cumsum([run.measured.size for run in self.runs])[:-1])

    @property
    def sigma(self) -> Array:
        return np.concatenate([run.sigma for run in self.runs])

    @property
    def fitted(self) -> NDArray[np.bool_]:
        return np.concatenate([run.fitted for run in self.runs])


def problem_of(recordings: Sequence[Recording], model: Model, held_out: Sequence[Recording] = (),
               bandwidth: float | None = None,
               motion_bandwidth: float = MOTION_BANDWIDTH, before_stop: float = 0.0) -> Problem:
    """Prepare recordings for diagnosis.

    Where coarse counts drown the torque below `COMPARED`, a recording is compared up to the
    frequency from which they do (motion_band.py), and its motion smoothed there: friction,
    which turns with the sign of the velocity, must not see them either.

    Args:
        recordings: what may be fitted.
        model: what they are held against.
        held_out: what is only judged.
        bandwidth: of the comparison [Hz], whatever the counts (None: 20, a tenth of a slower
            recording's rate, or what the counts tell; more where a torque that turns with the
            shaft passes above that).
        motion_bandwidth: of the smoothing of position and effort [Hz]; more where the comparison
            is wider than usual.
        before_stop: how long before each stop nothing is judged [s]: where torque comes late,
            effort is that of a shaft which stands already.

    Raises:
        InputError: no recording, or too little motion to judge a model by.
    """
    if not recordings:
        raise InputError('no recording given')
    by_counts = bandwidth is None
    told = [told_up_to(recording, model.motor.inertia) if by_counts else np.inf
            for recording in (*recordings, *held_out)]
    noises = [sampling_noise(recording) for recording in (*recordings, *held_out)]
    if bandwidth is None:
        most = min(OF_RATE / recording.interval for recording in recordings)
        bandwidth = min(COMPARED, most)
        passes = max(_line_above(recording, model, bandwidth, highest, noise)
                     for recording, highest, noise in zip(recordings, told, noises, strict=False))
        if passes > bandwidth:
            bandwidth = min(passes, most)
            motion_bandwidth *= bandwidth / COMPARED
    motions = [motion_of(recording, highest if highest < COMPARED else motion_bandwidth)
               for recording, highest in zip((*recordings, *held_out), told, strict=True)]
    fitted = motions[:len(recordings)]
    slowest = slowest_speed(fitted, model.friction.saturation_velocity,
                            max(motion.speed for motion in fitted))
    physics = physics_of(model)
    every: list[Run] = []
    for place, (recording, motion, highest, noise) in enumerate(zip(
            (*recordings, *held_out), motions, told, noises, strict=True)):
        band = min(bandwidth, highest)
        comparison = comparison_of(motion, band, slowest, before_stop)
        if comparison.grid.size == 0:
            # A shaft that stands throughout a recording tells nothing of the machine.
            continue
        counts = position_noise(recording, motion, comparison, physics, noise)
        run = _run(recording, motion, comparison, band, place >= len(recordings), counts,
                   physics, noise)
        every.append(replace(run, coarse=highest < COMPARED))
    runs, judged = (tuple(run for run in every if run.held_out == held)
                    for held in (False, True))
    points = sum(int(run.fitted.sum()) for run in runs)
    if points < LEAST_POINTS:
        raise InputError(
            f'{recordings[0].name}: too little motion to judge a model by ({points} filtered '
            f'values above {slowest:.3g} {"m" if model.joint.type == "prismatic" else "rad"}/s, '
            f'{LEAST_POINTS} are needed); record strokes')
    scene = scene_of([run.recording for run in runs], [run.motion for run in runs], model)
    floor = float(np.sqrt(np.mean(np.concatenate([run.noise for run in runs]) ** 2)))
    return Problem(runs, judged, model, scene, floor, bandwidth, before_stop)


def with_less_noise(problem: Problem, part: float) -> Problem:
    """Return the problem with a part of the mean square of the effort's noise; what counts and
    timing make stays."""
    if part == 1.0:
        return problem
    runs = tuple(_quieter(run, part) for run in problem.runs)
    floor = float(np.sqrt(np.mean(np.concatenate([run.noise for run in runs]) ** 2)))
    return replace(problem, runs=runs, noise_floor=floor, noise_part=part * problem.noise_part,
                   held_out=tuple(_quieter(run, part) for run in problem.held_out))


def _quieter(run: Run, part: float) -> Run:
    noise = np.sqrt(np.maximum(run.noise ** 2 - run.counts ** 2, 0.0) * part + run.counts ** 2)
    timing = np.maximum(run.sigma ** 2 - run.noise ** 2, 0.0)
    return replace(run, noise=noise, sigma=np.sqrt(noise ** 2 + timing))


def sharper(problem: Problem) -> Problem:
    """Return the problem with its recordings' motion as sharp as they tell it: dearer to fit, but
    what acts within milliseconds of a reversal is smeared less. What is held out is not in it."""
    motions = [sharp_motion_of(run.recording, step=SHARP_STEP) for run in problem.runs]
    slowest = slowest_speed(motions, problem.model.friction.saturation_velocity,
                            problem.scene.speed)

    def ready(run: Run, motion: Motion) -> Run:
        comparison = comparison_of(motion, problem.bandwidth, slowest, problem.before_stop)
        # The sharper chain takes the samples as they stand beside the counts' edges: what the
        # smoothed one makes of the counts is no measure of that.
        counts = np.zeros(comparison.grid.size)
        made = _quieter(_run(run.recording, motion, comparison, problem.bandwidth, False, counts,
                             physics_of(problem.model), run.sampling_noise), problem.noise_part)
        return replace(made, fitted=np.ones_like(made.fitted)) if run.fitted.all() else made

    return replace(problem, runs=tuple(map(ready, problem.runs, motions)), held_out=())


def holding(problem: Problem, model: Model) -> Problem:
    """Return the problem with the recordings held against another model."""
    return replace(problem, model=model, scene=scene_of(
        [run.recording for run in problem.runs], [run.motion for run in problem.runs], model))


def _line_above(recording: Recording, model: Model, bandwidth: float, highest: float,
                noise: SamplingNoise) -> float:
    """Return the frequency [Hz] at which the strongest torque that turns with the shaft passes at
    the motion's median speed, where it stands out above a band; 0 where none does.

    Below that frequency less than half of the motion would show it, and what it leaves there looks
    like something else.

    Args:
        recording: as it was taken.
        model: what it is held against.
        bandwidth: corner of the band [Hz].
        highest: up to where the position's counts tell the torque [Hz].
        noise: of the position.
    """
    inertia, corner = model.motor.inertia, ABOVE_BAND * bandwidth
    motion = motion_of(recording, min(highest, MOST_OF_RATE / recording.interval))
    variance = position_variance(recording, motion, noise)
    most = min(OF_RATE / recording.interval, highest,
               outweighed_from(recording, inertia, variance))
    if most <= bandwidth:
        return 0.0
    moving = judgeable(motion, slowest_speed([motion], model.friction.saturation_velocity,
                                             motion.speed))
    left = motion.effort - effort_of_motion(motion.samples(), motion.step, physics_of(model))
    above = left - filtered(left, gaussian_kernel(corner, motion.step))
    order = order_periodogram(motion, moving, corner, above).strongest_line(CHANCE)
    if order is None:
        return 0.0
    # At a constant speed all that counts do may be such a line.
    amplitude, fourth_power = line_amplitude(motion, moving, corner, above, order)
    if 0.5 * amplitude ** 2 < inertia ** 2 * fourth_power * variance:
        return 0.0
    usual = float(np.median(np.abs(motion.velocity[moving])))
    return min(order * usual / (2.0 * np.pi), most)


def _run(recording: Recording, motion: Motion, comparison: Comparison, bandwidth: float,
         held_out: bool, counts: Array, physics: Physics, position: SamplingNoise) -> Run:
    time = motion.time[comparison.grid]
    fitted = np.ones(time.size, bool)
    if held_out:
        fitted[:] = False
    else:
        length = motion.time[-1] / STRETCHES
        fitted = (time % length) < (1.0 - KEPT_OUT) * length
    resolution = float(np.median(np.abs(recording.effort))) * 1e-4
    if motion.commanded is not None:
        # A command's noise is what counts make of it, which a standing one does not show.
        resolution = (motion.commanded.law.gain * motion.quantum / np.sqrt(12.0)
                      * comparison.noise_gain_whole)

    def left() -> Array:
        return motion.effort - effort_of_motion(motion.samples(), motion.step, physics)

    if motion.fresh is not None:
        # Each window holds one value that was taken, as it is.
        told = noise_of_polled(motion, comparison, bandwidth, left(),
                               recording.signals[EFFORT_TAKEN].value)
        noise = np.full(time.size, max(told, resolution))
    else:
        told = _noise_of_effort(recording, motion, comparison, bandwidth, position, left())
        # Nor does a shaft at rest show what rounding does to an effort that changes.
        noise = np.maximum(max(told, resolution) / np.sqrt(comparison.scale),
                           rounding_noise(recording, motion, comparison))
    noise = np.hypot(noise, counts)
    smooth = filtered(motion.effort, comparison.taps)
    rate = np.abs(np.gradient(smooth, motion.step))[comparison.grid]
    timing = max(TIMING, TIMING_OF_SAMPLE * motion.recorded_step)
    tells = outweighed_from(recording, float(physics.nominal[N_INERTIA]),
                            position_variance(recording, motion, position))
    return Run(recording, motion, OwnSamples(motion.samples()), comparison,
               comparison(motion.effort), noise, counts, np.hypot(noise, timing * rate), rate,
               fitted, held_out, position, told=tells)


def _noise_of_effort(recording: Recording, motion: Motion, comparison: Comparison,
                     bandwidth: float, position: SamplingNoise, left: Array) -> float:
    """Return the noise of the filtered effort [N·m]: while the shaft rests or creeps one way;
    where it never does, the less of what a standing one shows, which may turn back and its
    friction with it, and of what a moving one shows, which holds something of what the model
    lacks. `left` (n,) is what the model leaves of the effort."""
    # Above the corner of the low-pass second differences are blind to what the motion needs.
    stride = max(1, round(0.8 / bandwidth / motion.step))
    standing = None
    if not mostly_white(recording):
        apart = (RESTING_COUNTS * count_of(recording.position) * (1.0 + 1e-6)
                 + RANGE_OF_NOISE * position.white)
        resting = low_passed_noise(motion, comparison, stride, turns_nowhere(
            recording, motion, comparison, stride, apart))
        if resting is not None:
            return resting
        standing = low_passed_noise(motion, comparison, stride)
    moving = noise_in_motion(motion, comparison, bandwidth, left)
    return moving if standing is None else min(standing, moving)
