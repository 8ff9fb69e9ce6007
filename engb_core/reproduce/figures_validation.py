"""Figures 17 to 25: validation and self-energizing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from engb_core.report.figures import Axis, Figure, Line, Panel, Points
from engb_core.reproduce.self_energizing_chapter import DiscResult
from engb_core.reproduce.validation_chapter import (
    Left,
    Tracking,
    ValidationResult,
    worst_offset,
)

__all__ = ['disc_figures', 'validation_figures']

Array = NDArray[np.float64]


def validation_figures(result: ValidationResult) -> list[Figure]:
    """Return Figures 17 to 23."""
    tracking = result.tracking
    return [
        _comparison('Figure 17: tracking, middle load', tracking, 'middle', 'Paper: '
                    '“Experimental result of position tracking control with PID, PID+FF '
                    'controller (middle load).”'),
        _comparison('Figure 18: tracking, high load', tracking, 'high', 'Paper: “Experimental '
                    'result of position tracking control with PID, PID+FF controller (high '
                    'load).” There: PID 0.83 rad max, 0.38 rms; with the model 0.32 and 0.13.'),
        _runs('Figure 19: tracking with identified model and PID', [
            tracking['model_1'], tracking['model_2']], 'Paper: “Position tracking control '
            'result with identified model and PID controller.” Two runs, for reproducibility.'),
        _left(result.left, 'odd'), _left(result.left, 'even'),
        _pd(result), _pd_error(result),
    ]


def disc_figures(result: DiscResult) -> list[Figure]:
    """Return Figures 24 and 25, and the odd part over load."""
    colours = {'standing': 'recorded', 'helping': 'after', 'hindering': 'before'}
    parts = {'standing': result.standing.paper, **{
        entry.name: entry.identified.paper for entry in result.directions}}
    standing = result.standing.paper.load
    grid = np.linspace(0.5, 19.5, 100)
    even = [Points(f'disc {name}' if name == 'standing' else f'disc turning, {name}',
                   paper.parts.position, -1e3 * paper.parts.even, colours[name])
            for name, paper in parts.items()]
    even += [Line(f'{entry.paper.gain.value:.3f} × the cubic of the standing disc', grid,
                  1e3 * entry.paper.gain.value * standing.torque(grid), colours[entry.name],
                  'dash') for entry in result.directions]
    odd = [Points(f'disc {name}' if name == 'standing' else f'disc turning, {name}',
                  paper.parts.position, -1e3 * paper.parts.odd, colours[name])
           for name, paper in parts.items()]
    over_load = [Points(f'disc {name}' if name == 'standing' else f'disc turning, {name}',
                        1e3 * paper.load.torque(paper.parts.position), -1e3 * paper.parts.odd,
                        colours[name]) for name, paper in parts.items()]
    helping = result.directions[0]
    return [
        Figure('Figure 24: self-energizing, even disturbance', Axis('Position', 'rad'),
               (Panel(Axis('−Even disturbance', 'mN·m'), tuple(even), 240),),
               alt='The even disturbance with the disc standing and turning either way.',
               caption='Paper: “Self-energizing effect validation (even disturbance).” To see: '
                       'with the disc turning the load is a constant times that with it '
                       f'standing: P = {helping.paper.gain.value:.3f} where the disc helps '
                       f'(paper 0.421), {result.directions[1].paper.gain.value:.3f} where it '
                       'hinders.'),
        Figure('Figure 25: self-energizing, odd disturbance', Axis('Position', 'rad'),
               (Panel(Axis('−Odd disturbance', 'mN·m'), tuple(odd), 240),),
               alt='The odd disturbance over position for the three cases.',
               caption='Paper: “Self-energizing effect validation (odd disturbance).” To see: '
                       'friction sits in gear and screw and goes by the load that they carry, so '
                       'at equal position it is lower where the disc helps. (By the clamp force, '
                       'as (13) writes it, it would stay the same over position.)'),
        Figure('The odd disturbance over the load', Axis('Load torque', 'mN·m'),
               (Panel(Axis('−Odd disturbance', 'mN·m'), tuple(over_load), 240),),
               alt='Over load the odd disturbances of the three cases fall onto one line.',
               caption='Over the load torque the three cases fall onto one line: the friction of '
                       'the mechanism, C₀ + C₁·T_L, does not change when the disc turns.'),
    ]


def _comparison(title: str, tracking: Mapping[str, Tracking], load: str, caption: str) -> Figure:
    pid, both = tracking[f'{load}_pid'], tracking[f'{load}_feedforward']
    return Figure(
        title, Axis('Time', 's'),
        (Panel(Axis('Position', 'rad'), (
            Line('reference', pid.time, pid.wanted, 'muted', 'dash'),
            Line('PID', pid.time, pid.position, 'before'),
            Line('PID and identified feedforward', both.time, both.position, 'after')), 170),
         Panel(Axis('Error', 'rad'), (
             Line('PID', pid.time, pid.error, 'before', width=1.2),
             Line('PID and identified feedforward', both.time, both.error, 'after', width=1.2)),
             150, zero=True)),
        alt='Position and tracking error with and without the identified feedforward.',
        caption=f'{caption} To see: the error falls from {pid.largest:.3f} rad max, '
                f'{pid.rms:.3f} rms to {both.largest:.3f} and {both.rms:.3f}.')


def _runs(title: str, runs: list[Tracking], caption: str) -> Figure:
    colours = ('after', 'third')
    return Figure(
        title, Axis('Time', 's'),
        (Panel(Axis('Position', 'rad'), (
            Line('reference', runs[0].time, runs[0].wanted, 'muted', 'dash'),
            *(Line(f'run {number}', run.time, run.position, colour, width=1.3)
              for number, (run, colour) in enumerate(zip(runs, colours, strict=True), 1))), 150),
         Panel(Axis('Error', 'mrad'), tuple(
             Line(f'run {number}', run.time, 1e3 * run.error, colour, width=1.0)
             for number, (run, colour) in enumerate(zip(runs, colours, strict=True), 1)), 120,
             zero=True)),
        alt='Tracking of two runs with the identified model.',
        caption=f'{caption} To see: errors of {1e3 * runs[0].rms:.1f} and '
                f'{1e3 * runs[1].rms:.1f} mrad rms; the runs differ in sensor noise only.')


def _left(runs: list[Left], part: str) -> Figure:
    number = {'odd': 20, 'even': 21}[part]
    colours = ('after', 'third')
    series: list = [Points('before, first run', 1e3 * runs[0].load,
                           1e3 * getattr(runs[0], f'{part}_before'), 'noise')]
    series += [Points(f'left, run {index}', 1e3 * run.load, 1e3 * getattr(run, part), colour)
               for index, (run, colour) in enumerate(zip(runs, colours, strict=True), 1)]
    share = 100.0 * runs[0].rms(part) / runs[0].rms(f'{part}_before')
    return Figure(
        f'Figure {number}: observed {part} disturbance with the identified model',
        Axis('Load torque', 'mN·m'),
        (Panel(Axis(f'{part.capitalize()} disturbance', 'mN·m'), tuple(series), 220, zero=True),),
        alt=f'The {part} disturbance before and after the model is taken off.',
        caption=f'Paper: “Observed load dependent {part} disturbance with identified model and '
                'PID controller.” To see: with the model taken off the observer finds next to '
                f'nothing, {1e3 * runs[0].rms(part):.2f} and {1e3 * runs[1].rms(part):.2f} mN·m '
                f'rms in the two runs, {share:.1f} % of what was there.')


def _pd(result: ValidationResult) -> Figure:
    run, sticking = result.tracking['pd_model'], result.tracking['pd_sticking']
    return Figure(
        'Figure 22: tracking with identified model and PD', Axis('Time', 's'),
        (Panel(Axis('Position', 'rad'), (
            Line('reference', run.time, run.wanted, 'muted', 'dash'),
            Line('position', run.time, run.position, 'after'),
            Line('a brake that sticks', sticking.time, sticking.position, 'third')), 190),),
        alt='Position and reference under PD and the identified model.',
        caption='Paper: “Position tracking control result with identified model and PD '
                'controller.” Without an integral part whatever the model lacks stays as an '
                'offset.')


def _pd_error(result: ValidationResult) -> Figure:
    run, sticking = result.tracking['pd_model'], result.tracking['pd_sticking']
    return Figure(
        'Figure 23: motor position error with identified model and PD', Axis('Time', 's'),
        (Panel(Axis('Error', 'mrad'), (
            Line('the identified brake', run.time, 1e3 * run.error, 'after'),
            Line('a brake that sticks', sticking.time, 1e3 * sticking.error, 'third')), 180,
            zero=True),),
        alt='The position error under PD and the identified model.',
        caption='Paper: “Motor position tracking error with identified model and PD '
                'controller.” To see: the steady offset stays below '
                f'{1e3 * worst_offset(result.offsets):.1f} mrad at all stops, and below '
                f'{1e3 * worst_offset(result.sticking_offsets):.1f} mrad on a brake that sticks '
                'while its model does not (paper: 0.1 rad, required 0.5 rad).')
