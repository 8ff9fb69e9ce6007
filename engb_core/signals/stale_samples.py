# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Samples that a bus told twice: all of the one before, though the shaft has moved on.

A master that polls faster than the drive answers, or a message that comes late, leaves the old
values standing under a new stamp. A shaft that passes several counts a sample before and
afterwards does not stand between them, and noise does not come twice to the last digit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from engb_core.recording import Recording
from engb_core.signals.count_edges import quantum_of

__all__ = ['stale_samples']

# From more than so many counts a sample on a shaft moves whatever the counts round off.
SEVERAL = 2.0
# Chance of taking coarse values that happen to be equal for one that was told twice.
CHANCE = 0.01


def stale_samples(recording: Recording) -> NDArray[np.bool_]:
    """Return which samples (n,) are the one before told once more.

    Where the shaft passes several counts a sample it shows which are, and how many in a hundred.
    If at other speeds about as many are equal to the one before, these are stale as well; where
    more are, most of them are equal because nothing changes there.
    """
    position, effort = recording.position, recording.effort
    stands, equal = np.diff(position) == 0.0, np.diff(effort) == 0.0
    same = stands & equal
    if recording.velocity is not None:
        same &= np.diff(recording.velocity) == 0.0
    # Values of the position one after the other, how often each is told once more, and how often
    # all else is as well.
    begins = np.flatnonzero(np.append(True, ~stands))
    several = np.abs(np.diff(position[begins])) > SEVERAL * quantum_of(position)
    passed = np.append(False, several) & np.append(several, False)
    again = np.diff(np.append(begins, position.size)) - 1
    all_again = np.add.reduceat(np.append(False, same).astype(int), begins)
    stale = passed & (again > 0) & (all_again == again)
    by_chance = float(np.mean(equal[~stands])) if not stands.all() else 1.0
    found = np.zeros(position.size, bool)
    if not stale.any() or binom.sf(
            int(stale.sum()) - 1, int(np.sum(passed & (again > 0))), by_chance) > CHANCE:
        return found
    usual = float(np.sum(again[stale]) / np.sum((again + 1)[stale | (passed & (again == 0))]))
    shown = np.repeat(stale, again + 1)
    elsewhere = np.append(False, same) & ~shown
    found = shown.copy()
    found[begins] = False
    if usual * int(np.sum(~shown)) >= 0.5 * int(np.sum(elsewhere)):
        found |= elsewhere
    return found
