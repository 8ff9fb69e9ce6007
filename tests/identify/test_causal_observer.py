# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The paper's causal observer: its low-pass, its lag, and the cure."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.identify.causal_observer import drive_velocity, observe_causally, pass_through_q
from engb_core.identify.paper_way import paper_way
from engb_core.identify.smoothing import motions
from engb_core.model import Model, Motor
from engb_core.recording import Signal

from .bench import PAPER, simulate, stroke_reference


@pytest.fixture(scope='module')
def recording():
    return simulate(stroke_reference(tops=[8.0, 14.0, 20.0]), noise=1e-3)


@pytest.mark.parametrize('order', [1, 2])
def test_the_low_pass_is_the_observers_own(order):
    """Without inertia and drag d̂ is −q∗u."""
    time = np.arange(800) * 1e-3
    torque = np.where(time > 0.1, 0.3, 0.0) + 0.1 * np.sin(40.0 * time)
    observer = DisturbanceObserver(Motor(inertia=1e-30, viscous_friction=0.0), 12.0, order)
    seen = -observer.filter(time, np.zeros_like(time), torque)
    assert pass_through_q(torque, 1e-3, observer) == pytest.approx(seen, abs=1e-12)


def gain(recording, start, **options):
    pieces = motions(recording)
    observed = [observe_causally(piece, start, recording, **options) for piece in pieces]
    return paper_way(pieces, start, observed=observed).friction.load_gain


def test_lag_takes_the_loads_slope_off_friction_and_delayed_position_gives_it_back(recording):
    start, true = Model(), PAPER['gain']
    late = [gain(recording, start, cutoff=cutoff) for cutoff in (20.0, 10.0, 5.0)]
    assert late[0] < true - 0.005
    assert late[2] < late[1] < late[0]
    for cutoff in (20.0, 5.0):
        cured = gain(recording, start, cutoff=cutoff, delayed=True)
        assert abs(cured - true) < 0.5 * abs(gain(recording, start, cutoff=cutoff) - true)


def test_what_the_node_published_is_taken_as_it_is(recording):
    piece, = motions(recording)
    start = Model()
    velocity = drive_velocity(recording, recording.time)
    same = Signal(recording.time, DisturbanceObserver(start.motor).filter(
        recording.time, velocity, recording.effort))
    published = replace(recording, signals={'disturbance': same})
    one = observe_causally(piece, start, recording)
    two = observe_causally(piece, start, published, published=True)
    assert two.disturbance == pytest.approx(one.disturbance, abs=1e-9)
    other = replace(recording, signals={'disturbance': Signal(
        same.time, np.zeros_like(same.value))})
    assert not observe_causally(piece, start, other, published=True).disturbance.any()
