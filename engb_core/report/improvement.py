# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How much better the corrected model predicts what no fit has seen."""

from __future__ import annotations

import math

from engb_core.diagnose.diagnosis import Diagnosis, QualityOfFit
from engb_core.report.layout import bar, Column, folded_points, MAIN_POINTS, Page
from engb_core.report.pictures import closed_loop, Units
from engb_core.report.text import breakable, join, shorten
from engb_core.report.wording import coordinate, quantities, scaled

__all__ = ['add_improvement']

# More rows than these are read from diagnosis.json, not on a page.
ROWS = 40


def add_improvement(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    """Add the held-out errors before and after, and the closed loop."""
    rows = diagnosis.held_out
    if not rows and not diagnosis.evidence.closed_loops:
        return
    page.section('How much better' if diagnosis.corrects else 'How well the model predicts')
    if rows:
        page.text('Root mean square errors on recordings, or parts of them, that no fit has '
                  'seen.', kind='muted')
        _fit_table(page, rows, corrected=diagnosis.corrects)
    loops = diagnosis.evidence.closed_loops
    for loop in loops[:1]:
        page.figure(closed_loop(loop, units), points=MAIN_POINTS)
    if len(loops) > 1:
        page.begin_details(f'Closed loop of the other recordings ({len(loops) - 1})')
        points = folded_points(5 * (len(loops) - 1))
        for loop in loops[1:]:
            page.figure(closed_loop(loop, units), points=points)
        page.end_details()


def _fit_table(page: Page, rows: tuple[QualityOfFit, ...], *, corrected: bool) -> None:
    table = []
    for row in rows[:ROWS]:
        largest = max(row.rms_before, row.rms_after, row.noise_floor or 0.0) or 1.0
        mark = None if row.noise_floor is None else row.noise_floor / largest
        bars = [bar(row.rms_before / largest, 'before', mark=mark)]
        if corrected:
            bars.append(bar(row.rms_after / largest, 'after', mark=mark))
        name = {'effort': 'motor torque' if row.unit != 'N' else 'motor force'}.get(
            row.quantity, f'closed-loop {coordinate(row.quantity)}')
        unit = scaled(largest, row.unit)[1]
        floor = math.nan if row.noise_floor is None else row.noise_floor
        before, after, noise, _ = quantities((row.rms_before, row.rms_after, floor, largest),
                                             row.unit)
        errors = (before, after, _change(row)) if corrected else (before,)
        table.append((breakable(shorten(row.recording, 44)),
                      f'{name} [{shorten(unit, 24)}]', *errors, noise, join(bars)))
    headings = ('As given', 'Corrected', 'Change') if corrected else ('Error',)
    page.table([Column('Recording'), Column('Quantity'),
                *(Column(heading, number=True) for heading in headings),
                Column('Noise floor', number=True), Column('', kind='bars')], table,
               caption='Upper bar: model as given; lower bar: corrected model; the line marks '
                       'the noise floor.' if corrected else 'The line marks the noise floor.')


def _change(row: QualityOfFit) -> str:
    change = row.rms_after / row.rms_before - 1 if row.rms_before > 0 else math.nan
    if not math.isfinite(change):
        return '–'
    rounded = round(100 * change)
    return f'{"+" if rounded > 0 else "−" if rounded else "±"}{abs(rounded)}\u202f%'
