# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""From fits to what is claimed: effects with share, probability, parameters and a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import LARGER_PART, MEASURED, STANDS_OUT, SURE
from engb_core.diagnose.diagnosis import EffectFinding, ParameterEstimate
from engb_core.diagnose.fitted import without_effects
from engb_core.diagnose.formula import something_known
from engb_core.diagnose.hypothesis import Variant
from engb_core.diagnose.load_shape import in_files_form, LOAD_SHAPE
from engb_core.diagnose.numbers.moved_by_refit import wrong_beside_others
from engb_core.diagnose.numbers.spike_and_slab import with_averaged_numbers
from engb_core.diagnose.numbers.wrong_numbers import (
    file_stands,
    held_at_file,
    number_place,
    NumberFinding,
    numbers_of,
    refit_of_file,
    still_wrong,
    with_these_refitted,
)
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.probability import (
    further_known,
    own_part_left,
    part_left,
    rival_weights,
)
from engb_core.diagnose.score.reduced_chi_square import excess, reduced_chi_square
from engb_core.diagnose.selection import Selection
from engb_core.diagnose.uncertainty import estimates, reported_deviations, stands_out
from engb_core.diagnose.unknown.flexible import form_left
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.diagnose.waves import is_line, left_at_order, wave_known
from engb_core.effects.base import NUMBER_OFF
from engb_core.effects.catalogue import catalogue, get_effect

__all__ = ['findings_of', 'in_order', 'number_findings', 'still_told', 'with_numbers_alone',
           'with_parts']

Array = NDArray[np.float64]
# A rival is worth telling from here on.
TOLD = 0.02


def findings_of(fitter: Fitter, nominal: Fit, explanation: Explanation, judged: Fit,
                numbers: list[NumberFinding], selection: Selection, told: Fit,
                ) -> tuple[list[EffectFinding], Array]:
    """Return the findings in order of share, and the mismatch (m,) [N·m] that they make up.

    Parameters are those of `told`, the same effects at numbers between refit and file. How sure an
    effect is follows from `judged`, the same effects fitted to the motion on which their rivals
    were fitted: numbers from a sharper motion leave more on the smoothed one, which says nothing
    against the effect.

    The mismatch is what the named physics adds to the effort, and what the wrong numbers change
    (all others as refitted: a file that was refitted around the effect would smear it), or,
    where nothing is named, what the nominal model leaves.
    """
    chosen = explanation.fit
    physics = _physics(fitter, judged, selection, told)
    changed = number_findings(fitter, nominal, judged, numbers)
    findings = [finding for finding, _ in (*physics, *changed)]
    if physics and changed:
        # What effects and numbers explain together, each by what is lost without it.
        left = excess(chosen, fitter) / max(excess(nominal, fitter), 1e-9)
        total = sum(matters for _, matters in (*physics, *changed))
        findings = [replace(finding, share=max(1.0 - left, 0.0) * matters / total)
                    for finding, matters in (*physics, *changed)]
    findings = in_order(_beyond_relaxation(_beyond_lost_motion(findings)),
                        stands=file_stands(fitter, judged))
    if not chosen.hypothesis.variants and all(entry.effect == LOAD_SHAPE for entry in numbers):
        return findings, nominal.residual
    hypothesis, vector = without_effects(chosen, set(range(len(chosen.hypothesis.variants))))
    for finding in numbers:
        if finding.effect == LOAD_SHAPE:
            # It acts wherever there is load, and would hide where the physics does.
            continue
        place = number_place(hypothesis.numbers, finding.effect)
        vector[place] = hypothesis.start_of_numbers()[place]
    return findings, chosen.predicted - fitter.predict(hypothesis, vector)


def _beyond_lost_motion(findings: list[EffectFinding]) -> list[EffectFinding]:
    """Return the findings without a contact that is off by no more than a gap: which of the flanks
    the load lay at, or where between them, is not in the file."""
    gap = max((finding.parameters['gap'].value for finding in findings
               if 'gap' in finding.parameters), default=0.0)
    return [finding for finding in findings if finding.effect != 'contact_shift'
            or abs(finding.parameters['shift'].value) > gap]


