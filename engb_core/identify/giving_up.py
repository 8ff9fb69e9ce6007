# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A computation in a thread that somebody may tell to give up: it looks between two evaluations.

Whom to ask is told once, at the top, and looked at far below, where the time is spent; it holds
for the thread (the context) in which it was told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from contextvars import ContextVar

__all__ = ['GivenUp', 'look_whether_to_give_up', 'may_be_given_up']

_asked: ContextVar[Callable[[], bool] | None] = ContextVar('asked', default=None)


class GivenUp(Exception):
    """What was begun is wanted no more."""


@contextlib.contextmanager
def may_be_given_up(asked: Callable[[], bool] | None) -> Iterator[None]:
    """Let what is computed in this context be given up as soon as `asked` returns true."""
    token = _asked.set(asked)
    try:
        yield
    finally:
        _asked.reset(token)


def look_whether_to_give_up() -> None:
    """Raise GivenUp where it is wanted; called where the next step may take long."""
    asked = _asked.get()
    if asked is not None and asked():
        raise GivenUp
