# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a report shows for a diagnosis: traces, loops, the revealing picture, rivals, figures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import (
    Candidate,
    ClosedLoop,
    EffectFinding,
    Evidence,
    NominalChange,
    QualityOfFit,
    ResidualOver,
    Trace,
)
from engb_core.diagnose.locate import coordinates
from engb_core.diagnose.nominal import DELAY
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.pictured import channels_of
from engb_core.diagnose.problem import Problem, Run
from engb_core.diagnose.score.probability import rival_weights
from engb_core.diagnose.score.reduced_chi_square import excess, unseen_rows
from engb_core.diagnose.selection import Selection
from engb_core.diagnose.uncertainty import vector_deviations
from engb_core.effects.catalogue import get_effect
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.physics.simulation import simulate_closed_loop
from engb_core.prediction import find_phases

__all__ = ['evidence_of', 'pooled', 'quality_of_fit', 'simulated_loops', 'unseen_errors']

Array = NDArray[np.float64]
BINS = 40
LOOP_POINTS = 4000


def _judged(problem: Problem) -> list[tuple[Run, NDArray[np.bool_]]]:
    """Return the runs with the rows that no fit has seen."""
    if problem.held_out:
        return [(run, np.ones(run.measured.size, bool)) for run in problem.held_out]
    return [(run, ~run.fitted) for run in problem.runs]


def _predicted(problem: Problem, run: Run, model: Model) -> Array:
    return problem.predicted(run, find_phases(run.motion, model))


def _begun(problem: Problem, run: Run, time: Array) -> NDArray[np.bool_]:
    """Return at which times (n,) of a run all effects act that begin within the recordings."""
    begun = np.ones(time.size, bool)
    for place, own in enumerate(problem.runs):
        for _, onset in problem.onsets:
            if own is run:
                begun &= time >= onset.begins[place]
    return begun


def unseen_errors(problem: Problem, model: Model) -> list[Array]:
    """Return the error of the filtered effort [N·m] on each stretch that the recordings kept from
    the fit."""
    found = []
    for run in problem.runs:
        error = run.measured - _predicted(problem, run, model)
        ends = np.flatnonzero(np.diff(run.fitted)) + 1
        found += [part for part, fitted in zip(np.split(error, ends), np.split(run.fitted, ends),
                                               strict=True) if part.size and not fitted[0]]
    return found


def pooled(errors: list[Array]) -> float:
    """Return the mean square of errors on all stretches together; 0 where there are none."""
    return float(np.mean(np.concatenate(errors) ** 2)) if errors else 0.0


def quality_of_fit(problem: Problem, corrected: Model, loops: dict[str, ClosedLoop],
                   ) -> tuple[QualityOfFit, ...]:
    """Return the held-out figures: effort, and position of the simulated loop where it can be."""
    angle, torque = (('rad', 'N·m') if problem.model.joint.type == 'revolute' else ('m', 'N'))
    found = []
    for run, rows in _judged(problem):
        if rows.sum() == 0:
            continue
        before, after = (
            float(np.sqrt(np.mean((run.measured - _predicted(problem, run, model))[rows] ** 2)))
            for model in (problem.model, corrected))
        found.append(QualityOfFit(run.recording.name, 'effort', before, after,
                                  _floor(run.noise[rows], before, after), torque))
        loop = loops.get(run.recording.name)
        if loop is not None:
            seen = np.interp(loop.time, run.motion.time[run.comparison.grid],
                             rows.astype(float)) > 0.5
            # The simulated loop has every effect from its begin on.
            seen &= _begun(problem, run, loop.time)
            if not seen.any():
                continue
            before, after = (float(np.sqrt(np.mean((values - loop.recorded)[seen] ** 2)))
                             for values in (loop.simulated_before, loop.simulated_after))
            if np.isfinite([before, after]).all():
                found.append(QualityOfFit(run.recording.name, 'position', before, after, _floor(
                    np.array(run.motion.quantum / np.sqrt(12.0)), before, after), angle))
    return tuple(found)


def _floor(noise: Array, *errors: float) -> float:
    """Return the rms of noise (n,), or the least of the rms `errors` of models in the same samples
    if that is less: what is left holds all of the noise there is. An estimate from beside the
    compared band takes what cogging or the ends of a motion do there for noise."""
    return min(float(np.sqrt(np.mean(noise ** 2))), *errors)


def simulated_loops(problem: Problem, corrected: Model) -> dict[str, ClosedLoop]:
    """Return each recording's loop, simulated with the nominal and the corrected model."""
    loops = {run.recording.name: _loop(run, problem.model, corrected)
             for run in (*problem.runs, *problem.held_out)}
    return {name: loop for name, loop in loops.items() if loop is not None}


