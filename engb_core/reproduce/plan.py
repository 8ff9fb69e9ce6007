# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The experiments: which brake, which loop, which motion; in the order in which they build up."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engb_core.bench.settings import BenchSettings
from engb_core.control.excitation import ExcitationSettings
from engb_core.control.pid import PidGains
from engb_core.control.reference import ReferenceSettings
from engb_core.model import Model
from engb_core.reproduce import chosen

__all__ = ['Experiment', 'length', 'OBSERVER_CUTOFFS', 'plan_of', 'REFERENCE', 'SPIN_UP', 'STAGES',
           'stepwise_reference', 'STROKES', 'Table', 'tracking_reference']

Array = NDArray[np.float64]

# A stage's experiments use what the ones before have identified.
STAGES = ('nominal', 'strokes', 'validation')

# Highest angle of the strokes; the mechanism ends at 22 rad and tracking overshoots.
HIGH, MIDDLE = 20.0, 12.0

# In chapter 5's runs the disc stands during the first strokes, then comes to speed in this
# time [s].
SPIN_UP = 0.5

# −3 dB points of q with which the observer works in the loop [Hz].
OBSERVER_CUTOFFS = (5.0, 10.0, 20.0)


@dataclass(frozen=True)
class Table:
    """A reference as `time` (k,) [s] and `position` (k,) [rad]."""

    time: Array
    position: Array

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write it as a CSV file that the controller reads."""
        rows = [f'{time:.6f},{position:.9f}' for time, position
                in zip(self.time.tolist(), self.position.tolist(), strict=True)]
        Path(path).write_text('\n'.join(['time,position', *rows]) + '\n', encoding='utf-8')


@dataclass(frozen=True)
class Experiment:
    """One run.

    Attributes:
        name: the recording's name.
        stage: one of STAGES.
        figures: the paper's figures that it serves.
        purpose: one line.
        brake: the true brake: a bench brake, or a model run as it is.
        duration: [s].
        unloaded: the caliper is taken off.
        added_inertia: on the motor's shaft [kg·m²].
        excitation: open-loop torque, or None where the loop is closed.
        reference: what the loop tracks.
        table: for references of kind 'file'.
        model: the loop's: 'nominal', 'classical' (step test and cogging), 'paper' (identified the
            paper's way) or 'joint' (by joint regression).
        gains: of the PID.
        observer: −3 dB point of the loop's disturbance observer [Hz]; 0: none in the loop.
        observed: the disturbance observer runs beside the loop and its d̂ is recorded.
        disc: times [s] and speeds [rad/s] of the disc, linear in between.
        seed: added to the run's own.
    """

    name: str
    stage: str
    figures: str
    purpose: str
    brake: BenchSettings | Model
    duration: float
    unloaded: bool = False
    added_inertia: float = 0.0
    excitation: ExcitationSettings | None = None
    reference: ReferenceSettings | None = None
    table: Table | None = None
    model: str = 'nominal'
    gains: PidGains = field(default_factory=lambda: chosen.GAINS)
    observer: float = 0.0
    observed: bool = False
    disc: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0,), (0.0,))
    seed: int = 0


def tracking_reference(top: float, frequency: float = 1.0, cycles: int = 4,
                       rest: float = 0.5) -> Table:
    """Return raised cosines 0 → `top` → 0 [rad] at `frequency` [Hz], a rest [s] before and after.

    1 Hz is the low end of the 1 to 5 Hz in which the paper sees its brake work.
    """
    time = np.arange(0.0, cycles / frequency + 2.0 * rest + 0.005, 0.01)
    inside = np.clip(time - rest, 0.0, cycles / frequency)
    return Table(time, 0.5 * top * (1.0 - np.cos(2.0 * np.pi * frequency * inside)))


def stepwise_reference(levels: tuple[float, ...], move: float = 0.5, rest: float = 1.0) -> Table:
    """Return smooth moves [s] between `levels` [rad] with a rest [s] at each."""
    times, positions = [np.arange(0.0, rest, 0.01)], [np.full(round(rest / 0.01), levels[0])]
    begin = rest
    for low, high in zip(levels, levels[1:], strict=False):
        part = np.arange(0.0, move + rest, 0.01)
        shape = 0.5 * (1.0 - np.cos(np.pi * np.clip(part / move, 0.0, 1.0)))
        times.append(begin + part)
        positions.append(low + (high - low) * shape)
        begin += part.size * 0.01
    return Table(np.concatenate(times), np.concatenate(positions))


REFERENCE = ReferenceSettings(kind='strokes', amplitudes=(8.0, 14.0, HIGH), repetitions=1,
                              slow_range=(0.0, 0.0))


def length(settings: ReferenceSettings) -> float:
    """Return how long a run of these strokes takes [s], a rest after it included."""
    trajectory = settings.trajectory()
    return round(trajectory.duration + 0.3, 2) if trajectory else 0.0


# The strokes of the identification, for whoever identifies another brake.
STROKES = Experiment('strokes', 'strokes', '7–16', 'the identification strokes', chosen.FORM,
                     length(REFERENCE), reference=REFERENCE, model='classical')


def plan_of(brake: BenchSettings, wearing: BenchSettings | None = None) -> tuple[Experiment, ...]:
    """Return the experiments on one brake; with `wearing`, a last one on that."""
    slow = ReferenceSettings(kind='strokes', amplitudes=(4.0 * np.pi,), acceleration=200.0,
                             slow_speeds=(2.0, 4.0), slow_range=(0.0, 4.0 * np.pi),
                             stop_time=0.3)
    poor = replace(REFERENCE, acceleration=100.0, stop_time=0.8)
    unseen = replace(REFERENCE, amplitudes=(6.0, 17.0, 11.0), acceleration=80.0)
    middle, high = tracking_reference(MIDDLE), tracking_reference(HIGH)
    levels = stepwise_reference((0.0, 10.0, HIGH, 14.0, 5.0, 0.0))
    step = ExcitationSettings('steps', duration=4.0)
    sweep = ExcitationSettings('sweep', duration=20.0)
    pd = replace(chosen.GAINS, i=0.0)

    def driven(name: str, purpose: str, excitation: ExcitationSettings,
               added_inertia: float = 0.0) -> Experiment:
        return Experiment(name, 'nominal', '6', purpose, brake, excitation.duration + 0.2,
                          unloaded=True, added_inertia=added_inertia, excitation=excitation)

    def closed(name: str, figures: str, purpose: str, reference: ReferenceSettings | Table,
               stage: str = 'validation', **more: object) -> Experiment:
        more = {'brake': brake, 'model': 'classical', **more}
        if isinstance(reference, Table):
            return Experiment(name, stage, figures, purpose,
                              duration=float(reference.time[-1]) + 0.3, table=reference,
                              reference=ReferenceSettings(kind='file'),
                              **more)  # type: ignore[arg-type]
        return Experiment(name, stage, figures, purpose, duration=length(reference),
                          reference=reference, **more)  # type: ignore[arg-type]

    def turning(name: str, purpose: str, speed: float) -> Experiment:
        twice = replace(REFERENCE, repetitions=2)
        begin = 0.5 * (length(twice) - 0.3)
        return closed(name, '24, 25', purpose, twice, 'strokes', disc=(
            (0.0, begin, begin + SPIN_UP), (0.0, 0.0, speed)))

    plan = [
        driven('steps', 'step test of the free motor', step),
        driven('steps_added', 'the same with a known inertia added', step, chosen.ADDED_INERTIA),
        driven('sweep', 'sine sweep of the free motor, 4 A, 0 to 10 Hz', sweep),
        closed('cogging', '', 'slow strokes of the free motor', slow, 'nominal', unloaded=True,
               model='nominal'),
        closed('cogging_compensated', '', 'the same with the cogging fed forward', slow,
               'strokes', unloaded=True),
        closed('strokes', '7–16', 'the identification strokes', REFERENCE, 'strokes',
               observed=True),
        closed('strokes_poor', '7–16', 'faster strokes under low gains', poor, 'strokes',
               gains=chosen.POOR_GAINS, observed=True),
        turning('disc_helping', 'strokes with the disc standing, then turning so that it helps',
                chosen.DISC_SPEED),
        turning('disc_hindering', 'the same with the disc turning the other way',
                -chosen.DISC_SPEED),
    ]
    for kind, gains in (('poor', chosen.POOR_GAINS), ('good', chosen.GAINS)):
        for load, reference, figure in (('middle', middle, '17'), ('high', high, '18')):
            plan += [
                closed(f'{load}_pid_{kind}', figure, f'PID with the nominal feedforward, {load} '
                       f'load, {kind} gains', reference, gains=gains),
                closed(f'{load}_paper_{kind}', figure, 'PID and feedforward as identified the '
                       f'paper’s way, {load} load, {kind} gains', reference, gains=gains,
                       model='paper'),
                closed(f'{load}_joint_{kind}', figure, 'PID and feedforward by joint regression, '
                       f'{load} load, {kind} gains', reference, gains=gains, model='joint')]
    plan += [closed(f'observer_{cutoff:g}', '18', 'PID with the nominal feedforward and the '
                    f'observer in the loop, q at {cutoff:g} Hz, high load, poor gains', high,
                    gains=chosen.POOR_GAINS, observer=cutoff) for cutoff in OBSERVER_CUTOFFS]
    plan += [
        closed('model_1', '19–21', 'strokes that nothing was identified from, under the model '
               'identified the paper’s way, first run', unseen, model='paper'),
        closed('model_2', '19–21', 'the same, second run', unseen, model='paper'),
        closed('pd_paper', '22, 23', 'PD and the model identified the paper’s way, stops at five '
               'angles', levels, model='paper', gains=pd),
        closed('pd_joint', '22, 23', 'the same with the model by joint regression', levels,
               model='joint', gains=pd),
    ]
    if wearing is not None:
        often = replace(REFERENCE, amplitudes=(18.0,), repetitions=18, stop_time=0.6)
        begin = _rest_after(often, 3)
        plan.append(closed('wear', '', 'strokes while the pads wear and heat', often,
                           brake=wearing, model='joint', disc=(
                               (0.0, begin, begin + SPIN_UP), (0.0, 0.0, chosen.DISC_SPEED))))
    # Each run has noise of its own: the same in two runs would cancel where they are compared.
    return tuple(replace(entry, seed=number) for number, entry in enumerate(plan))


def _rest_after(settings: ReferenceSettings, strokes: int) -> float:
    """Return when the rest after so many strokes begins [s]."""
    trajectory = settings.trajectory()
    if trajectory is None:
        return 0.0
    time = np.arange(0.0, trajectory.duration, 0.005)
    position = np.array([trajectory.at(value).position for value in time.tolist()])
    down = position <= position.min() + 1e-6
    ends = np.flatnonzero(down[1:] & ~down[:-1])
    return float(time[ends[strokes - 1] + 1])
