# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Pictures of what lies beyond the paper: wear, heat and force."""

from __future__ import annotations

import numpy as np

from engb_core.report.figures import Axis, Band, Figure, Line, Panel, Points
from engb_core.reproduce.beyond_chapter import WearResult

__all__ = ['force_figure', 'wear_figure']


def wear_figure(result: WearResult) -> Figure:
    """P and the contact's shift, stroke by stroke, beside the truth."""
    at = np.array([entry.time for entry in result.updates])
    gain, gain_std, shift, shift_std = (
        np.array([getattr(entry, name) for entry in result.updates])
        for name in ('gain', 'gain_std', 'shift', 'shift_std'))
    gain_error, shift_error = result.errors()
    gain_scatter, shift_scatter = result.scatter()
    moved = float(np.diff(np.interp(at[[0, -1]], result.time, result.true_shift))[0])
    turning = result.time > (at[0] - 1.0 if at.size else 0.0)
    return Figure(
        'P and the contact, tracked while the pads wear and heat', Axis('Time', 's'),
        (Panel(Axis('Self-energizing gain P', '-'), (
            Band('two deviations', at, gain - 2.0 * gain_std, gain + 2.0 * gain_std),
            Line('simulated brake', result.time[turning], result.true_gain[turning], 'good',
                 width=2.2),
            Points('each stroke', at, gain, 'after')), 160),
         Panel(Axis('Contact’s shift', 'rad'), (
             Band('two deviations', at, shift - 2.0 * shift_std, shift + 2.0 * shift_std),
             Line('simulated brake', result.time, result.true_shift, 'good', width=2.2),
             Points('each stroke', at, shift, 'after')), 160),
         Panel(Axis('Pad temperature', '°C'), (
             Line('', result.time, result.temperature, 'before'),), 130)),
        alt='The tracked gain and contact follow the wearing pads.',
        caption='The curve was learnt from three strokes with the disc standing; then the disc '
                f'turns. In the mean P is {np.mean(gain_error):+.3f} and the contact '
                f'{np.mean(shift_error):+.2f} rad off: P is not one number over a stroke, since '
                'wedge and pad friction change with angle and force, and what it lacks is taken '
                f'for a shift. Changes are seen to {gain_scatter:.3f} and {shift_scatter:.2f} rad '
                '(standard deviation over the strokes): the contact moves by '
                f'{shift[-1] - shift[0]:.2f} rad, in truth by {moved:.2f} rad.')


def force_figure(result: WearResult) -> Figure:
    """The estimated clamp force beside the load cell."""
    force = result.force
    # Three strokes with the disc turning, drawn large enough to tell the lines apart.
    begin = result.updates[0].time if result.updates else 0.0
    shown = (force.time >= begin) & (force.time <= begin + 7.0)
    time, estimate, deviation, cell = (values[shown] for values in (
        force.time, force.estimate, force.deviation, force.cell))
    return Figure(
        'Clamp force: estimate and load cell', Axis('Time', 's'),
        (Panel(Axis('Clamp force', 'N'), (
            Band('two deviations', time, estimate - 2.0 * deviation, estimate + 2.0 * deviation),
            Line('load cell', time, cell, 'good', width=2.2),
            Line('estimate from angle and current', time, estimate, 'after', 'dash',
                 width=1.6)), 200),
         Panel(Axis('Estimate less cell', 'N'), (
             Band('two deviations', time, -2.0 * deviation, 2.0 * deviation),
             Line('estimate less cell', time, estimate - cell, 'recorded')), 150, zero=True)),
        alt='Estimated and measured clamp force with the band of the estimate.',
        caption=f'Over the whole run the estimate is {force.rms:.0f} N rms off, of up to '
                f'{force.largest:.0f} N, where the clamp is closed. The estimator’s own belief, '
                'in which a force has no loop, holds the load cell at '
                f'{100 * force.narrow:.0f} % of the samples. Gear and screw do not explain '
                f'{force.loop:.3f} of C₁: what is lost between them and the pads lies in the '
                'caliper, whose force has a loop as wide. With that in it, two deviations hold '
                f'the cell at {100 * force.inside:.0f} %.')
