# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Take a model along: to C, an FMU, Modelica, MuJoCo (MJCF), URDF or JSON.

c: the simulated brake with all effects and laws as C99 (engb_model.h, engb_model.c), and a header
with the feedforward torque (engb_feedforward.h). fmu: the same as a co-simulation unit, source and
binary. Both hold everything, the position loop with what a drive makes of its set-point and of its
recorded effort as well, and give the numbers that engb itself computes; only sampling_delay, which
is how a recording was stamped, is nothing that a machine does. mjcf, urdf and modelica hold what
the format can say; what it cannot is told, and stands in the file.

examples:
  engb export result/model.yaml --to fmu --out unit
  engb export result/model.yaml --to fmu --fmi 3 --source-only --out unit
  engb export result/model.yaml --to c mjcf urdf modelica json --out taken

docs/export.md says how each is used. Without --out the folder is `export` beside the model file.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.text.printable import printable
from engb_ros.commands.common import add_effects, folder_output, read_model

if TYPE_CHECKING:
    from engb_core.model import Model

__all__ = ['FILES', 'add_arguments', 'run']

# Format → the files that it makes.
FILES = {'c': ('engb_model.h', 'engb_model.c', 'engb_feedforward.h'), 'fmu': ('model.fmu',),
         'modelica': ('EngbModel.mo',), 'json': ('model.json',), 'mjcf': ('model.xml',),
         'urdf': ('model.urdf',)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('model', metavar='MODEL.yaml', help='the model file')
    parser.add_argument('--to', required=True, nargs='+', choices=sorted(FILES), metavar='FORMAT',
                        help=f'one or several of {", ".join(sorted(FILES))}')
    parser.add_argument('--out', metavar='DIR', help='where the files go')
    parser.add_argument('--fmi', type=int, choices=(2, 3),
                        help='version of the FMU (default 2)')
    parser.add_argument('--source-only', action='store_true',
                        help='an FMU without a binary; compile it where it runs')
    add_effects(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    model = read_model(arguments.model)
    model.refuse_negative_friction()
    out = Path(arguments.out) if arguments.out else Path(arguments.model).parent / 'export'
    wanted = list(dict.fromkeys(arguments.to))
    if 'fmu' not in wanted and (arguments.fmi is not None or arguments.source_only):
        option = '--source-only' if arguments.source_only else f'--fmi {arguments.fmi}'
        raise InputError(f'{option}: has no effect without --to fmu; leave it out')
    with folder_output(out, [name for one in wanted for name in FILES[one]],
                       [arguments.model]) as folder:
        notes = {one: _WRITERS[one](model, folder, arguments) for one in wanted}
    for one in wanted:
        print(printable(f'{one}: {", ".join(str(out / name) for name in FILES[one])}'))
        for note in notes[one]:
            print(f'   not in it: {note}')


def _c(model: Model, folder: Path, _: argparse.Namespace) -> tuple[str, ...]:
    from engb_core.export.c_model import c_model, feedforward_header
    made = c_model(model)
    for name, text in zip(FILES['c'], (made.header, made.source, feedforward_header(model)),
                          strict=True):
        (folder / name).write_text(text, encoding='utf-8')
    return made.beside


def _fmu(model: Model, folder: Path, arguments: argparse.Namespace) -> tuple[str, ...]:
    from engb_core.export.fmu import write_fmu
    return write_fmu(model, folder / FILES['fmu'][0], arguments.fmi or 2,
                     title=Path(arguments.model).stem, binary=not arguments.source_only)


def _modelica(model: Model, folder: Path, _: argparse.Namespace) -> tuple[str, ...]:
    from engb_core.export.modelica import modelica
    return _text(folder / FILES['modelica'][0], *modelica(model))


def _json(model: Model, folder: Path, _: argparse.Namespace) -> tuple[str, ...]:
    from engb_core.export.json_text import json_text
    return _text(folder / FILES['json'][0], json_text(model), ())


def _mjcf(model: Model, folder: Path, _: argparse.Namespace) -> tuple[str, ...]:
    from engb_core.export.robot_formats import mjcf
    return _text(folder / FILES['mjcf'][0], *mjcf(model))


def _urdf(model: Model, folder: Path, _: argparse.Namespace) -> tuple[str, ...]:
    from engb_core.export.robot_formats import urdf
    return _text(folder / FILES['urdf'][0], *urdf(model))


def _text(path: Path, text: str, lacks: tuple[str, ...]) -> tuple[str, ...]:
    path.write_text(text, encoding='utf-8')
    return lacks


_WRITERS: dict[str, Callable[[Model, Path, argparse.Namespace], tuple[str, ...]]] = {
    'c': _c, 'fmu': _fmu, 'modelica': _modelica, 'json': _json, 'mjcf': _mjcf, 'urdf': _urdf}
