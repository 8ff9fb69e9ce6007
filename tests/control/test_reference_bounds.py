# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A trajectory that the brake could not follow is refused before anything moves."""

import math

import numpy as np
import pytest

from control.supervised import BRAKE, GAINS
from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings
from engb_core.control.loop import LoopSettings
from engb_core.control.reference import ReferenceSettings
from engb_core.control.supervisor_settings import SupervisorSettings
from engb_core.control.trajectory import file_reference, identification_strokes
from engb_core.errors import InputError


def controller(reference, **settings):
    return BrakeController(BRAKE, ControllerSettings(
        LoopSettings(GAINS), reference, **{'position_max': 40.0, **settings}))


def with_file(folder, text, **settings):
    path = folder / 'reference.csv'
    path.write_text('time,position\n' + text)
    return controller(ReferenceSettings(kind='file', file=str(path)), **settings)


@pytest.mark.parametrize(('text', 'told'), [
    ('0,0\n2,60\n10,60\n', 'line 3: 60 rad lies beyond position_max, 40 rad; change the row'),
    ('0,0\n\n2,20\n3,-7\n', 'line 5: -7 rad lies beyond position_min, -5 rad; change the row'),
    ('0,0\n0.001,39\n5,39\n', 'the move to line 3 takes .* rad/s, and this brake can follow 209'),
    ('0,0\n0.1,30\n', 'the move to line 3 takes 300 rad/s'),
    ('0,0\n1,5\n1.05,20\n2,20\n', 'the move to line 4 takes'),
    ('0,0\n1e300,5\n', r'line 3 comes 1e\+300 s after the first row; .* give time in seconds'),
    ('0,0\n1000,5\n90000,6\n200000,7\n', 'line 4 comes 9e[+]04 s after the first row'),
])
def test_a_file_that_the_brake_could_not_follow_is_refused_in_one_line(tmp_path, text, told):
    with pytest.raises(InputError, match=told) as caught:
        with_file(tmp_path, text)
    assert str(tmp_path / 'reference.csv') in str(caught.value)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('text', [
    '0,0\n2,40\n10,-5\n', '5,0\n5.4,36\n6,36\n', '0,0\n0.2,38\n', '0,1\n86400,1\n'])
def test_a_file_that_it_can_follow_is_taken(tmp_path, text):
    with_file(tmp_path, text)


def test_the_bounds_are_those_of_this_brake(tmp_path):
    text = '0,0\n0.2,30\n'   # 150 rad/s
    with_file(tmp_path, text)
    for weaker in ({'effort_limit': 0.3}, {'largest_error': 0.5}, {'largest_speed': 100.0}):
        with pytest.raises(InputError, match='the move to line 3 takes 150 rad/s'):
            with_file(tmp_path, text, supervisor=SupervisorSettings(**weaker))
    with pytest.raises(InputError, match='position_max, 29 rad'):
        with_file(tmp_path, text, position_max=29.0)


@pytest.mark.parametrize(('changes', 'told'), [
    ({'amplitudes': (12.0, 60.0)}, 'stroke_amplitudes: 60 rad lies beyond position_max, 40 rad'),
    ({'slow_range': (-8.0, 3.0)}, 'slow_range: -8 rad lies beyond position_min'),
    ({'acceleration': 5000.0}, 'the identification strokes take 424.3 rad/s, and this brake'),
])
def test_strokes_that_it_could_not_follow_are_refused(changes, told):
    with pytest.raises(InputError, match=told):
        controller(ReferenceSettings(kind='strokes', **changes))


def test_strokes_of_another_range_harm_nobody_who_follows_commands():
    controller(ReferenceSettings(amplitudes=(60.0,)))
    controller(ReferenceSettings(kind='strokes', slow_speeds=(), slow_range=(-8.0, 3.0)))


def test_top_speeds_are_those_of_the_motion(tmp_path):
    path = tmp_path / 'reference.csv'
    path.write_text('time,position\n0,0\n1,5\n1.5,20\n3,18\n4,18\n')
    for made in (file_reference(path), identification_strokes([12.0, 30.0], 80.0, 0.2)):
        time = np.linspace(0.0, made.duration, 200_001)
        highest = np.abs(made.sample(time)[1]).max()
        assert max(made.top_speeds()) == pytest.approx(highest, rel=1e-3)
    assert max(identification_strokes([30.0], 80.0, 0.2).top_speeds()) == pytest.approx(
        math.sqrt(30.0 * 80.0))
