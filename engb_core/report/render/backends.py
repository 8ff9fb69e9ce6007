# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Draws figures with what is installed: plotly, matplotlib, or tables of numbers."""

from __future__ import annotations

import importlib
import math

import numpy as np

from engb_core.report.figures import Band, Bars, Figure, Line, POINTS, Series
from engb_core.report.text import escape, Html, join, shorten

__all__ = ['BACKENDS', 'best_backend', 'figure_table', 'render']

BACKENDS = ('plotly', 'matplotlib', 'table')


def best_backend() -> str:
    """Return the best renderer that is installed: plotly, matplotlib or table."""
    for name, module in (('plotly', 'plotly.offline'),
                         ('matplotlib', 'matplotlib.backends.backend_svg')):
        try:
            importlib.import_module(module)
        # An installation can be broken in many ways (a binary for another numpy, say), and no
        # diagnosis shall be lost because its pictures can't be drawn.
        except Exception:  # noqa: BLE001
            continue
        return name
    return 'table'


def render(figure: Figure, backend: str, identifier: str, points: int = POINTS) -> Html:
    """Return the figure as a <figure> element, drawn by `backend` (one of BACKENDS)."""
    drawing: Html
    if backend == 'plotly':
        from engb_core.report.render.plotly_figure import plotly_div
        drawing = plotly_div(figure, identifier, points)
    elif backend == 'matplotlib':
        from engb_core.report.render.matplotlib_figure import matplotlib_svg
        drawing = matplotlib_svg(figure, identifier, points)
    else:
        drawing = figure_table(figure)
    legend = _legend(figure, identifier, interactive=backend == 'plotly') \
        if backend != 'table' else Html('')
    caption = Html(f'<p class="caption">{escape(figure.caption)}</p>') if figure.caption else ''
    return Html(f'<figure id="{escape(identifier)}" class="plot"><figcaption>'
                f'<span class="figure-title">{escape(figure.title)}</span>{legend}</figcaption>'
                f'{drawing}{caption}</figure>')


def figure_table(figure: Figure, rows: int = 12) -> Html:
    """Return the figure's numbers, thinned to `rows` rows, as folded tables: one a panel."""
    tables = []
    for panel in figure.panels:
        body = []
        for series in panel.series:
            if isinstance(series, Bars):
                pairs = list(zip(series.labels, np.asarray(series.values, float), strict=True))
            else:
                y = (np.asarray(series.high, float) if isinstance(series, Band)
                     else np.asarray(series.y, float))
                x = np.asarray(series.x, float)
                index = np.unique(np.linspace(0, x.size - 1, min(rows, x.size)).astype(int))
                pairs = [(f'{x[i]:.4g}', y[i]) for i in index]
            cells = join(Html(f'<td>{escape(shorten(label, 24))}<br><b>'
                              f'{escape(f"{value:.4g}" if math.isfinite(value) else "–")}'
                              '</b></td>') for label, value in pairs)
            body.append(Html(f'<tr><th scope="row">{escape(shorten(series.name))}</th>'
                             f'{cells}</tr>'))
        tables.append(Html(f'<div class="scroll"><table class="numbers"><caption>'
                           f'{escape(panel.y.title)} over {escape(figure.x.title)}</caption>'
                           f'<tbody>{join(body)}</tbody></table></div>'))
    return Html(f'<p class="alt">{escape(figure.alt)}</p><details class="minor"><summary>'
                f'Numbers of this picture</summary>{join(tables)}</details>')


def _legend(figure: Figure, identifier: str, *, interactive: bool) -> Html:
    entries = figure.legend
    if len(entries) < 2 and not any(isinstance(entry, Band) for entry in entries):
        return Html('')
    items = []
    for entry in entries:
        content = Html(f'{_swatch(entry)}{escape(shorten(entry.name))}')
        if interactive:
            items.append(Html(f'<button type="button" aria-pressed="true" '
                              f'data-figure="{escape(identifier)}" '
                              f'data-series="{escape(entry.name)}">{content}</button>'))
        else:
            items.append(Html(f'<span>{content}</span>'))
    return Html(f'<span class="legend">{join(items)}</span>')


_MARKS = {'circle': '<circle cx="13" cy="6" r="3.4"/>',
          'square': '<rect x="9.8" y="2.8" width="6.4" height="6.4"/>',
          'up': '<path d="M13 1.8 17 9.4H9z"/>', 'down': '<path d="M13 10.2 9 2.6h8z"/>'}
_DASHES = {'solid': '', 'dash': '5 3', 'dot': '1.5 2.5'}


def _swatch(entry: Series) -> Html:
    colour = f'var(--{entry.colour})'
    if isinstance(entry, (Bars, Band)):
        opacity = '.3' if isinstance(entry, Band) else '1'
        body = ('<rect x="3" y="1" width="20" height="10" '
                f'style="fill:{colour};opacity:{opacity}"/>')
    else:
        body = ''
        if isinstance(entry, Line):
            body = (f'<path d="M1 6h24" style="stroke:{colour};stroke-width:{entry.width + 0.4};'
                    f'stroke-dasharray:{_DASHES[entry.dash] or "none"};fill:none"/>')
        if entry.marker:
            fill = 'var(--paper)' if entry.marker == 'down' else colour
            body += (f'<g style="fill:{fill};stroke:{colour};stroke-width:1.4">'
                     f'{_MARKS[entry.marker]}</g>')
    return Html(f'<svg viewBox="0 0 26 12" width="26" height="12" aria-hidden="true">{body}</svg>')
