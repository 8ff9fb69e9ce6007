# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A whole diagnosis: gate, search, choice, numbers, location, evidence, corrected model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
import time
from typing import Any

import numpy as np

from engb_core.diagnose.absent_load import absent_load
from engb_core.diagnose.begun_again import searched
from engb_core.diagnose.cause_sets import shipped_calibration, with_cause_sets
from engb_core.diagnose.constants import CLEAN_EXCESS, LARGER_PART, LEAST_PROBABILITY
from engb_core.diagnose.decimated import decimated
from engb_core.diagnose.diagnosis import (
    Diagnosis,
    EffectFinding,
    Interval,
    NextExperiment,
    Timing,
    Unexplained,
    Zone,
)
from engb_core.diagnose.effort_scale import with_effort_scale
from engb_core.diagnose.evidence import evidence_of, quality_of_fit, simulated_loops
from engb_core.diagnose.experiment.next_experiment import next_experiment
from engb_core.diagnose.false_discovery import mismatched
from engb_core.diagnose.findings import (
    findings_of,
    in_order,
    still_told,
    with_numbers_alone,
    with_parts,
)
from engb_core.diagnose.formula import something_known
from engb_core.diagnose.full_bandwidth import (
    at_full_bandwidth,
    carries_over,
    CorrectedModels,
    explained_problem,
    fitted_to_all,
    that_helps,
)
from engb_core.diagnose.load_shape import (
    LOAD_SHAPE,
    load_shape_finding,
    moved_as_a_whole,
    nameless_curve,
    with_free_load_curve,
)
from engb_core.diagnose.locate import intervals, zones
from engb_core.diagnose.nameless import that_carries, without_what_passes_once
from engb_core.diagnose.numbers.load_friction import missing_load_friction
from engb_core.diagnose.numbers.wrong_numbers import NumberFinding, wrong_numbers
from engb_core.diagnose.onset_search import with_onset
from engb_core.diagnose.optimise.cross_entropy import middle_of_basin
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.multistart import is_multimodal, search_around
from engb_core.diagnose.parallel_map import parallel_map, processors
from engb_core.diagnose.problem import Problem, problem_of, with_less_noise
from engb_core.diagnose.resonance.wide_band import (
    judged_wide,
    RESONANCE,
    Resonance,
    resonance_beside,
)
from engb_core.diagnose.resonance.wind_up import with_resonance
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.search.every_effect import search
from engb_core.diagnose.search.more_orders import without_idle_orders
from engb_core.diagnose.selection import makeshifts, select, Selection
from engb_core.diagnose.slider import of_slider
from engb_core.diagnose.timing import BEFORE_STOP, lateness, timing_of, with_timing
from engb_core.diagnose.unknown.openset import explain, Explanation
from engb_core.diagnose.verdict import unless_nothing_helps, verdict_of, with_nearest
from engb_core.effects.catalogue import get_effect
from engb_core.errors import InputError
from engb_core.laws.competition import law_for, law_instead, nearest_told, Won
from engb_core.laws.judgement import Nearest
from engb_core.laws.rival_experiment import experiment_between
from engb_core.model import Model
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording
from engb_core.signals.absent_effort import with_effort
from engb_core.signals.data_faults import cleaned, DataFault, without_motion
from engb_core.signals.plausibility import refuse_implausible

__all__ = ['diagnose']

# A lag from here on [s] has efforts before a stop belong to a shaft that stands.
SHORTEST_LAG = 1e-3


