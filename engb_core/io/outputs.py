# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where the commands put what they make: checked before any computing, written whole or not.

One rule for all of them: what the program did not make is never deleted or overwritten. A folder
of results holds a list of what was written there, with a digest of each file; a single file is
signed within itself. Whatever stands in the way and is not on the list, or was changed since, is
refused with the remedy. Recordings are made by other programs too: one is replaced on demand only,
and only what is a recording and nothing else.

What is being made lies in a hidden folder, inside the target where that exists (the one place
that is sure to be writable and on the same disk), else beside it, and appears by renaming. A run
that is killed outright (SIGKILL, a power cut) leaves that folder; the next one that writes to the
same place clears it away. What is cleared has to prove whose it was: it holds this program's mark,
and nobody holds the mark's lock any more, which ends with the process that took it. A folder in
which something lies that was to be replaced is left for its owner to look at.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
import contextlib
import fcntl
from fnmatch import fnmatchcase
import hashlib
import json
import os
from pathlib import Path
import shutil
import signal
import stat
import tempfile
import threading
from types import FrameType
from typing import Any

from engb_core.errors import InputError
from engb_core.io.bags.bag_files import recording_fault
from engb_core.io.signed import is_signed, sign

__all__ = ['LIST', 'claimed_folder', 'file_output', 'folder_output', 'recording_output',
           'undisturbed']

LIST = '.engb-outputs.json'
_FORMAT = 'engb-outputs/1'
_SCRATCH = '.engb-'         # hidden: neither a survey nor a bag's reader takes it for a recording
# What a hidden folder holds: the mark, and what is being made.
_MARK, _MADE = 'made-by-engb', 'made'
_MARKED = b'A run of engb works here. The next one clears this folder away if that was killed.\n'
_REPLACED = '.replaced'
_LIST_LIMIT = 16 << 20
_BLOCK = 1 << 20


@contextlib.contextmanager
def folder_output(folder: str | os.PathLike[str], names: Sequence[str],
                  inputs: Iterable[str | os.PathLike[str]] = (),
                  former: Sequence[str] = ()) -> Iterator[Path]:
    """Give a hidden folder to write into; its files appear in `folder` once all is well.

    Args:
        folder: made if need be; other files in it stay.
        names: every file or folder that may be written; those of a former run that this one
            doesn't write are removed.
        inputs: what the command reads: never overwritten, and nothing is written into them.
        former: patterns of what else a former run may have left there: removed, unless this one
            reads it, or it was changed since.

    Raises:
        InputError: the folder can't be written to, or something that the program did not make, or
            that was changed since, has one of these names.
    """
    told = f'--out {os.fspath(folder)}'
    target = _real(folder)
    read = [str(os.fspath(path)) for path in inputs]
    if target.exists() and not target.is_dir():
        raise InputError(f'{told}: is a file; name a folder')
    _refuse_inputs(told, target, names, read)
    if target.exists():
        with _alone(target):
            _refuse_foreign(told, target, names)
    with _scratch(told, target) as scratch:
        yield scratch
        made = {path.relative_to(scratch).as_posix(): _digest(path)
                for path in sorted(scratch.rglob('*')) if path.is_file()}
        with _alone(target):
            if target.exists():
                # Once more: computing takes minutes, and others may have written meanwhile.
                _refuse_foreign(told, target, names)
            _put(scratch, target, names, made, _left_behind(target, names, former, read))


@contextlib.contextmanager
def claimed_folder(folder: str | os.PathLike[str], names: Sequence[str],
                   inputs: Iterable[str | os.PathLike[str]] = ()) -> Iterator[Path]:
    """Give a folder for work that goes on where it stopped: files appear in it one by one.

    Args:
        folder: made if need be; other files in it stay.
        names: the files written last, which a reader takes for the result.
        inputs: as for `folder_output`.

    Raises:
        InputError: as for `folder_output`.
    """
    told = f'--out {os.fspath(folder)}'
    target = _real(folder)
    if target.exists() and not target.is_dir():
        raise InputError(f'{told}: is a file; name a folder')
    _refuse_inputs(told, target, names, [os.fspath(path) for path in inputs])
    if target.exists():
        with _alone(target):
            _refuse_foreign(told, target, names)
    with _scratch(told, target):
        pass        # it can be written to
    try:
        target.mkdir(parents=True, exist_ok=True)
        yield target
    finally:
        with _alone(target), undisturbed(), contextlib.suppress(OSError):
            made = {name: _digest(target / name) for name in names if (target / name).is_file()}
            if made:
                _write_list(target, {**_listed(target), **made})


