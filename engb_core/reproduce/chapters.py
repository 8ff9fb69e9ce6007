# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""All chapters in turn, on both brakes: each stage uses what the stages before have found."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from engb_core.bench.settings import BenchSettings
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.reproduce import chosen
from engb_core.reproduce.beyond_chapter import analyse_wear, BeyondResult, diagnose_residual
from engb_core.reproduce.identification_chapter import analyse_strokes
from engb_core.reproduce.nominal_chapter import analyse_nominal, compare_cogging
from engb_core.reproduce.plan import Experiment, plan_of
from engb_core.reproduce.results import BrakeResults, Results
from engb_core.reproduce.self_energizing_chapter import analyse_disc
from engb_core.reproduce.truth import truth_of
from engb_core.reproduce.validation_chapter import analyse_validation

__all__ = ['plans', 'reproduce']

Record = Callable[[str, Experiment, Model], Recording]


def plans() -> dict[str, tuple[Experiment, ...]]:
    """Return the experiments on each brake, by the brake's name."""
    return {name: plan_of(brake, chosen.WEARING if name == 'more' else None)
            for name, brake in chosen.BRAKES.items()}


def reproduce(record: Record, progress: Callable[[str], None] | None = None, seeds: int = 20,
              diagnosis: bool = True) -> Results:
    """Run (or read) every experiment and analyse it.

    Args:
        record: returns the recording of a brake's experiment under the controller's model.
        progress: called with one line of text per step.
        seeds: of the noise, over which each way of identifying is judged.
        diagnosis: diagnose what the paper's model leaves of the second brake.

    Raises:
        InputError: a recording can't be analysed.
    """
    tell = progress or (lambda line: None)
    found, recordings, plan = {}, {}, plans()
    for name, brake in chosen.BRAKES.items():
        found[name], recordings[name] = _one_brake(name, brake, plan[name], record, seeds, tell)
    more = found['more']
    wear = next(entry for entry in plan['more'] if entry.name == 'wear')
    tell('tracking wear, heat and force')
    beyond = BeyondResult(
        analyse_wear(recordings['more']['wear'], wear, more.strokes.good.model,
                     more.disc.directions[0].joint.gain.value,
                     more.nominal.torque_constant.value),
        diagnose_residual(recordings['more'], more.paper_model, tell) if diagnosis else None)
    return Results(found['form'], more, beyond, seeds)


def _one_brake(name: str, brake: BenchSettings, plan: tuple[Experiment, ...], record: Record,
               seeds: int, tell: Callable[[str], None],
               ) -> tuple[BrakeResults, Mapping[str, Recording]]:
    models = {'nominal': chosen.NOMINAL}
    recordings: dict[str, Recording] = {}
    experiments = {entry.name: entry for entry in plan}
    truth = truth_of(brake)

    def run(stage: str) -> None:
        for experiment in (entry for entry in plan if entry.stage == stage):
            tell(f'{name}/{experiment.name}: {experiment.purpose}')
            recordings[experiment.name] = record(name, experiment, models[experiment.model])

    run('nominal')
    tell(f'{name}: analysing the free motor')
    nominal = analyse_nominal(recordings)
    models['classical'] = nominal.classical
    run('strokes')
    tell(f'{name}: identifying from the strokes')
    cogging = compare_cogging(recordings['cogging'], recordings['cogging_compensated'])
    strokes = analyse_strokes(recordings, experiments, nominal, truth, seeds, tell)
    models['joint'] = strokes.good.model
    models['paper'] = strokes.causal.model(nominal.classical)
    disc = analyse_disc(recordings, nominal, truth)
    run('validation')
    tell(f'{name}: analysing the validation')
    validation = analyse_validation(recordings, experiments, models['paper'], models['joint'])
    return BrakeResults(name, truth, nominal, cogging, strokes, models['paper'], validation,
                        disc), recordings
