# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Find the physics that a model leaves out: compare it with recordings of the real machine.

Writes into DIR: report.html (start here), diagnosis.json, model.yaml (the corrected model), and
next_experiment.csv where another recording would settle what this one cannot.

A table of a bench (.csv, .mat, .mf4, …) is taken as it is; what its titles don't tell is asked, or
said with --column, --unit and --torque-constant. Without --model a first model is made of the
recordings; it and the tables as recordings go into DIR too.

With --simulated or --fmu your own simulator takes the model's place: a surrogate of it is
identified (surrogate.yaml), its own error told, and what is named is what the simulator lacks.

examples:
  engb diagnose bench.csv --out result
  engb diagnose bench.csv --unit position=deg effort=A --torque-constant 0.05 --out result
  engb diagnose run1 --model nominal.yaml --out result
  engb diagnose morning.mcap evening.mcap --model nominal.yaml --out result
  engb diagnose train --model nominal.yaml --holdout test --out result
  engb diagnose bench.csv --simulated simulation.csv --out result
  engb diagnose run1 --fmu simulator.fmu --out result
  engb diagnose run1 --model robot.xml --joint wheel --out result
  engb diagnose run1 --model nominal.yaml --mechanism mechanism.yaml --out result

A recording is a rosbag2 folder, an .mcap or a .db3 file (plain or zstd) that holds joint_states.
Without --holdout a part of the recordings is kept out of every fit. A mismatch is a result:
exit status 0. Status 2 and one line on standard error: there is no diagnosis to give.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
import textwrap
from typing import TYPE_CHECKING

from engb_core.errors import computing, InputError
from engb_core.text.printable import printable
from engb_ros.commands.common import (
    add_effects,
    add_namespace,
    add_progress,
    folder_output,
    Progress,
)
from engb_ros.commands.inputs import (
    add_table_options,
    read_inputs,
    recording_names,
    refuse_idle,
    request_of,
    write_first_model,
    write_inputs,
)
from engb_ros.commands.nominal_source import (
    add_nominal,
    is_joint_file,
    model_given,
    simulator_of,
    simulator_paths,
    SURROGATE,
)

if TYPE_CHECKING:
    from engb_core.diagnose.diagnosis import Diagnosis, NextExperiment
    from engb_core.model import Model
    from engb_ros.commands.inputs import Inputs

__all__ = ['FILES', 'add_arguments', 'run', 'summary', 'write_results']

REPORT, DOCUMENT, MODEL, EXPERIMENT = FILES = (
    'report.html', 'diagnosis.json', 'model.yaml', 'next_experiment.csv')

FIRST = ('first_model.yaml', 'first_model.html')

# A name that is more likely wrong than right is told as one.
EVEN = 0.5
# What is left may be as many noise floors and be called one.
NEAR_FLOOR = 1.3

VERDICTS = {
    'consistent': 'consistent: nothing above the noise floor; the model describes these '
                  'recordings',
    'explained': 'explained: what is below takes the mismatch away',
    'partly_explained': 'partly explained: effects were found, and structure remains',
    'unexplained': 'unexplained: there is structure that no known effect accounts for',
}
BUT_TIMING = ('consistent: nothing above the noise floor but that effort and position are part of '
              'a sample apart; model.yaml holds it')
