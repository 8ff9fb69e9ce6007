# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Figures as plotly JSON, drawn by the page's script: zoom, pan and hover, no network.

The JSON is written here, not by plotly's Python classes: only plotly.js itself is needed from the
plotly package, and what is written works with plotly.js 2 and 3.
"""

from __future__ import annotations

from collections.abc import Sequence
import html
import json
from typing import Any

import numpy as np

from engb_core.report.figures import (
    Band,
    Bars,
    decimate,
    Figure,
    Line,
    log_ticks,
    Points,
    rounded,
    Series,
)
from engb_core.report.text import clean, escape, Html, shorten

__all__ = ['plotly_div', 'plotly_script', 'plotly_spec']

# Pixels around and between panels; each panel's title stands above it.
TOP, BOTTOM, GAP, LEFT, RIGHT = 30, 44, 40, 56, 14
LABELS = 16   # more room above the first panel where spans carry labels

# Plotly takes the next step of 1, 2, 5 that gives no more ticks than it is told: at worst two and
# a half times fewer. An axis with fewer than three can't be read.
LEAST_TICKS = 8
# Of a low panel fewer, so that they do not touch: pixels each takes.
TICK = 13

# Marks a colour role in the JSON. No text from outside holds it: `clean` removes it.
ROLE = '\x01'

SYMBOLS = {'circle': 'circle', 'square': 'square', 'up': 'triangle-up',
           'down': 'triangle-down-open'}


def plotly_script() -> str:
    """Return plotly.js as it may stand inside a <script> element."""
    from plotly.offline import get_plotlyjs
    script: str = get_plotlyjs()
    return script.replace('</script', '<\\/script').replace('<!--', '<\\!--')


def plotly_div(figure: Figure, identifier: str, points: int) -> Html:
    """Return the element that the page's script draws into, and the data it draws."""
    spec = plotly_spec(figure, points)
    text = json.dumps(spec, ensure_ascii=True, allow_nan=False, separators=(',', ':'))
    # A data block ends at any "</script" or may open a comment: no "<" may stand in it.
    text = text.replace('<', '\\u003c').replace('>', '\\u003e').replace('&', '\\u0026')
    height = spec['layout']['height']
    return Html(f'<div class="drawing" role="group" style="height:{height}px" '
                f'aria-label="{escape(figure.alt or figure.title)}"></div>'
                f'<script type="application/json" data-plot="{escape(identifier)}">{text}'
                '</script>')


