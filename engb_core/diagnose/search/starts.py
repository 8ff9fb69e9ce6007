# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where fits start that a fixed grid can't serve: orders, frequencies, places and episodes.

Each is read off the residual of the fit that the effect is added to.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.ndimage import gaussian_filter1d

from engb_core.diagnose.hypothesis import usual_angle
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.search.orders import highest_order, leading_orders
from engb_core.effects.base import Effect
from engb_core.signals.position_error import effort_of_recording

__all__ = ['orders_left', 'settings_from_residual', 'strongest_frequency']

Array = NDArray[np.float64]
Settings = list[dict[str, float]]

_BINS = 160
# What repeats less often than in so many turns is no wave of the motor.
LOWEST_ORDER = 0.4


def settings_from_residual(fitter: Fitter, fit: Fit, effect: Effect) -> Settings | None:
    """Return where `effect` may start on top of `fit`; None: its own starts serve."""
    # Each tells its settings by kinds of parameters, which every effect names as it likes.
    makers: dict[str, Callable[[Fitter, Fit, Effect], Settings]] = {
        'order': _orders, 'place': _places, 'begin': _episodes, 'frequency': _frequencies}
    for kind, maker in makers.items():
        if effect.of_kind(kind) is not None:
            return [{_name(effect, entry): value for entry, value in found.items()}
                    for found in maker(fitter, fit, effect)]
    return None


def _name(effect: Effect, kind: str) -> str:
    parameter = effect.of_kind(kind)
    assert parameter is not None, f'an effect with this start has a parameter of kind {kind}'
    return parameter.name


def _orders(fitter: Fitter, fit: Fit, effect: Effect) -> Settings:
    return [{'order': order} for order in orders_left(
        fitter, fit, 'effort' if 'actuation' in effect.stages else '')]


def orders_left(fitter: Fitter, fit: Fit, *factors: str) -> list[float]:
    """Return the orders [cycles per 2π of the position] of the strongest waves over the position
    that a fit leaves, of each factor the strongest first.

    Args:
        fitter: of the problem.
        fit: what is left is its.
        factors: what they are in proportion to, 'effort' or 'direction' ('': nothing).
    """
    unit = usual_angle(fitter.problem.scene)
    efforts = [effort_of_recording(run.recording, run.motion, run.samples,
                                   fit.hypothesis.physics(fit.vector, index), told=run.told)
               for index, run in enumerate(fitter.problem.runs)]
    highest = max(highest_order(run.motion.position, run.motion.velocity, run.motion.bandwidth)
                  for run in fitter.problem.runs)
    orders: list[float] = []
    for factor in factors:
        angle, residual, weight, reach = [], [], [], []
        for run, effort in zip(fitter.problem.runs, efforts, strict=True):
            by = {'': np.ones_like(effort), 'effort': effort,
                  'direction': np.sign(run.motion.velocity)}[factor]
            left = (run.motion.effort - effort) * run.comparison.weight
            angle.append(run.motion.position)
            residual.append(left * by)
            weight.append(run.comparison.weight * by ** 2)
            reach.append(2.0 * np.pi * run.motion.bandwidth
                         / np.maximum(np.abs(run.motion.velocity), 1e-300))
        orders += leading_orders(np.concatenate(angle), np.concatenate(residual),
                                 np.concatenate(weight), np.concatenate(reach),
                                 LOWEST_ORDER / unit, highest)
    return orders


def _frequencies(fitter: Fitter, fit: Fit, effect: Effect) -> Settings:
    found = [strongest_frequency(fitter, fit)]
    if 'actuation' in effect.stages:
        # What goes with an effort that changes its size and sign shows beside its own frequency.
        found.append(strongest_frequency(fitter, fit, by_effort=True))
    return [{'frequency': frequency} for frequency in dict.fromkeys(found)
            if frequency is not None]


