# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Starts nodes as processes, waits until they hear each other, and stops them by signal.

`ros2 launch` does this and more where it is installed; this needs nothing but the package.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
import contextlib
import fcntl
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any, Protocol

from engb_ros.interface import DEFAULT_NAMESPACE
from engb_ros.nodes.transport import stay_on_this_computer

__all__ = ['NodeProcess', 'Runner', 'RunnerError', 'RunnerTimeout', 'node_command',
           'reserved_domain']


class RunnerError(Exception):
    """A process that should run has ended, or a condition was not met in time."""


class RunnerTimeout(RunnerError, TimeoutError):
    """A condition was not met in time, or a process did not end in time."""


@contextlib.contextmanager
def reserved_domain(first: int = 20, last: int = 100) -> Iterator[int]:
    """Give a ROS_DOMAIN_ID that no other runner on this machine holds.

    Raises:
        RunnerError: all are held.
    """
    span = last - first + 1
    for offset in range(span):
        domain = first + (os.getpid() + offset) % span
        path = Path(tempfile.gettempdir()) / f'engb_ros_domain_{domain}.lock'
        try:
            lock = path.open('a')
        except OSError:   # another user's
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            continue
        with lock:
            yield domain
        return
    raise RunnerError(f'every ROS domain from {first} to {last} is in use on this machine')


def node_command(
    executable: str,
    namespace: str = DEFAULT_NAMESPACE,
    parameters: Mapping[str, Any] | None = None,
    parameter_file: str | os.PathLike[str] | None = None,
    name: str | None = None,
) -> list[str]:
    """Return the command line that starts a node of this package with this Python, or of any
    module: a name with a dot."""
    command = [sys.executable, '-m', 'engb_ros.start', executable, '--ros-args',
               '-r', f'__ns:={namespace}']
    if name:
        command += ['-r', f'__node:={name}']
    if parameter_file:
        command += ['--params-file', os.fspath(parameter_file)]
    for key, value in (parameters or {}).items():
        command += ['-p', f'{key}:={_yaml(value)}']
    return command


def _yaml(value: Any) -> str:
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, (list, tuple)):
        return '[' + ', '.join(_yaml(item) for item in value) + ']'
    if isinstance(value, float):
        text = repr(value)
        # YAML 1.1 takes 1e-05 for a text.
        return text if '.' in text or 'n' in text else text.replace('e', '.0e')
    if isinstance(value, (str, os.PathLike)):
        return "'" + os.fspath(value).replace("'", "''") + "'"
    return str(value)


def spawn_process(command: list[str], environment: dict[str, str],
                  output_path: Path) -> subprocess.Popen[bytes]:
    """Start a command in a session of its own, which prints into a file."""
    with output_path.open('wb') as output:
        return subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
            env=environment, start_new_session=True)


class Started(Protocol):
    """What a runner asks of a process: whoever starts them in another way gives back what acts so,
    as subprocess.Popen does."""

    @property
    def pid(self) -> int:
        """Its number."""

    def poll(self) -> int | None:
        """Return its exit status, None while it runs."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; subprocess.TimeoutExpired after `timeout` [s]."""

    def send_signal(self, sig: int, /) -> None:
        """Send a signal, if it still runs."""

    def kill(self) -> None:
        """End it at once."""


# As `spawn_process`.
Spawn = Callable[[list[str], dict[str, str], Path], Started]


class NodeProcess:
    """One process with its output kept in a file."""

    def __init__(self, name: str, command: list[str], environment: Mapping[str, str],
                 folder: Path, spawn: Spawn) -> None:
        self.name = name
        self.output_path = folder / f'{name}.{time.monotonic_ns()}.txt'
        self.process = spawn(command, dict(environment), self.output_path)

    @property
    def output(self) -> str:
        """What it has printed."""
        return self.output_path.read_text(encoding='utf-8', errors='replace')

    @property
    def status(self) -> int | None:
        """Exit status, None while it runs."""
        return self.process.poll()

    def signal(self, number: int) -> None:
        """Send a signal, if it still runs."""
        if self.status is None:
            self.process.send_signal(number)

    def wait(self, timeout: float = 20.0) -> int:
        """Wait for its end and return the exit status.

        Raises:
            RunnerTimeout: it still runs after `timeout` [s].
        """
        try:
            return self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise RunnerTimeout(f'{self.name} still runs {timeout:.0f} s after the signal; it '
                                f'printed: {self.output[-2000:]}') from None