def plotly_spec(figure: Figure, points: int) -> dict[str, Any]:
    """Return {'data': …, 'layout': …} for plotly.js, colours still as roles."""
    heights = [panel.height for panel in figure.panels]
    inner = sum(heights) + GAP * (len(heights) - 1)
    above = LABELS if any(span.label for span in figure.spans) else 0
    data: list[dict[str, Any]] = []
    layout: dict[str, Any] = {
        'height': inner + TOP + above + BOTTOM, 'showlegend': False, 'hovermode': 'closest',
        'margin': {'l': LEFT, 'r': RIGHT, 't': TOP + above, 'b': BOTTOM}, 'uirevision': 'keep',
        'paper_bgcolor': 'rgba(0,0,0,0)', 'plot_bgcolor': 'rgba(0,0,0,0)',
        'font': {'color': ROLE + 'muted', 'size': 12},
        'modebar': {'bgcolor': 'rgba(0,0,0,0)', 'color': ROLE + 'muted',
                    'activecolor': ROLE + 'after'},
        'hoverlabel': {'bgcolor': ROLE + 'panel', 'bordercolor': ROLE + 'rule',
                       'font': {'color': ROLE + 'ink', 'size': 12}},
        'annotations': [], 'shapes': [], 'barmode': 'group', 'bargap': 0.3,
    }
    top = 1.0
    for number, panel in enumerate(figure.panels, 1):
        bottom = max(top - panel.height / inner, 0.0)
        suffix = '' if number == 1 else str(number)
        axis = {'domain': [bottom, top], 'anchor': 'x', 'gridcolor': ROLE + 'grid',
                'linecolor': ROLE + 'rule', 'zeroline': panel.zero, 'zerolinewidth': 1,
                'zerolinecolor': ROLE + 'muted',
                'nticks': max(panel.height // 26, min(LEAST_TICKS, panel.height // TICK)),
                'automargin': True, 'fixedrange': False}
        if panel.y.log:
            axis |= _log(panel.series, 'y')
        if panel.y.limits:
            axis['range'] = _limits(panel.y.limits, panel.y.log)
        layout[f'yaxis{suffix}'] = axis
        layout['annotations'].append({
            'text': _text(panel.y.title), 'xref': 'paper', 'yref': 'paper', 'x': 0, 'y': top,
            'xanchor': 'left', 'yanchor': 'bottom', 'showarrow': False,
            'xshift': -LEFT + 12, 'yshift': 5 + (above if number == 1 else 0),
            'font': {'color': ROLE + 'ink', 'size': 12}})
        for span in figure.spans:
            layout['shapes'].append({
                'type': 'rect', 'layer': 'below', 'xref': 'x', 'yref': f'y{suffix} domain',
                'x0': span.begin, 'x1': span.end, 'y0': 0, 'y1': 1,
                'line': {'width': 0.5, 'color': f'{ROLE}{span.colour}@0.6'},
                'fillcolor': f'{ROLE}{span.colour}@0.24'})
        for series in panel.series:
            data.extend(_traces(series, f'y{suffix}', points))
        top = bottom - GAP / inner
    layout['annotations'].extend({
        'text': _text(span.label), 'xref': 'x', 'yref': 'paper', 'y': 1, 'yanchor': 'bottom',
        'x': (span.begin + span.end) / 2, 'xanchor': 'center', 'yshift': 2, 'showarrow': False,
        'font': {'color': ROLE + 'ink', 'size': 11}} for span in figure.spans if span.label)
    last = '' if len(heights) == 1 else str(len(heights))
    layout['xaxis'] = {
        'anchor': f'y{last}', 'title': {'text': _text(figure.x.title), 'standoff': 8},
        'gridcolor': ROLE + 'grid', 'linecolor': ROLE + 'rule', 'zeroline': False,
        'ticks': 'outside', 'tickcolor': ROLE + 'rule', 'ticklen': 4, 'nticks': 10,
        'showline': True}
    if any(isinstance(series, Bars) for panel in figure.panels for series in panel.series):
        layout['xaxis'] |= {'type': 'category', 'showgrid': False, 'ticks': ''}
    if figure.x.log:
        layout['xaxis'] |= _log(
            [series for panel in figure.panels for series in panel.series], 'x')
    if figure.x.limits:
        layout['xaxis']['range'] = _limits(figure.x.limits, figure.x.log)
    return {'data': data, 'layout': layout}


def _log(series: Sequence[Series], side: str) -> dict[str, Any]:
    # Plotly writes bare 2 and 5 between the decades, in which nobody reads 0.2 and 0.5.
    values, text = log_ticks(series, side)
    return {'type': 'log', 'tickvals': values, 'ticktext': text} if values else {'type': 'log'}


def _traces(series: Series, axis: str, points: int) -> list[dict[str, Any]]:
    colour = ROLE + series.colour
    # `group` is the legend's name for it, word for word; `name` is what plotly shows.
    common: dict[str, Any] = {'name': _text(shorten(series.name)), 'group': clean(series.name),
                              'xaxis': 'x', 'yaxis': axis}
    if isinstance(series, Bars):
        trace = common | {'type': 'bar', 'x': [_text(shorten(label)) for label in series.labels],
                          'y': rounded(series.values), 'marker': {'color': colour}}
        if series.errors is not None:
            trace['error_y'] = {'type': 'data', 'array': rounded(series.errors),
                                'color': ROLE + 'ink', 'thickness': 1}
        return [trace]
    common |= {'type': 'scatter'}
    if isinstance(series, Band):
        x, low = decimate(series.x, series.low, points)
        x_high, high = decimate(series.x, series.high, points)
        edge = common | {'mode': 'lines', 'line': {'width': 0}, 'hoverinfo': 'skip'}
        return [edge | {'x': rounded(x), 'y': rounded(low)},
                edge | {'x': rounded(x_high), 'y': rounded(high), 'fill': 'tonexty',
                        'fillcolor': f'{colour}@0.22'}]
    if isinstance(series, Points):
        x, y = _thinned(series, points)
        return [common | {'mode': 'markers', 'x': rounded(x), 'y': rounded(y),
                          'marker': {'color': colour, 'size': series.size,
                                     'symbol': SYMBOLS[series.marker]}}]
    x, y = decimate(series.x, series.y, points)
    trace = common | {'mode': 'lines+markers' if series.marker else 'lines',
                      'x': rounded(x), 'y': rounded(y), 'connectgaps': False,
                      'line': {'color': colour, 'width': series.width, 'dash': series.dash}}
    if series.marker:
        trace['marker'] = {'color': colour, 'size': 7, 'symbol': SYMBOLS[series.marker],
                           'line': {'width': 1.4, 'color': colour}}
    return [trace]


def _thinned(series: Line | Points, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Every k-th point: a cloud must keep its density, not only its envelope."""
    x, y = np.asarray(series.x, float), np.asarray(series.y, float)
    step = max(-(-x.size // points), 1)
    return x[::step], y[::step]


def _text(value: str) -> str:
    """Plotly reads text as HTML of its own kind: give it entities, so that it stays text."""
    return html.escape(shorten(value, 72), quote=False)


def _limits(limits: tuple[float, float], log: bool) -> list[float]:
    return [float(value) for value in (np.log10(limits) if log else limits)]