def diagnose(recordings: Sequence[Recording], model: Model, holdout: Sequence[Recording] = (),
             progress: Callable[[str], None] | None = None, threads: int | None = None,
             ) -> Diagnosis:
    """Compare a model with recordings and say what physics it leaves out.

    Args:
        recordings: what may be fitted.
        model: the nominal model.
        holdout: judged only. A part of the other recordings is kept out of what decides; with
            a holdout the numbers of what was decided are fitted to that part as well.
        progress: is told what is being done, a line each.
        threads: that fit side by side (None: one for each processor); the result is the same.

    Raises:
        InputError: too little motion to judge a model by, units that cannot be right, neither
            effort nor a reference from which a position loop tells it, or a damaged installation.
    """
    started = time.perf_counter()
    tell = progress or (lambda text: None)
    shipped_calibration()   # Damaged, it is told before all the work.
    threads = processors() if threads is None else threads
    recordings, holdout = with_effort(recordings, model), with_effort(holdout, model)
    refuse_implausible((*recordings, *holdout), model)
    tell('reading the motion')
    recordings, faults = _cleaned(recordings, model)
    holdout, further = _cleaned(holdout, model)
    problem, outcome = _without_stops(recordings, model, holdout, tell, threads)
    used = [run.recording for run in (*problem.runs, *problem.held_out)]
    still = [without_motion(recording) for recording in (*recordings, *holdout)
             if all(recording is not other for other in used)]
    tell('listening for a resonance above the band')
    resonance = resonance_beside(outcome.judged_on(problem), outcome.corrected, threads)
    if resonance is not None:
        tell('judging what is left beside the resonance')
        beyond = decimated(with_resonance(problem, resonance.setting, threads), threads)
        beside = _judged(beyond, tell, threads, outcome.fitter,
                         None if resonance.instead else outcome.selection.chosen)
        if _explains_as_much(beside, outcome):
            outcome = _beside(resonance, _with_law(beside, tell))
        else:
            resonance = None
    if resonance is None:
        outcome = _with_law(outcome, tell)
    problem = outcome.judged_on(problem)
    explanation, findings = outcome.explanation, with_parts(outcome.findings)
    located, where = _located(problem, outcome, resonance)
    tell('simulating the loop')
    last: tuple[Callable[[], Any], ...] = (
        partial(_proposed, outcome),
        partial(simulated_loops, problem, outcome.corrected))
    proposal, loops = parallel_map(lambda work: work(), last, threads)
    unexplained = with_nearest(outcome.unexplained) or nameless_curve(findings)
    diagnosis = Diagnosis(
        verdict=outcome.verdict, effects=with_cause_sets(findings), time=tuple(located),
        where=tuple(where), unexplained=unexplained,
        held_out=quality_of_fit(problem, outcome.corrected, loops),
        next_experiment=proposal, model=outcome.corrected,
        evidence=evidence_of(problem, outcome.fitter, explanation.fit, outcome.selection,
                             outcome.corrected, findings, loops,
                             time.perf_counter() - started),
        data_faults=(*faults, *further, *still), timing=outcome.timing)
    return of_slider(diagnosis) if model.joint.type == 'prismatic' else diagnosis


def _proposed(outcome: _Outcome) -> NextExperiment | None:
    """Return the reference that tells names from their rivals, or a law from others that do as
    well."""
    proposal = next_experiment(outcome.fitter, outcome.explanation.fit, outcome.findings,
                               outcome.selection.rivals)
    if outcome.law is None or proposal is not None and proposal.time is not None:
        return proposal
    return experiment_between(outcome.law.found) or proposal


def _located(problem: Problem, outcome: _Outcome, resonance: Resonance | None,
             ) -> tuple[list[Interval], list[Zone]]:
    """Return the stretches of time and the ranges of coordinates in which the model is off."""
    if outcome.verdict == 'consistent':
        return [], []
    findings, explanation = outcome.findings, outcome.explanation
    runs, parts, bandwidth = list(problem.runs), problem.split(outcome.mismatch), problem.bandwidth
    left = explanation.fit.residual
    if explanation.table is not None:
        left = left - explanation.table.predicted
    rest = problem.split(left)
    residual = not explanation.fit.hypothesis.variants and all(
        entry.effect in (LOAD_SHAPE, RESONANCE) for entry in findings)
    if resonance is not None and all(
            entry.effect == resonance.setting.effect or entry.probability < LARGER_PART
            for entry in findings):
        runs, parts, rest = list(resonance.runs), list(resonance.parts), list(resonance.left)
        bandwidth, residual = resonance.bandwidth, False
    real = mismatched([run.time for run in runs], parts, rest, [run.sigma for run in runs],
                      bandwidth, residual)
    return [entry for run, part, holds in zip(runs, parts, real, strict=True)
            for entry in intervals(run, part, holds)], zones(runs, parts, outcome.corrected)