class Runner:
    """A set of processes in one ROS domain; a context manager that leaves none behind.

    Args:
        domain: ROS_DOMAIN_ID; None: the environment's.
        local: keep discovery on this machine.
        environment: more variables.
        spawn: starts a process.
    """

    def __init__(self, domain: int | None = None, local: bool = True,
                 environment: Mapping[str, str] | None = None,
                 spawn: Spawn = spawn_process) -> None:
        self._spawn = spawn
        self._folder = tempfile.TemporaryDirectory(prefix='engb_run_')
        self.environment = dict(os.environ)
        self.environment['ROS_LOG_DIR'] = self._folder.name
        self.environment['PYTHONUNBUFFERED'] = '1'
        if domain is not None:
            self.environment['ROS_DOMAIN_ID'] = str(domain)
        if local:
            stay_on_this_computer(self.environment)
        self.environment.update(environment or {})
        self.processes: dict[str, NodeProcess] = {}

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *error: object) -> None:
        self.kill()
        self._folder.cleanup()

    def start(self, executable: str, name: str | None = None, **options: Any) -> NodeProcess:
        """Start a node; `options` as for `node_command`. `name` must be new, or have ended."""
        key = name or executable
        return self.start_command(key, node_command(executable, name=name, **options))

    def start_command(self, key: str, command: list[str]) -> NodeProcess:
        """Start any command under the name `key`."""
        before = self.processes.get(key)
        if before is not None and before.status is None:
            raise RunnerError(f'{key} runs already')
        process = NodeProcess(key, command, self.environment, Path(self._folder.name),
                              self._spawn)
        self.processes[key] = process
        return process

    def check(self) -> None:
        """Raise RunnerError where a process has ended that should run."""
        for process in self.processes.values():
            if process.status is not None:
                raise RunnerError(f'{process.name} ended with status {process.status}; it '
                                  f'printed: {process.output[-2000:]}')

    def wait_until(self, condition: Callable[[], Any], what: str, timeout: float = 30.0,
                   pause: Callable[[], None] | None = None) -> Any:
        """Wait until `condition()` is true and return it; fail at once if a process has ended.

        Args:
            condition: asked again and again.
            what: for the message, e.g. 'the controller to hear the plant'.
            timeout: [s].
            pause: called in between (e.g. an executor's spin_once); by default 20 ms of sleep.

        Raises:
            RunnerTimeout: not met in time.
            RunnerError: a process has ended.
        """
        end = time.monotonic() + timeout
        while True:
            found = condition()
            if found:
                return found
            self.check()
            if time.monotonic() > end:
                raise RunnerTimeout(f'waited {timeout:.0f} s for {what}')
            if pause is None:
                time.sleep(0.02)
            else:
                pause()

    def stop(self, names: Iterable[str] | None = None, number: int = signal.SIGINT,
             timeout: float = 20.0) -> None:
        """Stop processes (all by default, in order of start) and check that each ends with 0.

        Raises:
            RunnerTimeout: one does not end in time.
            RunnerError: one does not end with status 0.
        """
        chosen = [self.processes[name] for name in (names or list(self.processes))]
        for process in chosen:
            process.signal(number)
        for process in chosen:
            status = process.wait(timeout)
            self.processes.pop(process.name, None)
            if status != 0:
                raise RunnerError(f'{process.name} ended with status {status}; it printed: '
                                  f'{process.output[-2000:]}')

    def kill(self) -> None:
        """End whatever still runs, at once."""
        for process in self.processes.values():
            if process.status is None:
                with contextlib.suppress(ProcessLookupError):
                    process.process.send_signal(signal.SIGCONT)
                    process.process.kill()
        for process in self.processes.values():
            process.process.wait()
        self.processes.clear()
