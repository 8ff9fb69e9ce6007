# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reports of what a diagnosis leaves out: no law's picture, no traces, no number at all."""

from dataclasses import replace
import sys

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import (
    Candidate,
    Interval,
    LawFinding,
    NominalChange,
    ParameterEstimate,
    ResidualOver,
    Zone,
)
from engb_core.report.figures import Axis, Figure, Line, log_ticks, Panel
from engb_core.report.layout import Page
from engb_core.report.page import diagnosis_page
from engb_core.report.pictures import close_up, residual_over, Units
from engb_core.report.render import backends
from engb_core.report.render.backends import best_backend, render
from engb_core.report.wording import zone_range

from .samples import empty, explained, partly, unexplained


def page(diagnosis, backend='table'):
    return diagnosis_page(diagnosis, backend=backend).html()


def test_a_number_that_is_not_determined_is_told_as_a_guess():
    diagnosis = explained()
    finding = diagnosis.effects[0]
    guess = replace(finding, parameters={'breakaway_ratio': ParameterEstimate(1.4, None, '-')})
    assert 'take the value as a guess' in page(replace(diagnosis, effects=(guess,)))
    assert 'take the value as a guess' not in page(diagnosis)


def test_numbers_that_explain_without_a_name_are_told_as_that():
    told = page(replace(empty(), effects=()))
    assert 'none of them stands out as the one that is off' in told
    assert 'Other numbers in the model explain the mismatch' in told
    assert 'no effect in the catalogue' not in told and 'know what this is' not in told


def test_of_numbers_that_explain_the_one_that_has_changed_most_is_told():
    changes = (NominalChange('inertia', 8.0e-5, 8.1e-5, 1e-7, 'kg·m²'),
               NominalChange('saturation_velocity', 0.8, 0.13, 0.01, 'rad/s'),
               NominalChange('load_gain', 0.1, 0.01, 0.2, '-'),
               NominalChange('coulomb', 0.01, 0.001, None, 'N·m'))
    diagnosis = empty()
    told = page(replace(diagnosis, effects=(), evidence=replace(diagnosis.evidence,
                                                                nominal=changes)))
    assert 'most of all: Saturation velocity, 0.80' in told
    assert 'none of them stands out' not in told


def test_what_is_left_without_words_and_coordinates_still_tells_its_share():
    diagnosis = unexplained()
    bare = replace(diagnosis.unexplained, statement='', depends_on=(), where=())
    text = page(replace(diagnosis, unexplained=bare))
    assert 'It holds 100' in text and 'It depends on' not in text
    assert 'It depends on' in page(diagnosis)


def test_a_law_without_picture_and_rivals_is_told_by_its_line():
    law = LawFinding('0.3 * load', 'a * load', 'torque',
                     {'a': ParameterEstimate(0.3, 0.01, '-')}, 'T = 0.30(1) · load',
                     'A torque that depends on the load.', (), True, 0.97, None)
    diagnosis = unexplained()
    text = page(replace(diagnosis, unexplained=replace(diagnosis.unexplained, law=law)))
    assert 'T = 0.30(1) · load' in text
    assert 'the law through it' not in text and 'Other ways to write' not in text


def test_a_diagnosis_without_traces_tells_where_in_words():
    diagnosis = partly()
    text = page(replace(diagnosis, evidence=replace(diagnosis.evidence, traces=())))
    assert 'Where it happens' in text and '% of the mismatch lies at' in text
    assert 'Close-up' not in text


def test_without_held_out_figures_the_closed_loop_stands_alone():
    diagnosis = explained()
    text = page(replace(diagnosis, held_out=()))
    assert 'How much better' in text and 'Root mean square errors' not in text


def test_a_rival_without_a_figure_is_told_without_why():
    diagnosis = explained()
    rivals = (replace(diagnosis.evidence.candidates[0]), Candidate(('backlash',), 0.1, np.nan,
                                                                   np.nan))
    text = page(replace(diagnosis, evidence=replace(diagnosis.evidence, candidates=rivals)))
    assert 'held-out error' not in text


# ---- pictures

def test_a_close_up_needs_samples():
    diagnosis = explained()
    trace, units = diagnosis.evidence.traces[0], Units(diagnosis)
    assert close_up(trace, Interval(trace.recording, 20.0, 20.5, 0.5), units) is not None
    assert close_up(trace, Interval(trace.recording, 900.0, 900.5, 0.5), units) is None


