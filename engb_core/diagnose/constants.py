# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The constants that decide what a diagnosis says: unit, meaning and origin of each.

Levels and excesses are of the mean squared residual in units of the noise's (noise = 1); an
excess is what a level has above 1. Origin is one of: a *test* (level of significance), a *loss*
(what one error costs against the other), a *prior* (how common something is), *counted* (set by
how often it was right on generated cases; to be replaced by a score on what was left out), a
*level* (of a statement; any other may be asked for).
Constants of a search (starts, rounds, companions) only cost time, and stand where they are used.
"""

from __future__ import annotations

__all__ = ['ALL_BUT', 'AT_MOST', 'BESIDE', 'BESIDE_EFFECTS', 'BESIDE_LEAVES', 'BESIDE_LOAD',
           'BETTER', 'CLEAN_EXCESS', 'COLOURED', 'CONTAINING', 'CONTAINING_PART', 'FALSE_PART',
           'FORMULA_ERROR', 'FORMULA_MISSES', 'FORMULA_TAILS', 'HELD_LEFT', 'HELD_LOSS',
           'HELD_RISE', 'INSISTED', 'INSISTED_PART', 'KNOWN_ODDS', 'LINE_LEVEL', 'MOST_NOISE',
           'NAMED_PART', 'NAMELESS_PRICE', 'NEXT_TO_NOTHING', 'NO_SIGN',
           'NUMBERS_SUFFICE', 'NUMBER_BONUS', 'OF_NEXT', 'OTHERS_TAKE', 'PARAMETER_PRICE',
           'PHYSICS_FOR_NUMBER', 'REFITTED', 'SECOND', 'SET_LEVEL', 'SHARPNESS', 'STANDING_PART',
           'STANDS_BETTER', 'STANDS_BETTER_PART', 'STANDS_OUT', 'TABLE_WORTH', 'TAKEN_LEAST',
           'TAKEN_MUCH', 'TAKEN_PART', 'TEMPER', 'TWO_LEAVE', 'TWO_LEAVE_PART', 'UNNAMED',
           'WITHOUT_TWO']

# -- is there anything? ---------------------------------------------------------------------------

# Chance with which noise alone has a line over the angle that widens the comparison. Test: 1 %.
LINE_LEVEL = 0.01
# Excess that a clean recording may show: how wrongly a level of noise is known (a deviation of
# 13 %), and what derivatives add to it. Loss: a false alarm on a clean recording. It is also the
# discrepancy that may be there unseen (discrepancy.py).
CLEAN_EXCESS = 0.30
# The excess up to which what a fit leaves may be noise, if it has no colour: as much again as the
# noise is thought to be. Loss: beyond that something is wrong that should be told.
MOST_NOISE = 1.0
# Chance of taking noise for coloured. Test: 1 %.
COLOURED = 0.01
# An effect is no nearer to none than this many standard deviations of its size. Test: 5 %.
STANDS_OUT = 2.0

# -- which of several fits? -----------------------------------------------------------------------

# Part of what the simpler effect leaves that one which contains it must take away. Counted.
CONTAINING_PART = 0.30
# Log mean square by which one wrong number may fit worse than physics and is preferred. Prior:
# numbers are wrong more often than physics is missing.
NUMBER_BONUS = 0.01
# Log mean square by which a description without a name must fit better than physics. Loss: a
# description predicts worse where nothing was recorded.
NAMELESS_PRICE = 0.2
# Log mean square that each fitted parameter must take away: a criterion of information for some
# 250 independent values. Test.
PARAMETER_PRICE = 0.004

# -- how sure? ------------------------------------------------------------------------------------

# Excess, as a part of the noise, below which rivals are told apart no further: the noise-like part
# of a formula's error. Counted.
FORMULA_ERROR = 0.10
# Weight of a rival: the ratio of excesses to this power, half the number of independent values
# that the residual of a nearly right formula is worth. Counted.
TEMPER = 6.0
# How much rarer a cause is beforehand, where it fits no better: one without a name; physics that
# looks like one wrong number; an effect that contains the chosen one and would have shown more.
# Priors.
UNNAMED, PHYSICS_FOR_NUMBER, CONTAINING = 0.15, 0.08, 0.03
# Odds beforehand that what a file misses is physics of the library: of four causes on a machine
# one is something that nobody wrote down. Prior.
KNOWN_ODDS = 3.0
# Root mean square that another formulation of the same physics leaves, as a part of the torque
# that it makes up: scale of a Student distribution of so many degrees of freedom (heavy tails: now
# and then a formula is far off). Prior.
FORMULA_MISSES, FORMULA_TAILS = 0.2, 4.0

# Part of the cases whose true causes lie in the sets of causes (cause_sets.py), unless another one
# is asked for. Level.
SET_LEVEL = 0.9

# -- is it named at all? --------------------------------------------------------------------------

# Part of all that can be explained which named effects must account for. Loss: a wrong name is
# worse than none. Counted.
NAMED_PART = 0.62
# Part of the excess that a description without a name must take away to be kept. Loss: it predicts
# worse elsewhere.
TABLE_WORTH = 0.1

# -- which number is wrong? -----------------------------------------------------------------------

# Rise of the level at which a held number counts as insisted upon (as CLEAN_EXCESS), and the part
# of the file's whole excess that it must be. Loss.
INSISTED, INSISTED_PART = 0.25, 0.05
# What a refit is seen to have held need rise no more than this multiple of what the effects leave.
# Counted.
HELD_LEFT = 5.0
# Beside effects the whole is no more than this multiple of the excess that refitted numbers leave.
# Counted.
BESIDE_EFFECTS = 2.0
# Where no one or two numbers make the file fit, and no refit is seen to have held one, the data
# insist on the wrong one by this rise at least; others that they insist on by this part of it may
# be it instead, weighed by the ratio to this power. Counted.
NO_SIGN, SECOND, SHARPNESS = 1.0, 0.75, 6.0
# Excess that refitted numbers leave where no physics is missing. Counted.
NUMBERS_SUFFICE = 1.0
# Two wrong numbers leave no more than this level, or where no refit is seen this part of what the
# lesser one matters: any two of a refitted file leave more, since its others have moved as well.
# Counted.
TWO_LEAVE, TWO_LEAVE_PART = 0.03, 0.05
# A file whose excess is within this multiple of what any numbers leave without the effects was
# refitted around them. Counted: of 129 that fitted within half as much again, 1 of 94 refitted
# ones lay above, 9 of 35 others.
REFITTED = 1.25
# Beside effects a wrong number must matter as much as this part of what the file loses to refitted
# numbers, and the file's other numbers may cost this part of what it matters. Counted.
BESIDE, BESIDE_LEAVES = 0.5, 0.15
# Parts of the file's sum of squares that the free numbers take away, in units of the noise's: at
# least so many times that and so much of the whole; beside effects that make up most of it, so
# many times. Counted.
TAKEN_LEAST, TAKEN_PART, TAKEN_MUCH = 1.0, 0.15, 5.0
# Part of all that is taken which the others take without the number that was held, at most; next
# to nothing, without two that were held, or where effects make up most of what the file misses;
# somewhat more, if no two were held, and so little a part of what they take without any other
# number. Counted.
OTHERS_TAKE, AT_MOST, OF_NEXT, NEXT_TO_NOTHING = 0.2, 0.3, 0.6, 0.05
# What part they may take without two, where numbers alone make up for all but so much. Counted.
WITHOUT_TWO, ALL_BUT = 0.1, 0.1

# -- what moved the load curve? -------------------------------------------------------------------

# Beside effects a moved load curve must matter as much as this part of what the file loses, or of
# what refitted numbers leave; held by a refit of the file, it must raise the level by this part.
# Counted.
BESIDE_LOAD, HELD_RISE = 0.2, 0.45
# With the file's load curve held a fit may be this much worse, in units of the noise, and is
# preferred all the same. Prior: files are right more often than not.
HELD_LOSS = 0.12
# By this much in the log mean square two causes must fit better than one, or than two others.
# Test, as PARAMETER_PRICE for some parameters.
BETTER = 0.03
# Part of what a moved load curve gains that the file's other numbers may cost where they stand.
# Counted.
STANDING_PART = 0.1
# How much better a hypothesis must fit with the file's numbers as they stand than what was chosen:
# in units of the noise, and as a part of what the file misses, since no formula is perfect. Loss.
STANDS_BETTER, STANDS_BETTER_PART = 0.1, 0.02

# -- where? ---------------------------------------------------------------------------------------

# Expected part of the blocks in which a mismatch is told that hold none, at most. Level.
FALSE_PART = 0.1
