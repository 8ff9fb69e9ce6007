# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Pictures as plain data; a renderer (`render/`) turns them into plotly, SVG or a table.

A `Figure` is a stack of panels over one x axis, so that zooming one panel moves all. Colours are
roles ('recorded', 'before', 'after', …) that the page's style sheet gives a value, in light and
in dark.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ['Axis', 'Band', 'Bars', 'Figure', 'Line', 'POINTS', 'Panel', 'Points', 'Series', 'Span',
           'decimate', 'log_ticks', 'rounded']

Array = NDArray[np.float64]

# Points drawn of one series: min and max of about a thousand stretches, finer than a screen.
POINTS = 2000
# Ticks on an axis in powers of ten, at most about.
_MOST_TICKS = 8


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


def log_ticks(series: Sequence[Series], side: str) -> tuple[list[float], list[str]]:
    """Return places of ticks on an axis in powers of ten that shows lines and points, and their
    text; `side` is the axis, 'x' or 'y'.

    1, 2 and 5 of each decade, or only every so many decades where those would be too many.
    """
    joined = np.concatenate([np.ravel(np.asarray(getattr(entry, side), float)) for entry in series
                             if isinstance(entry, Line | Points)] or [np.array([])])
    joined = joined[np.isfinite(joined) & (joined > 0.0)]
    if not joined.size:
        return [], []
    low, high = float(joined.min()), float(joined.max())
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    steps = (1.0, 2.0, 5.0) if last - first <= _MOST_TICKS // 2 - 1 else (1.0,)
    stride = max(1, math.ceil((last - first) / _MOST_TICKS))
    ticks = [step * 10.0 ** decade for decade in range(first, last + 1, stride) for step in steps]
    if len(steps) > 1:
        # Beyond the data they would widen the axis.
        ticks = [tick for tick in ticks if low * (1.0 - 1e-9) <= tick <= high * (1.0 + 1e-9)]
    return ticks, [f'{tick:g}' for tick in ticks]


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
