# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Service `~/accept_model`, answered in a thread: whatever the file holds, the loop goes on."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import os
from pathlib import Path
import stat
import sys
import threading
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from engb_core.control.brake_controller import BrakeController
from engb_core.control.force_control import PreparedModel
from engb_core.errors import InputError
from engb_core.model import Model
from engb_ros.interface import ACCEPT_MODEL
from engb_ros.nodes.messages import message_class

__all__ = ['ModelDoor', 'read_candidate']

# A model file is a page of text; what is larger is none [bytes].
LARGEST_FILE = 1_000_000

# The loop takes a model at its next look; it looks at least every 20 ms [s].
_TAKEN_WITHIN = 2.0

# Python hands the interpreter over this often, so a long computation delays no cycle more [s].
_SWITCH = 5e-4


def read_candidate(path: str) -> Model:
    """Read a model file that somebody names while the brake is in use.

    Raises:
        InputError: no regular file (a pipe would block), too large, or no valid model.
    """
    try:
        status = os.stat(path)
    except (OSError, ValueError) as error:
        raise InputError(f'{path}: cannot be read ({getattr(error, "strerror", error)}); give a '
                         'model file') from error
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f'{path}: not a regular file; give a model file')
    if status.st_size > LARGEST_FILE:
        raise InputError(f'{path}: {status.st_size} bytes; a model file has less than '
                         f'{LARGEST_FILE}')
    return Model.read(path)


class ModelDoor:
    """Reads, judges and builds in a thread of its own; the control thread only swaps.

    rclpy answers a service when its callback returns, so the service has an executor of its own:
    a (hidden) node beside the controller's.

    Args:
        node: the controller's node; the service gets its name.
        controller: who judges.
        path: returns the file to take.
        adapt: gives its model the names of this brake.
    """

    def __init__(self, node: Node, controller: BrakeController, path: Callable[[], str],
                 adapt: Callable[[Model], Model]) -> None:
        self._controller = controller
        self._path = path
        self._adapt = adapt
        self._ready: tuple[PreparedModel, threading.Event] | None = None
        sys.setswitchinterval(_SWITCH)
        self._node = rclpy.create_node(
            f'_{node.get_name()}_models', namespace=node.get_namespace(), context=node.context,
            use_global_arguments=False, enable_rosout=False, start_parameter_services=False)
        self._node.create_service(
            message_class(ACCEPT_MODEL.type), node.resolve_service_name(ACCEPT_MODEL.name),
            self._answer)
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._serve, name='models', daemon=True)
        self._thread.start()

    def look(self) -> None:
        """Take a model that is ready; called in the control thread, between two cycles."""
        ready = self._ready
        if ready is not None:
            self._ready = None
            self._controller.take_model(ready[0])
            ready[1].set()

    def close(self) -> None:
        """End the service."""
        self._executor.shutdown(timeout_sec=0.5)
        self._thread.join(timeout=1.0)
        with contextlib.suppress(Exception):
            self._node.destroy_node()

    def _serve(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()

    def _answer(self, request: Any, response: Any) -> Any:
        try:
            response.message = self._accept()
            response.success = True
        except InputError as error:
            response.message, response.success = str(error), False
        except Exception as error:   # nothing in a file may end a controller
            response.message = f'{self._path()}: no usable model ({type(error).__name__}: {error})'
            response.success = False
        return response

    def _accept(self) -> str:
        path = self._path()
        if not path:
            raise InputError('parameter candidate_model is empty; set it to the model file to '
                             'accept')
        prepared = self._controller.prepare_model(
            self._adapt(read_candidate(str(Path(path)))))
        taken = threading.Event()
        self._ready = (prepared, taken)
        if not taken.wait(_TAKEN_WITHIN):
            self._ready = None
            raise InputError('the control loop did not take the model; is it running?')
        self._node.get_logger().info(f'model {path} accepted')
        return f'{path} is in use'
