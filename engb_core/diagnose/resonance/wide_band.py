# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Does the drivetrain resonate? Asked in a wider band than everything else; so is whether what
rings has play: flanks that give ring like a shaft, but for a moment behind each reversal.

A shaft rings above the low-pass through which all other effects are judged; below it there is
only a remnant, which a softer load curve explains as well. The wide band holds more noise (counts
become acceleration), which a strongly damped resonance near its edge would smooth away: such a
one is not believed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
import itertools

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import (
    CLEAN_EXCESS,
    DAMPED_BELOW,
    EDGE,
    LARGER_PART,
    LEAST_FRACTION,
    MOST_FRACTION,
    STANDS_OUT,
)
from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.formula import chance_part, formula_odds, no_more, something_known
from engb_core.diagnose.hypothesis import Variant, variants_of
from engb_core.diagnose.nominal import DELAY
from engb_core.diagnose.onset import Onset
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.multistart import followed, Promise, promises, search_around
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.problem import holding, Problem, problem_of, Run, with_less_noise
from engb_core.diagnose.score.probability import part_left
from engb_core.diagnose.score.ranking import worth_a_further_effect, worth_having
from engb_core.diagnose.score.reduced_chi_square import excess, reduced_chi_square
from engb_core.diagnose.search.starts import strongest_frequency
from engb_core.diagnose.uncertainty import estimates, stands_out, vector_deviations
from engb_core.effects.catalogue import get_effect
from engb_core.effects.drivetrain_resonance import NONLINEAR
from engb_core.model import EffectSetting, Model
from engb_core.signals.motion import MOST_OF_RATE, MOTION_BANDWIDTH

__all__ = ['RESONANCE', 'RIVAL', 'Resonance', 'judged_wide', 'linear_shaft', 'resonance_beside',
           'rings', 'silent_shafts', 'with_play']

RESONANCE = 'drivetrain_resonance'
RIVAL = 'backlash'
# The comparison's corner is at most this part of the corner of the motion's smoothing; below this
# frequency [Hz] it is no wider than any other.
OF_MOTION = 0.6
LEAST_BAND = 25.0
# Its best starts that are followed; a linear one takes up with damping what isn't linear.
BENT_KEPT = 3
LIGHTLY = 0.03
# One that hardens much is no linear one at all, and rings far below it: its minima are many, but
# wide where it is damped. Tried from each frequency [Hz], change of stiffness and twist [rad] that
# takes twice a linear one's torque; what promises most at a frequency is followed by random moves,
# and the best two of these by more.
SLOW, CHANGES = (7.0, 10.0, 14.0, 20.0, 28.0, 40.0), (10.0, 100.0, 600.0)
TWICE_THE_TORQUE = (0.02, 0.04, 0.08, 0.16)
DAMPED = {'inertia_fraction': 0.3, 'damping_ratio': 0.15, 'friction_fraction': 0.1}
FOLLOWED, FIRST_MOVES = 4, 60
SETTLED, FURTHER_MOVES, ROUNDS = 2, 150, 12
# It must promise to take away a tenth of the cost.
HOPE = 0.1
# Part of the inertia beyond the shaft at which frequencies are tried, and how many are followed; a
# light one, and what is known of a load that swings.
FRACTION, PROMISED = 0.3, 3
RUBS = (0.1, 0.5, 0.9)    # Part of the friction behind the play.
LIGHT, HANGING = 0.1, {'damping_ratio': LIGHTLY, 'friction_fraction': 0.0}
# Frequencies [Hz] of soft shafts, below the effect's own starts, and where half of all friction is
# beyond: both halves together move as one number does, so that descent hardly finds there.
SOFT, HALF_BEYOND = (3.0, 4.2, 5.8), {'friction_fraction': 0.5, 'viscous_fraction': 0.5}


@dataclass(frozen=True)
class Resonance:
    """A resonance that was found, or play between flanks that ring: what is said of it, and what
    it does to the effort; `excess` is what it leaves beside refitted numbers, and `instead` says
    whether what was named before stood for it.

    `runs` are the recordings in the wide band, whose comparison has `bandwidth` [Hz]; `parts` (one
    (m,) [N·m] a run) what the resonance adds to their filtered effort, `left` what the fit with it
    leaves of that, likewise.
    """

    finding: EffectFinding
    setting: EffectSetting
    runs: tuple[Run, ...]
    parts: tuple[NDArray[np.float64], ...]
    left: tuple[NDArray[np.float64], ...]
    bandwidth: float
    excess: float
    instead: bool = False


