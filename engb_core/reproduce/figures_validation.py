# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Figures 17 to 25: validation and self-energizing, of both brakes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.paper_way import PaperResult
from engb_core.report.figures import Axis, Figure, Line, Panel, Series
from engb_core.reproduce.figures_identification import cloud, sentence
from engb_core.reproduce.plan import OBSERVER_CUTOFFS
from engb_core.reproduce.results import BrakeResults
from engb_core.reproduce.validation_chapter import worst_offset

__all__ = ['disc_figures', 'validation_figures']

Array = NDArray[np.float64]

WAYS = (('pid', 'PID', 'before'), ('paper', 'with the paper’s model', 'recorded'),
        ('joint', 'with the joint model', 'after'))


def validation_figures(brakes: Sequence[BrakeResults]) -> list[Figure]:
    """Return Figures 17 to 23."""
    return [
        _comparison('Figure 17: tracking, middle load', brakes, 'middle', 'Paper: '
                    '“Experimental result of position tracking control with PID, PID+FF '
                    'controller (middle load).”'),
        _comparison('Figure 18: tracking, high load', brakes, 'high', 'Paper: “Experimental '
                    'result of position tracking control with PID, PID+FF controller (high '
                    'load).” There: PID 0.83 rad max, 0.38 rms; with the model 0.32 and 0.13.'),
        _observers(brakes), _runs(brakes), _left(brakes, 'odd'), _left(brakes, 'even'),
        _pd(brakes), _pd_error(brakes),
    ]


def disc_figures(brakes: Sequence[BrakeResults]) -> list[Figure]:
    """Return Figures 24 and 25, and the odd part over load."""
    return [_disc_even(brakes), _disc_odd(brakes), _disc_over_load(brakes)]


def _comparison(title: str, brakes: Sequence[BrakeResults], load: str, caption: str) -> Figure:
    first = brakes[0].validation.tracking[f'{load}_pid_poor']
    panels = [Panel(Axis('Reference, and PID’s position at low gains', 'rad'), (
        Line('PID', first.time, first.position, 'before'),
        Line('reference', first.time, first.wanted, 'third', 'dash', width=2.0)), 130)]
    told = []
    for brake in brakes:
        for kind, name in (('poor', 'low gains'), ('good', 'good gains')):
            runs = [(brake.validation.tracking[f'{load}_{way}_{kind}'], label, colour)
                    for way, label, colour in WAYS]
            panels.append(Panel(Axis(f'Error, {name}, {brake.label}', 'rad'), tuple(
                Line(label, run.time, run.error, colour, width=1.3)
                for run, label, colour in runs), 140, zero=True))
            told.append(f'{brake.label}, {name}: ' + ', '.join(
                f'{label} {run.largest:.3f} / {run.rms:.3f}' for run, label, _ in runs))
    return Figure(title, Axis('Time', 's'), tuple(panels),
                  alt='Position and tracking error with and without the identified models.',
                  caption=f'{caption} To see, largest / rms [rad]. {sentence(told)}.')


def _observers(brakes: Sequence[BrakeResults]) -> Figure:
    panels, told = [], []
    colours = ('third', 'good', 'after')
    for brake in brakes:
        tracking = brake.validation.tracking
        runs = [(tracking['high_pid_poor'], 'PID', 'before')] + [
            (tracking[f'observer_{cutoff:g}'], f'q at {cutoff:g} Hz', colour)
            for cutoff, colour in zip(OBSERVER_CUTOFFS, colours, strict=True)]
        panels.append(Panel(Axis(f'Error, {brake.label}', 'rad'), tuple(
            Line(label, run.time, run.error, colour, width=1.2) for run, label, colour in runs),
            150, zero=True))
        told.append(f'{brake.label}: ' + ', '.join(f'{label} {run.rms:.3f} rad rms'
                                                   for run, label, _ in runs))
    return Figure(
        'After Figure 18: the observer in the loop instead of a model', Axis('Time', 's'),
        tuple(panels), alt='Tracking error with the disturbance observer in the loop.',
        caption='High load, low gains, no model of load or friction: the causal observer takes '
                f'off what it sees, late by q. {sentence(told)}.')


