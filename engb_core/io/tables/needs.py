# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Optional readers: imported when a file needs one, with a plain word where it is missing."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

from engb_core.errors import InputError

__all__ = ['needed']


def needed(module: str, path: Path, kind: str, package: str = '') -> ModuleType:
    """Import an optional package.

    Raises:
        InputError: it is not installed, and the message has the command that installs it; or it
            is and does not start, and the message has its own reason.
    """
    package = package or module.partition('.')[0]
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise InputError(f'{path}: {kind} is read by {package}, which is not installed; run '
                         f'pip install {package}, or export the file as .csv') from error
    except ImportError as error:
        raise InputError(f'{path}: {kind} is read by {package}, which is installed and does not '
                         f'start ({error}); install a version that suits the others, or export '
                         'the file as .csv') from error