def judged_wide(problem: Problem) -> bool:
    """Whether the recordings are sampled fast enough, in counts fine enough, and the model file
    has no resonance yet."""
    known = any(entry.effect == RESONANCE for entry in problem.model.effects)
    return not known and not problem.coarse and _band(problem) >= LEAST_BAND


def _band(problem: Problem) -> float:
    """Return up to where [Hz] every recording's position tells more of the torque than of its own
    noise, and its rate lets a motion be derived; no wider than the motion is believed."""
    return min(MOTION_BANDWIDTH, OF_MOTION * MOST_OF_RATE / problem.scene.sampling,
               *(run.told for run in problem.runs))


def resonance_beside(problem: Problem, corrected: Model, threads: int = 1) -> Resonance | None:
    """Return the resonance that the recordings show beside what `corrected` holds, or instead of
    what that has beyond the file where the file with a resonance leaves clearly less: friction
    with bristles and a load's loop bend as a soft shaft does. None where they show none."""
    if not judged_wide(problem):
        return None
    bandwidth = _band(problem)
    beside = _wide(problem, corrected, bandwidth, threads)
    if _as_it_stands(beside.problem) < 1.0 + CLEAN_EXCESS:
        return None
    left = reduced_chi_square(beside.base(), beside)
    if left - 1.0 < CLEAN_EXCESS:
        return None
    named = tuple(entry for entry in beside.problem.model.effects
                  if entry not in problem.model.effects)
    found = _shown(beside, corrected, problem.onsets, named)
    if found is not None:
        left = 1.0 + found.excess
    if not named or left - 1.0 < CLEAN_EXCESS:
        return found
    instead = _shown(_wide(problem, problem.model, bandwidth, threads), corrected, problem.onsets)
    return replace(instead, instead=True) if instead is not None and worth_having(
        1.0 + instead.excess, left) else found


def _wide(problem: Problem, model: Model, bandwidth: float, threads: int) -> Fitter:
    """Return what fits in the wide band beside what a model holds but for resonances and gaps."""
    given = tuple(entry for entry in model.effects
                  if entry.effect not in (RESONANCE, RIVAL, DELAY, 'unexplained_surface'))
    wide = problem_of([run.recording for run in problem.runs],
                      replace(model, effects=given), bandwidth=bandwidth,
                      motion_bandwidth=2.0 * bandwidth, before_stop=problem.before_stop)
    return Fitter(replace(with_less_noise(wide, problem.noise_part), onsets=tuple(
        (effect, onset) for effect, onset in problem.onsets
        if any(entry.effect == effect for entry in given))), threads)


def _shown(fitter: Fitter, corrected: Model, onsets: tuple[tuple[str, Onset], ...],
           named: tuple[EffectSetting, ...] = ()) -> Resonance | None:
    """Return the resonance beside a fitter's model, of which some effects were `named`, if any;
    `corrected` and its `onsets` say where a gap may begin."""
    base = fitter.base()
    tried: list[Fit] = []
    for fit in _shafts(fitter, tried):
        known = something_known(part_left(fitter, base, fit))
        if known < LARGER_PART or not _rings(fit, fitter):
            continue
        if named and not worth_a_further_effect(
                excess(base, fitter), excess(fit, fitter), _without(fitter, named)):
            continue
        left = reduced_chi_square(fit, fitter)
        if any(reduced_chi_square(rival, fitter) < left
               for rival in _rivals(fitter, corrected, onsets)):
            return None
        loose = with_play(fitter, fit)
        if loose is not None:
            # What the narrow band has found of it stands.
            return None if any(entry.effect == RIVAL for entry in corrected.effects) \
                else _resonance(fitter, base, loose, {})
        return _resonance(fitter, base, fit, _over_formulations(fitter, base, fit, tried))
    return None


