# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Waves are looked for up to the order that the motion lets be seen, whatever the machine."""

import numpy as np
import pytest

from engb_core.diagnose.search.orders import highest_order, leading_orders

TIME = np.arange(0.0, 20.0, 0.004)


def swept(stroke: float) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity of a shaft that goes to and fro over a stroke [rad]."""
    rate = 2.0 * np.pi * 0.2
    return 0.5 * stroke * np.sin(rate * TIME), 0.5 * stroke * rate * np.cos(rate * TIME)


def reached(velocity: np.ndarray, bandwidth: float = 60.0) -> np.ndarray:
    """Return the highest order that passes each sample below a bandwidth [Hz]."""
    return 2.0 * np.pi * bandwidth / np.maximum(np.abs(velocity), 1e-300)


@pytest.mark.parametrize(('stroke', 'order'), [
    (60.0, 7.0),      # a motor
    (1.5, 183.0),     # a joint behind a gear of 1:26
    (0.3, 900.0),
])
def test_a_motor_s_wave_is_found_before_and_behind_a_gear(stroke: float, order: float) -> None:
    position, velocity = swept(stroke)
    residual = np.sin(order * position) + 0.2 * np.random.default_rng(1).normal(size=TIME.size)
    highest = highest_order(position, velocity, 60.0)
    assert highest > order
    found = leading_orders(position, residual, np.ones(TIME.size), reached(velocity), 0.4, highest)
    assert found[0] == pytest.approx(order, rel=0.03)


def test_a_shaft_that_stands_shows_no_wave() -> None:
    still = np.zeros(TIME.size)
    assert highest_order(still, still, 60.0) == 0.0
    assert leading_orders(still, still, np.ones(TIME.size), reached(still), 0.4, 0.0) == []


def test_the_faster_it_turns_the_less_is_seen() -> None:
    position, velocity = swept(60.0)
    assert highest_order(2.0 * position, 2.0 * velocity, 60.0) == pytest.approx(
        0.5 * highest_order(position, velocity, 60.0))


def test_no_order_is_named_that_the_sampling_folds_back():
    """A shaft that turns on steadily and is sampled 40 times a turn shows order 6 as 46 and 34 as
    well; beside it a short slow stroke reaches those orders, and holds none of them."""
    rate = 2.0 * np.pi * 178.0 / 40.0
    times = np.arange(1000) / 178.0 + np.random.default_rng(2).uniform(0.0, 1e-3, 1000)
    turning = rate * times
    slow = 3.0 + 0.4 * np.sin(2.0 * np.pi * 0.3 * times)
    velocity = np.concatenate([np.full(1000, rate), np.gradient(slow, times)])
    position = np.concatenate([turning, slow])
    residual = np.concatenate([np.sin(6.0 * turning + 1.0), np.sin(6.0 * slow + 1.0)])
    residual += 0.1 * np.random.default_rng(3).normal(size=residual.size)
    highest = highest_order(slow, velocity[1000:], 35.0)
    assert highest > 46.0
    found = leading_orders(position, residual, np.ones(2000), reached(velocity, 35.0), 0.4,
                           highest)
    assert found[0] == pytest.approx(6.0, rel=0.01)
    assert all(order < 20.0 for order in found)