def _cleaned(recordings: Sequence[Recording], model: Model,
             ) -> tuple[list[Recording], list[DataFault]]:
    """Return the recordings without samples that cannot be true, their faults among the notes;
    and the faults."""
    found, faults = [], []
    for recording in recordings:
        clean, wrong = cleaned(recording, model)
        found.append(replace(clean, notes=(*clean.notes, *(entry.statement for entry in wrong))))
        faults += wrong
    return found, faults


def _without_stops(recordings: Sequence[Recording], model: Model, holdout: Sequence[Recording],
                   tell: Callable[[str], None], threads: int) -> tuple[Problem, _Outcome]:
    """Return the problem and what is said of it; where torque was found to come late, once more
    without what comes too late before a stop."""
    def judged(before_stop: float, earlier: Fitter | None = None,
               found: Fit | None = None) -> tuple[Problem, _Outcome]:
        problem = problem_of(recordings, model, holdout, before_stop=before_stop)
        settled = replace(problem, settled=(RESONANCE,)) if judged_wide(problem) else problem
        return problem, _judged(decimated(settled, threads), tell, threads, earlier, found)

    problem, outcome = judged(0.0)
    lag = lateness(outcome.corrected)
    if lag < SHORTEST_LAG:
        return problem, outcome
    tell('judging once more without what comes too late before a stop')
    try:
        again = judged(BEFORE_STOP * lag, outcome.fitter, outcome.selection.chosen)
    except InputError:
        return problem, outcome
    return again if lateness(again[1].corrected) > 0.0 else (problem, outcome)


@dataclass(frozen=True)
class _Outcome:
    """What one round of fitting says: its fits, what is claimed, the mismatch (m,) [N·m] that
    this makes up, the corrected model, what the library says with its models, the law that won,
    and by how much torque and effort are apart within a sample."""

    fitter: Fitter
    selection: Selection
    explanation: Explanation
    findings: list[EffectFinding]
    mismatch: np.ndarray
    verdict: str
    unexplained: Unexplained | None
    corrected: Model
    told: CorrectedModels
    law: Won | None = None
    timing: Timing | None = None

    def judged_on(self, problem: Problem) -> Problem:
        """Return the problem with the onsets of what the corrected model holds, and with the noise
        that this was judged by."""
        noise = with_less_noise(problem, self.fitter.problem.noise_part)
        return replace(noise, onsets=self.explanation.fit.hypothesis.onsets)


