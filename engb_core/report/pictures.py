# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The figures of a diagnosis: what was compared, over time and over what reveals it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import (
    ClosedLoop,
    Diagnosis,
    Interval,
    NextExperiment,
    ResidualOver,
    Trace,
)
from engb_core.report.figures import Axis, Band, Figure, Line, Panel, Span
from engb_core.report.text import shorten
from engb_core.report.wording import capital, coordinate, scaled

__all__ = ['AFTER', 'BEFORE', 'Units', 'broken', 'close_up', 'closed_loop', 'experiment',
           'numbered', 'overlay', 'residual_over']

Array = NDArray[np.float64]
T = TypeVar('T')

# Labels on more intervals than these would overlap; shading of more would hide the curves.
LABELLED, SHADED = 6, 40

BEFORE, AFTER = 'model as given', 'corrected model'


class Units:
    """What all pictures share: units (rad and N·m, or m and N where the axis is linear), whether
    there is a corrected model to draw, and the noise floor of the effort (None: unknown)."""

    def __init__(self, diagnosis: Diagnosis) -> None:
        linear = diagnosis.model.joint.type == 'prismatic'
        self.position = 'm' if linear else 'rad'
        self.velocity = 'm/s' if linear else 'rad/s'
        self.effort = 'N' if linear else 'N·m'
        self.effort_name = 'force' if linear else 'torque'
        self.corrected = diagnosis.corrects
        floors = [trace.noise_floor for trace in diagnosis.evidence.traces
                  if np.isfinite(trace.noise_floor)]
        self.noise: float | None = float(np.median(floors)) if floors else None


def numbered(intervals: Sequence[Interval], recording: str) -> list[tuple[int, Interval]]:
    """Return the recording's intervals with their rank by share among all intervals, from 1."""
    ranked = sorted(intervals, key=lambda entry: -entry.share)
    return [(rank, entry) for rank, entry in enumerate(ranked, 1)
            if entry.recording == recording]


def overlay(trace: Trace, intervals: Sequence[Interval], units: Units) -> Figure:
    """Recorded against predicted effort, their difference, and the motion, over time."""
    spans = tuple(Span(entry.begin, entry.end, str(rank) if rank <= LABELLED else '')
                  for rank, entry in numbered(intervals, trace.recording)[:SHADED])
    return Figure(
        f'Recorded and modelled {units.effort_name}, {shorten(trace.recording, 60)}',
        Axis('Time', 's'),
        (*_effort_panels(trace, units, np.isfinite(trace.time)),
         Panel(Axis('Position', units.position),
               (Line('', trace.time, trace.position, 'muted', width=1.3),), 80)),
        alt=f'Recorded and modelled motor {units.effort_name} of {trace.recording} over time; '
            'below it their difference, and the position.'
            + (f' {len(spans)} intervals with mismatch are marked.' if spans else ''),
        caption=_overlay_caption(trace, spans),
        spans=spans)


def close_up(trace: Trace, interval: Interval, units: Units) -> Figure | None:
    """The strongest interval at full resolution, or None where the overlay shows it well."""
    duration = float(trace.time[-1] - trace.time[0]) if trace.time.size else 0.0
    width = min(max(2.5 * (interval.end - interval.begin), 1.5), 8.0)
    if duration < 2.5 * width:
        return None
    middle = (interval.begin + interval.end) / 2
    inside = np.abs(trace.time - middle) <= width / 2
    if np.count_nonzero(inside) < 10:
        return None
    return Figure(
        f'Close-up of the strongest mismatch, {interval.begin:.2f} to {interval.end:.2f} s',
        Axis('Time', 's'),
        (*_effort_panels(trace, units, inside),
         Panel(Axis('Velocity', units.velocity),
               (Line('', trace.time[inside], trace.velocity[inside], 'muted', width=1.3),), 80,
               zero=True)),
        alt=f'The same curves from {middle - width / 2:.2f} to {middle + width / 2:.2f} seconds.',
        spans=(Span(max(interval.begin, middle - width / 2),
                    min(interval.end, middle + width / 2)),))


def closed_loop(loop: ClosedLoop, units: Units) -> Figure:
    """Recorded against simulated closed-loop position, and the error of the simulation."""
    before, after = loop.simulated_before - loop.recorded, loop.simulated_after - loop.recorded
    factor, unit = scaled(_largest(before, after), units.position)
    return Figure(
        f'Closed loop, simulated and recorded, {shorten(loop.recording, 60)}',
        Axis('Time', 's'),
        (Panel(Axis('Position', units.position), (
            Line('recorded', loop.time, loop.recorded, 'recorded', width=2.2),
            *_states(units, Line(BEFORE, loop.time, loop.simulated_before, 'before', dash='dash'),
                     Line(AFTER, loop.time, loop.simulated_after, 'after'))), 170),
         Panel(Axis('Simulated − recorded', unit),
               _states(units, Line(BEFORE, loop.time, factor * before, 'before', width=1.2),
                       Line(AFTER, loop.time, factor * after, 'after', width=1.2)), 130,
               zero=True)),
        alt=f'Position of {loop.recording}, recorded and simulated in closed loop, and the error '
            'of the simulation' + (', with the model as given and the corrected model.'
                                   if units.corrected else '.'))


