# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Runs a node: from its command line to its end by signal, which is always a clean one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import gc
import os
import signal
import sys
import time
from typing import Any, TYPE_CHECKING

import rclpy
from rclpy.exceptions import ROSInterruptException
from rclpy.executors import Executor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions

from engb_core.errors import InputError
from engb_ros.nodes.command_line import answer_without_ros
from engb_ros.nodes.executor import make_executor, spin_once
from engb_ros.nodes.realtime import use_realtime
from engb_ros.nodes.transport import share_no_memory, word_about

if TYPE_CHECKING:
    from engb_ros.nodes.base import ManagedNode

__all__ = ['run']

# After the signal to stop, a node that still has work may finish it [s]; launch waits 5 s.
LONGEST_FINISH = 3.0


def run(make_node: Callable[[], ManagedNode], args: Sequence[str] | None = None) -> int:
    """Run a node until SIGINT or SIGTERM; return the exit status (2 where input was bad).

    `--help` is answered, and what is no option refused, before ROS is started.

    rclpy's own signal handling loses the race with a fast timer now and then, so the handlers
    here only set a flag, and the loop ends between two callbacks.
    """
    answered = answer_without_ros(make_node, args)
    if answered is not None:
        return answered
    stopped = False

    def on_signal(number: int, frame: Any) -> None:
        nonlocal stopped
        stopped = True

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    node: ManagedNode | None = None
    executor: Executor | None = None
    status, name = 0, getattr(make_node, 'node_name', 'node')
    share_no_memory(os.environ)
    try:
        rclpy.init(args=None if args is None else list(args),
                   signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:
        print(f'ROS could not be started: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    try:
        try:
            node = make_node()
        except rclpy_implementation.RCLError as error:   # DDS security without its keys, say
            raise InputError(f'could not be created: {" ".join(str(error).split())}') from error
        if 'scheduling_priority' in node.values:
            use_realtime(node.values)
            if word := word_about(os.environ):
                node.get_logger().warning(word)
        node.autostart()
        # What is there now stays: the garbage collector needn't walk it in the midst of a cycle.
        gc.collect()
        gc.freeze()
        executor = make_executor()
        executor.add_node(node)
        while not stopped:
            if spin_once(executor, node.poll_period):
                node.get_logger().info('an event came of what had been destroyed')
            if node.broken:
                raise node.broken
            node.poll()
            node.destroy_silenced()
            node.settle_for_less()
        end = time.monotonic() + LONGEST_FINISH
        while node.finishing() and time.monotonic() < end:
            pause = time.monotonic() + 0.1
            while time.monotonic() < pause:
                spin_once(executor, 0.02)
        if node.broken:
            raise node.broken
    except InputError as error:
        status = _say(name if node is None else node.get_name(), error)
    except (KeyboardInterrupt, ROSInterruptException):
        pass
    finally:
        if node is not None:
            name = node.get_name()   # a node that has been destroyed has none
            try:
                _end(node)
                if node.broken and status == 0:
                    raise node.broken
            except InputError as error:   # a bag that cannot be closed
                status = _say(name, error)
        rclpy.try_shutdown()
        # The middleware's threads end with the last reference to the node. Frozen it would outlive
        # Python, and those threads would run on into the libraries' own end: a crash at times.
        node = executor = None
        gc.unfreeze()
        gc.collect()
    return status


def _end(node: ManagedNode) -> None:
    try:
        if node.active:
            node.trigger_deactivate()
    finally:
        node.destroy_node()


def _say(name: str, error: InputError) -> int:
    """Print what is wrong, in one line; return the exit status."""
    print(f'{name}: {error}', file=sys.stderr, flush=True)
    return 2