BY_NUMBERS = ('explained: other numbers in the model take the mismatch away{which}; model.yaml '
              'holds them')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('recordings', nargs='+', metavar='RECORDING',
                        help='what to diagnose: bag folders or files, or tables')
    parser.add_argument('--out', required=True, metavar='DIR', help='where the results go')
    add_nominal(parser)
    parser.add_argument('--holdout', nargs='+', default=[], metavar='RECORDING',
                        help='recordings that no fit sees, on which the result is judged')
    parser.add_argument('--level', type=float, metavar='P', help='tell sets of causes that hold '
                        'the true one in this part of the cases (default: 0.9)')
    parser.add_argument('--mechanism', metavar='FILE', help='mechanism file (gear_ratio, '
                        'screw_lead, …): a law that repeats along the stroke then says which part '
                        'turns so')
    add_effects(parser)
    add_namespace(parser)
    add_progress(parser)
    add_table_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    if arguments.level is not None:
        from engb_core.diagnose.cause_sets import checked_level
        checked_level(arguments.level)
    mechanism = None
    if arguments.mechanism is not None:
        from engb_core.control.clamp_force import read_mechanism
        mechanism = read_mechanism(arguments.mechanism)
    from engb_core.recording import refuse_copies
    model, lacks = model_given(arguments)
    simulator = simulator_paths(arguments)
    request = request_of(arguments, model)
    given = [*arguments.recordings, *arguments.holdout]
    refuse_idle(arguments, [*given, *(arguments.simulated or ())], constant_kept=model is None)
    if arguments.fmu_variable and not arguments.fmu:
        raise InputError('--fmu-variable: has no effect without --fmu; leave it out')
    names = FILES if model else (*FILES, SURROGATE) if simulator else (*FILES, *FIRST)
    with Progress(arguments) as progress, folder_output(
            arguments.out, (*names, *recording_names(given).values()),
            [*([arguments.model] if model else []),
             *([arguments.mechanism] if mechanism else []), *simulator, *given],
            # The page beside a first model stays with it where that is what is diagnosed.
            former=(*(() if arguments.model and Path(arguments.model).name == FIRST[0] else FIRST),
                    SURROGATE, '*.mcap')) as scratch:
        # A joint of an .xml or .urdf may have another name there than in the recordings.
        inputs = read_inputs(given, model, arguments.namespace, progress, request,
                             arguments.joint, other_joint=is_joint_file(arguments.model))
        if not simulator:
            # What is no recording of a machine is told in one line, not below those of columns.
            _refuse(inputs, model)
        notes = (*inputs.told, *lacks)
        # Told with the result: where there is none, a line says why, and it alone.
        told = list(notes)
        recordings = inputs.recordings[:len(arguments.recordings)]
        holdout = inputs.recordings[len(arguments.recordings):]
        refuse_copies(recordings, holdout)
        write_inputs(scratch, inputs)
        with computing(', '.join(arguments.recordings)):
            if simulator:
                found = simulator_of(arguments, recordings, inputs.joint, inputs.request,
                                     progress)
                told += found.told
                model, notes = found.model, (*notes, *found.told)
                model.write(scratch / SURROGATE)
            if model is None:
                from engb_core.identify.first_model import first_model
                first = first_model(recordings, inputs.joint,
                                    inputs.request.torque_constant, progress)
                model = first.model
                write_first_model(scratch / FIRST[0], scratch / FIRST[1], first)
                told.append(
                    f'no model was given: a first one is in {FIRST[0]}\n{first.summary()}')
                notes = (*notes, 'No model was given: a first one was identified from these '
                         f'recordings ({FIRST[0]}).', *(f'The first model could not tell {text}.'
                                                        for text in first.not_told))
            from engb_core.diagnose.engine import diagnose
            diagnosis = diagnose(recordings, model, holdout=holdout, progress=progress)
        if mechanism is not None:
            from engb_core.laws.shafts import with_mechanism
            diagnosis = with_mechanism(diagnosis, mechanism)
        if arguments.level is not None:
            from engb_core.diagnose.cause_sets import with_cause_sets
            diagnosis = replace(diagnosis, effects=with_cause_sets(diagnosis.effects,
                                                                   arguments.level))
        diagnosis = replace(diagnosis, evidence=replace(
            diagnosis.evidence, notes=(*notes, *diagnosis.evidence.notes)))
        progress('writing the report')
        write_results(scratch, diagnosis)
    print(*told, sep='\n', end='\n' if told else '')
    if simulator:
        print(f'your simulator is described by {SURROGATE}; what is named here it lacks:')
    print(summary(diagnosis, said=notes))
    out = printable(arguments.out)
    print(f'report: {Path(out) / REPORT}')
    if diagnosis.next_experiment is not None and diagnosis.next_experiment.time is not None:
        print(f'next experiment: {Path(out) / EXPERIMENT}')


def _refuse(inputs: Inputs, model: Model | None) -> None:
    from engb_core.signals.plausibility import refuse_implausible, refuse_unmeasured
    if model is None:
        refuse_unmeasured(inputs.recordings, inputs.joint)
    else:
        refuse_implausible(inputs.recordings, model)


