# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What position counts take off the inertia."""

import numpy as np
import pytest

from engb_core.identify.attenuation import attenuation, below_the_counts
from engb_core.identify.procedure import identify
from engb_core.identify.smoothing import BANDWIDTH, motions, moving_pieces

from .bench import PAPER, simulate, stroke_reference


def slow_strokes(counts, seed=0):
    tops = np.random.default_rng(seed).uniform(12.0, 20.0, 4).tolist()
    return simulate(stroke_reference(tops=tops, acceleration=60.0), seed=seed, noise=1e-3,
                    counts=counts)


@pytest.mark.parametrize('counts', (512, 1024))
def test_coarse_counts_take_nothing_off_the_inertia(counts):
    """At 20 Hz it came out a quarter too small with 512 counts a turn, and a deviation of 2 %."""
    found = [identify([slow_strokes(counts, seed)]).estimates['inertia'] for seed in range(2)]
    off = [entry.value / PAPER['inertia'] - 1.0 for entry in found]
    assert np.mean(off) == pytest.approx(0.0, abs=0.04)
    assert all(abs(entry.value - PAPER['inertia']) < 4.5 * entry.std for entry in found)


def test_what_counts_take_off_is_foretold():
    recording = slow_strokes(512)
    pieces = motions(recording)
    truth = slow_strokes(2 ** 20)
    fine = motions(truth)
    assert 0.15 < attenuation(pieces, 3) < 0.3
    assert attenuation(fine, 3) < 1e-6


def test_fine_counts_leave_the_bandwidth_as_it_is():
    fine, coarse = ([slow_strokes(counts)] for counts in (65536, 512))
    pieces = moving_pieces(fine)
    assert below_the_counts(fine, pieces, 3) is pieces
    slower = below_the_counts(coarse, moving_pieces(coarse), 3)
    assert all(piece.bandwidth < 0.5 * BANDWIDTH for piece in slower)
