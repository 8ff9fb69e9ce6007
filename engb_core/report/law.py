# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The law for what has no name: the remainder as points, the law through them, its rivals."""

from __future__ import annotations

import numpy as np

from engb_core.diagnose.diagnosis import LawFinding, LawPicture
from engb_core.report.figures import Axis, Figure, Line, Panel, Points, Series
from engb_core.report.layout import Column, Page
from engb_core.report.pictures import Units
from engb_core.report.text import escape, Html
from engb_core.report.wording import capital, coordinate, estimate, percent, scaled

__all__ = ['add_law']

_ACTS = {'torque': 'a torque that is added', 'friction_gain': 'a part by which friction changes',
         'load_gain': 'a part by which the load changes',
         'effort_gain': 'a part by which torque per effort changes',
         'inertia': 'an inertia over the angle: J(θ)·a + ½ J′(θ)·ω²',
         'position_shift': 'an error of the measured position',
         'delay': 'a delay between effort and motion'}


def add_law(page: Page, law: LawFinding, units: Units) -> None:
    """Add the law, what was measured and what it says, its numbers, and what does as well."""
    page.subsection('A law for it')
    page.call(Html(f'<b>{escape(law.line)}</b>'))
    if law.below:
        page.text(f'where {", ".join(law.below)}')
    facts = [('Formula', law.formula), ('It acts as', _ACTS.get(law.acts_as, law.acts_as)),
             ('Explained of what was left', percent(law.explained))]
    facts += [(name, estimate(value)) for name, value in law.parameters.items()]
    page.table([Column('Quantity'), Column('Value')], facts, kind='compact')
    if law.picture is not None:
        page.figure(_figure(law.picture, units))
    if law.alternatives:
        page.text('Laws that do about as well:' if not law.settled else
                  'Other ways to write nearly the same:')
        page.notes(law.alternatives)
    page.text('The corrected model holds this law within the range in which it was recorded. '
              'engb adopt gives it a name, so that the next diagnosis knows it.', kind='caption')


def _figure(picture: LawPicture, units: Units) -> Figure:
    factor, unit = scaled(_largest((*picture.measured, *picture.law)), units.effort)
    name = coordinate(picture.coordinate)
    before: list[Series] = []
    after: list[Series] = []
    for direction, marker, dash, place in (('applying', 'up', 'solid', 0),
                                           ('releasing', 'down', 'dash', 1)):
        before += [Points(f'measured, {direction}', picture.centre,
                          factor * picture.measured[place], 'recorded', marker),
                   Line(f'law, {direction}', picture.centre, factor * picture.law[place],
                        'after', dash=dash)]
        after.append(Points(f'left, {direction}', picture.centre, factor * picture.left[place],
                            'after', marker))
    return Figure(
        f'What was left, and the law through it, over {name}',
        Axis(capital(name), picture.unit),
        (Panel(Axis(f'Left before the law, mean {units.effort_name}', unit), tuple(before), 240,
               zero=True),
         Panel(Axis('Left after it', unit), tuple(after), 120, zero=True)),
        alt=f'Mean of what names and numbers leave over {name}, applying and releasing, the law '
            'through it, and what is left after the law.',
        caption='Points are means of what was measured less all that has a name; the line is the '
                'law, fitted with all numbers free.')


def _largest(parts: tuple[np.ndarray, ...]) -> float:
    values = np.abs(np.concatenate(parts))
    return float(np.max(values, where=np.isfinite(values), initial=0.0))