def strongest_frequency(fitter: Fitter, fit: Fit, by_effort: bool = False) -> float | None:
    """Return the frequency [Hz] of the strongest line in a fit's residual over time, or in the
    residual times the effort; None if no line stands out."""
    runs = fitter.problem.runs
    longest = max(run.motion.time[-1] for run in runs)
    step = min(float(np.median(np.diff(run.time))) for run in runs)
    frequencies = np.arange(0.5, 0.5 / step, 0.35 / longest)
    power = np.zeros(frequencies.size)
    by = fit.predicted / np.sqrt(np.mean(fit.predicted ** 2)) if by_effort else 1.0
    residuals = fitter.problem.split(by * fit.residual / fitter.spread)
    for run, residual in zip(runs, residuals, strict=True):
        time = run.motion.time[run.comparison.grid]
        own = float(np.median(np.diff(time)))
        # The grid is even with values missing; those are zero, as they are in the sum.
        row = np.zeros(next_fast_len(int(np.ceil(longest / own / 0.2)) + 1, real=True))
        np.add.at(row, np.round((time - time[0]) / own).astype(int), residual)
        spectrum = np.abs(rfft(row)) ** 2
        power += np.interp(frequencies, np.arange(spectrum.size) / (row.size * own), spectrum,
                           right=0.0)
    peak = int(np.argmax(power))
    if power[peak] < 12.0 * np.median(power):
        return None
    return float(frequencies[peak])


def _places(fitter: Fitter, fit: Fit, effect: Effect) -> Settings:
    """Return the places of the stroke where the mean residual stands out, each in two widths."""
    runs = fitter.problem.runs
    position = np.concatenate([run.motion.position[run.comparison.grid] for run in runs])
    sign = np.sign(np.concatenate([run.motion.velocity[run.comparison.grid] for run in runs]))
    low, high = np.quantile(position, [0.0, 1.0])
    edges = np.linspace(low, high + 1e-9, _BINS + 1)
    place = np.clip(np.digitize(position, edges) - 1, 0, _BINS - 1)
    found: Settings = []
    for by in (1.0, sign):
        total = np.bincount(place, fit.residual * by / fitter.spread ** 2, _BINS)
        mass = np.bincount(place, 1.0 / fitter.spread ** 2, _BINS)
        for width in (1.2, 3.0):
            smooth = gaussian_filter1d(total, width) / (
                gaussian_filter1d(mass, width) + 0.02 * mass.mean())
            peak = int(np.argmax(np.abs(smooth)))
            found.append({'place': float(0.5 * (edges[peak] + edges[peak + 1])),
                          'width': float(width * (edges[1] - edges[0]))})
    return found


def _episodes(fitter: Fitter, fit: Fit, effect: Effect) -> Settings:
    """Return the stretch of time of any recording whose residual is largest in the mean, in a few
    lengths."""
    energies: list[tuple[float, float, Array]] = []
    residuals = fitter.problem.split(fit.residual / fitter.spread)
    for time, residual in zip(fitter.problem.times, residuals, strict=True):
        step = float(np.median(np.diff(time)))
        grid = np.round((time - time[0]) / step).astype(int)
        energy = np.zeros(grid[-1] + 1)
        energy[grid] = residual ** 2
        energies.append((float(time[0]), step, energy))
    found: Settings = []
    for length in (1.0, 3.0, 7.0):
        best = max((_fullest(*recorded, length) for recorded in energies), default=(0.0, 0.0))
        if best[0] > 0.0:
            found.append({'begin': best[1], 'end': best[1] + length})
    return found


def _fullest(first: float, step: float, energy: Array, length: float) -> tuple[float, float]:
    """Return the largest mean of values (n,) at even steps over such a length [s], and where it
    begins [s]; none of a recording that is no longer."""
    count = int(length / step)
    if count >= energy.size:
        return 0.0, first
    window = np.convolve(energy, np.full(count, 1.0 / count), 'valid')
    place = int(np.argmax(window))
    return float(window[place]), first + place * step
