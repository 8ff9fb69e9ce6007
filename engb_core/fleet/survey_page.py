# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The survey on one page: which effect on which unit, what is common, what changes, who stands
out, and a link to each recording's own report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from urllib.parse import quote

import numpy as np

from engb_core.fleet.common_causes import Cause, causes_of, Outlier, outliers_of
from engb_core.fleet.pooling import pool, Pooled
from engb_core.fleet.rows import Entry, Measure, measures_of
from engb_core.fleet.trends import find_trends, Trend
from engb_core.report.figures import Axis, Figure, Line, Panel, Points
from engb_core.report.layout import bar, Column, Page
from engb_core.report.text import escape, Html, shorten
from engb_core.report.wording import (
    capital,
    effect_name,
    enumerate_words,
    number,
    parameter_name,
    percent,
    quantities,
    quantity,
)

__all__ = ['quantity_name', 'survey_page']

_UNITS = 40         # units that have a column or curve of their own
_RECORDINGS = 5000  # rows of the last table
_TRENDS = 12        # trends that are drawn
_COLOURS = ('recorded', 'before', 'after', 'good', 'third', 'noise', 'mark')
_SIGNS = {'ok': 'diagnosed', 'refused': 'not usable', 'fault': 'fault of the program',
          'lost': 'given up'}


def survey_page(entries: Sequence[Entry], *, backend: str | None = None) -> Page:
    """Return the page of a survey; `backend` as in `Page`."""
    measures = measures_of(entries)
    causes, pooled, trends = causes_of(entries), pool(measures), find_trends(measures)
    outliers = outliers_of(entries, pooled)
    page = Page('engb survey', backend=backend)
    _header(page, entries, causes, trends, outliers)
    _causes(page, entries, causes)
    _differences(page, pooled)
    _trends(page, trends, measures)
    _outliers(page, outliers)
    _recordings(page, entries)
    page.footer('engb survey. The tables beside this page, survey.csv and effects.csv, hold the '
                'numbers.')
    return page


def quantity_name(name: str) -> str:
    """Return a quantity as words: 'breakaway ratio of Stribeck friction'."""
    effect, _, parameter = name.rpartition('.')
    text = parameter_name(parameter)
    return f'{text} of {effect_name(effect)}' if effect else text


def _header(page: Page, entries: Sequence[Entry], causes: list[Cause], trends: list[Trend],
            outliers: list[Outlier]) -> None:
    good = [entry for entry in entries if entry.good]
    units = {entry.unit for entry in good}
    common = [cause for cause in causes if cause.common]
    if not good:
        headline, tone = 'No recording could be diagnosed', 'warn'
    elif common:
        first = common[0]
        headline = (f'{effect_name(first.effect, start=True)} on {len(first.on)} of '
                    f'{_count(len(units), "unit")}: the model lacks it')
        tone = 'warn'
    elif len(units) == 1 and any(cause.on for cause in causes):
        found = enumerate_words([effect_name(cause.effect) for cause in causes if cause.on])
        headline = f'{capital(found)} on {shorten(next(iter(units)))}: the model lacks it'
        tone = 'warn'
    elif any(cause.on for cause in causes):
        headline, tone = 'What the model lacks differs from unit to unit', 'warn'
    else:
        headline, tone = 'No effect that most recordings of any unit share', 'good'
    verdicts = Counter(entry.result['document']['verdict'] for entry in good)
    lead = [f'{_count(len(entries), "recording")} of {_count(len(units), "unit")}; '
            + enumerate_words([f'{count} {verdict.replace("_", " ")}'
                               for verdict, count in verdicts.most_common()])
            + '.'] if good else []
    if outliers:
        names = list(dict.fromkeys(outlier.unit for outlier in outliers))
        lead.append('Out of line: ' + enumerate_words([shorten(name) for name in names[:5]])
                    + (' and others' if len(names) > 5 else '') + '.')
    page.header('Fleet survey', headline, lead, tone=tone, key=[
        ('diagnosed', f'{len(good)} of {len(entries)}', 'recordings'),
        ('effects found', str(len(causes)), f'{len(common)} common to most units'),
        ('trends', str(len(trends)), 'with time or mileage'),
        ('out of line', str(len(outliers)), 'units or recordings')])


def _count(count: int, word: str) -> str:
    return f'{count} {word}{"" if count == 1 else "s"}'