def _judged(problem: Problem, tell: Callable[[str], None], threads: int,
            earlier: Fitter | None = None, found: Fit | None = None) -> _Outcome:
    by_form, selection = searched(problem, tell, threads, earlier, found)
    fitter = by_form.fitter
    problem, nominal = fitter.problem, fitter.nominal()
    by_file = fitter, nominal, selection
    if not selection.consistent:
        tell('asking whether the load curve has another form')
        free = with_free_load_curve(fitter, selection)
        whole = None if free is None else moved_as_a_whole(by_form, selection)
        if whole is not None:
            selection = whole
        elif free is not None:
            tell('beginning again with a free load curve')
            again = search(free, tell, selection.chosen)
            fitter, nominal, selection = free, free.nominal(), select(again)
    if not selection.consistent:
        tell('asking whether an effect begins within the recordings')
        selection = with_effort_scale(fitter, with_onset(fitter, selection, found))
    tell('refining')
    chosen = selection.chosen
    if is_multimodal(chosen):
        chosen = middle_of_basin(fitter, search_around(fitter, fitter.refine(chosen)))
    chosen = fitter.finish(without_idle_orders(fitter, fitter.refine(chosen)))
    gone = makeshifts(fitter, chosen)
    chosen = fitter.finished_without(chosen, gone) if gone else chosen
    tell('asking whether a flexible model explains more')
    explanation = explain(fitter, chosen)
    timing = timing_of(fitter, explanation.fit)
    told = CorrectedModels(explanation, explanation.models(),
                           explained_problem(fitter, explanation.fit), explanation.fit)
    numbers: list[NumberFinding] = []
    if not selection.consistent:
        tell('telling wrong numbers from missing physics')
        numbers = wrong_numbers(fitter, explanation.fit)
        grows = missing_load_friction(fitter, explanation.fit)
        if grows is not None and all(entry.effect != grows.effect for entry in numbers):
            numbers.append(grows)
        shape = load_shape_finding(fitter, explanation.fit)
        numbers += [] if shape is None else [shape]
        tell('taking the numbers from a sharper motion')
        told = at_full_bandwidth(fitter, explanation)
    findings, mismatch = findings_of(fitter, nominal, told.explanation, explanation.fit, numbers,
                                     selection, told.averaged)
    doubtful = tuple(entry.effect for entry in findings if entry.probability < LEAST_PROBABILITY)
    findings = [entry for entry in findings if entry.probability >= LEAST_PROBABILITY]
    carries = carries_over(told, problem.model)
    if findings and not (carries and (
            any(_is_physics(entry, selection) for entry in findings)
            or that_carries(fitter, nominal, told).models)):
        # Nor does a free load curve carry over that is told with them; but a number that is off
        # whatever the form of the curve is off.
        was_free = fitter.load_shape and carries
        fitter, nominal, selection = by_file
        told = _without_names(fitter, explanation, findings)
        explanation, mismatch = told.explanation, nominal.residual
        findings = still_told(fitter, explanation, findings) if was_free else []
    absent = absent_load(fitter, nominal)
    if absent is not None and absent.is_plainer(fitter, explanation):
        told = _without_names(fitter, explanation, findings)
        return _Outcome(fitter, selection, told.explanation, [], absent.residual, 'unexplained',
                        absent.unexplained(fitter), absent.corrected(problem.model, fitter),
                        told)
    verdict, unexplained = verdict_of(
        fitter, nominal, replace(explanation, dropped=(*explanation.dropped, *doubtful)),
        findings, selection.further)
    corrected, certain = problem.model, told
    if verdict != 'consistent':
        # What is likelier wrong than right is told, but has to carry over to be in the model.
        likely = any(_is_physics(entry, selection) and entry.any_cause >= LARGER_PART
                     for entry in findings)
        certain = without_what_passes_once(fitter, told, findings)
        applied = certain if likely else that_carries(fitter, nominal, certain)
        otherwise = () if findings and applied.models else (problem.model,)
        alone = None if applied.models else with_numbers_alone(fitter, explanation, findings)
        if alone is not None:
            certain = replace(certain, explanation=alone, models=alone.models())
            applied = that_carries(fitter, nominal, certain)
        corrected = that_helps(applied, otherwise)
    # Numbers that are not right for every kind of motion may help all the same: not consistent.
    helps = corrected is not problem.model or (
        verdict != 'consistent'
        and that_helps(told, (problem.model,)) is not problem.model)
    verdict = unless_nothing_helps(verdict, findings, helps)
    if verdict == 'consistent':
        # When samples were taken is known to a sample, and is no missing physics.
        corrected, timing = with_timing(fitter, nominal)
    if problem.held_out and corrected in certain.models:
        tell('fitting the numbers to all that may be fitted')
        corrected = fitted_to_all(fitter, certain, certain.models.index(corrected))
    return _Outcome(fitter, selection, told.explanation, findings, mismatch, verdict,
                    unexplained, corrected, told, timing=timing)


def _with_law(outcome: _Outcome, tell: Callable[[str], None]) -> _Outcome:
    """Return the outcome with a law for what names and numbers leave, where one is believed."""
    # A free load curve describes, as a law does: each says what the other could have said.
    described = any(entry.effect == LOAD_SHAPE for entry in outcome.findings)
    if outcome.unexplained is not None and outcome.unexplained.load_is_absent:
        # What has to be identified first needs no law.
        return outcome
    if outcome.unexplained is None and not described:
        return _unless_law_is_likelier(outcome, tell)
    # Names of which one is likelier right than none stand beside a law.
    likely = any(entry.any_cause >= LARGER_PART for entry in outcome.findings
                 if entry.effect != LOAD_SHAPE)
    law = law_for(outcome.fitter, outcome.told, likely, tell)
    if law is None:
        return outcome
    if isinstance(law, Nearest):
        return outcome if outcome.unexplained is None else replace(
            outcome, unexplained=nearest_told(outcome.fitter, outcome.told, law,
                                              outcome.unexplained))
    return _told_with(outcome, law)


