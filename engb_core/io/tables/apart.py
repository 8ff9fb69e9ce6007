# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads a table in a process of its own, with limits on memory and time.

Readers of binary formats are other people's, partly in C: a damaged file can end the process that
reads it, or take all of the machine's memory. Here that costs the file, and is told in one line.
Only numbers and text come back, never pickled objects.
"""

from __future__ import annotations

from collections.abc import Iterable
import json
from multiprocessing.connection import Connection
import os
from pathlib import Path
import resource
import signal
import socket
import subprocess
import sys
import tempfile
from typing import Any
import weakref

import numpy as np

from engb_core.blas_threads import ONE_THREAD
from engb_core.errors import InputError
from engb_core.io.tables.formats import open_here
from engb_core.io.tables.table import Channel, Samples, Table

__all__ = ['TableApart', 'serve', 'start_process']

# What reading may take beside the imported reader [bytes]: this, and so many times the file's
# size, for what is packed in it. Several copies of three signals of a long recording fit in.
_ROOM, _UNPACKED = 600 << 20, 8
# Processor time [s], with what a large file takes more [bytes/s]; a reader that only waits is
# given up after so many times that.
_SECONDS, _SPEED, _PATIENCE = 40.0, 5 << 20, 3.0
# From the signal that ends a reader until it is killed [s].
_LET_END = 2.0

_CODE = '''
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from engb_core.io.tables.apart import serve
serve(int(sys.argv[2]))
'''


class TableApart(Table):
    """A table whose reader runs in a process that ends with this object."""

    def __init__(self, path: Path, kind: str) -> None:
        """Open the table of this kind (a word of `formats.kind_of`).

        Raises:
            InputError: not readable, damaged, or its reader is not installed.
        """
        self.path = path
        size = path.stat().st_size
        self._patience = _PATIENCE * (_SECONDS + size / _SPEED)
        here, there = socket.socketpair()
        with there:
            # Readers keep temporary files (asammdf), which one that is killed leaves behind.
            scratch = tempfile.TemporaryDirectory(prefix='engb_reader_',
                                                  ignore_cleanup_errors=True)
            process = start_process(there, scratch.name)
        self._pipe = Connection(here.detach())
        self._process = process
        self._end = weakref.finalize(self, _end, process, self._pipe, scratch)
        opened = self._asked({'path': str(path), 'kind': kind, 'room': _ROOM + _UNPACKED * size,
                              'seconds': _SECONDS + size / _SPEED})
        self.kind = opened['kind']
        super().__init__(path, [Channel(**entry) for entry in opened['channels']])

    def read(self, channels: Iterable[int]) -> dict[int, Samples]:
        """Return the channels of these numbers; see `Table`."""
        places = list(dict.fromkeys(channels))
        answer = self._asked({'read': places})
        found = {}
        for place, timed in zip(places, answer['timed'], strict=True):
            value = self._array()
            found[place] = Samples(value, self._array() if timed else None)
        return found

    def _asked(self, request: dict[str, Any]) -> dict[str, Any]:
        try:
            self._pipe.send_bytes(json.dumps(request).encode())
            answer = json.loads(self._bytes())
        except (EOFError, OSError) as error:
            raise InputError(f'{self.path}: {self._death()}') from error
        except BaseException:   # a signal that ends the program ends the reader as well
            self._end()
            raise
        if 'error' in answer:
            self._end()
            raise InputError(answer['error'])
        found: dict[str, Any] = answer
        return found

    def _bytes(self) -> bytes:
        if not self._pipe.poll(self._patience):
            self._end()
            raise InputError(f'{self.path}: not read within {self._patience:.0f} s; is the file '
                             'damaged? Export it as .csv')
        return self._pipe.recv_bytes()

    def _array(self) -> np.ndarray:
        try:
            return np.frombuffer(self._bytes(), float)
        except (EOFError, OSError) as error:
            raise InputError(f'{self.path}: {self._death()}') from error

    def _death(self) -> str:
        """Say how the reader ended."""
        code = self._process.wait()
        self._end()
        if code == -signal.SIGXCPU:
            return (f'not read within {self._patience / _PATIENCE:.0f} s of processor time; is '
                    'the file damaged? Export it as .csv')
        how = signal.strsignal(-code) if code < 0 else f'status {code}'
        return f'its reader broke down ({how}); the file is damaged. Export it anew, or as .csv'


def start_process(there: socket.socket, scratch: str) -> subprocess.Popen[bytes]:
    """Start a process that serves `there` and has its temporary files in the folder `scratch`."""
    # What readers print of a damaged file would stand beside the one line that is told.
    return subprocess.Popen(
        [sys.executable, '-c', _CODE, json.dumps(sys.path), str(there.fileno())],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        pass_fds=[there.fileno()],
        env=os.environ | ONE_THREAD | {'TMPDIR': scratch})


def _end(process: Any, pipe: Connection, scratch: tempfile.TemporaryDirectory[str]) -> None:
    pipe.close()
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(_LET_END)
        except subprocess.TimeoutExpired:   # a parent that ignores SIGTERM passes that on
            process.kill()
    process.wait()
    scratch.cleanup()


def serve(descriptor: int) -> None:
    """Answer what a `TableApart` asks on this socket, until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)    # Ctrl-C is the parent's to handle
    table, path = None, ''
    with Connection(descriptor) as pipe:
        while True:
            try:
                request = json.loads(pipe.recv_bytes())
            except (EOFError, OSError):
                return
            try:
                if table is None:
                    path = request['path']
                    table = _opened(request)
                    _tell(pipe, {'kind': table.kind, 'channels': [
                        vars(channel) for channel in table.channels]})
                else:
                    _send(pipe, request['read'], table.read(request['read']))
            except (InputError, MemoryError) as error:
                text = str(error)
                if isinstance(error, MemoryError) or isinstance(error.__cause__, MemoryError):
                    text = (f'{path}: asks for more memory than a file of its size needs; it is '
                            'damaged. Export it anew, or as .csv')
                _tell(pipe, {'error': text})


def _opened(request: dict[str, Any]) -> Table:
    path = Path(request['path'])
    _limit(resource.RLIMIT_DATA, _held() + request['room'])
    _limit(resource.RLIMIT_CPU, int(request['seconds']) + 1)
    _limit(resource.RLIMIT_CORE, 0)
    return open_here(path, request['kind'])


def _limit(what: int, most: int) -> None:
    _, hard = resource.getrlimit(what)
    if hard != resource.RLIM_INFINITY:
        most = min(most, hard)
    resource.setrlimit(what, (most, hard))


def _held() -> int:
    """Return how much data this process holds already [bytes]."""
    with open('/proc/self/status', encoding='ascii') as lines:
        return next(int(line.split()[1]) << 10 for line in lines if line.startswith('VmData:'))


def _tell(pipe: Connection, answer: dict[str, Any]) -> None:
    pipe.send_bytes(json.dumps(answer).encode())


def _send(pipe: Connection, places: list[int], read: dict[int, Samples]) -> None:
    _tell(pipe, {'timed': [read[place].time is not None for place in places]})
    for place in places:
        for values in (read[place].value, read[place].time):
            if values is not None:
                pipe.send_bytes(np.ascontiguousarray(values, float).data.cast('B')
                                if values.size else b'')