def _without(fitter: Fitter, named: tuple[EffectSetting, ...]) -> float:
    """Return the excess that refitted numbers leave without the effects that are `named`: what
    their formulas miss is a part of what they explain."""
    model = fitter.problem.model
    others = replace(model, effects=tuple(
        entry for entry in model.effects if entry not in named))
    plain = Fitter(holding(fitter.problem, others), fitter.threads)
    return excess(plain.base(), fitter)


def _as_it_stands(problem: Problem) -> float:
    """Return the mean squared residual of the model, nothing fitted, in units of the noise's."""
    missed = problem.measured - np.concatenate([problem.predicted(run, problem.model)
                                                for run in problem.runs])
    return float(np.mean((missed / problem.sigma) ** 2))


def _rivals(fitter: Fitter, corrected: Model, onsets: tuple[tuple[str, Onset], ...],
            ) -> Iterator[Fit]:
    """Yield fits of a gap: begun where the narrow band has found one, and where any may begin."""
    # Play in front of a load that stays makes nothing that rings.
    variant, *_ = variants_of(get_effect(RIVAL), fitter.problem.scene)
    for known in corrected.effects:
        if known.effect == RIVAL:
            begins = replace(variant, onset=dict(onsets).get(RIVAL))
            starts = fitter.starts(begins, [dict(known.parameters)])
            yield fitter.refine(fitter.fit(begins, starts=starts, rounds=8))
    yield fitter.refine(fitter.fit(variant, rounds=8))


def with_play(fitter: Fitter, shaft: Fit) -> Fit | None:
    """Return the finished fit of play between flanks that ring as a shaft does, where it is worth
    its parameters and more than none; else None."""
    values, (elastic,) = _values(shaft), get_effect(RIVAL).richer
    (variant,) = variants_of(elastic, fitter.problem.scene)
    gap, damping = variant.effect.parameters[0], variant.effect.parameters[-1]
    settings = [{'gap': start, 'inertia_fraction': values['inertia_fraction'],
                 'friction_fraction': rubs, 'loaded_friction_fraction': rubs,
                 'viscous_fraction': rubs,
                 'flank_frequency': values['frequency'],
                 'flank_damping': min(values['damping_ratio'], damping.high)}
                for start in gap.starts for rubs in RUBS]
    promised = promises(fitter, fitter.base(), fitter.hypothesis((variant,)), settings)
    loose = min(followed(fitter, promised[:PROMISED], 8, fitter.iterate),
                key=lambda fit: fit.cost)
    loose = fitter.finish(fitter.refine(loose))
    added = len(variant.effect.parameters) - len(shaft.hypothesis.variants[0].effect.parameters)
    if worth_having(reduced_chi_square(loose, fitter), reduced_chi_square(shaft, fitter),
                    max(added, 1)) and stands_out(loose, fitter, 0):
        return loose
    return None


def linear_shaft(fitter: Fitter) -> Fit:
    """Return the best fit of a linear shaft; each further variant starts where the best so far
    has come to, and so does the first in the end."""
    first, *further = variants_of(get_effect(RESONANCE), fitter.problem.scene)
    best = _settled(fitter, min(fitter.fit(first, rounds=8, keep=4), *_promised(fitter, first),
                                key=lambda entry: entry.cost))
    for variant in (*further, first):
        starts = fitter.starts(variant, [_values(best)])
        fit = _settled(fitter, fitter.fit(variant, starts=starts, rounds=8, keep=4))
        best = min(best, fit, key=lambda entry: entry.cost)
    return best


def _settled(fitter: Fitter, fit: Fit) -> Fit:
    """Return a fit refined until it is no better any more: what rubs beyond a shaft moves the
    numbers a good way with it."""
    for _ in range(ROUNDS):
        better = fitter.refine(fit)
        if no_more(fit.cost, better.cost):
            return better
        fit = better
    return fit


