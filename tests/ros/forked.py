# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Starts nodes by forking a process that has imported ROS already: half a second of processor time
less for each, and all else is as it is: processes of their own, with their own environment,
arguments and output, which run `engb_ros.start` to its end.

    python forked.py SOCKET     serves; nothing of ROS has begun in it
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import inspect
import json
import os
from pathlib import Path
import signal
import socket
import subprocess
import sys
import time

from engb_ros.processes.runner import spawn_process

__all__ = ['NodeServer']

# prctl(2): orphans below become this process's children, so it can wait for them.
_SET_CHILD_SUBREAPER = 36

# What is imported before anything is forked.
MODULES = tuple(f'engb_ros.nodes.{name}' for name in (
    'can_bridge', 'controller', 'disturbance_observer', 'drive_emulator', 'excitation',
    'identifier', 'monitor', 'plant', 'recorder'))

START = [sys.executable, '-m', 'engb_ros.start']


class Forked:
    """A process that the server has forked, as far as a runner asks subprocess.Popen for it."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """Return its exit status, the negative number of the signal that ended it, or None."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; subprocess.TimeoutExpired after `timeout` [s]."""
        begin = time.monotonic()
        while self.poll() is None:
            if timeout is not None and time.monotonic() - begin > timeout:
                raise subprocess.TimeoutExpired('forked node', timeout)
            time.sleep(0.002)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal, if it still runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)


class NodeServer:
    """The process that forks, and the way to it. A context manager."""

    def __init__(self) -> None:
        if ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0):
            raise OSError('orphans cannot be waited for')
        self._wire, other = socket.socketpair()
        with other:
            self._process = subprocess.Popen(
                [sys.executable, __file__, str(other.fileno())], stdin=subprocess.DEVNULL,
                pass_fds=[other.fileno()])
        self._answers = self._wire.makefile('r')

    def __enter__(self) -> NodeServer:
        return self

    def __exit__(self, *error: object) -> None:
        self._answers.close()
        self._wire.close()
        self._process.wait()

    def spawn(self, command: list[str], environment: dict[str, str],
              output_path: Path) -> Forked | subprocess.Popen:
        """Fork a node of this package; start anything else as it is."""
        if command[:3] != START:
            return spawn_process(command, environment, output_path)
        output_path.touch()   # it may be read before the new process has opened it
        self._wire.sendall(json.dumps(
            {'arguments': command[3:], 'environment': environment, 'output': str(output_path),
             'folder': os.getcwd()}).encode() + b'\n')
        return Forked(int(self._answers.readline()))


def _serve(wire: socket.socket) -> list[str] | None:
    """Fork for each line; return the arguments in the new process, None in the old one."""
    with wire, wire.makefile('r') as lines:
        for line in lines:
            asked = json.loads(line)
            read, write = os.pipe()
            middle = os.fork()
            if middle == 0:
                if os.fork() == 0:
                    break
                os._exit(0)
            os.waitpid(middle, 0)
            os.close(write)
            wire.sendall(os.read(read, 20) + b'\n')
            os.close(read)
        else:
            return None
    os.setsid()
    os.write(write, str(os.getpid()).encode())
    os.close(write)
    os.close(read)
    output = os.open(asked['output'], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    os.chdir(asked['folder'])
    sys.path[0] = asked['folder']   # as `python -m` has it
    os.environ.clear()
    os.environ.update(asked['environment'])
    return asked['arguments']


def _warm_up() -> None:
    """Import what a node needs to run, and let Python find what it keeps; begin nothing."""
    for name in MODULES:
        importlib.import_module(name)
    from lifecycle_msgs import msg as lifecycle_messages
    from lifecycle_msgs import srv as lifecycle_services
    from rcl_interfaces import msg as parameter_messages
    from rcl_interfaces import srv as parameter_services
    from rclpy.type_support import check_for_type_support
    from rclpy.utilities import get_rmw_implementation_identifier
    import rosidl_generator_py  # noqa: F401

    from engb_ros import interface
    from engb_ros.nodes.brake_parameters import make_brake
    from engb_ros.nodes.messages import message_class
    from engb_ros.nodes.plant import PlantNode
    get_rmw_implementation_identifier()   # loads the middleware's library
    kinds = [message_class(entry.type) for entry in vars(interface).values()
             if isinstance(entry, (interface.Topic, interface.Service))]
    kinds += [kind for module in (lifecycle_messages, lifecycle_services, parameter_messages,
                                  parameter_services)
              for kind in vars(module).values() if isinstance(kind, type)]
    for kind in kinds:
        check_for_type_support(kind)
    make_brake({spec.name: spec.default for spec in PlantNode.parameters}).advance()
    with contextlib.suppress(ImportError):   # CAN is an extra
        from engb_ros.can.codec import dbc_file, DriveCodec
        DriveCodec(dbc_file(''), 'DRIVE')
    inspect.getframeinfo(inspect.stack(0)[0].frame)


def main() -> int:
    """Import, serve, and be the node in each process that was forked."""
    sys.path[0] = os.getcwd()
    _warm_up()
    gc.collect()
    gc.freeze()
    arguments = _serve(socket.socket(fileno=int(sys.argv[1])))
    if arguments is None:
        return 0
    from engb_ros.start import start
    gc.unfreeze()
    sys.argv[1:] = arguments[1:]
    return start(arguments[0])


if __name__ == '__main__':
    sys.exit(main())
