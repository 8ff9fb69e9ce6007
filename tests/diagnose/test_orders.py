# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Waves are looked for up to the order that the motion lets be seen, whatever the machine."""

import numpy as np
import pytest

from engb_core.diagnose.orders import highest_order, leading_orders

TIME = np.arange(0.0, 20.0, 0.004)


def swept(stroke: float) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity of a shaft that goes to and fro over a stroke [rad]."""
    rate = 2.0 * np.pi * 0.2
    return 0.5 * stroke * np.sin(rate * TIME), 0.5 * stroke * rate * np.cos(rate * TIME)


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
    found = leading_orders(position, residual, np.ones(TIME.size), 0.4, highest)
    assert found[0] == pytest.approx(order, rel=0.03)


def test_a_shaft_that_stands_shows_no_wave() -> None:
    still = np.zeros(TIME.size)
    assert highest_order(still, still, 60.0) == 0.0
    assert leading_orders(still, still, np.ones(TIME.size), 0.4, 0.0) == []


def test_the_faster_it_turns_the_less_is_seen() -> None:
    position, velocity = swept(60.0)
    assert highest_order(2.0 * position, 2.0 * velocity, 60.0) == pytest.approx(
        0.5 * highest_order(position, velocity, 60.0))
