# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The errors that a user can mend."""

import traceback

from engb_core.printable import printable

__all__ = ['InputError', 'raised_at']


class InputError(Exception):
    """Input that cannot be used, told in one line: which file, which field, what to do.

    The command line prints the message and ends with status 2; a node logs it and ends.
    """

    def __init__(self, message: str) -> None:
        super().__init__(printable(' '.join(str(message).split())))


def raised_at(error: Exception) -> str:
    """Return what somebody else's file raised, and at which of its lines."""
    line = traceback.extract_tb(error.__traceback__)[-1].lineno
    return f'{type(error).__name__}: {error} (line {line} of the file)'
