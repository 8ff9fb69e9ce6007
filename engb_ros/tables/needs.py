"""Optional readers: imported when a file needs one, with a plain word where it is missing."""

from __future__ import annotations

import importlib
import logging
from pathlib import Path
from types import ModuleType

from engb_core.errors import InputError

__all__ = ['needed']


def needed(module: str, path: Path, kind: str, package: str = '') -> ModuleType:
    """Import an optional package.

    Raises:
        InputError: it is not installed; the message has the command that installs it.
    """
    top = module.partition('.')[0]
    try:
        found = importlib.import_module(module)
    except ImportError as error:
        package = package or top
        raise InputError(f'{path}: {kind} is read by {package}, which is not installed; run '
                         f'pip install {package}, or export the file as .csv') from error
    # What a reader logs of a damaged file would stand beside the one line that is told.
    for name in list(logging.root.manager.loggerDict):
        if name.partition('.')[0] == top:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    return found
