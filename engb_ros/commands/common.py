"""What the commands share: reading inputs, writing results whole, telling progress."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
import contextlib
import os
from pathlib import Path
import shutil
import sys
import tempfile
from typing import TYPE_CHECKING

from engb_core.errors import InputError

if TYPE_CHECKING:
    from engb_core.model import Model
    from engb_core.recording import Recording

__all__ = ['Progress', 'add_model', 'add_namespace', 'add_progress', 'file_output',
           'folder_output', 'read_recordings']


def add_model(parser: argparse.ArgumentParser, required: bool = True, text: str = '') -> None:
    """Add --model."""
    parser.add_argument('--model', required=required, metavar='MODEL.yaml',
                        help=text or 'the model file (format: engb-model/1)')


def add_namespace(parser: argparse.ArgumentParser) -> None:
    """Add --namespace."""
    parser.add_argument('--namespace', metavar='/NAME', help='the brake\'s namespace, where a '
                        'recording holds several joint_states, e.g. /front_left')


def add_progress(parser: argparse.ArgumentParser) -> None:
    """Add --verbose and --quiet."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument('--verbose', action='store_true', help='tell each step on standard error '
                       '(by default only on a terminal)')
    group.add_argument('--quiet', action='store_true', help='tell no step')


class Progress:
    """Tells what is going on, on standard error; call it with one line of text.

    On a terminal the line is overwritten by the next; otherwise it is silent unless asked, so
    that a script sees nothing there but an error.
    """

    def __init__(self, arguments: argparse.Namespace) -> None:
        self._terminal = sys.stderr.isatty()
        self._on = arguments.verbose or (self._terminal and not arguments.quiet)
        self._shown = False

    def __call__(self, text: str) -> None:
        if not self._on:
            return
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            print(f'\r\033[K{text[:width]}', end='', file=sys.stderr, flush=True)
            self._shown = True
        else:
            print(text, file=sys.stderr, flush=True)

    def done(self) -> None:
        """Clear the line."""
        if self._shown:
            print('\r\033[K', end='', file=sys.stderr, flush=True)
            self._shown = False

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        self.done()


def read_recordings(paths: Sequence[str], model: Model | None, namespace: str | None,
                    progress: Callable[[str], None]) -> list[Recording]:
    """Read recordings, each under a name of its own.

    Raises:
        InputError: one can't be read, or is given twice.
    """
    import dataclasses

    from engb_ros.bags.read import read_recording
    seen: set[str] = set()
    for path in paths:
        real = os.path.realpath(path)
        if real in seen:
            raise InputError(f'{path}: given twice')
        seen.add(real)
    joint = model.joint.name if model else None
    found = []
    for number, path in enumerate(paths, 1):
        progress(f'reading {path} ({number} of {len(paths)})')
        found.append(read_recording(path, joint=joint, namespace=namespace))
    names = [recording.name for recording in found]
    return [recording if names.count(recording.name) == 1 else dataclasses.replace(
        recording, name=f'{Path(os.path.abspath(path)).parent.name}/{recording.name}')
        for recording, path in zip(found, paths, strict=True)]


@contextlib.contextmanager
def folder_output(folder: str, names: Sequence[str]) -> Iterator[Path]:
    """Give a hidden folder to write into; its files appear in `folder` once all is well.

    Args:
        folder: made if need be; other files in it stay.
        names: every file name that may be written; those of a former run that this one doesn't
            write are removed.

    Raises:
        InputError: the folder can't be written to.
    """
    target = Path(os.path.abspath(folder))
    if target.exists() and not target.is_dir():
        raise InputError(f'--out {folder}: is a file; name a folder')
    made = [parent for parent in (target, *target.parents) if not parent.exists()]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(dir=target.parent, prefix=f'.{target.name}.'))
    except OSError as error:
        raise InputError(f'--out {folder}: cannot be written to ({error.strerror})') from error
    try:
        yield scratch
        scratch.chmod(0o755)
        if not target.exists():
            os.replace(scratch, target)
            return
        for name in names:
            if (scratch / name).exists():
                os.replace(scratch / name, target / name)
            else:
                (target / name).unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f'--out {folder}: cannot be written to '
                         f'({error.strerror or error})') from error
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
        if not target.exists():
            for parent in made[1:]:
                with contextlib.suppress(OSError):
                    parent.rmdir()


@contextlib.contextmanager
def file_output(path: str, suffix: str) -> Iterator[Path]:
    """Give a hidden file to write into; it becomes `path` once all is well.

    Raises:
        InputError: the path is a folder or can't be written, or lacks the suffix.
    """
    target = Path(os.path.abspath(path))
    if target.suffix != suffix:
        raise InputError(f'--out {path}: the name must end in {suffix}')
    if target.is_dir():
        raise InputError(f'--out {path}: is a folder; name a file ending in {suffix}')
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f'.{target.name}.',
                                        suffix=suffix)
        os.close(handle)
    except OSError as error:
        raise InputError(f'--out {path}: cannot be written ({error.strerror})') from error
    try:
        yield Path(name)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except OSError as error:
        raise InputError(f'--out {path}: cannot be written '
                         f'({error.strerror or error})') from error
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)