def _causes(page: Page, entries: Sequence[Entry], causes: list[Cause]) -> None:
    page.section('Which effect on which unit')
    if not causes:
        page.text('No effect was found in any recording.')
        return
    units = list(causes[0].share)
    count = Counter(entry.unit for entry in entries if entry.good)
    for cause in causes:
        if cause.common:
            page.call(Html(f'<b>{escape(effect_name(cause.effect, start=True))}</b> is on '
                           f'{len(cause.on)} of {len(units)} units: a common cause. It belongs '
                           'into the model; a unit\'s own wear or tolerance would not be on most '
                           'of them.'))
        elif len(cause.on) == 1 and len(units) > 2:
            page.call(Html(f'<b>{escape(effect_name(cause.effect, start=True))}</b> is on '
                           f'<b>{escape(shorten(cause.on[0]))}</b> only: look at that unit.'))
        for unit, key in list(cause.first.items())[:5]:
            page.call(Html(f'<b>{escape(effect_name(cause.effect, start=True))}</b> appeared on '
                           f'<b>{escape(shorten(unit))}</b>: in no recording before '
                           f'{escape(shorten(key, 60))}, in every one since.'))
    page.text('Each cell: the share of the unit\'s recordings in which the effect was found '
              '(probability 0.5 and more).', kind='caption')
    shown = units[:_UNITS]
    columns = [Column('unit'), Column('recordings', number=True),
               *(Column(capital(effect_name(cause.effect))) for cause in causes[:8])]
    rows = [[shorten(unit), str(count[unit]), *(
        Html(f'{bar(cause.share[unit], "before" if cause.common else "after")} '
             f'{escape(percent(cause.share[unit]))}') if cause.share[unit] else Html('–')
        for cause in causes[:8])] for unit in shown]
    page.table(columns, rows, caption='' if len(shown) == len(units) else
               f'The first {len(shown)} of {len(units)} units; effects.csv has all.')
    if len(causes) > 8:
        page.text('Also found: ' + enumerate_words(
            [effect_name(cause.effect) for cause in causes[8:]]) + '.', kind='muted')


def _differences(page: Page, pooled: list[Pooled]) -> None:
    page.section('What is common, what differs between units')
    if not pooled:
        page.text('It takes recordings of at least two units.')
        return
    page.text('Each number was refitted on every recording and then over all of them together '
              '(random effects): the common value, how far units lie apart from it, and how far '
              'recordings of one unit scatter beyond their own uncertainty.')
    rows = []
    for entry in pooled:
        unit = entry.unit_of_measure
        rows.append([capital(quantity_name(entry.quantity)),
                     ' ± '.join(quantities([entry.mean, 2 * entry.std], unit)),
                     quantity(entry.between, unit, 2) if entry.between else '–',
                     quantity(entry.within, unit, 2) if entry.within else '–',
                     str(len(entry.units)), 'units differ' if entry.heterogeneous else 'common'])
    page.table([Column('number'), Column('common value (95 %)', number=True),
                Column('between units', number=True), Column('between recordings', number=True),
                Column('units', number=True), Column('')], rows,
               chosen=[index for index, entry in enumerate(pooled) if entry.heterogeneous])
    for entry in [entry for entry in pooled if entry.heterogeneous][:6]:
        shown = entry.units[:_UNITS]
        place = np.arange(len(shown), dtype=float)
        value = np.array([unit.value for unit in shown])
        spread = 2 * np.array([unit.std for unit in shown])
        bars = [Line('95 %' if index == 0 else '', [at, at], [mean - half, mean + half], 'after',
                     width=2.0) for index, (at, mean, half) in enumerate(
                         zip(place, value, spread, strict=True))]
        common = Line('common value', [-0.5, len(shown) - 0.5], [entry.mean] * 2, 'noise', 'dash')
        page.figure(Figure(
            f'{capital(quantity_name(entry.quantity))} of each unit', Axis('unit number'),
            (Panel(Axis(quantity_name(entry.quantity), entry.unit_of_measure),
                   (common, Points('unit', place, value, 'after'), *bars), 220),),
            alt=f'{len(shown)} units around {quantity(entry.mean, entry.unit_of_measure)}.',
            caption='Units: ' + ', '.join(f'{index} {shorten(unit.unit, 24)}'
                                          for index, unit in enumerate(shown))))