def _loop(run: Run, nominal: Model, corrected: Model) -> ClosedLoop | None:
    try:
        before, _ = simulate_closed_loop(run.recording, nominal)
        after, _ = simulate_closed_loop(run.recording, corrected)
    except InputError:
        return None
    if not (np.isfinite(before).all() and np.isfinite(after).all()):
        return None
    pick = slice(None, None, max(1, run.recording.time.size // LOOP_POINTS))
    return ClosedLoop(run.recording.name, run.recording.time[pick], run.recording.position[pick],
                      before[pick], after[pick])


def evidence_of(problem: Problem, fitter: Fitter, chosen: Fit, selection: Selection,
                corrected: Model, findings: list[EffectFinding],
                loops: dict[str, ClosedLoop], seconds: float) -> Evidence:
    """Gather what the report draws of `problem`, which `fitter` may have further effects in."""
    runs = [*problem.runs, *problem.held_out]
    traces = []
    for run in runs:
        grid = run.comparison.grid
        before, after = (_predicted(problem, run, model) for model in (problem.model, corrected))
        errors = [float(np.sqrt(np.mean((run.measured - effort) ** 2)))
                  for effort in (before, after)]
        traces.append(Trace(
            run.recording.name, run.held_out, run.motion.time[grid], run.motion.position[grid],
            run.motion.velocity[grid], run.measured, before, after, np.ones(grid.size, bool),
            _floor(run.noise, *errors),
            channels_of(run, corrected, [finding.effect for finding in findings])))
    return Evidence(
        traces=tuple(traces), closed_loops=tuple(loops.values()),
        residual_over=tuple(_pictures(problem, traces, corrected, findings)),
        candidates=tuple(_candidates(fitter, chosen, selection)),
        nominal=tuple(_changes(fitter, chosen)),
        notes=tuple(f'{run.recording.name}: {note}' for run in runs
                    for note in run.recording.notes),
        seconds=seconds)


def _pictures(problem: Problem, traces: list[Trace], corrected: Model,
              findings: list[EffectFinding]) -> list[ResidualOver]:
    names = [get_effect(finding.effect).reveals for finding in findings] or ['position',
                                                                           'velocity']
    tables = [coordinates(run, corrected) for run in problem.runs]
    found = []
    for name in dict.fromkeys(name if all(name in table for table in tables) else 'velocity'
                              for name in names):
        values = np.concatenate([table[name][0] for table in tables])
        own = traces[:len(problem.runs)]
        applying = np.concatenate([trace.velocity for trace in own]) > 0
        before = np.concatenate([trace.effort - trace.predicted_before for trace in own])
        after = np.concatenate([trace.effort - trace.predicted_after for trace in own])
        low, high = np.quantile(values, [0.002, 0.998])
        edges = np.linspace(float(low), float(high), BINS + 1)
        if not np.all(np.diff(edges) > 0):
            continue
        place = np.digitize(values, edges) - 1
        curves = [_binned(place, rows, residual) for residual in (before, after)
                  for rows in (applying, ~applying)]
        found.append(ResidualOver(
            name, tables[0][name][1], 0.5 * (edges[1:] + edges[:-1]), curves[0], curves[1],
            curves[2], curves[3],
            'What follows the coordinate is a mismatch that depends on it; what lies along the '
            'zero line is noise.'))
    return found


def _binned(place: NDArray[np.int64], rows: NDArray[np.bool_], residual: Array) -> Array:
    good = rows & (place >= 0) & (place < BINS)
    count = np.bincount(place[good], minlength=BINS)
    total = np.bincount(place[good], residual[good], BINS)
    return np.where(count > 2, total / np.maximum(count, 1), np.nan)


def _candidates(fitter: Fitter, chosen: Fit, selection: Selection) -> list[Candidate]:
    fits = [chosen, *selection.rivals[:11]]
    weights = rival_weights(chosen, list(fits[1:]), fitter, selection.excess_before)
    rows = unseen_rows(fitter)
    found = []
    for fit, weight in zip(fits, weights, strict=True):
        after = excess(fit, fitter)
        share = 0.0 if selection.excess_before <= 0 else \
            float(np.clip(1.0 - after / selection.excess_before, 0.0, 1.0))
        found.append(Candidate(
            fit.hypothesis.ids, float(weight),
            float(np.sqrt(np.mean(fit.residual[rows] ** 2))), share,
            'chosen' if fit is chosen else ''))
    return found


def _changes(fitter: Fitter, chosen: Fit) -> list[NominalChange]:
    deviations = vector_deviations(chosen, fitter)
    start = chosen.hypothesis.start_of_numbers()
    found = []
    for place, number in enumerate(chosen.hypothesis.numbers):
        if number.name == DELAY or number.effect:
            continue
        before, after, std = start[place], chosen.vector[place], deviations[place]
        if number.logarithmic:
            before, after = np.exp(before), np.exp(after)
            std = std * after
        undetermined = std > 3.0 * max(abs(after), 1e-12)
        found.append(NominalChange(number.name, float(before), float(after),
                                   None if undetermined else float(std), number.unit))
    return found
