# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Figures: decimation that keeps what is seen, JSON without NaN, every renderer."""

from __future__ import annotations

import json

import numpy as np
import pytest

from engb_core.report.figures import (
    Axis,
    Band,
    Bars,
    decimate,
    Figure,
    Line,
    Panel,
    Points,
    rounded,
    Span,
)
from engb_core.report.render.backends import BACKENDS, render
from engb_core.report.render.plotly_figure import plotly_spec


def figure() -> Figure:
    x = np.linspace(0, 10, 5000)
    y = np.sin(x)
    y[1000:1500] = np.nan
    return Figure('A <title>', Axis('Time', 's'), (
        Panel(Axis('Torque', 'N·m'), (Line('recorded', x, y), Band('noise', x, y - 1, y + 1),
                                      Points('points', x, y, 'third')), zero=True),
        Panel(Axis('Speed', 'rad/s', limits=(-1, 1)), (Line('', x, -y, 'after', marker='up'),))),
        alt='what it shows', spans=(Span(1, 2, '1'),))


def test_decimation_keeps_peaks_ends_and_breaks():
    x = np.arange(100_000.0)
    y = np.zeros(x.size)
    y[54_321], y[7] = 9, -9
    y[30_000:40_000] = np.nan
    few_x, few_y = decimate(x, y, 400)
    assert few_x.size <= 402
    assert (few_x[0], few_x[-1]) == (0, x[-1])
    assert np.nanmax(few_y) == 9 and np.nanmin(few_y) == -9
    assert np.all(np.diff(few_x) > 0)
    inside = (few_x > 30_500) & (few_x < 39_500)
    assert inside.any() and np.isnan(few_y[inside]).all()


@pytest.mark.parametrize('size', [0, 1, 2, 3, 7, 399, 400, 401, 1203])
def test_decimation_of_any_size(size):
    x, y = decimate(np.arange(size), np.random.default_rng(size).normal(size=size), 400)
    assert x.size == y.size <= 402
    assert (size == 0) == (x.size == 0)


@pytest.mark.parametrize('values', [[], [np.nan, np.inf], [1.0], [0.0, 0.0], [1e-12, 2e-12],
                                    [1e300, -1e300], [123456.0, 123456.001], [5e-324, 0.0]])
def test_rounded_is_valid_json_and_close(values):
    out = rounded(values)
    json.dumps(out, allow_nan=False)
    span = np.ptp([value for value in values if np.isfinite(value)] or [0.0])
    for value, short in zip(values, out, strict=True):
        assert (short is None) == (not np.isfinite(value))
        if short is not None and span < 1e300:
            assert abs(value - short) <= max(span, abs(value)) * 1e-4 + 1e-300


def test_spec_has_one_x_axis_for_all_panels():
    spec = plotly_spec(figure(), 300)
    assert {trace['xaxis'] for trace in spec['data']} == {'x'}
    assert {trace['yaxis'] for trace in spec['data']} == {'y', 'y2'}
    assert spec['layout']['yaxis2']['domain'][0] == pytest.approx(0, abs=1e-9)
    json.dumps(spec, allow_nan=False)


@pytest.mark.parametrize('backend', BACKENDS)
def test_every_backend_draws(backend):
    html = render(figure(), backend, 'figure-1', 300)
    assert 'A &lt;title&gt;' in html and '<title>' not in html
    assert 'what it shows' in html
    bars = Figure('bars', Axis('recording'), (Panel(Axis('rms'), (
        Bars('before', ['a', 'b'], [1, np.nan], 'before', errors=[0.1, 0.2]),
        Bars('after', ['a', 'b'], [0.5, 1]))),))
    assert 'before' in render(bars, backend, 'figure-2')


def test_svg_follows_the_style_sheet_and_is_reproducible():
    first = render(figure(), 'matplotlib', 'figure-1')
    assert first == render(figure(), 'matplotlib', 'figure-1')
    assert 'var(--recorded)' in first and 'var(--before)' not in first
    assert 'http' not in first


def test_curves_break_where_the_shaft_stands():
    """The grid holds no values there: a straight line across looked like a measurement."""
    from dataclasses import replace

    from engb_core.report.pictures import overlay, Units

    from .samples import explained
    diagnosis = explained()
    trace = diagnosis.evidence.traces[0]
    gap = (trace.time < 2.0) | (trace.time > 3.0)
    shortened = replace(trace, channels={}, **{name: getattr(trace, name)[gap] for name in (
        'time', 'position', 'velocity', 'effort', 'predicted_before', 'predicted_after',
        'judged')})
    torque, residual, *_ = overlay(shortened, (), Units(diagnosis)).panels
    after_gap = int(np.flatnonzero(shortened.time > 3.0)[0])
    for panel in (torque, residual):
        for line in (entry for entry in panel.series if isinstance(entry, Line)):
            assert np.isnan(line.y[after_gap]), line.name
            assert np.isfinite(line.y[after_gap - 1])


def test_an_axis_in_powers_of_ten_has_whole_numbers_at_its_ticks():
    """Plotly writes 2 and 5 between the decades, which nobody reads as 0.2 and 0.5."""
    x = np.geomspace(0.03, 4.0, 50)
    figure = Figure('f', Axis('Speed', 'rad/s', log=True),
                    (Panel(Axis('Friction', 'N·m'), (Line('a', x, x),)),
                     Panel(Axis('Density', '', log=True), (Points('b', x, 1e-4 * x),))))
    layout = plotly_spec(figure, 100)['layout']
    assert layout['xaxis']['tickvals'] == pytest.approx([0.05, 0.1, 0.2, 0.5, 1.0, 2.0])
    assert layout['xaxis']['ticktext'] == ['0.05', '0.1', '0.2', '0.5', '1', '2']
    assert 'tickvals' not in layout['yaxis']
    assert set(layout['yaxis2']['ticktext']) >= {'1e-05', '0.0001'}
    assert len(layout['yaxis2']['ticktext']) <= 8
    drawn = render(figure, 'matplotlib', 'a', 100)
    assert '>0.5<' in str(drawn)


def test_ticks_of_a_low_panel_do_not_touch():
    """At worst as many as are asked for are drawn, of 12 pixels each."""
    layout = plotly_spec(Figure('f', Axis('Time', 's'), (
        Panel(Axis('Position', 'rad'), (Line('a', [0, 1], [0, 1]),), 80),)), 10)['layout']
    assert layout['yaxis']['nticks'] * 12 <= 80