def _trends(page: Page, trends: list[Trend], measures: list[Measure]) -> None:
    page.section('Trends')
    if not trends:
        page.text('Nothing changes with time or mileage beyond what chance would do (one false '
                  'finding in twenty allowed). A trend of a unit takes at least four recordings.')
        return
    rows = [[capital(quantity_name(trend.quantity)), trend.unit or 'all units',
             ' ± '.join(quantities([trend.slope * _per(trend), 2 * trend.std * _per(trend)],
                                   trend.unit_of_measure)),
             'per 1000 km' if trend.over == 'mileage' else 'per 30 days', str(trend.count)]
            for trend in trends]
    page.table([Column('number'), Column('unit'), Column('change (95 %)', number=True),
                Column('over'), Column('recordings', number=True)], rows)
    drawn = dict.fromkeys((trend.quantity, trend.over) for trend in trends)
    for name, over in list(drawn)[:_TRENDS]:
        page.figure(_trend_figure(name, over, measures))


def _per(trend: Trend) -> float:
    return 1000.0 if trend.over == 'mileage' else 30.0


def _trend_figure(name: str, over: str, measures: list[Measure]) -> Figure:
    chosen = [measure for measure in measures if measure.quantity == name and (
        measure.mileage if over == 'mileage' else measure.days) is not None]
    units = sorted({measure.unit for measure in chosen})[:_UNITS]
    series = []
    for index, unit in enumerate(units):
        mine = sorted(((measure.mileage if over == 'mileage' else measure.days), measure.value)
                      for measure in chosen if measure.unit == unit)
        x, y = np.array(mine, float).T
        series.append(Line(shorten(unit, 24), x, y, _COLOURS[index % len(_COLOURS)],
                           marker='circle',
                           dash=('solid', 'dash', 'dot')[index // len(_COLOURS) % 3]))
    axis = Axis('mileage', 'km') if over == 'mileage' else Axis('time since the first recording',
                                                                'days')
    return Figure(f'{capital(quantity_name(name))} over {over}', axis,
                  (Panel(Axis(quantity_name(name), chosen[0].unit_of_measure), tuple(series),
                         240),),
                  alt=f'{quantity_name(name)} of {_count(len(units), "unit")} over {over}.')


def _outliers(page: Page, outliers: list[Outlier]) -> None:
    page.section('Out of line')
    if not outliers:
        page.text('No unit and no recording lies further from the others than 3.5 standard '
                  'deviations.')
        return
    page.table([Column('unit'), Column('recording'), Column('what'), Column('why')],
               [[shorten(entry.unit), shorten(entry.key) or 'all',
                 quantity_name(entry.quantity), entry.statement] for entry in outliers[:200]])


def _recordings(page: Page, entries: Sequence[Entry]) -> None:
    bad = [entry for entry in entries if not entry.good]
    if bad:
        page.section('Not diagnosed')
        page.table([Column('recording'), Column('unit'), Column(''), Column('why')],
                   [[shorten(entry.key, 60), shorten(entry.unit),
                     _SIGNS.get(entry.result['status'], entry.result['status']),
                     entry.result['message']] for entry in bad[:1000]])
    page.section('Every recording')
    rows = []
    for entry in [entry for entry in entries if entry.good][:_RECORDINGS]:
        document, fit = entry.result['document'], entry.held_out()
        found = ', '.join(f'{effect_name(name)} {number(effect["probability"], 2)}'
                          for name, effect in entry.claimed.items()) or '–'
        link = entry.result.get('report')
        space = entry.result.get('namespace')
        label = escape(shorten(entry.key + (f' {space}' if space else ''), 60))
        rows.append([Html(f'<a href="{quote(link)}">{label}</a>') if link else label,
                     shorten(entry.unit),
                     '–' if entry.mileage is None else number(entry.mileage),
                     document['verdict'].replace('_', ' '), found,
                     '–' if fit is None else f'{quantity(fit["rms_before"], fit["unit"], 2)} → '
                     f'{quantity(fit["rms_after"], fit["unit"], 2)}'])
    page.table([Column('recording'), Column('unit'), Column('km', number=True),
                Column('verdict'), Column('effects (probability)'),
                Column('held-out residual', number=True)], rows)
    left = sum(entry.good for entry in entries) - len(rows)
    if left > 0:
        page.text(f'{left} more in survey.csv.', kind='muted')
