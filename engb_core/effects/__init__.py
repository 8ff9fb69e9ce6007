# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effects: physics that a model may leave out, one file each."""

from __future__ import annotations

from typing import Any

__all__ = ['register']


def __getattr__(name: str) -> Any:
    # Not at once: the catalogue is looked through only where it is asked for.
    if name == 'register':
        from engb_core.effects.catalogue import register
        return register
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
