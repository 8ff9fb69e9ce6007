# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Inputs that may be recordings or tables, and what is made of them beside a result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.text.printable import printable
from engb_ros.commands.common import read_recordings
from engb_ros.commands.table_options import add_table_options, request_of

if TYPE_CHECKING:
    from engb_core.identify.first_model import FirstModel
    from engb_core.io.tables.measure import Measured
    from engb_core.io.tables.request import Request
    from engb_core.model import Joint, Model
    from engb_core.recording import Recording

__all__ = ['Inputs', 'add_table_options', 'read_inputs', 'recording_names', 'request_of',
           'write_first_model', 'write_inputs']


@dataclass(frozen=True)
class Inputs:
    """Recordings in the order given; `tables` are those that came as tables, by their file's name
    as a recording; `told` says which column was taken for what, `request` all that was said of
    them, answers included."""

    recordings: list[Recording]
    tables: dict[str, Measured]
    joint: Joint
    told: tuple[str, ...]
    request: Request


def recording_names(paths: Sequence[str]) -> tuple[str, ...]:
    """Return the names under which tables among `paths` are written as recordings."""
    from engb_core.io.tables.open import is_table
    return tuple(_recording_name(path) for path in paths if is_table(path))


def _recording_name(path: str) -> str:
    # A byte that is no UTF-8 may be in a file's name, but not within a bag.
    return Path(path).stem.encode(errors='replace').decode().replace('?', '_') + '.mcap'


def read_inputs(paths: Sequence[str], model: Model | None, namespace: str | None,
                progress: Callable[[str], None], request: Request) -> Inputs:
    """Read recordings and tables. With a model those without effort will do, where the reference
    tells what the position loop asked for.

    Raises:
        InputError: one can't be read, does not tell all that is needed, or they are of different
            kinds of axis.
    """
    from engb_core.io.tables.measure import measured_of
    from engb_core.io.tables.open import is_table
    from engb_core.model import Joint
    from engb_core.signals.absent_effort import with_effort
    names = recording_names(paths)
    if len(set(names)) < len(names):
        raise InputError('two tables have the same name; rename one')
    bags = [path for path in paths if not is_table(path)]
    read = dict(zip(bags, read_recordings(bags, model, namespace, progress,
                                         model is not None), strict=True))
    tables: dict[str, Measured] = {}
    told: list[str] = []
    kinds: set[str] = set()
    recordings = []
    for path in paths:
        if path in read:
            recordings.append(read[path])
            continue
        progress(f'reading {path}')
        measured, request = measured_of(path, request)
        tables[_recording_name(path)] = measured
        kinds.add(measured.joint_type)
        told += [f'{printable(Path(path).name)}: {text}' for text in measured.told]
        recordings.append(measured.recording(model.joint.name if model else 'motor'))
    if model is not None and kinds and kinds != {model.joint.type}:
        raise InputError(f'{paths[0]}: position is that of a {kinds.pop()} axis, the model\'s of '
                         f'a {model.joint.type} one; set joint.type or --unit position=…')
    if len(kinds) > 1:
        raise InputError('the tables are of different kinds of axis: angles and lengths')
    if model is not None:
        given, recordings = recordings, with_effort(recordings, model)
        told += [f'{new.name}: {new.notes[-1]}' for old, new in zip(given, recordings, strict=True)
                 if new is not old]
    joint = model.joint if model else Joint(recordings[0].joint, kinds.pop() if kinds
                                            else 'revolute')
    return Inputs(recordings, tables, joint, tuple(told), request)


def write_inputs(folder: Path, inputs: Inputs) -> None:
    """Write the tables as recordings into `folder`."""
    from engb_ros.commands.import_table import write_recording
    for name, measured in inputs.tables.items():
        write_recording(folder / name, measured, inputs.joint.name)


def write_first_model(path: Path, page: Path, first: FirstModel) -> None:
    """Write a first model and the page that shows how far it can be trusted."""
    from engb_core.report.first_model import write_first_model_page
    first.model.write(path)
    write_first_model_page(page, first)
