# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Arithmetic that breaks down is a matter of the input, told in one line."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib

from engb_core.errors import InputError

__all__ = ['computing']


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