def _runs(brakes: Sequence[BrakeResults]) -> Figure:
    panels, told = [], []
    first = brakes[0].validation.tracking['model_1']
    panels.append(Panel(Axis(f'Position, {brakes[0].label}', 'rad'), (
        Line('run 1', first.time, first.position, 'after', width=3.4),
        Line('reference', first.time, first.wanted, 'mark', 'dash', width=1.6)), 140))
    for brake in brakes:
        runs = [brake.validation.tracking[name] for name in ('model_1', 'model_2')]
        panels.append(Panel(Axis(f'Error, {brake.label}', 'mrad'), tuple(
            Line(f'run {number}', run.time, 1e3 * run.error, colour, dash, width)
            for number, (run, (colour, dash, width)) in enumerate(zip(
                runs, (('after', 'solid', 3.0), ('mark', 'dash', 1.2)), strict=True), 1)),
            150, zero=True))
        told.append(f'{brake.label}: {1e3 * runs[0].rms:.1f} and {1e3 * runs[1].rms:.1f} mrad rms')
    return Figure(
        'Figure 19: tracking with the paper’s model and PID', Axis('Time', 's'), tuple(panels),
        alt='Tracking of two runs with the identified model.',
        caption='Paper: “Position tracking control result with identified model and PID '
                'controller.” Two runs, for reproducibility, of strokes that nothing was '
                f'identified from. {sentence(told)}; the runs differ in sensor noise only.')


def _left(brakes: Sequence[BrakeResults], part: str) -> Figure:
    number = {'odd': 20, 'even': 21}[part]
    panels, told = [], []
    for brake in brakes:
        validation = brake.validation
        first = validation.left[0]
        series: list[Series] = [cloud('before, first run', 1e3 * first.load,
                                      1e3 * getattr(first, f'{part}_before'), 'noise')]
        series += [cloud(f'left by the paper’s model, run {index}', 1e3 * run.load,
                         1e3 * getattr(run, part), colour, marker)
                   for index, (run, colour, marker) in enumerate(zip(
                       validation.left, ('before', 'third'), ('up', 'square'), strict=True), 1)]
        joint = validation.joint_left[0]
        series.append(cloud('left by the joint model, run 1', 1e3 * joint.load,
                            1e3 * getattr(joint, part), 'after'))
        panels.append(Panel(Axis(f'{part.capitalize()} disturbance, {brake.label}', 'mN·m'),
                            tuple(series), 190, zero=True))
        told.append(f'{brake.label}: ' + ', '.join(
            f'{1e3 * left.rms(part):.2f} mN·m rms by the {name} model '
            f'({100.0 * left.rms(part) / left.rms(f"{part}_before"):.1f} % of what was there)'
            for name, left in (('paper’s', first), ('joint', joint))))
    return Figure(
        f'Figure {number}: observed {part} disturbance with the identified model',
        Axis('Load torque', 'mN·m'), tuple(panels),
        alt=f'The {part} disturbance before and after the model is taken off.',
        caption=f'Paper: “Observed load dependent {part} disturbance with identified model and '
                f'PID controller.” What is left. {sentence(told)}.')


def _pd(brakes: Sequence[BrakeResults]) -> Figure:
    panels = []
    for brake in brakes:
        run = brake.validation.tracking['pd_paper']
        panels.append(Panel(Axis(f'Position, {brake.label}', 'rad'), (
            Line('position', run.time, run.position, 'after', width=3.0),
            Line('reference', run.time, run.wanted, 'mark', 'dash', width=1.6)), 140))
    return Figure(
        'Figure 22: tracking with the paper’s model and PD', Axis('Time', 's'), tuple(panels),
        alt='Position and reference under PD and the identified model.',
        caption='Paper: “Position tracking control result with identified model and PD '
                'controller.” Without an integral part whatever the model lacks stays as an '
                'offset.')


def _pd_error(brakes: Sequence[BrakeResults]) -> Figure:
    panels, told = [], []
    for brake in brakes:
        validation = brake.validation
        panels.append(Panel(Axis(f'Error, {brake.label}', 'mrad'), tuple(
            Line(label, run.time, 1e3 * run.error, colour, width=1.4)
            for run, label, colour in (
                (validation.tracking['pd_paper'], 'paper’s model', 'recorded'),
                (validation.tracking['pd_joint'], 'joint model', 'after'))), 150, zero=True))
        told.append(f'{brake.label}: {1e3 * worst_offset(validation.offsets):.0f} mrad with the '
                    f'paper’s model, {1e3 * worst_offset(validation.joint_offsets):.0f} mrad '
                    'with the joint one')
    return Figure(
        'Figure 23: motor position error with identified model and PD', Axis('Time', 's'),
        tuple(panels), alt='The position error under PD and the identified model.',
        caption='Paper: “Motor position tracking error with identified model and PD '
                'controller.” The largest steady offset (paper: 0.1 rad, required 0.5 rad). '
                f'{sentence(told)}.')


