# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The errors that a user can mend."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import traceback

from engb_core.text.printable import printable

__all__ = ['InputError', 'computing', 'raised_at']


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


@contextlib.contextmanager
def computing(subject: str) -> Iterator[None]:
    """Turn arithmetic that breaks down into an InputError about `subject`.

    Numbers far from any brake's (an inertia of 1e300, a constant position) make equations
    singular; which equation it is doesn't help whoever gave them.
    """
    try:
        yield
    except ArithmeticError as error:
        raise _broken_down(subject, error) from error
    except ValueError as error:
        # numpy's LinAlgError is a ValueError; other ones are faults of the program.
        if type(error).__name__ != 'LinAlgError':
            raise
        raise _broken_down(subject, error) from error


def _broken_down(subject: str, error: Exception) -> InputError:
    return InputError(f'{subject}: the numbers lead to no result ({error}); check sizes and '
                      'units in the recording and in the model file')
