# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The constants that decide what a diagnosis says: unit, meaning and origin of each.

Levels and excesses are of the mean squared residual in units of the noise's (noise = 1); an
excess is what a level has above 1. Origin is one of: a *test* (level of significance), a *loss*
(what one error costs against the other), a *prior* (how common something is), a *level* (of a
statement; any other may be asked for). None is counted on cases.
Constants of a search (starts, rounds, companions) only cost time, and stand where they are used.
What means the same is the same constant.
"""

from __future__ import annotations

__all__ = ['CHANCE', 'CLEAN_EXCESS', 'CONTAINING', 'DAMPED_BELOW', 'EDGE', 'FALSE_PART',
           'FORMULA_ERROR', 'FORMULA_MISSES', 'FORMULA_TAILS', 'KNOWN_ODDS', 'LARGER_PART',
           'LEAST_FRACTION', 'LEAST_PROBABILITY', 'MEASURED', 'MOST_FRACTION', 'MOST_NOISE',
           'NAMELESS_PRICE', 'PARAMETER_PRICE', 'PHYSICS_FOR_NUMBER', 'REPEATS', 'SET_LEVEL',
           'STANDS_OUT', 'SURE', 'UNNAMED', 'WORTH_PART']

# -- is there anything? ---------------------------------------------------------------------------

# Chance [-] of taking noise for more than that: a line over the angle, a colour, the scatter among
# recordings. Test: 1 %.
CHANCE = 0.01
# Excess that a clean recording may show, and rise of a level that means nothing: how wrongly a
# level of noise is known (a deviation of 13 %), and what derivatives add to it. Loss: a false
# alarm on a clean recording. It is also the discrepancy that may be there unseen (discrepancy.py).
CLEAN_EXCESS = 0.30
# The excess up to which what a fit leaves may be noise, if it has no colour: as much again as the
# noise is thought to be. Loss: beyond that something is wrong that should be told.
MOST_NOISE = 1.0
# An effect is no nearer to none than this many standard deviations of its size, and two values
# that agree are no farther apart. Test: 5 %.
STANDS_OUT = 2.0
# Part [-] of the range of a parameter from which on it is driven to the end of what it can be, and
# stands for something else. Prior.
EDGE = 0.97

# -- which of several fits? -----------------------------------------------------------------------

# Log mean square by which a description without a name must fit better than physics. Loss: a
# description predicts worse where nothing was recorded.
NAMELESS_PRICE = 0.2
# Log mean square that each fitted parameter must take away, and what one nat of odds beforehand is
# worth: Akaike's criterion, 2/n, for some n = 500 independent values. Test.
PARAMETER_PRICE = 0.004
# Part [-] of a mean square that a richer model must take away to be worth having: the first of the
# effects of the excess, all else of what no fit has seen. Loss: it predicts worse elsewhere.
WORTH_PART = 0.1
# Part [-] of a whole that decides, where nothing speaks for more or less: the larger part of a
# mismatch, a name that is likelier right than wrong, numbers most of which are off. Loss: both
# errors cost the same.
LARGER_PART = 0.5

# -- how sure? ------------------------------------------------------------------------------------

# Root mean square [-] that the right formulas leave, and excess below which fits are told apart no
# further: this part of the noise's mean square, and this part of the torque (its square, of the
# mean square). Prior.
FORMULA_ERROR = 0.10
# How much rarer a cause is beforehand [-], where it fits no better: one without a name; physics
# that looks like one wrong number; an effect that contains the chosen one and would have shown
# more. Priors.
UNNAMED, PHYSICS_FOR_NUMBER, CONTAINING = 0.15, 0.08, 0.03
# Odds beforehand [-] that what a file misses is physics of the library: of four causes on a
# machine one is something that nobody wrote down. Prior.
KNOWN_ODDS = 3.0
# Root mean square that another formulation of the same physics leaves, as a part of the torque
# that it makes up [-]: scale of a Student distribution of so many degrees of freedom (heavy tails:
# now and then a formula is far off). Prior. It is also how far a refit by another measure may lie
# from the minimum (held_parameters.py), and, squared, the part of a whole mismatch that a further
# effect or a wrong number must be to be more than what other formulas miss (selection.py).
FORMULA_MISSES, FORMULA_TAILS = 0.2, 4.0
# Part of the cases [-] whose true causes lie in the sets of causes (cause_sets.py), unless another
# one is asked for. Level.
SET_LEVEL = 0.9

# -- is it named at all? --------------------------------------------------------------------------

# Probability [-] below which a name is not given, but as an alternative of another (findings.py).
# Loss: it is surer to be wrong than it is worth.
LEAST_PROBABILITY = 0.05
# Probability [-] from which on a finding is sure, and what is doubtful may be a makeshift for its
# details. Loss: a name that is not there costs twice one that is not given.
SURE = 2.0 / 3.0

# -- of one effect alone --------------------------------------------------------------------------

# Relative deviation [-] of numbers that come from masses and lengths, at best. Prior.
MEASURED = 0.01
# How often a wave must repeat along the stroke to be told from what stands in some places once,
# the form of the load curve (waves.py). Prior.
REPEATS = 5.0
# Parts [-] of the inertia that a shaft which rings has beyond it, unless it is lightly damped and
# within the band: less is no shaft's resonance, more only smooths what the motor's acceleration
# holds of noise and timing; and part of the band from which on one at the bound of its damping
# smooths noise (wide_band.py). Priors.
LEAST_FRACTION, MOST_FRACTION, DAMPED_BELOW = 0.15, 0.7, 0.6

# -- where? ---------------------------------------------------------------------------------------

# Expected part [-] of the blocks in which a mismatch is told that hold none, at most. Level.
FALSE_PART = 0.1
