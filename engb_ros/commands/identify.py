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

from engb_core.errors import computing
from engb_core.text.printable import printable
from engb_ros.commands.common import (
    add_model,
    add_namespace,
    add_progress,
    file_output,
    Progress,
    read_model,
    read_recordings,
)

__all__ = ['add_arguments', 'run']


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('recordings', nargs='+', metavar='RECORDING', help='bag folders or files')
    parser.add_argument('--out', required=True, metavar='MODEL.yaml',
                        help='where the identified model goes')
    add_model(parser, required=False, text='the model to start from')
    add_namespace(parser)
    add_progress(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    model = read_model(arguments.model) if arguments.model else None
    inputs = [*arguments.recordings, *([arguments.model] if arguments.model else [])]
    with Progress(arguments) as progress, file_output(
            arguments.out, '.yaml', inputs) as scratch:
        recordings = read_recordings(arguments.recordings, model, arguments.namespace, progress)
        from engb_core.identify.procedure import identify
        progress('identifying')
        with computing(', '.join(arguments.recordings)):
            identified = identify(recordings, model)
        identified.model.write(scratch)
    print(identified.summary())
    print(f'model: {printable(arguments.out)}')