def _promised(fitter: Fitter, variant: Variant) -> list[Fit]:
    """Return fits begun where a resonance of some size promises most: half its size does not do
    half of what it does, so that linear least squares may mistake the frequency."""
    settings = [{**start, **rubs, 'inertia_fraction': FRACTION}
                for start in (*variant.starts(), *({**variant.starts()[0], 'frequency': frequency}
                                                   for frequency in SOFT))
                for rubs in ({}, HALF_BEYOND)]
    line = strongest_frequency(fitter, fitter.base())
    if line is not None:
        # What rings long does so in a narrower band than lies between two starts; and a load that
        # swings from a hook is light and does not rub.
        settings += [{**HANGING, 'frequency': line, 'inertia_fraction': fraction}
                     for fraction in (FRACTION, LIGHT)]
    promised = promises(fitter, fitter.base(), fitter.hypothesis((variant,)), settings)
    return followed(fitter, promised[:PROMISED], 8, fitter.iterate)


def _shafts(fitter: Fitter, tried: list[Fit]) -> Iterator[Fit]:
    """Yield finished fits of shafts that may ring, what explains more first: one that isn't
    linear, and the linear one, which stands where the other one was led astray. All that were
    fitted are added to `tried`."""
    linear = fitter.finish(linear_shaft(fitter))
    tried.append(linear)
    if excess(linear, fitter) > CLEAN_EXCESS:
        other = _bent(fitter, linear, tried) if _rings(linear, fitter) \
            else _hardened(fitter, linear, tried)
        if other is not linear:
            yield fitter.finish(other)
    yield linear


def _bent(fitter: Fitter, linear: Fit, tried: list[Fit]) -> Fit:
    """Return the fit with a shaft that isn't linear where that takes away most of what a linear
    one leaves; all that were fitted are added to `tried`."""
    left = reduced_chi_square(linear, fitter) - 1.0
    values = _values(linear)
    best, least = linear, (1.0 - chance_part()) * left
    for effect in NONLINEAR:
        added = effect.parameters[len(get_effect(RESONANCE).parameters):]
        settings = [{**values, **dict(zip((entry.name for entry in added), start, strict=True)),
                     'damping_ratio': damping}
                    for start in itertools.product(*(entry.starts for entry in added))
                    for damping in {values['damping_ratio'], LIGHTLY}]
        for variant in variants_of(effect, fitter.problem.scene):
            fit = fitter.refine(fitter.fit(variant, starts=fitter.starts(variant, settings),
                                           rounds=8, keep=BENT_KEPT))
            tried.append(fit)
            if reduced_chi_square(fit, fitter) - 1.0 < least:
                best, least = fit, reduced_chi_square(fit, fitter) - 1.0
    if least > CLEAN_EXCESS:
        fit = _hardened(fitter, linear, tried)
        if reduced_chi_square(fit, fitter) - 1.0 < least:
            return fit
    return best


def _hardened(fitter: Fitter, than: Fit, tried: list[Fit]) -> Fit:
    """Return the best fit found of a shaft that hardens much, where one promises to be better
    than another fit; else that one. All that were fitted are added to `tried`."""
    (variant,) = variants_of(NONLINEAR[0], fitter.problem.scene)
    hypothesis, base = fitter.hypothesis((variant,)), fitter.base()
    promised = promises(fitter, base, hypothesis, [
        {**DAMPED, 'frequency': frequency, 'stiffness_change': change,
         'stiffness_twist': twist * np.sqrt(change / 3.0)}
        for frequency, change, twist in itertools.product(SLOW, CHANGES, TWICE_THE_TORQUE)])
    if promised[0].cost > (1.0 - HOPE) * base.cost:
        return than
    most: dict[float, Promise] = {}
    for promise in promised:
        most.setdefault(hypothesis.named(promise.vector, 0)['frequency'], promise)

    def moved(promise: Promise) -> Fit:
        return search_around(fitter, fitter.evaluate(hypothesis, promise.vector), FIRST_MOVES)

    def settled(fit: Fit) -> Fit:
        return fitter.refine(search_around(fitter, fit, FURTHER_MOVES), ROUNDS)

    first = sorted(parallel_map(moved, list(most.values())[:FOLLOWED], fitter.threads),
                   key=lambda fit: fit.cost)
    better = [fit for fit in first if fit.cost < than.cost][:SETTLED]
    fits = list(parallel_map(settled, better, fitter.threads))
    tried += fits
    return min([than, *fits], key=lambda fit: fit.cost)


