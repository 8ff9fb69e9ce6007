# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Inputs that may be recordings or tables, and what is made of them beside a result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import os
from pathlib import Path
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.text.printable import printable
from engb_ros.commands.common import tell_what_is_missing
from engb_ros.commands.table_options import add_table_options, refuse_idle, request_of

if TYPE_CHECKING:
    from engb_core.identify.first_model import FirstModel
    from engb_core.io.tables.measure import Measured
    from engb_core.io.tables.request import Request
    from engb_core.model import Joint, Model
    from engb_core.recording import Recording

__all__ = ['Inputs', 'add_table_options', 'read_inputs', 'recording_names', 'refuse_idle',
           'request_of', 'write_first_model', 'write_inputs']


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


def recording_names(paths: Sequence[str]) -> dict[str, str]:
    """Return the names under which tables among `paths` are written as recordings, by path.

    Raises:
        InputError: two of them come to one name.
    """
    from engb_core.io.tables.open import is_table
    made: dict[str, str] = {}
    for path, name in zip(paths, _distinct_names(paths), strict=True):
        if not is_table(path):
            continue
        # A byte that is no UTF-8 may be in a file's name, but not within a bag.
        file = name.encode(errors='replace').decode().replace('?', '_').replace('/', '_') + '.mcap'
        twin = next((other for other, taken in made.items() if taken == file), None)
        if twin is not None:
            raise InputError(f'{path}: would be written as {file}, as {twin} is; rename one')
        made[path] = file
    return made


def _distinct_names(paths: Sequence[str]) -> list[str]:
    """Return a name for each recording: that of its file or folder, with the folders above it
    where others have the same."""
    from engb_core.io.bags.bag_files import recording_name
    from engb_core.io.tables.open import is_table

    def short(path: Path) -> str:
        return path.stem if is_table(path) else recording_name(path)

    places = [Path(os.path.abspath(path)) for path in paths]
    alike = [sum(short(other) == short(place) and other.parent == place.parent
                 for other in places) > 1 for place in places]
    last = [place.name if twin else short(place)
            for place, twin in zip(places, alike, strict=True)]
    above = [0] * len(places)
    while True:
        names = ['/'.join([*place.parts[len(place.parts) - 1 - count:-1], name])
                 for place, name, count in zip(places, last, above, strict=True)]
        more = [number for number, name in enumerate(names)
                if names.count(name) > 1 and above[number] < len(places[number].parts) - 2]
        if not more:
            return names
        for number in more:
            above[number] += 1


def read_inputs(paths: Sequence[str], model: Model | None, namespace: str | None,
                progress: Callable[[str], None], request: Request, joint: str | None = None,
                other_joint: bool = False) -> Inputs:
    """Read recordings and tables, each under a name of its own. With a model, and unless the
    request needs it, those without effort will do, where the reference tells what the position
    loop asked for.

    Args:
        paths: of recordings and tables.
        model: tells the joint; None: there is none.
        namespace: the brake's, where a recording holds several joint_states.
        progress: is told what is being read.
        request: what is said of tables.
        joint: which one is meant, where no model tells it; None: nobody said.
        other_joint: whether a recording that has one joint only may call it otherwise.

    Raises:
        InputError: one can't be read, is given twice, does not tell all that is needed, has
            no such joint, or they are of different kinds of axis.
    """
    from engb_core.io.bags.read import read_recording
    from engb_core.io.tables.measure import measured_of
    from engb_core.model import Joint
    from engb_core.signals.absent_effort import with_effort
    _refuse_twice(paths)
    files = recording_names(paths)
    named = joint or (model.joint.name if model else None)
    tell_what_is_missing()
    tables: dict[str, Measured] = {}
    told: list[str] = []
    kinds: set[str] = set()
    recordings = []
    for number, (path, name) in enumerate(zip(paths, _distinct_names(paths), strict=True), 1):
        progress(f'reading {path} ({number} of {len(paths)})')
        if path not in files:
            found = read_recording(path, named, namespace, request.effort_optional)
            if joint is not None and not other_joint and found.joint not in ('', joint):
                raise InputError(f'{path}: holds no joint {joint!r} but {found.joint!r}; give '
                                 f'--joint {found.joint}')
        else:
            measured, request = measured_of(path, request)
            tables[files[path]] = measured
            kinds.add(measured.joint_type)
            source = printable(Path(path).name if name == Path(path).stem else path)
            told += [f'{source}: {text}' for text in measured.told]
            found = measured.recording(named or 'motor')
        recordings.append(replace(found, name=printable(name)))
    if model is not None and kinds and kinds != {model.joint.type}:
        raise InputError(f'{paths[0]}: position is that of a {kinds.pop()} axis, the model\'s of '
                         f'a {model.joint.type} one; set joint.type or --unit position=…')
    if len(kinds) > 1:
        raise InputError('the tables are of different kinds of axis: angles and lengths')
    if model is not None and request.effort_optional:
        given, recordings = recordings, with_effort(recordings, model)
        told += [f'{new.name}: {new.notes[-1]}' for old, new in zip(given, recordings, strict=True)
                 if new is not old]
    own = model.joint if model else Joint(recordings[0].joint, kinds.pop() if kinds
                                          else 'revolute')
    return Inputs(recordings, tables, own, tuple(told), request)


def _refuse_twice(paths: Sequence[str]) -> None:
    seen: set[str] = set()
    for path in paths:
        real = os.path.realpath(path)
        if real in seen:
            raise InputError(f'{path}: given twice')
        seen.add(real)


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