@contextlib.contextmanager
def file_output(path: str | os.PathLike[str], suffix: str,
                inputs: Iterable[str | os.PathLike[str]] = (), told: str = '') -> Iterator[Path]:
    """Give a hidden file to write into; it becomes `path` once all is well.

    Args:
        path: a file there already is replaced if this program made it and nobody changed it.
        suffix: that its name must have: '.yaml' or '.npz'.
        inputs: as for `folder_output`.
        told: what messages call it.

    Raises:
        InputError: the path is a folder, an input or somebody's file, can't be written, or lacks
            the suffix.
    """
    told = told or f'--out {os.fspath(path)}'
    target = _real(path)
    if target.suffix != suffix:
        raise InputError(f'{told}: the name must end in {suffix}')
    if target.is_dir():
        raise InputError(f'{told}: is a folder; name a file ending in {suffix}')
    _refuse_inputs(told, target.parent, [target.name], [os.fspath(path) for path in inputs])
    _refuse_strange_file(told, target)
    with _scratch(told, target, inside=False) as scratch:
        made = scratch / f'made{suffix}'
        made.touch()
        yield made
        sign(made)
        _refuse_strange_file(told, target)
        made.chmod(0o644)
        os.replace(made, target)


@contextlib.contextmanager
def recording_output(path: str | os.PathLike[str], replace: bool = False,
                     inputs: Iterable[str | os.PathLike[str]] = (),
                     told: str = '') -> Iterator[Path]:
    """Give a hidden place to make a bag at (nothing is there yet); it becomes `path` at the end.

    Args:
        path: the bag's folder, or its single file ending in .mcap or .db3.
        replace: whether a recording that is there already may be replaced.
        inputs: as for `folder_output`.
        told: what messages call it.

    Raises:
        InputError: the path can't be written, is there (without `replace`), or is anything but
            a recording, an empty folder, or nothing.
    """
    told = told or os.fspath(path)
    target = _real(path)
    try:
        target.name.encode()
    except UnicodeEncodeError:
        raise InputError(f'{told}: a byte of this name is no UTF-8, which a bag\'s metadata '
                         'cannot hold; choose another name') from None
    _refuse_inputs(told, target.parent, [target.name], [os.fspath(path) for path in inputs])
    _refuse_replacing(told, target, replace)
    with _scratch(told, target, inside=False) as scratch:
        made = scratch / target.name
        yield made
        if not made.exists():       # compressed as a whole
            made = made.with_name(made.name + '.zstd')
            target = target.with_name(made.name)
        _refuse_replacing(told, target, replace)
        with undisturbed():
            if target.is_dir():
                os.replace(target, scratch / _REPLACED)
            try:
                os.replace(made, target)
            except OSError:
                with contextlib.suppress(OSError):
                    os.replace(scratch / _REPLACED, target)
                raise


def _left_behind(target: Path, names: Sequence[str], former: Sequence[str],
                 inputs: Sequence[str]) -> list[str]:
    """Return the files of a former run that are to go: listed, unchanged, and read by nobody."""
    return [name for name, digest in _listed(target).items()
            if name not in names and '/' not in name
            and any(fnmatchcase(name, pattern) for pattern in former)
            and (target / name).is_file() and not (target / name).is_symlink()
            and not any(_same(target / name, Path(given)) for given in inputs)
            and _digest(target / name) == digest]


