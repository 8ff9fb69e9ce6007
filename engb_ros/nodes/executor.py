# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which executor the nodes run on, and one turn of it."""

from __future__ import annotations

import os

import rclpy
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor, SingleThreadedExecutor

__all__ = ['make_executor', 'spin_once']


def make_executor(context: rclpy.Context | None = None) -> Executor:
    """Return the EventsExecutor (half the CPU per cycle), or, where rclpy has none, the
    single-threaded one. ENGB_EXECUTOR=single asks for the latter."""
    if os.environ.get('ENGB_EXECUTOR', 'events') != 'single':
        try:
            from rclpy.experimental import EventsExecutor
            return EventsExecutor(context=context)
        except ImportError:
            pass
    return SingleThreadedExecutor(context=context)


def spin_once(executor: Executor, timeout: float) -> bool:
    """Handle what has come, waiting no longer than `timeout` [s]; return whether it was of
    something that had been destroyed.

    The EventsExecutor raises then: what is destroyed may have an event in its queue, such as
    another publisher that offers less than a subscription asks for.
    """
    try:
        executor.spin_once(timeout_sec=timeout)
    except InvalidHandle:
        return True
    return False
