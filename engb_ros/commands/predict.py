# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Say what a model predicts for a recording, sample by sample, as a .npz file.

Arrays in FILE.npz, all of the recording's cleaned samples: time [s from the first sample],
effort [N·m, the motor torque that the recorded motion needs], and, where the recording has a
reference and the model a controller, position [rad] and velocity [rad/s] of the simulated loop.

examples:
  engb predict test --model nominal.yaml --out nominal.npz
  engb predict test --model result/model.yaml --out corrected.npz

For a prismatic joint read m and N for rad and N·m.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any, cast

from engb_core.errors import computing, InputError
from engb_core.text.printable import printable
from engb_ros.commands.common import (
    add_effects,
    add_model,
    add_namespace,
    add_progress,
    file_output,
    Progress,
    read_model,
)
from engb_ros.commands.inputs import (
    add_table_options,
    read_inputs,
    refuse_idle,
    request_of,
)

__all__ = ['add_arguments', 'run']


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('recording', metavar='RECORDING', help='a bag folder or file, or a table')
    add_model(parser)
    parser.add_argument('--out', required=True, metavar='FILE.npz', help='where the arrays go')
    add_effects(parser)
    add_namespace(parser)
    add_progress(parser)
    add_table_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    model = read_model(arguments.model)
    refuse_idle(arguments, [arguments.recording], constant_kept=False)
    request = replace(request_of(arguments, model), effort_optional=False)
    with Progress(arguments) as progress, file_output(
            arguments.out, '.npz', [arguments.model, arguments.recording]) as scratch:
        inputs = read_inputs([arguments.recording], model, arguments.namespace, progress, request)
        recording, = inputs.recordings
        import numpy as np

        from engb_core.prediction import predict_effort
        progress('the torque that the motion needs')
        with computing(arguments.recording):
            arrays = {'time': recording.time, 'effort': predict_effort(recording, model)}
        if recording.reference is not None and model.controller is not None:
            from engb_core.physics.simulation import simulate_closed_loop
            progress('simulating the closed loop')
            with computing(arguments.recording):
                arrays['position'], arrays['velocity'] = simulate_closed_loop(recording, model)
        if not np.isfinite(arrays['effort']).all():
            raise InputError(f'{arguments.model}: its numbers give no finite effort for '
                             f'{arguments.recording}; check their size and unit')
        # A loop may be unstable with numbers that say well what a motion needs, as with an
        # inertia of nearly nothing, which slow motion tells nothing of.
        unstable = not all(np.isfinite(values).all() for values in arrays.values())
        if unstable:
            del arrays['position'], arrays['velocity']
        with scratch.open('wb') as file:
            np.savez_compressed(file, **cast(dict[str, Any], arrays))
    for told in inputs.told:
        print(told)
    print(f'{printable(arguments.out)}: {recording.time.size} samples, '
          f'{recording.duration:.1f} s, {", ".join(arrays)}')
    difference = float(np.sqrt(np.mean((arrays['effort'] - recording.effort) ** 2)))
    if unstable:
        print(f'note: with the numbers of {printable(arguments.model)} the closed loop is not '
              'stable; position and velocity are left out')
    print(f'effort: predicted and recorded differ by {difference:.3g} rms (unfiltered)')
