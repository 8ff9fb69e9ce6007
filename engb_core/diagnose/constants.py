"""The constants that decide what a diagnosis says, each with its unit, meaning and origin."""

from __future__ import annotations

__all__ = ['CLEAN_EXCESS', 'STANDS_OUT']

# Excess of the mean squared residual over the noise's 1 that a clean recording may show: how
# wrongly a level of noise is known (a deviation of 13 %), and what derivatives add to it. Loss: a
# false alarm on a clean recording.
CLEAN_EXCESS = 0.30
# An effect is no nearer to none than this many standard deviations of its size: level of 5 %.
STANDS_OUT = 2.0
