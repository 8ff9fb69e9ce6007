# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The kernel: exact on what a brake does, the same for both sides, honest about holes."""

import numpy as np
import pytest

from engb_core.identify.confidence import coloured_covariance
from engb_core.identify.smoothing import Kernel, motions
from engb_core.identify.strokes import find_strokes
from engb_core.recording import Recording

from .bench import simulate, stroke_reference


def test_kernel_differentiates_a_parabola_exactly():
    kernel = Kernel.for_bandwidth(20.0, 1e-3)
    time = np.arange(400) * 1e-3
    inner = slice(kernel.half, -kernel.half)
    path = 2.0 + 3.0 * time + 20.0 * time**2
    assert kernel.apply(path, 1)[inner] == pytest.approx((3.0 + 40.0 * time)[inner])
    assert kernel.apply(path, 2)[inner] == pytest.approx(np.full(400, 40.0)[inner])


def test_kernel_has_its_half_power_point_where_it_says():
    kernel = Kernel.for_bandwidth(20.0, 1e-3)
    wave = np.exp(-2j * np.pi * 20.0 * np.arange(-kernel.half, kernel.half + 1) * 1e-3)
    assert abs(kernel.taps() @ wave) == pytest.approx(np.sqrt(0.5), rel=0.01)


def test_smooth_is_the_kernel_at_the_rows():
    recording = simulate(stroke_reference(count=1))
    motion, = motions(recording)
    assert motion.smooth(motion.effort) == pytest.approx(
        motion.kernel.apply(motion.effort)[motion.rows])


def test_holes_part_or_mask_a_recording():
    time = np.arange(4000) * 1e-3
    keep = (time < 1.0) | (time > 1.05)
    keep &= (time < 2.0) | (time > 2.6)
    wave = np.sin(6 * time)
    pieces = motions(Recording.from_samples('holed', time[keep], wave[keep], wave[keep]))
    assert len(pieces) == 2
    assert not pieces[0].known[1010:1040].any()
    used = pieces[0].time[pieces[0].rows]
    assert not ((used > 0.98) & (used < 1.07)).any()


def test_strokes_are_found_whatever_stands_between():
    recording = simulate(stroke_reference(tops=[20.0, 8.0, 14.0]))
    motion, = motions(recording)
    strokes = find_strokes([motion])
    assert [round(motion.position[stroke.clamp].max()) for stroke in strokes] == [20, 8, 14]
    for stroke in strokes:
        assert (motion.smooth_velocity[stroke.clamp] > 0).all()
        assert (motion.smooth_velocity[stroke.release] < 0).all()


def test_covariance_knows_the_residuals_colour():
    rng = np.random.default_rng(5)
    size = 800
    design = np.column_stack([np.ones(size), np.linspace(-1, 1, size)])
    draws, claimed = [], []
    for _ in range(60):
        noise = np.empty(size)
        noise[0] = rng.normal()
        for k in range(1, size):
            noise[k] = 0.8 * noise[k - 1] + rng.normal()
        found = np.linalg.lstsq(design, noise, rcond=None)[0]
        covariance, _ = coloured_covariance(design, noise - design @ found, np.arange(size))
        draws.append(found)
        claimed.append(np.diag(covariance))
    ratio = np.mean(claimed, axis=0) / np.var(draws, axis=0)
    assert (ratio > 0.6).all()
    assert (ratio < 1.7).all()