def _beyond_relaxation(findings: list[EffectFinding]) -> list[EffectFinding]:
    """Return the findings without a wrong stiffness that is just what creep takes away again: the
    file's curve is that of the relaxed load, and no number of it is off."""
    creep = next((finding for finding in findings if 'relaxed_fraction' in finding.parameters),
                 None)
    stiff = next((finding for finding in findings if finding.effect == 'load_stiffness_error'
                  and finding.onset is None), None)
    if creep is None or stiff is None:
        return findings
    relaxed = stiff.parameters['scale'].value * (1.0 - creep.parameters['relaxed_fraction'].value)
    if abs(relaxed - 1.0) > MEASURED:
        return findings
    both = replace(creep, share=creep.share + stiff.share, statement=(
        f"{creep.statement.removesuffix('.')}; the model file's load is the relaxed one."))
    return [both if finding is creep else finding for finding in findings
            if finding is not stiff]


def with_parts(findings: Sequence[EffectFinding]) -> list[EffectFinding]:
    """Return the findings, and what one of them stands for as well: another effect that it holds,
    with its share of what both change."""
    told = list[EffectFinding]()
    for finding in findings:
        part = _part_of(finding)
        if part is None or any(other.effect == part.effect for other in findings):
            told.append(finding)
        else:
            told += [replace(finding, share=finding.share - part.share), part]
    return sorted(told, key=lambda finding: -finding.share)


def _part_of(finding: EffectFinding) -> EffectFinding | None:
    """Return the effect that a finding holds, where what sizes that is more than none by its
    deviation."""
    holder, own = get_effect(finding.effect), finding.parameters
    if holder.part is None:
        return None
    effect, weights = get_effect(holder.part.effect), holder.part.weights
    sizing, sized = effect.parameters[0], holder.parameters[0].name
    assert sizing.none is not None, 'a part vanishes at some size'
    value = sum(weight * own[name].value for name, weight in weights.items())
    if any(own[name].std is None for name in weights):
        # Of what is not told no part is told either.
        return None
    std = math.hypot(*(weight * (own[name].std or 0.0) for name, weight in weights.items()))
    away = abs(value - sizing.none)
    if away <= STANDS_OUT * std:
        return None
    share = finding.share * away ** 2 / (away ** 2 + (weights[sized] * own[sized].value) ** 2)
    return EffectFinding(
        effect.id, finding.probability,
        {sizing.name: ParameterEstimate(value, std, sizing.unit)}, share, (),
        f"{effect.statement({**effect.defaults, sizing.name: value})} The {holder.title.lower()} "
        'of the corrected model holds it.', onset=finding.onset)


def in_order(findings: list[EffectFinding], stands: bool = False) -> list[EffectFinding]:
    """Return the findings in order of share. What is doubtful may well be a makeshift for details
    of what is sure, unless it is expected to explain more than all of that; and a number that is
    off, unless the file `stands` but for those that are told, may have moved with the file's refit
    to make up for physics that is missing: they get no more than half of the least of that."""
    sure = [finding for finding in findings if finding.probability >= SURE]
    expected = sum(finding.probability * finding.share for finding in sure)
    if sure:
        sure += [finding for finding in findings if finding not in sure
                 and finding.probability * finding.share > expected]
    physics = [] if stands else [finding for finding in sure if not _is_number(finding)]
    most = LARGER_PART * min((finding.share for finding in physics or sure), default=2.0)

    def leads(finding: EffectFinding) -> bool:
        # No refit moves a form that none of the file's numbers can give the load curve.
        return finding in (physics or sure) or (finding.effect == LOAD_SHAPE and finding in sure)

    return sorted((finding if leads(finding) else replace(finding, share=min(finding.share, most))
                   for finding in findings), key=lambda finding: -finding.share)


def _is_number(finding: EffectFinding) -> bool:
    """Whether a finding is a number of the file that is off, and no missing physics."""
    effect = catalogue().get(finding.effect)
    return effect is not None and effect.number_only and finding.onset is None


