# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""By how much torque and recorded effort are apart within one sample, and what may be why.

Every hypothesis fits when samples of effort and position were taken, up to a sample apart. A lag
of the drive, or of the measurement of effort, that is no longer than that moves torque the same
way: the recordings say that something is late, and a set of causes, none of which is claimed.
One that is longer than samples can be apart is physics.
"""

from __future__ import annotations

from engb_core.diagnose.constants import STANDS_OUT
from engb_core.diagnose.diagnosis import ParameterEstimate, Timing
from engb_core.diagnose.evidence import pooled, unseen_errors
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.nominal import DELAY
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.ranking import worth_having
from engb_core.diagnose.uncertainty import vector_deviations
from engb_core.effects.catalogue import get_effect
from engb_core.model import Model
from engb_core.physics.plant import effects_of

__all__ = ['BEFORE_STOP', 'LAG', 'lateness', 'later_than_sampled', 'timing_of', 'with_timing']

# How long before a stop nothing can be judged, as a multiple of the longest delay: efforts there
# belong to a shaft that stands.
BEFORE_STOP = 1.5
LAG = 'actuation_lag'


def timing_of(fitter: Fitter, fit: Fit) -> Timing | None:
    """Return by how much torque comes after the recorded effort in a finished fit, and the set of
    causes; None where that is not significant, or where an effect of the fit says it."""
    place = next((place for place, number in enumerate(fit.hypothesis.numbers)
                  if number.name == DELAY), None)
    if place is None:
        return None
    number, delay = fit.hypothesis.numbers[place], float(fit.vector[place])
    deviation = float(vector_deviations(fit, fitter)[place])
    if abs(delay) <= STANDS_OUT * deviation:
        return None
    at_bound = delay in (number.low, number.high)
    what, lag, other = (
        ('torque follows the recorded effort', LAG, 'the drive takes that long')
        if delay > 0.0 else
        ('the recorded effort follows the torque', 'effort_measurement_lag',
         'the effort is filtered before it is recorded'))
    return Timing(
        ParameterEstimate(delay, deviation, 's'), (lag, DELAY), at_bound,
        f"{what[0].upper()}{what[1:]} by {'at least ' if at_bound else ''}"
        f'{1e3 * abs(delay):.2g} ms (standard deviation {1e3 * deviation:.2g} ms), less than a '
        f'sample: {other}, or effort and position are sampled apart. At this rate the '
        'recordings do not tell which; both are the same in the corrected model.')


def later_than_sampled(fitter: Fitter, fit: Fit) -> bool:
    """Whether torque comes later than that effort and position were sampled apart can tell: the
    fit would have them as far apart as they can be, and a lag in place of that fits better and is
    significantly longer."""
    number, delay = next(((number, float(value)) for number, value in zip(
        fit.hypothesis.numbers, fit.vector, strict=False) if number.name == DELAY), (None, 0.0))
    if number is None or delay < number.high or LAG in fitter.problem.settled:
        return False
    variant, = variants_of(get_effect(LAG), fitter.problem.scene)
    late = fitter.finish(fitter.refine(fitter.fit(variant, fit, keep=len(variant.starts()))))
    place = late.hypothesis.size - len(variant.effect.parameters)
    shortest = late.vector[place] - STANDS_OUT * vector_deviations(late, fitter)[place]
    return late.cost < fit.cost and bool(shortest > number.high)


def with_timing(fitter: Fitter, nominal: Fit) -> tuple[Model, Timing | None]:
    """Return the model file with the delay that a fit of it alone has found, and what is said of
    that; the file and None where it is not significant, or predicts what no fit has seen no
    better."""
    fit, file = fitter.finished(nominal), fitter.problem.model
    timing = timing_of(fitter, fit)
    if timing is not None:
        model = fit.hypothesis.corrected(fit.vector)
        before, after = (pooled(unseen_errors(fitter.problem, entry)) for entry in (file, model))
        if worth_having(after, before):
            return model, timing
    return file, None


def lateness(model: Model) -> float:
    """Return by how much torque comes late [s], which nothing of a late measurement is."""
    return sum((sum(effect.time_shift(dict(zip(effect.names, values, strict=True))))
                for effect, values in effects_of(model)
                if effect.time_shift is not None and effect.id != DELAY), 0.0)
