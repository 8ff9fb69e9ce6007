# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Is a wave over the motor angle a wave, or the form of the load curve?

Whatever form stands in some places once is a sum of a few slow waves. What tells a wave is that it
comes often along the stroke; or that it comes a whole number of times in a revolution, as what
poles, slots and teeth make does, and as a form does by chance only.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from engb_core.diagnose.constants import FORMULA_MISSES, LARGER_PART, REPEATS, STANDS_OUT
from engb_core.diagnose.objective import added_by
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.search.more_orders import amplitudes_of, orders_of
from engb_core.diagnose.uncertainty import estimates
from engb_core.effects.base import Effect

__all__ = ['comes_often', 'is_line', 'left_at_order', 'repeats', 'wave_known']


def repeats(fitter: Fitter, effect: Effect, values: Mapping[str, float]) -> bool:
    """Return whether a wave over the motor angle, if that is what the effect is, comes often
    enough to be told from the form of the load curve; one without an order comes once a turn."""
    order = effect.of_kind('order')
    return effect.reveals != 'motor_angle' or comes_often(
        fitter, 1.0 if order is None else values[order.name])


def is_line(fitter: Fitter, effect: Effect, values: Mapping[str, float]) -> bool:
    """Return whether an effect is a wave over the motor angle that comes often enough to be a line
    among the orders."""
    return effect.reveals == 'motor_angle' and effect.of_kind('order') is not None and repeats(
        fitter, effect, values)


def left_at_order(fitter: Fitter, fit: Fit, index: int) -> float:
    """Return the part (0 to 1) of the waves at the order of one effect of a fit that the effect
    does not take away: waves that go with direction, speed or effort otherwise than it says."""
    effect = fit.hypothesis.variants[index].effect
    order = effect.of_kind('order')
    assert order is not None, 'it is a line'
    frequency = fit.hypothesis.named(fit.vector, index)[order.name]
    columns = []
    for run in fitter.problem.runs:
        motion = run.motion
        wave = np.exp(1j * frequency * motion.position)
        waves = [by * part for part in (wave.real, wave.imag) for by in (
            1.0, np.sign(motion.velocity), motion.velocity, motion.effort)]
        columns.append(np.stack([run.comparison(entry) for entry in waves], axis=1))
    design = np.concatenate(columns) / fitter.sigma[:, None]
    left = fit.residual / fitter.sigma
    said = added_by(fitter, fit, index) / fitter.sigma
    waves_left = design @ np.linalg.lstsq(design, left, rcond=None)[0]
    return float(waves_left @ waves_left / max(waves_left @ waves_left + said @ said,
                                               np.finfo(float).tiny))


def comes_often(fitter: Fitter, order: float) -> bool:
    """Return whether a wave of so many cycles per revolution repeats along the stroke."""
    return _periods(fitter, order) >= REPEATS


def _periods(fitter: Fitter, order: float) -> float:
    """Return how often a wave of so many cycles per revolution repeats along the stroke."""
    low, high = fitter.problem.scene.position_range
    return order * (high - low) / (2.0 * np.pi)


def wave_known(fitter: Fitter, fit: Fit, index: int) -> float:
    """Return the probability that an effect of a fit is what it says and not the form of the load
    curve, if it is a wave over the motor angle: sure where those of its orders that come often are
    the larger part (of their mean square); else as likely as not, or as much likelier as it would
    be rare for its order to lie by chance so near to a whole number, and for a form to bend as the
    wave does wherever that says so without a parameter to say it by: where both lie within what
    formulas miss."""
    effect, values = fit.hypothesis.variants[index].effect, fit.hypothesis.named(fit.vector, index)
    if _mostly_comes_often(fitter, effect, values):
        return 1.0
    order, model = effect.of_kind('order'), fitter.problem.model
    odds = LARGER_PART / (1.0 - LARGER_PART)
    if order is not None:
        # One that comes often among others that do not says no more than one that just does.
        bends = 2.0 * min(_periods(fitter, values[order.name]), REPEATS)
        odds *= FORMULA_MISSES ** -max(0.0, bends - len(effect.parameters))
    # A slider has no revolutions; and of a pendulum whatever goes with its load has whole orders.
    if order is not None and model.joint.type == 'revolute' \
            and model.load_torque.form != 'sinusoid':
        told = estimates(fitter.finished(fit), fitter, index)[order.name]
        odds *= _beside_chance(told.value, np.inf if told.std is None else told.std)
    return odds / (1.0 + odds)


def _mostly_comes_often(fitter: Fitter, effect: Effect, values: Mapping[str, float]) -> bool:
    """Whether of several waves those that come often are the larger part (of their mean square);
    whether one does, or it is no wave."""
    if effect.reveals != 'motor_angle' or 'order_2' not in values:
        return repeats(fitter, effect, values)
    orders, sizes = orders_of(values), amplitudes_of(values)
    quick = sum(sizes[number] ** 2 for number in orders if comes_often(fitter, orders[number]))
    return quick > LARGER_PART * sum(size ** 2 for size in sizes.values())


def _beside_chance(order: float, deviation: float) -> float:
    """Return how many times likelier a whole order makes what is found, as near to a whole number
    as its deviation allows, than any order: 1 where it is not so near."""
    near = STANDS_OUT * deviation
    if abs(order - max(1.0, round(order))) > near:
        return 1.0
    return max(1.0, 0.5 / max(near, np.finfo(float).eps))
