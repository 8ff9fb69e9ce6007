# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Machine code kept on disk between runs, named by everything that was compiled into it.

numba's own cache asks whether the file of a function has changed. What a function calls, and the
constants it takes from other modules, are compiled into it too: change those and the old machine
code is run. Here the name of an entry is a digest of the function, of all functions that it
calls, of the values that it reads, of the types, and of compiler and processor. An entry is
never changed and never wrong; what is not found is compiled. Files appear by renaming, so that
processes that start together with nothing cached do each other no harm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from functools import cached_property
import hashlib
import os
from pathlib import Path
import pickle
import sys
import tempfile
import types
from typing import Any

import numpy as np

__all__ = ['CodeCache', 'fingerprint']

# Entries of one function that are kept: other versions of Python, of the source, other types.
KEPT = 8
_PACKAGE = Path(__file__).resolve().parent


def fingerprint(function: Callable[..., object]) -> str:
    """Return a digest of a Python function and of everything that is compiled into it."""
    digest = hashlib.sha256()
    for part in _parts(_plain(function), {}):
        digest.update(repr(part).encode())
    return digest.hexdigest()


def _plain(value: Any) -> Any:
    """Return the Python function behind a compiled one, an effect's or numba's own kind of
    function; other values as they are."""
    for name in ('py_func', 'definition', '_defn'):
        if isinstance(getattr(value, name, None), types.FunctionType):
            return getattr(value, name)
    return value


def _parts(function: types.FunctionType, seen: dict[int, int]) -> Iterator[object]:
    # A function that was met already stands as its number: code may be recursive.
    if id(function) in seen:
        yield seen[id(function)]
        return
    seen[id(function)] = len(seen)
    yield from _code_parts(function.__code__)
    outside = {name: function.__globals__[name] for name in sorted(_names(function.__code__))
               if name in function.__globals__}
    cells = function.__closure__ or ()
    outside |= dict(zip(function.__code__.co_freevars, (cell.cell_contents for cell in cells),
                        strict=True))
    for name, value in outside.items():
        yield name
        value = _plain(value)
        if isinstance(value, types.FunctionType):
            yield from _parts(value, seen)
        elif isinstance(value, np.ndarray):
            yield value.dtype.str, value.shape, value.tobytes()
        elif hasattr(value, '__name__'):
            # A module, a type, something that numba knows: versions are in the key.
            yield getattr(value, '__module__', ''), value.__name__
        else:
            yield value


def _names(code: types.CodeType) -> set[str]:
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names(constant)
    return names


def _code_parts(code: types.CodeType) -> Iterator[object]:
    yield code.co_name, code.co_code, code.co_names, code.co_varnames, code.co_freevars
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _code_parts(constant)
        else:
            yield constant


class CodeCache:
    """Where a numba dispatcher or C callback keeps its machine code; numba calls the methods.

    Args:
        function: what is compiled, as Python.
        kind: tells apart what is compiled in several ways.
    """

    def __init__(self, function: Callable[..., object], kind: str = '') -> None:
        self._function = function
        self._name = f'{function.__module__}.{function.__qualname__}'.replace('<locals>.', '')
        self._kind = kind

    @cached_property
    def _key(self) -> tuple[str, str]:
        digest = fingerprint(self._function)
        # numba names machine code by the function's name and a number that starts at one in each
        # process: what two processes put into one cache must not go by the same name.
        self._function.__qualname__ += f'_{digest[:12]}'
        return self._kind, digest

    @property
    def cache_path(self) -> str:
        """Where the entries lie."""
        return str(_folder())

    def load_overload(self, signature: object, target_context: Any) -> object | None:
        """Return the compiled function of this signature, None where there is none."""
        from numba.core.compiler import CompileResult
        target_context.refresh()
        content = _read(self._path(signature, target_context.codegen()))
        if content is None:
            return None
        try:
            found: object = CompileResult._rebuild(target_context, *pickle.loads(content))
            return found
        except Exception:
            # Whatever another installation has left there: compile anew.
            return None

    def save_overload(self, signature: object, result: Any) -> None:
        """Keep a compiled function."""
        from numba.core.serialize import dumps
        if result.lifted or result.library.has_dynamic_globals:
            return
        path = self._path(signature, result.codegen)
        if path is not None:
            with contextlib.suppress(OSError):
                _write(path, dumps(result._reduce()))
                _prune(path.parent, self._name)

    def _path(self, signature: object, codegen: Any) -> Path | None:
        import llvmlite
        import numba
        folder = _folder()
        if folder is None:
            return None
        key = repr((self._key, str(signature), codegen.magic_tuple(), numba.__version__,
                    llvmlite.__version__, np.__version__, sys.implementation.cache_tag))
        return folder / f'{self._name}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.code'


def _folder() -> Path | None:
    """Return where entries may be written: beside the package or in the user's cache."""
    global _found
    if _found is _UNKNOWN:
        user = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache')
        given = os.environ.get('NUMBA_CACHE_DIR')
        _found = next((folder for folder in (
            *((Path(given) / 'engb',) if given else ()),
            _PACKAGE / '__pycache__' / 'machine_code', user / 'engb' / 'machine_code')
            if _writable(folder)), None)
    return _found


_UNKNOWN = Path('')
_found: Path | None = _UNKNOWN


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def _read(path: Path | None) -> bytes | None:
    """Return an entry's content; None where it is missing or damaged."""
    if path is None:
        return None
    try:
        data = path.read_bytes()
    except OSError:
        return None
    digest, content = data[:32], data[32:]
    return content if hashlib.sha256(content).digest() == digest else None


def _write(path: Path, content: bytes) -> None:
    handle, name = tempfile.mkstemp(dir=path.parent, suffix='.part')
    try:
        with open(handle, 'wb') as file:
            file.write(hashlib.sha256(content).digest() + content)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _prune(folder: Path, name: str) -> None:
    """Remove a function's oldest entries."""
    entries = sorted(folder.glob(f'{name}-*.code'), key=lambda entry: entry.stat().st_mtime)
    for entry in entries[:-KEPT]:
        entry.unlink(missing_ok=True)