def _unless_law_is_likelier(outcome: _Outcome, tell: Callable[[str], None]) -> _Outcome:
    """Return the outcome, or one with a law instead of names that explain all there is, where
    these are less sure than one name that leaves nothing: several, or one that leaves something.
    Wrong numbers stand beside either."""
    named = outcome.explanation.fit.hypothesis.ids
    sure = [entry.any_cause for entry in outcome.findings
            if entry.any_cause >= LARGER_PART and entry.effect in named]
    if not sure or len(sure) == 1 and sure[0] >= something_known(0.0):
        return outcome
    law = law_instead(outcome.fitter, outcome.told, float(np.prod(sure)), tell)
    return outcome if law is None else _told_with(outcome, law)


def _told_with(outcome: _Outcome, law: Won) -> _Outcome:
    """Return the outcome with a law that won."""
    findings = still_told(law.fitter, law.explanation, outcome.findings) if law.alone else [
        finding for finding in outcome.findings if finding.effect not in law.fallen]
    left = max(0.0, 1.0 - sum(finding.share for finding in findings))
    return replace(
        outcome, fitter=law.fitter, explanation=law.explanation, findings=findings,
        mismatch=outcome.mismatch + law.contribution if findings else law.contribution,
        verdict='partly_explained' if findings else 'unexplained',
        unexplained=law.told(outcome.unexplained, left), corrected=law.model, law=law,
        # Beside a law numbers are others, and it may say itself that torque is late.
        timing=None)


def _explains_as_much(outcome: _Outcome, other: _Outcome) -> bool:
    """Whether an outcome leaves no more than another one of the same recordings, or no more than
    noise: what takes the place of a gap in the wide band must do as much in the narrow one."""
    left, best = (reduced_chi_square(entry.explanation.fit, other.fitter)
                  for entry in (outcome, other))
    return left - 1.0 <= max(best - 1.0, CLEAN_EXCESS)


def _beside(resonance: Resonance, outcome: _Outcome) -> _Outcome:
    """Return the outcome of a round that was given the resonance, with the resonance in it."""
    share = resonance.finding.share
    left = 1.0 - share
    findings = in_order([resonance.finding, *(replace(entry, share=left * entry.share)
                                              for entry in outcome.findings)])
    without = replace(outcome.corrected, effects=tuple(
        entry for entry in outcome.corrected.effects if entry.effect != resonance.setting.effect))
    adds = np.concatenate([run.predicted(physics_of(outcome.corrected))
                           - run.predicted(physics_of(without))
                           for run in outcome.fitter.problem.runs])
    mismatch = outcome.mismatch + adds if outcome.findings else adds
    verdict = {'consistent': 'explained', 'unexplained': 'partly_explained'}.get(
        outcome.verdict, outcome.verdict)
    unexplained = outcome.unexplained
    if unexplained is not None:
        unexplained = replace(unexplained, share=max(
            0.0, 1.0 - sum(finding.share for finding in findings)))
    return replace(outcome, findings=findings, mismatch=mismatch, verdict=verdict,
                   unexplained=unexplained)


def _is_physics(finding: EffectFinding, selection: Selection) -> bool:
    """Whether more is named than a number, which a refit moves whatever is missing; but two that
    agree (effort_scale.py) are more than that."""
    return finding.effect in selection.believed or (
        finding.effect != LOAD_SHAPE and not get_effect(finding.effect).number_only)


def _without_names(fitter: Fitter, explanation: Explanation, findings: list[EffectFinding],
                   ) -> CorrectedModels:
    """Return refitted numbers alone, with the names that were dropped for them."""
    base = fitter.finished_base
    dropped = (*explanation.dropped, *(entry.effect for entry in findings))
    alone = Explanation(base, None, dropped, carried_over=False)
    return CorrectedModels(alone, alone.models(), fitter.problem, base)
