# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Nominal numbers between a refit and the file: Bayesian model averaging by spike and slab.

A refit moves every number a little, and on another motion each of these moves costs. A number is
either as in the file (the spike) or anywhere about it (the slab: the file's own spread), the one
as likely beforehand as the other. How likely each choice of numbers that stand is after the data
follows from the posterior density at the file's values over the prior density there, the
Savage-Dickey ratio (Dickey, Annals of Mathematical Statistics 42 (1971) 204). Where the data do
not settle the choice, none is made: what is told is the mean over all choices, each weighted by
its probability (Hoeting, Madigan, Raftery and Volinsky, Statistical Science 14 (1999) 382). A
file that was refitted around what was missing has its numbers far from what they are beside it,
and none of them weighs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import LARGER_PART
from engb_core.diagnose.formula import no_more
from engb_core.diagnose.nominal import DELAY, SHAPE_NUMBERS
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.uncertainty import (
    noise_covariance,
    reported_covariance,
    vector_covariance,
)

__all__ = ['machine_vector', 'predicting_vector', 'standing', 'with_averaged_numbers']

Array = NDArray[np.float64]

# Parts of the way to the mean that are tried; derivatives that hold for none of them tell no mean.
PARTS = (1.0, 0.5, 0.25, 0.125, 0.0625)


def with_averaged_numbers(fitter: Fitter, fit: Fit, free: tuple[str, ...] = ()) -> Fit:
    """Return a finished fit at the mean of the machine's numbers over which of the file's stand;
    the numbers named in `free` do not."""
    return fitter.finish(_at_mean(fitter, fit, vector_covariance(fit, fitter), free))


def machine_vector(fitter: Fitter, fit: Fit) -> Array:
    """Return the vector (size,) of `with_averaged_numbers`."""
    return _at_mean(fitter, fit, vector_covariance(fit, fitter)).vector


def predicting_vector(fitter: Fitter, fit: Fit) -> Array:
    """Return the mean (size,) of the vector that predicts best over which of the file's numbers
    stand. With formulas that are only nearly right the numbers that fit best do: how far from
    these the machine's may lie says nothing of them, and noise alone makes them unsure."""
    return _at_mean(fitter, fit, noise_covariance(fit, fitter)).vector


def standing(fitter: Fitter, fit: Fit, free: tuple[str, ...] = ()) -> Array:
    """Return how likely each number (numbers,) of a finished fit is as in the file, given all that
    may put it elsewhere: noise, discrepancy and other formulas of the effects. Those named in
    `free`, and what no file tells, are not."""
    weighed = _Weighed.of(fit, reported_covariance(fit, fitter), free)
    kept = np.zeros(len(fit.hypothesis.numbers))
    for weight, choice in zip(weighed.weights, weighed.choices, strict=True):
        kept[list(choice.kept)] += weight
    return kept


@dataclass(frozen=True)
class _Weighed:
    """All choices of numbers that are as in the file, with their weights (choices,); the file's
    vector (size,), and the unit (size,) that the choices' means are in, about the file."""

    choices: list[_Choice]
    weights: Array
    file: Array
    scale: Array

    @classmethod
    def of(cls, fit: Fit, covariance: Array, free: tuple[str, ...]) -> _Weighed:
        numbers = fit.hypothesis.numbers
        count = len(numbers)
        # In units of what the file is believed to: the slab's density at the file is that of 0.
        scale = np.ones(fit.vector.size)
        scale[:count] = [number.spread for number in numbers]
        covariance = covariance / np.outer(scale, scale)
        # What the file says of the numbers counts beside what the recordings do.
        told = covariance[:, :count]
        covariance = covariance - told @ np.linalg.solve(told[:count] + np.eye(count), told.T)
        file = np.zeros(fit.vector.size)
        file[:count] = fit.hypothesis.start_of_numbers()
        candidates = tuple(place for place, number in enumerate(numbers)
                           if number.name not in (*SHAPE_NUMBERS, DELAY, *free)
                           # What the data do not move at all stands whatever is chosen.
                           and covariance[place, place] > np.finfo(float).eps)
        choices = list(_choices((fit.vector - file) / scale, covariance, candidates))
        logarithms = np.array([choice.log_factor for choice in choices])
        weights = np.exp(logarithms - logarithms.max())
        return cls(choices, weights / weights.sum(), file, scale)


def _at_mean(fitter: Fitter, fit: Fit, covariance: Array, free: tuple[str, ...] = ()) -> Fit:
    """Return a finished fit at the mean of its vector over which of the file's numbers stand, as
    far on the way there, by derivatives, as these make up the larger part of what it costs. Those
    named in `free` do not stand, nor does what no file tells: the knots of a load curve, and by
    how much samples of effort and position are apart."""
    assert fit.jacobian is not None, 'the fit is finished'
    weighed = _Weighed.of(fit, covariance, free)
    means = np.array([choice.mean for choice in weighed.choices])
    way = weighed.file + weighed.scale * (weighed.weights @ means) - fit.vector

    def size(residual: Array) -> float:
        return float(np.sum((fitter.weight * residual) ** 2))

    least = size(fit.residual)
    for part in PARTS:
        said = size(fit.residual - fit.jacobian @ (part * way)) - least
        there = fitter.evaluate(fit.hypothesis, np.clip(
            fit.vector + part * way, *fit.hypothesis.bounds))
        if no_more(size(there.residual), least + max(said, 0.0) / LARGER_PART):
            return there
    return fit


@dataclass(frozen=True)
class _Choice:
    """One choice of numbers that are as in the file: their places, the logarithm of how much
    likelier it is than that all are free, and the mean (size,) of all entries beside them."""

    kept: tuple[int, ...]
    log_factor: float
    mean: Array


def _choices(mean: Array, covariance: Array, candidates: tuple[int, ...],
             kept: tuple[int, ...] = (), log_factor: float = 0.0) -> Iterator[_Choice]:
    """Yield every choice of the candidates beside those that are kept, given mean (size,) and
    covariance (size, size) of all entries beside these, in units of the file's spread."""
    if not candidates:
        yield _Choice(kept, log_factor, mean)
        return
    place, *others = candidates
    yield from _choices(mean, covariance, tuple(others), kept, log_factor)
    variance = covariance[place, place]
    if variance <= np.finfo(float).eps:
        # With those that are kept it is as in the file: no other choice.
        return
    gain = covariance[place] / variance
    yield from _choices(
        mean - gain * mean[place], covariance - np.outer(gain, covariance[place]), tuple(others),
        (*kept, place), log_factor - 0.5 * (np.log(variance) + mean[place] ** 2 / variance))