def _physics(fitter: Fitter, chosen: Fit, selection: Selection, told: Fit,
             ) -> list[tuple[EffectFinding, float]]:
    """Return the named effects, and by how much the reduced chi-square rises without each."""
    variants = chosen.hypothesis.variants
    if not any(not variant.effect.unnamed for variant in variants):
        return []
    before = max(selection.excess_before, selection.nominal_excess)
    share = max(0.0, 1.0 - selection.excess_after / before)
    # What refitted numbers explain says nothing of an effect, but where the effect is one of them
    # that is wrong: then what the others explain does not.
    wrong = all(variant.number_only for variant in variants)
    without = fitter.base(chosen.hypothesis.numbers if wrong else None)
    left = part_left(fitter, without, chosen)
    # What wrong numbers or another load curve explain says nothing of how nearly right an effect's
    # formula is: rivals are weighed by what the same numbers leave without any effect.
    to_explain = excess(fitter.base(chosen.hypothesis.numbers), fitter)
    smaller = [fitter.base(chosen.hypothesis.numbers)] if len(variants) == 1 else [
        fitter.without(chosen, index) for index in range(len(variants))]
    matters = [max(reduced_chi_square(fit, fitter) - reduced_chi_square(chosen, fitter), 1e-6)
               for fit in smaller]
    total = sum(matters)
    nameless = sum(part for part, variant in zip(matters, variants, strict=True)
                   if variant.effect.unnamed)
    makeshift = 1.0
    if nameless > LARGER_PART * total:
        # What leads has no name: a companion may well be a makeshift for its details.
        makeshift = LARGER_PART
    findings = []
    by_itself = refit_of_file(fitter, fitter.finished(chosen)).by_itself \
        if wrong_beside_others(chosen) else {}
    for index, variant in enumerate(variants):
        # What a refit of the file has moved around the others is in the model, and no finding.
        itself = by_itself.get(variant.effect.id, 1.0)
        if variant.effect.unnamed or itself < LARGER_PART:
            continue
        values = told.hypothesis.named(told.vector, index)
        parameters = estimates(told, fitter, index)
        own = form_left(fitter, smaller[index], chosen, variant.effect.reveals)
        surely = makeshift * something_known(left, own)
        if len(variants) > 1:
            surely = min(surely, further_known(fitter, without, smaller[index], chosen, own))
        if is_line(fitter, variant.effect, values):
            # What else is missing and no line at that order says nothing of this one.
            line = max(own_part_left(fitter, chosen, index),
                       left_at_order(fitter, chosen, index))
            surely = max(surely, something_known(line, line))
        believed = surely * itself * (
            variant.effect.credence(values) if variant.effect.credence else 1.0)
        if not stands_out(chosen, fitter, index):
            believed = 0.0
        else:
            believed *= wave_known(fitter, chosen, index)
        rivals = [fit for fit in selection.rivals
                  if _differs_by(fit, chosen, variant.effect.id)]
        weights = rival_weights(chosen, rivals, fitter, to_explain)
        alternatives = tuple(
            (_other(fit, chosen), believed * weight)
            for fit, weight in zip(rivals, weights[1:], strict=True) if believed * weight > TOLD)
        probability = believed * weights[0]
        if variant.effect.id in selection.believed:
            probability, rival = selection.believed[variant.effect.id]
            alternatives = ((rival, 1.0 - probability),)
        onset = _onset(fitter, variant)
        finding = EffectFinding(
            effect=variant.effect.id, probability=probability,
            parameters=parameters,
            share=share * matters[index] / total, alternatives=alternatives,
            statement=_said(variant.effect.statement(values), onset), onset=onset)
        findings.append((finding, matters[index]))
    return findings


def _onset(fitter: Fitter, variant: Variant) -> tuple[str, float] | None:
    if variant.onset is None:
        return None
    return fitter.problem.runs[variant.onset.run].recording.name, variant.onset.time


def _said(statement: str, onset: tuple[str, float] | None) -> str:
    """Return the statement with the time from which it holds: a number that changes while the
    brake is in use is not one that was off."""
    if onset is None:
        return statement
    return f'From {onset[1]:.2f} s into {onset[0]} on: {statement.removeprefix(NUMBER_OFF)}'


def _differs_by(rival: Fit, chosen: Fit, effect_id: str) -> bool:
    """Whether the rival has another effect in the place of `effect_id` and is alike otherwise."""
    rest = set(chosen.hypothesis.ids) - {effect_id}
    others = set(rival.hypothesis.ids)
    return rest <= others and effect_id not in others and not others <= set(chosen.hypothesis.ids)


def _other(rival: Fit, chosen: Fit) -> str:
    return next(entry for entry in rival.hypothesis.ids if entry not in chosen.hypothesis.ids)