def _put(scratch: Path, target: Path, names: Sequence[str], made: dict[str, str],
         gone: Sequence[str] = ()) -> None:
    """Move what was made to its place, list it there, and remove what has `gone`."""
    with undisturbed():
        listed = _listed(target)
        kept = {name: digest for name, digest in listed.items()
                if name.split('/')[0] not in names and name not in gone}
        _write_list(scratch, {**kept, **made})
        if not target.exists():
            scratch.chmod(0o755)
            os.replace(scratch, target)
            return
        for name in names:
            if (target / name).is_dir() and not (target / name).is_symlink():
                # A folder can't be replaced by another where it holds something.
                os.replace(target / name, scratch / f'{_REPLACED}-{name}')
            if (scratch / name).exists():
                os.replace(scratch / name, target / name)
            else:
                (target / name).unlink(missing_ok=True)
        for name in gone:
            (target / name).unlink(missing_ok=True)
        os.replace(scratch / LIST, target / LIST)


@contextlib.contextmanager
def _alone(target: Path) -> Iterator[None]:
    """Let no other run of this program look at a folder of results or change it meanwhile: its
    files and their list belong together."""
    with contextlib.ExitStack() as stack:
        # The folder that is to hold it comes first for everyone: it may not be there yet itself.
        for folder in (target.parent, target):
            # Some network drives know no locks, and not every folder may be read.
            with contextlib.suppress(OSError):
                lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
                stack.callback(os.close, lock)
                fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@contextlib.contextmanager
def undisturbed() -> Iterator[None]:
    """Hold back the signals that end the program until a few files are in their places."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[tuple[int, FrameType | None]] = []
    kinds = [getattr(signal, name) for name in ('SIGINT', 'SIGTERM', 'SIGHUP')
             if hasattr(signal, name)]
    before = {kind: signal.signal(kind, lambda number, frame: came.append((number, frame)))
              for kind in kinds}
    try:
        yield
    finally:
        for kind, handler in before.items():
            signal.signal(kind, signal.SIG_DFL if handler is None else handler)
        for number, frame in came:
            handler = before[number]
            if callable(handler):
                handler(number, frame)
            elif handler != signal.SIG_IGN:
                os.kill(os.getpid(), number)


def _real(path: str | os.PathLike[str]) -> Path:
    """Return where something that is written to `path` really lands."""
    if not os.fspath(path):
        raise InputError('--out is empty; name a place')
    try:
        return Path(os.path.realpath(path))
    except (OSError, ValueError) as error:      # a name with a zero byte
        raise InputError(f'--out {os.fspath(path)!r}: no path ({error})') from error


def _refuse_inputs(told: str, target: Path, names: Sequence[str], inputs: Sequence[str]) -> None:
    """Raise InputError where an output would overwrite an input, or land in a recording."""
    for given in inputs:
        real = Path(os.path.realpath(given))
        for name in names:
            output = target / name
            if output == real or output in real.parents or _same(output, real):
                raise InputError(f'{told}: would overwrite the input {given}; name another place')
        if real.is_dir() and (target == real or real in target.parents):
            raise InputError(f'{told}: lies in the input {given}; name a place outside of it')


def _same(one: Path, other: Path) -> bool:
    """Whether two names mean one file (a hard link)."""
    try:
        return one.samefile(other)
    except OSError:
        return False


def _refuse_foreign(told: str, target: Path, names: Sequence[str]) -> None:
    """Raise InputError where one of `names` in `target` isn't as this program left it there."""
    listed = _listed(target)
    for name in names:
        path = target / name
        if not os.path.lexists(path):
            continue
        files = [path] if path.is_symlink() or not path.is_dir() else sorted(
            entry for entry in path.rglob('*') if entry.is_symlink() or not entry.is_dir())
        for file in files:
            key = file.relative_to(target).as_posix()
            if key not in listed:
                raise InputError(f'{told}: holds {key}, which engb did not write there; move it '
                                 'away or name another folder')
            if file.is_symlink() or not file.is_file() or _digest(file) != listed[key]:
                raise InputError(f'{told}: {key} was changed since engb wrote it; move it away '
                                 'or name another folder')


def _refuse_strange_file(told: str, target: Path) -> None:
    if not os.path.lexists(target):
        return
    if not target.is_file():
        raise InputError(f'{told}: is there and no file; choose another name')
    if not is_signed(target):
        raise InputError(f'{told}: is there, and engb did not write it, or it was changed since; '
                         'move it away or choose another name')