def _over_formulations(fitter: Fitter, base: Fit, told: Fit, tried: list[Fit],
                       ) -> dict[str, float]:
    """Return how far from the one that is `told` other formulations of the shaft put the numbers
    that all of them have (root mean square), each as likely as it is that a formula misses what it
    leaves; one that is likelier a makeshift says nothing of them."""
    values, others = _values(told), [_values(fit) for fit in tried]
    odds = np.array([formula_odds(part_left(fitter, base, fit)) for fit in tried])
    odds[odds < 1.0] = 0.0
    if not odds.any():
        return {}

    def apart(name: str) -> float:
        away = np.array([other[name] - values[name] for other in others])
        return float(np.sqrt(odds @ away ** 2 / odds.sum()))

    return {parameter.name: apart(parameter.name)
            for parameter in get_effect(RESONANCE).parameters}


def _values(fit: Fit) -> dict[str, float]:
    return fit.hypothesis.named(fit.vector, 0)


def _part_of_bound(values: Mapping[str, float], name: str) -> float:
    """Return a parameter as a part of its upper bound."""
    return values[name] / next(parameter.high for parameter in get_effect(RESONANCE).parameters
                               if parameter.name == name)


def rings(values: Mapping[str, float], bandwidth: float) -> bool:
    """Whether a shaft of these parameters is one that rings, and none that only smooths noise and
    timing within the comparison's `bandwidth` [Hz]."""
    within = values['frequency'] < DAMPED_BELOW * bandwidth
    fraction, damping = values['inertia_fraction'], _part_of_bound(values, 'damping_ratio')
    if within and damping <= LARGER_PART:
        # What smooths does it by its damping: this one rings, however little is beyond it.
        return _part_of_bound(values, 'inertia_fraction') < EDGE
    return LEAST_FRACTION <= fraction <= MOST_FRACTION and (within or damping < EDGE)


def _rings(fit: Fit, fitter: Fitter, index: int = 0) -> bool:
    """Whether the shaft that is one of a finished fit's effects is one that rings, and not a stiff
    one: far above the band only a flank is seen, which goes by compliance, 1/frequency²."""
    hypothesis = fit.hypothesis
    assert fit.jacobian is not None, 'the fit is finished'
    if not rings(hypothesis.named(fit.vector, index), fitter.problem.bandwidth) \
            or not np.isfinite(fit.jacobian).all():
        # Where next to nothing is beyond the shaft, its twist has no derivatives.
        return False
    deviations = vector_deviations(fit, fitter, by_noise_alone=True)
    places = {hypothesis.parameter(entry).name: len(hypothesis.numbers) + entry
              for entry, (owner, _, _) in enumerate(hypothesis.places) if owner == index}
    fraction = places['inertia_fraction']
    return bool(2.0 * STANDS_OUT * deviations[places['frequency']] < 1.0
                and fit.vector[fraction] > STANDS_OUT * deviations[fraction])


def silent_shafts(fitter: Fitter, fit: Fit) -> set[int]:
    """Return which effects of a finished fit are shafts that do not ring once all is fitted
    together."""
    return {index for index, effect in enumerate(fit.hypothesis.ids)
            if effect == RESONANCE and not _rings(fit, fitter, index)}


def _resonance(fitter: Fitter, base: Fit, fit: Fit, apart: dict[str, float]) -> Resonance:
    values = _values(fit)
    parameters = {
        name: replace(entry, std=None if entry.std is None else float(
            np.hypot(entry.std, apart.get(name, 0.0))))
        for name, entry in estimates(fit, fitter, 0).items()}
    effect, left = fit.hypothesis.variants[0].effect, excess(fit, fitter)
    without = fitter.predict(fitter.hypothesis(()), fit.vector[:len(fit.hypothesis.numbers)])
    finding = EffectFinding(
        effect=effect.id, probability=something_known(part_left(fitter, base, fit)),
        parameters=parameters,
        share=float(np.clip(1.0 - left / excess(base, fitter), 0.0, 1.0)),
        alternatives=(), statement=effect.statement(values))
    return Resonance(finding, EffectSetting(effect.id, values), fitter.problem.runs,
                     tuple(fitter.problem.split(fit.predicted - without)),
                     tuple(fitter.problem.split(fit.residual)), fitter.problem.bandwidth, left)