def residual_over(picture: ResidualOver, units: Units) -> Figure:
    """The residual over the coordinate that reveals it; applying and releasing apart."""
    factor, unit = scaled(_largest(picture.applying_before, picture.releasing_before,
                                   picture.applying_after, picture.releasing_after), units.effort)
    name = coordinate(picture.coordinate)
    curves: list[Band | Line] = []
    if units.noise is not None and picture.centre.size:
        # For scale only: the curves are means of many samples, so they stand out inside it too.
        floor = np.full(2, factor * units.noise)
        curves.append(Band('noise of one sample, ±σ', picture.centre[[0, -1]], -floor, floor))
    for state, colour, applying, releasing in _states(
            units, (BEFORE, 'before', picture.applying_before, picture.releasing_before),
            (AFTER, 'after', picture.applying_after, picture.releasing_after)):
        if np.array_equal(applying, releasing, equal_nan=True):
            curves.append(Line(state, picture.centre, factor * applying, colour, marker='circle'))
            continue
        for direction, values, dash, marker in (('applying', applying, 'solid', 'up'),
                                                ('releasing', releasing, 'dash', 'down')):
            if np.any(np.isfinite(values)):
                curves.append(Line(f'{state}, {direction}', picture.centre, factor * values,
                                   colour, dash=dash, marker=marker))
    return Figure(
        f'What the model misses, over {name}',
        Axis(capital(name), picture.unit),
        (Panel(Axis(f'Recorded − modelled {units.effort_name}, mean', unit), tuple(curves), 260,
               zero=True),),
        alt=f'Mean difference between recorded and modelled {units.effort_name} over {name}, '
            + ('before and after the correction, ' if units.corrected else '')
            + 'applying and releasing.',
        caption=picture.why)


def experiment(proposal: NextExperiment, units: Units) -> Figure | None:
    """The proposed reference over time, or None where it is only described."""
    if proposal.time is None or proposal.position is None or not np.size(proposal.time):
        return None
    return Figure('Proposed reference', Axis('Time', 's'),
                  (Panel(Axis('Reference position', units.position),
                         (Line('', proposal.time, proposal.position, 'after'),), 180),),
                  alt='The proposed reference position over time.')


def broken(time: Array, values: Array) -> Array:
    """Break a curve (n,) over time (n,) [s] where nothing was judged: at standstill the model says
    nothing."""
    step = np.diff(time, prepend=time[:1])
    return np.where(step > 3.0 * np.median(step), np.nan, values) if time.size else values


def _effort_panels(trace: Trace, units: Units, chosen: np.ndarray) -> tuple[Panel, Panel]:
    """Effort, and the residual where it could be judged, of the chosen samples."""
    time = trace.time[chosen]
    judged = np.asarray(trace.judged[chosen], bool)
    # Where the shaft stands, friction is undetermined: a residual there would be no evidence.
    effort, by_given, by_corrected = (broken(time, values[chosen]) for values in (
        trace.effort, trace.predicted_before, trace.predicted_after))
    before = np.where(judged, effort - by_given, np.nan)
    after = np.where(judged, effort - by_corrected, np.nan)
    factor, unit = scaled(_largest(before, after), units.effort)
    total, total_unit = scaled(_largest(trace.effort), units.effort)
    floor = np.full(2, 2 * factor * trace.noise_floor)
    edges = time[[0, -1]] if time.size else np.zeros(2)
    torque = Panel(Axis(f'Motor {units.effort_name}', total_unit), (
        Line('recorded', time, total * effort, 'recorded', width=2.2),
        *_states(units,
                 Line(BEFORE, time, total * by_given, 'before', width=1.3),
                 Line(AFTER, time, total * by_corrected, 'after', width=1.3))), 190)
    residual = Panel(Axis('Recorded − modelled, in motion', unit), (
        Band('noise floor, ±2σ', edges, -floor, floor),
        *_states(units, Line(BEFORE, time, factor * before, 'before', width=1.1),
                 Line(AFTER, time, factor * after, 'after', width=1.1))), 150, zero=True)
    return torque, residual


def _states(units: Units, before: T, after: T) -> tuple[T, ...]:
    """Before and after, or only before where nothing was corrected: they would coincide."""
    return (before, after) if units.corrected else (before,)


def _overlay_caption(trace: Trace, spans: Sequence[Span]) -> str:
    text = 'No fit has seen this recording.' if trace.held_out else ''
    if spans:
        text += ' Shaded: the intervals that hold the mismatch'
        text += ('; the strongest are numbered.' if any(span.label for span in spans) else '.')
    return text.strip()


def _largest(*arrays: np.ndarray) -> float:
    values = np.concatenate([np.ravel(np.asarray(array, float)) for array in arrays])
    values = np.abs(values[np.isfinite(values)])
    return float(values.max()) if values.size else 0.0