def _refuse_replacing(told: str, target: Path, replace: bool) -> None:
    """Raise InputError unless `target` is nothing, or may be replaced and holds a recording."""
    if not os.path.lexists(target):
        return
    if not replace:
        raise InputError(f'{told}: exists already; remove it or choose another name')
    home = Path(os.path.realpath(os.path.expanduser('~')))
    here = Path(os.path.realpath(os.getcwd()))
    for kind, place in (('your home', home), ('the working folder', here)):
        if target == place or target in place.parents:
            raise InputError(f'{told}: is or holds {kind}; name a folder of the recording\'s own')
    if os.path.ismount(target):
        raise InputError(f'{told}: is a mount point; name a folder in it')
    fault = recording_fault(target)
    if fault:
        raise InputError(f'{told}: is not replaced, because {fault}; remove it yourself or choose '
                         'another name')


@contextlib.contextmanager
def _scratch(told: str, target: Path, inside: bool = True) -> Iterator[Path]:
    """Give a hidden folder on the disk of `target`, and clear it away afterwards."""
    place = target if inside and target.is_dir() else target.parent
    made = [parent for parent in (place, *place.parents) if not parent.exists()]
    try:
        place.mkdir(parents=True, exist_ok=True)
        _clear_left(place)
        folder = Path(tempfile.mkdtemp(dir=place, prefix=_SCRATCH))
        lock = _marked(folder)
        scratch = folder / _MADE
        scratch.mkdir(mode=0o700)
    except OSError as error:
        _remove_empty(made)
        raise InputError(f'{told}: cannot be written to ({error.strerror}); name another '
                         'place') from error
    try:
        yield scratch
    except OSError as error:
        raise InputError(f'{told}: cannot be written to '
                         f'({error.strerror or error}); nothing was changed') from error
    except InputError as error:
        # Whoever writes into the hidden folder tells of a place that nobody named.
        text = str(error).replace(str(scratch / target.name), told).replace(str(scratch), told)
        if text == str(error):
            raise
        raise InputError(text) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)
        _remove_empty(made)


def _marked(folder: Path) -> int:
    """Put the mark into a hidden folder; return the descriptor that holds its lock."""
    # The mark appears with its lock held: another run never sees it free while this one lives.
    new = folder / f'{_MARK}.new'
    lock = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    os.write(lock, _MARKED)
    with contextlib.suppress(OSError):      # some network drives know no locks
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.replace(new, folder / _MARK)
    return lock


def _clear_left(place: Path) -> None:
    """Remove the hidden folders in `place` that killed runs of this program left there."""
    for folder in place.glob(f'{_SCRATCH}*'):
        with contextlib.suppress(OSError):
            if folder.is_symlink() or {entry.name for entry in folder.iterdir()} - {_MARK, _MADE}:
                continue
            lock = os.open(folder / _MARK, os.O_RDWR | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)    # OSError: its run goes on
                if os.read(lock, len(_MARKED) + 1) == _MARKED and not any(
                        folder.glob(f'{_MADE}/{_REPLACED}*')):
                    shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(lock)


def _remove_empty(folders: Sequence[Path]) -> None:
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


def _digest(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open('rb') as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _listed(folder: Path) -> dict[str, str]:
    """Return what the program wrote into a folder: path in it → SHA-256."""
    path = folder / LIST
    try:
        if not stat.S_ISREG(path.stat().st_mode) or path.stat().st_size > _LIST_LIMIT:
            return {}
        data: Any = json.loads(path.read_text(encoding='utf-8'))
        if data['format'] != _FORMAT:
            return {}
        return {str(name): str(digest) for name, digest in data['files'].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def _write_list(folder: Path, files: dict[str, str]) -> None:
    # Under a name of its own: a link of somebody's is not followed.
    with tempfile.NamedTemporaryFile('w', dir=folder, prefix=_SCRATCH, suffix='.part',
                                     encoding='utf-8', delete=False) as file:
        json.dump({'format': _FORMAT, 'files': files}, file, indent=1)
    os.chmod(file.name, 0o644)
    os.replace(file.name, folder / LIST)