def _disc_even(brakes: Sequence[BrakeResults]) -> Figure:
    panels, told = [], []
    for brake in brakes:
        helping, hindering = brake.disc.directions
        standing = helping.standing.paper.load
        grid = np.linspace(0.5, 19.5, 100)
        series: list[Series] = [
            cloud(name, paper.parts.position, -1e3 * paper.parts.even, colour, marker)
            for name, paper, colour, marker in (
                ('disc standing', helping.standing.paper, 'noise', 'circle'),
                ('disc turning, helping', helping.turning.paper, 'after', 'up'),
                ('disc turning, hindering', hindering.turning.paper, 'before', 'square'))]
        series += [Line(f'P × the cubic of the standing disc, {entry.name}', grid,
                        1e3 * entry.paper.gain.value * standing.torque(grid), colour, dash,
                        width=2.2)
                   for entry, colour, dash in ((helping, 'recorded', 'dash'),
                                               (hindering, 'recorded', 'solid'))]
        panels.append(Panel(Axis(f'−Even disturbance, {brake.label}', 'mN·m'), tuple(series),
                            220))
        told.append(f'{brake.label}: P = {helping.paper.gain.value:.3f} helping (true '
                    f'{helping.true_gain:.3f}), {hindering.paper.gain.value:.3f} hindering (true '
                    f'{hindering.true_gain:.3f})')
    return Figure(
        'Figure 24: self-energizing, even disturbance', Axis('Position', 'rad'), tuple(panels),
        alt='The even disturbance with the disc standing and turning either way.',
        caption='Paper: “Self-energizing effect validation (even disturbance)”, P 0.421. In one '
                'run each the disc stands, comes to speed, and turns. The paper’s way. '
                f'{sentence(told)}.')


def _disc_odd(brakes: Sequence[BrakeResults]) -> Figure:
    return Figure(
        'Figure 25: self-energizing, odd disturbance', Axis('Position', 'rad'),
        tuple(Panel(Axis(f'−Odd disturbance, {brake.label}', 'mN·m'), tuple(
            cloud(name, paper.parts.position, -1e3 * paper.parts.odd, colour, marker)
            for name, paper, colour, marker in _three(brake)), 210) for brake in brakes),
        alt='The odd disturbance over position for the three cases.',
        caption='Paper: “Self-energizing effect validation (odd disturbance).” To see: '
                'friction sits in gear and screw and goes by the load that they carry, so '
                'at equal position it is lower where the disc helps. (By the clamp force, '
                'as (13) writes it, it would stay the same over position.)')


def _disc_over_load(brakes: Sequence[BrakeResults]) -> Figure:
    return Figure(
        'After Figure 25: the odd disturbance over the load', Axis('Load torque', 'mN·m'),
        tuple(Panel(Axis(f'−Odd disturbance, {brake.label}', 'mN·m'), tuple(
            cloud(name, 1e3 * paper.load.torque(paper.parts.position), -1e3 * paper.parts.odd,
                  colour, marker)
            for name, paper, colour, marker in _three(brake)), 210) for brake in brakes),
        alt='Over load the odd disturbances of the three cases fall onto one line.',
        caption='Over the load torque the three cases fall nearly onto one line: the friction of '
                'the mechanism, C₀ + C₁·T_L, does not change when the disc turns. What the '
                'caliper loses goes by the clamp force instead.')


def _three(brake: BrakeResults) -> tuple[tuple[str, PaperResult, str, str], ...]:
    helping, hindering = brake.disc.directions
    return (('disc standing', helping.standing.paper, 'noise', 'circle'),
            ('disc turning, helping', helping.turning.paper, 'after', 'up'),
            ('disc turning, hindering', hindering.turning.paper, 'before', 'square'))
