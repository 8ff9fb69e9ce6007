"""All chapters in turn: each stage's runs use what the stages before have identified."""

from __future__ import annotations

from collections.abc import Callable

from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.reproduce import chosen
from engb_core.reproduce.identification_chapter import analyse_strokes
from engb_core.reproduce.nominal_chapter import analyse_nominal, compare_cogging
from engb_core.reproduce.numbers import Results
from engb_core.reproduce.plan import Experiment, PLAN
from engb_core.reproduce.self_energizing_chapter import analyse_disc
from engb_core.reproduce.validation_chapter import analyse_validation

__all__ = ['reproduce']

Record = Callable[[Experiment, Model], Recording]


def reproduce(record: Record, progress: Callable[[str], None] | None = None,
              plan: tuple[Experiment, ...] = PLAN) -> Results:
    """Run (or read) every experiment and analyse it.

    Args:
        record: returns the recording of an experiment under the controller's model.
        progress: called with one line of text per step.
        plan: the experiments.

    Raises:
        InputError: a recording can't be analysed.
    """
    tell = progress or (lambda line: None)
    models = {'nominal': chosen.NOMINAL}
    recordings: dict[str, Recording] = {}

    def run(stage: str) -> None:
        for experiment in (entry for entry in plan if entry.stage == stage):
            tell(f'{experiment.name}: {experiment.purpose}')
            recordings[experiment.name] = record(experiment, models[experiment.model])

    run('nominal')
    tell('analysing the free motor')
    nominal = analyse_nominal(recordings)
    models['cogging'] = nominal.nominal
    run('strokes')
    tell('identifying from the strokes')
    cogging = compare_cogging(recordings['cogging'], recordings['cogging_compensated'])
    strokes = analyse_strokes(recordings, nominal)
    models['identified'] = strokes.good.model
    disc = analyse_disc(recordings, nominal, strokes.good)
    run('validation')
    tell('analysing the validation')
    validation = analyse_validation(recordings, strokes.good)
    return Results(nominal, cogging, strokes, validation, disc)
