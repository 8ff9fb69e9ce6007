# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Identify a brake model from recorded clamp and release strokes (the paper's steps 2 to 6).

examples:
  engb identify strokes --out model.yaml
  engb identify strokes_1 strokes_2 --model nominal.yaml --out model.yaml

The strokes must reach contact and come back, with constant speed up and down; `engb demo` and
the controller node's identification mode drive such strokes. The start model gives what they
can't determine; without it the paper's numbers are taken.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

from engb_core.errors import computing
from engb_core.text.printable import printable
from engb_ros.commands.common import (
    add_joint,
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
    parser.add_argument('recordings', nargs='+', metavar='RECORDING',
                        help='bag folders or files, or tables')
    parser.add_argument('--out', required=True, metavar='MODEL.yaml',
                        help='where the identified model goes')
    add_model(parser, required=False, text='the model to start from')
    add_joint(parser)
    add_namespace(parser)
    add_progress(parser)
    add_table_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    from engb_core.model import Model
    model = read_model(arguments.model) if arguments.model else None
    refuse_idle(arguments, arguments.recordings)
    # Strokes are identified from what was measured, not from what a loop asked for.
    request = replace(request_of(arguments, model), effort_optional=False)
    if arguments.joint is not None:
        start = model or Model()
        model = replace(start, joint=replace(start.joint, name=arguments.joint))
    inputs = [*arguments.recordings, *([arguments.model] if arguments.model else [])]
    with Progress(arguments) as progress, file_output(
            arguments.out, '.yaml', inputs) as scratch:
        read = read_inputs(arguments.recordings, model, arguments.namespace, progress, request,
                           arguments.joint)
        constant = read.request.torque_constant
        if constant is not None:
            start = model or Model()
            model = replace(start, motor=replace(start.motor, torque_constant=constant))
        from engb_core.identify.procedure import identify
        progress('identifying')
        with computing(', '.join(arguments.recordings)):
            identified = identify(read.recordings, model)
        identified.model.write(scratch)
    for told in read.told:
        print(told)
    print(identified.summary())
    print(f'model: {printable(arguments.out)}')
