# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Trajectories: symmetric strokes, speeds kept, files read or refused in one line."""

import numpy as np
import pytest

from engb_core.control.trajectory import (
    file_reference,
    identification_strokes,
    joined,
    slow_strokes,
    TrajectoryBuilder,
)
from engb_core.errors import InputError


def sampled(trajectory, step=1e-3):
    time = np.arange(0.0, trajectory.duration, step)
    return time, *trajectory.sample(time)


def test_position_velocity_and_acceleration_belong_together():
    time, position, velocity, acceleration = sampled(
        identification_strokes([10.0, 30.0], acceleration=50.0, stop=0.3, speed=20.0), 1e-4)
    assert np.allclose(np.gradient(position, time), velocity, atol=0.02)
    inside = np.abs(np.diff(acceleration, append=0.0)) < 1e-9
    assert np.allclose(np.gradient(velocity, time)[inside][1:], acceleration[inside][1:],
                       atol=30.0)
    assert np.abs(np.diff(position)).max() < 21.0 * 1e-4
    assert set(np.round(np.abs(acceleration), 6)) == {0.0, 50.0}


def test_strokes_are_symmetric_so_that_velocity_is_odd_over_position_mirrored():
    trajectory = identification_strokes([20.0], acceleration=60.0, stop=0.5)
    time = np.linspace(0.0, trajectory.duration, 2001)
    position, velocity, _ = trajectory.sample(time)
    assert np.allclose(position, position[::-1], atol=1e-9)
    assert np.allclose(velocity, -velocity[::-1], atol=1e-9)


def test_stop_sections_stand_still_and_all_amplitudes_are_reached():
    _, position, velocity, _ = sampled(identification_strokes([5.0, 15.0, 25.0], stop=0.4))
    standing = position[velocity == 0.0]
    for angle in (0.0, 5.0, 15.0, 25.0):
        assert np.sum(np.abs(standing - angle) < 1e-9) >= 350


def test_slow_strokes_run_at_the_asked_speeds():
    _, _, velocity, _ = sampled(slow_strokes(0.5, 3.0, [1.0, 4.0]))
    for speed in (1.0, 4.0):
        assert np.sum(np.abs(velocity - speed) < 1e-9) > 100
        assert np.sum(np.abs(velocity + speed) < 1e-9) > 100


def test_joined_parts_have_no_jump():
    _, position, _, _ = sampled(joined([slow_strokes(1.0, 3.0, [2.0]),
                                        identification_strokes([8.0])]))
    assert np.abs(np.diff(position)).max() < 0.05


def test_it_stands_still_before_and_after():
    trajectory = TrajectoryBuilder(2.0).move(5.0, 10.0).build()
    assert trajectory.at(-1.0) == (2.0, 0.0, 0.0)
    end = trajectory.at(trajectory.duration + 1.0)
    assert end.position == pytest.approx(5.0)
    assert (end.velocity, end.acceleration) == (0.0, 0.0)


def test_a_file_is_followed_without_overshoot(tmp_path):
    path = tmp_path / 'reference.csv'
    path.write_text('time,position\n0,0\n1,0\n1.2,10\n3,10\n')
    trajectory = file_reference(path)
    _, position, velocity, _ = sampled(trajectory)
    assert trajectory.duration == pytest.approx(3.0)
    assert position.min() >= -1e-9
    assert position.max() <= 10.0 + 1e-9
    assert velocity.min() >= -1e-6


@pytest.mark.parametrize(('text', 'told'), [
    ('time,angle\n0,0\n1,1\n', "no column 'position'"),
    ('time,position\n0,0\n', 'fewer than two rows'),
    ('time,position\n0,0\n1,nan\n', 'not finite'),
    ('time,position\n0,0\n1,x\n', 'line 3'),
    ('time,position\n0,0\n2,1\n1,1\n', 'line 4'),
    ('', "no column 'time'"),
])
def test_a_bad_file_is_refused_in_one_line(tmp_path, text, told):
    path = tmp_path / 'reference.csv'
    path.write_text(text)
    with pytest.raises(InputError, match=told) as caught:
        file_reference(path)
    assert 'reference.csv' in str(caught.value)
    assert '\n' not in str(caught.value)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match='cannot be read'):
        file_reference(tmp_path / 'none.csv')