def number_findings(fitter: Fitter, nominal: Fit, chosen: Fit, numbers: list[NumberFinding],
                    ) -> list[tuple[EffectFinding, float]]:
    """Return the wrong numbers, and by how much the reduced chi-square rises with each as the
    file has it."""
    before = max(reduced_chi_square(nominal, fitter) - 1.0, 1e-9)
    total = sum(finding.matters for finding in numbers)
    after = excess(chosen, fitter)
    taken = max(0.0, 1.0 - after / before)
    left = part_left(fitter, nominal, chosen)
    # What is missing beside a number, and could be put into it by another formula.
    whole = min(nominal, fitter.base(), key=lambda fit: excess(fit, fitter))
    findings = []
    for finding in numbers:
        effect = get_effect(finding.effect)
        parameters = _estimates(fitter, finding)
        others = sum(weight for _, weight in finding.rivals)
        surely = (_shape_known if finding.effect == LOAD_SHAPE else _number_known)(
            fitter, finding, whole, left)
        findings.append((EffectFinding(
            effect=effect.id, probability=surely * finding.moved * (1.0 - others),
            parameters=parameters,
            share=min(1.0, taken * finding.matters / total),
            alternatives=tuple((other, surely * weight) for other, weight in finding.rivals),
            statement=effect.statement({
                **finding.fit.hypothesis.given(effect.id),
                **{name: entry.value for name, entry in parameters.items()}})), finding.matters))
    return findings


def _number_known(fitter: Fitter, finding: NumberFinding, whole: Fit, left: float) -> float:
    """Return the probability that a wrong number is none that stands for something else: beside
    effects it is bound as each further one, by how much of the `whole` they leave without it."""
    held = held_at_file(fitter, finding.fit, finding.effect)
    own = form_left(fitter, held, finding.fit, get_effect(finding.effect).reveals)
    surely = something_known(left, own)
    if not finding.fit.hypothesis.variants:
        return surely
    return min(surely, further_known(fitter, whole, held, finding.fit, own))


def _shape_known(fitter: Fitter, finding: NumberFinding, whole: Fit, left: float) -> float:
    """Return the probability that the load curve has another form: beside effects, that this is
    none of what their formulas miss along the angle."""
    surely = something_known(left)
    if not finding.fit.hypothesis.variants:
        return surely
    whole, held = (in_files_form(fitter, fit) for fit in (whole, finding.fit))
    return min(surely, further_known(fitter, whole, held, finding.fit))


def still_told(fitter: Fitter, explanation: Explanation, findings: Sequence[EffectFinding],
               ) -> list[EffectFinding]:
    """Return the findings of numbers that were likely wrong and still are beside an explanation
    found since, each with its share of what is lost without all of them: one that is told on one
    side alone may have stood for what was found, or makes up for its form."""
    fit = explanation.fit
    again = still_wrong(fitter, fit, {
        (finding.effect, name): entry.value for finding in findings
        if finding.probability >= LARGER_PART for name, entry in finding.parameters.items()})
    if not again:
        return []
    found = [finding for finding, _ in number_findings(
        fitter, fitter.nominal(), fit, again)]
    total = sum(finding.share for finding in found)
    left = excess(with_these_refitted(fitter, fit, [finding.effect for finding in found]), fitter)
    taken = max(0.0, 1.0 - left / max(excess(fitter.nominal(), fitter), 1e-9))
    return in_order([replace(finding, share=taken * finding.share / max(total, 1e-9))
                     for finding in found])


def with_numbers_alone(fitter: Fitter, explanation: Explanation,
                       findings: Sequence[EffectFinding]) -> Explanation | None:
    """Return the explanation with no more fitted than the numbers that are likely wrong, or None
    where none is."""
    likely = [entry.effect for entry in findings if entry.probability >= LARGER_PART]
    if not numbers_of(likely):
        return None
    return replace(explanation, table=None, fit=with_these_refitted(
        fitter, explanation.fit, likely))


def _estimates(fitter: Fitter, finding: NumberFinding) -> dict[str, ParameterEstimate]:
    """Return the effect's parameters, which are nominal numbers of the fit: all that is known is
    that these are wrong, so that any of the others may stand as in the file."""
    fit = fitter.finished(finding.fit)
    wrong = tuple(parameter.name for parameter in get_effect(finding.effect).parameters)
    fit = with_averaged_numbers(fitter, fit, free=wrong)
    deviations = reported_deviations(fit, fitter, get_effect(finding.effect))
    numbers = {number.name: (number, place)
               for place, number in enumerate(fit.hypothesis.numbers)}
    found = {}
    for parameter in get_effect(finding.effect).parameters:
        if parameter.name not in numbers:
            continue
        number, place = numbers[parameter.name]
        value = float(fit.vector[place])
        std = deviations[place]
        if number.logarithmic:
            value = float(np.exp(value))
            std *= value
        found[parameter.name] = ParameterEstimate(value, float(std), parameter.unit)
    return found
