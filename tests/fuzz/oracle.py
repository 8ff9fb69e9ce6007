# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Runs one case within this process and says what is wrong with how it ended."""

from __future__ import annotations

import contextlib
import io
import json
import os
from pathlib import Path
import signal
import socket
import subprocess
import sys
import tempfile
import time

import numpy as np

from .cases import Case

__all__ = ['ForkedReader', 'in_this_process', 'judge']


def judge(case: Case, folder: Path) -> tuple[str, str]:
    """Run a case.

    Returns:
        What is wrong ('' if nothing), and how it ended, in a word or a line.
    """
    from engb_ros.commands.main import main
    before = _standing(folder)
    out, err = io.StringIO(), io.StringIO()
    begin = time.monotonic()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = main(case.arguments)
        except BaseException as error:      # the fault that is looked for
            return f'{type(error).__name__}: {error}', 'raised'
    seconds = time.monotonic() - begin
    complaint = err.getvalue()
    left = sorted(_standing(folder) - before)
    if status == 0:
        if complaint:
            return f'status 0 with words on standard error: {complaint[:300]}', 'ok'
        return _wrong_result(case, out.getvalue()), f'ok in {seconds:.1f} s'
    if status != 2:
        return f'status {status}: {complaint[:300]}', 'status'
    if complaint.count('\n') != 1 or not complaint.endswith('\n'):
        return f'not one line: {complaint[:300]!r}', 'refused'
    if 'not enough memory' in complaint:
        return complaint, 'memory'
    if out.getvalue():
        return f'refused, yet printed {out.getvalue()[:100]!r}', 'refused'
    if left:
        return f'left behind: {left}', 'refused'
    return '', complaint.strip()


def in_this_process(tasks, work, jobs, seconds):
    """Stand in for `run_processes`: a process of its own per case would take most of the time."""
    del jobs, seconds
    yield from ((index, work(task)) for index, task in enumerate(tasks))


class ForkedReader:
    """Stands in for the process of `engb_core.io.tables.apart.start_process`, forked from this
    one: it has the readers imported already, which would take most of the time."""

    def __init__(self, there: socket.socket, scratch: str) -> None:
        self._code: int | None = None
        self._child = os.fork()
        if self._child:
            return
        status = 1
        try:
            from engb_core.io.tables.apart import serve
            nowhere = os.open(os.devnull, os.O_RDWR)
            for stream in range(3):
                os.dup2(nowhere, stream)
            # Only the parent holds the other end, as after an exec.
            os.closerange(there.fileno() + 1, 256)
            os.closerange(3, there.fileno())
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            tempfile.tempdir = scratch
            serve(there.fileno())
            status = 0
        finally:
            os._exit(status)

    def poll(self) -> int | None:
        """As of subprocess.Popen."""
        if self._code is None:
            child, status = os.waitpid(self._child, os.WNOHANG)
            if child:
                self._code = os.waitstatus_to_exitcode(status)
        return self._code

    def wait(self, timeout: float | None = None) -> int:
        """As of subprocess.Popen."""
        if timeout is not None:
            given_up = time.monotonic() + timeout
            while self.poll() is None:
                if time.monotonic() > given_up:
                    raise subprocess.TimeoutExpired('reader', timeout)
                time.sleep(0.001)
        if self._code is None:
            self._code = os.waitstatus_to_exitcode(os.waitpid(self._child, 0)[1])
        return self._code

    def terminate(self) -> None:
        """As of subprocess.Popen."""
        if self.poll() is None:
            os.kill(self._child, signal.SIGTERM)

    def kill(self) -> None:
        """As of subprocess.Popen."""
        os.kill(self._child, signal.SIGKILL)


def _standing(folder: Path) -> set[str]:
    return {str(entry.relative_to(folder)) for entry in folder.rglob('*')}


def _wrong_result(case: Case, printed: str) -> str:
    """Check what a command wrote when it said that all is well."""
    from engb_core.model import Model
    out = Path(case.out)
    if not printed:
        return 'status 0 without a word'
    if case.arguments[0] == 'import':
        return '' if '--list' in case.arguments or out.exists() else 'no recording'
    if case.arguments[0] == 'predict':
        with np.load(out) as arrays:
            sizes = {array.shape for array in arrays.values()}
            finite = all(np.isfinite(array).all() for array in arrays.values())
        return '' if len(sizes) == 1 and finite else f'arrays: {sizes}, finite: {finite}'
    if case.arguments[0] == 'identify':
        Model.read(out)
        return ''
    if case.arguments[0] == 'diagnose':
        return _wrong_diagnosis(out)
    return _wrong_survey(out)


def _wrong_survey(out: Path) -> str:
    """A survey survives what goes wrong with a recording; here it must not hide it."""
    if not (out / 'survey.html').exists():
        return 'no survey.html'
    for file in (out / 'results').iterdir():
        for result in json.loads(file.read_text(encoding='utf-8'))['results']:
            if result['status'] not in ('ok', 'refused'):
                return f'survey: {result["status"]}: {result["message"]}'
    return ''


def _wrong_diagnosis(out: Path) -> str:
    import jsonschema

    import engb_core.diagnose
    from engb_core.model import Model
    schema = Path(engb_core.diagnose.__file__).parent / 'diagnosis.schema.json'
    text = (out / 'diagnosis.json').read_text(encoding='utf-8')
    try:
        jsonschema.validate(json.loads(text, parse_constant=_refuse), json.loads(
            schema.read_text(encoding='utf-8')))
    except (jsonschema.ValidationError, ValueError) as error:
        return f'diagnosis.json: {str(error)[:300]}'
    Model.read(out / 'model.yaml')
    return '' if (out / 'report.html').stat().st_size else 'empty report'


def _refuse(text: str) -> float:
    raise ValueError(f'{text} in JSON')


if sys.flags.optimize:
    raise RuntimeError('the fuzz oracle needs assertions')
