# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Make the first model of any axis: of tables of a bench, or of rosbag2 recordings.

Inertia, viscous and Coulomb friction, an offset, and a load curve, sinusoid or contact where the
data determine it: blocks of time are predicted by fits to all others, and of the forms that do
this as well as the best, but for chance, the one with the fewest numbers is taken.
Writes MODEL.yaml and, beside it, MODEL.html: what was found, how sure, and what could not be told.

examples:
  engb model bench.csv --out model.yaml
  engb model bench.csv --unit position=deg effort=A --torque-constant 0.05 --out model.yaml
  engb model run1 run2 --out model.yaml

Strokes of a brake, whose load and friction the paper's procedure separates: engb identify.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from engb_core.errors import computing, InputError
from engb_core.text.printable import printable
from engb_ros.commands.common import (
    add_joint,
    add_namespace,
    add_progress,
    folder_output,
    Progress,
)
from engb_ros.commands.inputs import (
    add_table_options,
    read_inputs,
    refuse_idle,
    request_of,
    write_first_model,
)

__all__ = ['add_arguments', 'run']

NO_CONSTANT = ('the torque constant: no input tells it, and motor.torque_constant is a usual '
               'value; give --torque-constant')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('recordings', nargs='+', metavar='TABLE-or-RECORDING')
    parser.add_argument('--out', required=True, metavar='MODEL.yaml',
                        help='where the model goes; the page goes beside it')
    add_joint(parser)
    add_namespace(parser)
    add_progress(parser)
    add_table_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    out = Path(arguments.out)
    if out.suffix != '.yaml':
        raise InputError(f'--out {arguments.out}: the name must end in .yaml')
    refuse_idle(arguments, arguments.recordings)
    request = request_of(arguments)
    page = out.with_suffix('.html')
    with Progress(arguments) as progress, folder_output(
            str(out.parent), (out.name, page.name), arguments.recordings) as scratch:
        inputs = read_inputs(arguments.recordings, None, arguments.namespace, progress, request,
                             arguments.joint)
        from engb_core.identify.first_model import first_model
        with computing(', '.join(arguments.recordings)):
            first = first_model(inputs.recordings, inputs.joint,
                                inputs.request.torque_constant, progress)
        if inputs.request.torque_constant is None:
            first = replace(first, not_told=(*first.not_told, NO_CONSTANT))
        write_first_model(scratch / out.name, scratch / page.name, first)
    for told in inputs.told:
        print(told)
    print(first.summary())
    print(printable(f'model: {out}'))
    print(printable(f'report: {page}'))
