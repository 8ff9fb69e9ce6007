# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Figures as SVG, drawn by matplotlib: what a page shows where plotly is not installed."""

from __future__ import annotations

from collections.abc import Sequence
import io
import re
from typing import Any

import numpy as np

from engb_core.report.figures import Band, Bars, decimate, Figure, Line, log_ticks, Points, Series
from engb_core.report.style import LIGHT
from engb_core.report.text import escape, Html, shorten

__all__ = ['matplotlib_svg']

WIDTH = 860
MARKERS = {'circle': 'o', 'square': 's', 'up': '^', 'down': 'v'}
DASHES = {'solid': '-', 'dash': (0, (5, 3)), 'dot': (0, (1.5, 2.0))}


def matplotlib_svg(figure: Figure, identifier: str, points: int) -> Html:
    """Return the figure as an inline <svg> whose colours follow the page's style sheet."""
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure as Canvas

    heights = [panel.height for panel in figure.panels]
    above = 14 if any(span.label for span in figure.spans) else 0
    total = sum(heights) + 40 * (len(heights) - 1) + 70 + above
    settings: dict[Any, Any] = {
        'svg.fonttype': 'none', 'svg.hashsalt': identifier, 'path.simplify': True,
        'font.family': 'sans-serif', 'font.size': 11, 'axes.unicode_minus': True}
    with matplotlib.rc_context(settings):
        canvas = Canvas(figsize=(WIDTH / 72, total / 72))
        FigureCanvasSVG(canvas)
        axes = canvas.subplots(len(heights), 1, sharex=True, squeeze=False,
                               gridspec_kw={'height_ratios': heights})[:, 0]
        canvas.subplots_adjust(left=0.075, right=0.988, bottom=44 / total,
                               top=1 - (26 + above) / total,
                               hspace=40 * len(heights) / sum(heights))
        for number, (axis, panel) in enumerate(zip(axes, figure.panels, strict=True)):
            _style(axis)
            axis.set_title(_text(panel.y.title), loc='left', x=-0.06, fontsize=11,
                           color=LIGHT['ink'],
                           pad=6 if number else 6 + above)
            if panel.zero:
                axis.axhline(0, color=LIGHT['muted'], linewidth=0.8, zorder=1)
            bars = [series for series in panel.series if isinstance(series, Bars)]
            for series in panel.series:
                if isinstance(series, Bars):
                    _bars(axis, series, bars.index(series), len(bars))
                else:
                    _draw(axis, series, points)
            for span in figure.spans:
                axis.axvspan(span.begin, span.end, color=LIGHT[span.colour], alpha=0.24,
                             linewidth=0, zorder=0)
            if panel.y.log:
                axis.set_yscale('log')
                _log(axis.yaxis, panel.series, 'y')
            if panel.y.limits:
                axis.set_ylim(panel.y.limits)
        if figure.x.log:
            axes[-1].set_xscale('log')
            _log(axes[-1].xaxis, [series for panel in figure.panels for series in panel.series],
                 'x')
        if figure.x.limits:
            axes[-1].set_xlim(figure.x.limits)
        for span in figure.spans:
            if span.label:
                axes[0].text((span.begin + span.end) / 2, 1.01, _text(span.label), ha='center',
                             va='bottom', fontsize=9, color=LIGHT['ink'], clip_on=False,
                             transform=axes[0].get_xaxis_transform())
        axes[-1].set_xlabel(_text(figure.x.title), color=LIGHT['muted'])
        buffer = io.StringIO()
        canvas.savefig(buffer, format='svg', transparent=True,
                       metadata={'Date': None, 'Creator': None})
    return _inline(buffer.getvalue(), figure.alt or figure.title)


def _log(axis: Any, series: Sequence[Series], side: str) -> None:
    ticks, text = log_ticks(series, side)
    if ticks:
        axis.set_ticks(ticks, labels=text)
        axis.set_ticks([], minor=True)


def _style(axis: Any) -> None:
    for side in ('top', 'right', 'left'):
        axis.spines[side].set_visible(False)
    axis.spines['bottom'].set_color(LIGHT['rule'])
    axis.grid(True, color=LIGHT['grid'], linewidth=0.8)
    axis.set_axisbelow(True)
    axis.tick_params(colors=LIGHT['muted'], length=0, labelcolor=LIGHT['muted'])
    axis.margins(x=0.01, y=0.08)


def _draw(axis: Any, series: Series, points: int) -> None:
    colour = LIGHT[series.colour]
    if isinstance(series, Band):
        axis.fill_between(np.asarray(series.x, float), np.asarray(series.low, float),
                          np.asarray(series.high, float), color=colour, alpha=0.22, linewidth=0)
    elif isinstance(series, Points):
        x, y = np.asarray(series.x, float), np.asarray(series.y, float)
        step = max(-(-x.size // points), 1)
        axis.plot(x[::step], y[::step], MARKERS[series.marker], color=colour,
                  markersize=0.7 * series.size)
    else:
        assert isinstance(series, Line), 'bars have a drawing of their own'
        x, y = decimate(series.x, series.y, points)
        axis.plot(x, y, color=colour, linestyle=DASHES[series.dash], linewidth=series.width,
                  marker=MARKERS.get(series.marker), markersize=5.5,
                  markerfacecolor='none' if series.marker == 'down' else colour)


def _bars(axis: Any, series: Bars, number: int, count: int) -> None:
    width = 0.7 / count
    place = np.arange(len(series.labels)) + (number - (count - 1) / 2) * width
    errors = None if series.errors is None else np.asarray(series.errors, float)
    axis.bar(place, np.asarray(series.values, float), width * 0.94, color=LIGHT[series.colour],
             yerr=errors, ecolor=LIGHT['ink'])
    axis.set_xticks(np.arange(len(series.labels)),
                    [_text(shorten(label, 18)) for label in series.labels])


def _text(value: str) -> str:
    """Matplotlib reads '$' as the start of a formula; a recording's name is none."""
    return shorten(value, 72).replace('$', r'\$')


def _inline(text: str, alt: str) -> Html:
    """Turn matplotlib's SVG file into an element of an HTML page, colours into roles."""
    text = text[text.index('<svg'):]
    text = re.sub(r'<metadata>.*?</metadata>', '', text, flags=re.DOTALL)
    head, body = text.split('>', 1)
    box = re.search(r'viewBox="[^"]*"', head)
    for role, colour in LIGHT.items():
        body = re.sub(re.escape(colour), f'var(--{role})', body, flags=re.IGNORECASE)
    body = re.sub(r'<!--.*?-->', '', body, flags=re.DOTALL)
    return Html(f'<div class="drawing static"><svg {box.group(0) if box else ""} role="img" '
                f'aria-label="{escape(alt)}">{body}</div>')