def picture(**curves):
    centre = np.linspace(0.0, 1.0, 5)
    given = {name: np.full(5, 0.1) for name in ('applying_before', 'releasing_before',
                                                'applying_after', 'releasing_after')}
    return ResidualOver('velocity', 'rad/s', centre, **{**given, **curves}, why='')


def names(shown, diagnosis):
    return [series.name for series in residual_over(shown, Units(diagnosis)).panels[0].series]


def test_directions_that_are_alike_are_one_curve_and_one_without_samples_none():
    diagnosis = explained()
    alike = names(picture(), diagnosis)
    assert not any('applying' in name for name in alike) and len(alike) == 3
    one_way = names(picture(releasing_before=np.full(5, np.nan),
                            releasing_after=np.full(5, np.nan)), diagnosis)
    assert all('releasing' not in name for name in one_way)
    assert sum('applying' in name for name in one_way) == 2


def test_without_a_known_noise_no_band_of_it_is_drawn():
    diagnosis = explained()
    silent = replace(diagnosis, evidence=replace(diagnosis.evidence, traces=tuple(
        replace(trace, noise_floor=np.nan) for trace in diagnosis.evidence.traces)))
    assert any('noise' in name for name in names(picture(), diagnosis))
    assert not any('noise' in name for name in names(picture(), silent))


@pytest.mark.parametrize(('values', 'ticks'), [
    ([], []), ([-1.0, 0.0, np.nan], []), ([1.0, 3.0], [1.0, 2.0]),
    ([1e-9, 1e9], [10.0 ** power for power in range(-9, 10, 3)]),
])
def test_ticks_of_an_axis_in_powers_of_ten(values, ticks):
    found, text = log_ticks([Line('a', np.array(values), np.array(values), 'before')], 'y')
    assert found == pytest.approx(ticks) and len(text) == len(ticks)


@pytest.mark.filterwarnings('ignore:Data has no positive values')
def test_limits_and_axes_without_ticks_are_drawn():
    pytest.importorskip('matplotlib')
    line = Line('a', np.array([1.0, 2.0]), np.array([0.0, -1.0]), 'before')    # nothing to log
    figure = Figure('a', Axis('x', 's', limits=(0.0, 9.0)), (Panel(
        Axis('y', 'N·m', log=True), (line,), 100),))
    drawn = str(render(figure, 'matplotlib', 'f'))
    assert '<svg' in drawn
    wide = str(render(replace(figure, x=replace(figure.x, limits=None)), 'matplotlib', 'f'))
    assert wide != drawn


def test_without_any_plotting_package_numbers_are_written(monkeypatch):
    for name in ('plotly.offline', 'matplotlib.backends.backend_svg'):
        monkeypatch.setitem(sys.modules, name, None)
    assert best_backend() == 'table' == backends.BACKENDS[-1]


# ---- pages and words

def test_folded_parts_are_opened_and_closed():
    made = Page('a')
    with pytest.raises(ValueError, match='no details are open'):
        made.end_details()
    made.begin_details('more')
    with pytest.raises(ValueError, match='details are still open'):
        made.html()
    made.end_details()
    assert '</details>' in made.html()


@pytest.mark.parametrize('chosen', [True, False])
def test_only_who_did_not_choose_it_is_told_that_plotly_is_missing(monkeypatch, chosen):
    pytest.importorskip('matplotlib')
    monkeypatch.setattr('engb_core.report.layout.best_backend', lambda: 'matplotlib')
    made = Page('a', backend='matplotlib') if chosen else Page('a')
    line = Line('a', np.array([1.0, 2.0]), np.array([0.0, 1.0]), 'before')
    made.figure(Figure('a', Axis('x', 's'), (Panel(Axis('y', 'N·m'), (line,), 100),)))
    assert ('pip install plotly' in made.html()) == (not chosen)


@pytest.mark.parametrize(('begin', 'end', 'text'), [
    (-np.inf, np.inf, 'velocity'), (2.0, np.inf, 'velocity above 2\u202frad/s'),
    (-np.inf, 150.0, 'velocity below 150\u202frad/s'),
    (100.0, 250.0, 'velocity 100 to 250\u202frad/s'),
])
def test_a_zone_may_be_open_at_either_end(begin, end, text):
    found = zone_range(Zone('velocity', begin, end, 'rad/s', 0.5))
    assert found.replace('speed', 'velocity') == text
