# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Pictures as plain data; a renderer turns them into plotly, SVG or a table.

A `Figure` is a stack of panels over one x axis, so that zooming one panel moves all. Colours are
roles ('recorded', 'before', 'after', …) that the page's style sheet gives a value, in light and
in dark.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
import importlib
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.report.text import escape, Html, join, shorten

__all__ = ['Axis', 'BACKENDS', 'Band', 'Bars', 'Figure', 'Line', 'Panel', 'Points', 'Series',
           'Span', 'best_backend', 'decimate', 'figure_table', 'render', 'rounded']

Array = NDArray[np.float64]

BACKENDS = ('plotly', 'matplotlib', 'table')

# Points drawn of one series: min and max of about a thousand stretches, finer than a screen.
POINTS = 2000


@dataclass(frozen=True)
class Axis:
    """An axis: its label and unit; `limits` None shows all data."""

    label: str
    unit: str = ''
    log: bool = False
    limits: tuple[float, float] | None = None

    @property
    def title(self) -> str:
        """Label and unit as they stand at the axis."""
        return f'{self.label} [{self.unit}]' if self.unit and self.unit != '-' else self.label


@dataclass(frozen=True)
class Line:
    """A curve through x, y (n,); not-finite samples break it. `dash`: solid, dash or dot.

    `marker`: '' for none, or circle, square, up, down.
    """

    name: str
    x: ArrayLike
    y: ArrayLike
    colour: str = 'recorded'
    dash: str = 'solid'
    width: float = 1.6
    marker: str = ''


@dataclass(frozen=True)
class Points:
    """Unconnected markers at x, y (n,), `size` pixels across."""

    name: str
    x: ArrayLike
    y: ArrayLike
    colour: str = 'recorded'
    marker: str = 'circle'
    size: float = 7.0


@dataclass(frozen=True)
class Band:
    """The area between `low` and `high` (n,) over x (n,)."""

    name: str
    x: ArrayLike
    low: ArrayLike
    high: ArrayLike
    colour: str = 'noise'


@dataclass(frozen=True)
class Bars:
    """One bar of each labelled category; several Bars in a panel stand side by side."""

    name: str
    labels: Sequence[str]
    values: ArrayLike
    colour: str = 'after'
    errors: ArrayLike | None = None


Series = Line | Points | Band | Bars


@dataclass(frozen=True)
class Panel:
    """One plot area: its y axis, what is drawn, and its height in pixels."""

    y: Axis
    series: tuple[Series, ...]
    height: int = 200
    zero: bool = False   # draw the zero line


@dataclass(frozen=True)
class Span:
    """A marked range of x across all panels, with an optional short label at its top."""

    begin: float
    end: float
    label: str = ''
    colour: str = 'mark'


@dataclass(frozen=True)
class Figure:
    """A picture: panels over one x axis.

    `alt` says in a sentence what the picture shows, for those who can't see it; `caption` stands
    below it.
    """

    title: str
    x: Axis
    panels: tuple[Panel, ...]
    alt: str = ''
    caption: str = ''
    spans: tuple[Span, ...] = field(default_factory=tuple)

    @property
    def legend(self) -> tuple[Series, ...]:
        """The first series of each name, in order of appearance."""
        seen: dict[str, Series] = {}
        for panel in self.panels:
            for series in panel.series:
                if series.name:
                    seen.setdefault(series.name, series)
        return tuple(seen.values())


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


def decimate(x: ArrayLike, y: ArrayLike, points: int = POINTS) -> tuple[Array, Array]:
    """Return at most `points` samples of (x, y) that look the same: each stretch's min and max.

    Stretches without a finite sample stay as a break in the line.
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    count = x.size
    if count <= max(points, 4):
        return x, y
    stretches = max(points // 2 - 1, 1)
    width = math.ceil(count / stretches)
    padded = np.full(stretches * width, np.nan)
    padded[:count] = y
    rows = padded.reshape(stretches, width)
    finite = np.isfinite(rows)
    start = np.arange(stretches) * width
    low = start + np.argmin(np.where(finite, rows, np.inf), axis=1)
    high = start + np.argmax(np.where(finite, rows, -np.inf), axis=1)
    index = np.unique(np.concatenate([[0], low, high, [count - 1]]))
    index = index[index < count]
    return x[index], y[index]


def rounded(values: ArrayLike) -> list[float | None]:
    """Return the values as short JSON numbers, steps of 1/10⁴ of their range or finer.

    What is not finite becomes None.
    """
    array = np.asarray(values, float)
    finite = array[np.isfinite(array)]
    if finite.size == 0:
        return [None] * array.size
    span = float(np.ptp(finite)) or abs(float(finite[0])) or 1.0
    decimals = 5 - math.floor(math.log10(span)) if span > 1e-300 else 0
    decimals = min(max(decimals - 1, 0), 300)
    return [None if not math.isfinite(value) else round(value, decimals) if decimals else
            float(round(value)) for value in array.tolist()]


def render(figure: Figure, backend: str, identifier: str, points: int = POINTS) -> Html:
    """Return the figure as a <figure> element, drawn by `backend` (one of BACKENDS)."""
    drawing: Html
    if backend == 'plotly':
        from engb_core.report.plotly_figure import plotly_div
        drawing = plotly_div(figure, identifier, points)
    elif backend == 'matplotlib':
        from engb_core.report.matplotlib_figure import matplotlib_svg
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