def write_results(folder: Path, diagnosis: Diagnosis) -> None:
    """Write all of a diagnosis's files into `folder`."""
    from engb_core.diagnose.document import to_json
    from engb_core.report.page import write_report
    (folder / DOCUMENT).write_text(to_json(diagnosis), encoding='utf-8')
    diagnosis.model.write(folder / MODEL)
    write_report(folder / REPORT, diagnosis)
    proposal = diagnosis.next_experiment
    if proposal is not None and proposal.time is not None and proposal.position is not None:
        write_experiment(folder / EXPERIMENT, proposal)


def write_experiment(path: Path, proposal: NextExperiment) -> None:
    """Write the proposed reference as a table that the controller node can run."""
    assert proposal.time is not None and proposal.position is not None
    with path.open('w', encoding='utf-8') as file:
        file.write('time,position\n')
        for time, position in zip(proposal.time, proposal.position, strict=True):
            file.write(f'{time:.6g},{position:.9g}\n')


def summary(diagnosis: Diagnosis, said: Sequence[str] = ()) -> str:
    """Return the diagnosis in a few lines of text, without notes that were `said` before."""
    from engb_core.report.alike import alike_together
    from engb_core.report.wording import largest_change
    by_numbers = diagnosis.verdict == 'explained' and not diagnosis.effects
    verdict = (BY_NUMBERS.format(which=largest_change(diagnosis)) if by_numbers else
               BUT_TIMING if diagnosis.verdict == 'consistent' and diagnosis.corrects else
               VERDICTS.get(diagnosis.verdict, diagnosis.verdict))
    lines = [verdict + _of_the_floor(diagnosis)]
    for number, finding in enumerate(diagnosis.effects, 1):
        doubt = ', rather not' if finding.probability < EVEN else ''
        lines.append(f'{number}. {finding.effect} (probability {finding.probability:.2f}{doubt}, '
                     f'{finding.share:.0%} of the mismatch)')
        lines.extend(_wrapped(finding.statement))
        rivals = ', '.join(f'{name} {probability:.2f}'
                           for name, probability in finding.alternatives)
        if rivals:
            lines.extend(_wrapped(f'not told apart from: {rivals}'))
        causes = finding.causes
        if causes is not None and (causes.another or len(causes.effects) > 1):
            open_ones = [*causes.effects, *(['another cause'] if causes.another else [])]
            lines.extend(_wrapped(f'set of causes at level {causes.level:.3g}: '
                                  f'{", ".join(open_ones)}'))
    if diagnosis.unexplained is not None and diagnosis.unexplained.statement:
        lines.append(f'unexplained: {diagnosis.unexplained.share:.0%} of the mismatch')
        lines.extend(_wrapped(diagnosis.unexplained.statement))
    if diagnosis.timing is not None:
        lines.append('timing, less than a sample')
        lines.extend(_wrapped(diagnosis.timing.statement))
    if diagnosis.held_out:
        lines.append('held out (rms):')
    for entry in diagnosis.held_out:
        floor = '' if entry.noise_floor is None else f', noise floor {entry.noise_floor:.3g}'
        lines.append(f'   {entry.recording} {entry.quantity}: {entry.rms_before:.3g} → '
                     f'{entry.rms_after:.3g} {entry.unit}{floor}')
    for note in alike_together([note for note in diagnosis.evidence.notes if note not in said]):
        lines.extend(_wrapped(f'note: {note}', ''))
    if diagnosis.next_experiment is not None:
        lines.extend(_wrapped(f'next: {diagnosis.next_experiment.reason}', ''))
    return '\n'.join(printable(line) for line in lines)


def _of_the_floor(diagnosis: Diagnosis) -> str:
    """Return how many noise floors of effort are left where an explanation was given."""
    rows = [entry for entry in diagnosis.held_out
            if entry.quantity == 'effort' and entry.noise_floor]
    if diagnosis.verdict != 'explained' or not rows:
        return ''
    floors = (sum(entry.rms_after ** 2 for entry in rows)
              / sum((entry.noise_floor or 0.0) ** 2 for entry in rows)) ** 0.5
    if floors <= NEAR_FLOOR:
        return ', effort down to the noise floor'
    return f', effort down to {floors:.1f} noise floors'


def _wrapped(text: str, indent: str = '   ') -> list[str]:
    return textwrap.wrap(text, 96, initial_indent=indent, subsequent_indent='   ')
