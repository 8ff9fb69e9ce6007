"""The experiments: which brake, which loop, which motion; in the order in which they build up."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engb_core.control.excitation import ExcitationSettings
from engb_core.control.pid import PidGains
from engb_core.control.reference import ReferenceSettings
from engb_core.model import Model
from engb_core.reproduce import chosen

__all__ = ['Experiment', 'PLAN', 'STAGES', 'Table', 'tracking_reference']

Array = NDArray[np.float64]

# A stage's experiments use what the ones before have identified.
STAGES = ('nominal', 'strokes', 'validation')

# Highest angle of the strokes; the mechanism ends at 22 rad and tracking overshoots.
HIGH, MIDDLE = 20.0, 12.0


@dataclass(frozen=True)
class Table:
    """A reference as `time` (k,) [s] and `position` (k,) [rad]."""

    time: Array
    position: Array

    def write(self, path: str | os.PathLike) -> None:
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
        brake: the true brake.
        duration: [s].
        excitation: open-loop torque, or None where the loop is closed.
        reference: what the loop tracks.
        table: for references of kind 'file'.
        model: 'nominal', 'cogging' (nominal with the cogging found) or 'identified'.
        gains: of the PID.
        load_feedforward, friction_feedforward: of the model.
        disc_speed: [rad/s].
        seed: added to the run's own.
    """

    name: str
    stage: str
    figures: str
    purpose: str
    brake: Model
    duration: float
    excitation: ExcitationSettings | None = None
    reference: ReferenceSettings | None = None
    table: Table | None = None
    model: str = 'nominal'
    gains: PidGains = field(default_factory=lambda: chosen.GAINS)
    load_feedforward: bool = True
    friction_feedforward: bool = True
    disc_speed: float = 0.0
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


def _strokes(**changes: object) -> ReferenceSettings:
    settings = ReferenceSettings(kind='strokes', amplitudes=(8.0, 14.0, HIGH), repetitions=1,
                                 slow_range=(0.0, 0.0))
    return replace(settings, **changes)


def _length(settings: ReferenceSettings) -> float:
    trajectory = settings.trajectory()
    return round(trajectory.duration + 0.3, 2) if trajectory else 0.0


def _plan() -> tuple[Experiment, ...]:
    standing, free = chosen.true_brake(), chosen.free_motor()
    slow = ReferenceSettings(kind='strokes', amplitudes=(4.0 * np.pi,), acceleration=200.0,
                             slow_speeds=(2.0, 4.0), slow_range=(0.0, 4.0 * np.pi),
                             stop_time=0.3)
    strokes = _strokes()
    poor = _strokes(acceleration=100.0, stop_time=0.8)
    middle, high = tracking_reference(MIDDLE), tracking_reference(HIGH)
    levels = stepwise_reference((0.0, 10.0, HIGH, 14.0, 5.0, 0.0))
    step, sweep = ExcitationSettings('steps'), ExcitationSettings('sweep', duration=20.0)

    def closed(name: str, figures: str, purpose: str, reference: ReferenceSettings | Table,
               brake: Model = standing, stage: str = 'validation',
               **more: object) -> Experiment:
        if isinstance(reference, Table):
            return Experiment(name, stage, figures, purpose, brake,
                              float(reference.time[-1]) + 0.3, table=reference,
                              reference=ReferenceSettings(kind='file'), **more)
        return Experiment(name, stage, figures, purpose, brake, _length(reference),
                          reference=reference, **more)

    pd = replace(chosen.GAINS, i=0.0)
    return (
        Experiment('steps', 'nominal', '6', 'step test of the free motor', free, 8.2,
                   excitation=step),
        Experiment('steps_added', 'nominal', '6', 'the same with a known inertia added',
                   chosen.free_motor(chosen.ADDED_INERTIA), 8.2, excitation=step),
        Experiment('sweep', 'nominal', '6', 'sine sweep of the free motor, 4 A, 0 to 10 Hz', free,
                   20.2, excitation=sweep),
        closed('cogging', '', 'slow strokes of the free motor', slow, free, 'nominal'),
        closed('cogging_compensated', '', 'the same with the cogging fed forward', slow, free,
               'strokes', model='cogging'),
        closed('strokes', '7–16', 'the identification strokes', strokes, stage='strokes',
               model='cogging'),
        closed('strokes_poor', '7–16', 'faster strokes under low gains', poor, stage='strokes',
               model='cogging', gains=chosen.POOR_GAINS),
        closed('disc_helping', '24, 25', 'the disc turns so that it helps', strokes,
               chosen.true_brake(chosen.PAD_FRICTION), 'strokes', model='cogging',
               disc_speed=chosen.DISC_SPEED),
        closed('disc_hindering', '24, 25', 'the disc turns the other way', strokes,
               chosen.true_brake(-chosen.PAD_FRICTION), 'strokes', model='cogging',
               disc_speed=-chosen.DISC_SPEED),
        closed('middle_pid', '17', 'PID with the nominal feedforward, middle load', middle,
               model='cogging'),
        closed('middle_feedforward', '17', 'PID and identified feedforward, middle load', middle,
               model='identified'),
        closed('high_pid', '18', 'PID with the nominal feedforward, high load', high,
               model='cogging'),
        closed('high_feedforward', '18', 'PID and identified feedforward, high load', high,
               model='identified'),
        closed('model_1', '19–21', 'strokes under the identified model, first run', strokes,
               model='identified'),
        closed('model_2', '19–21', 'the same, second run', strokes, model='identified', seed=7),
        closed('pd_model', '22, 23', 'PD and the identified model, stops at five angles', levels,
               model='identified', gains=pd),
        closed('pd_sticking', '22, 23', 'the same on a brake that sticks, as (13) has it', levels,
               chosen.true_brake(saturation_velocity=chosen.STICKING_VELOCITY),
               model='identified', gains=pd),
    )


PLAN: tuple[Experiment, ...] = _plan()
