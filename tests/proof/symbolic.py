# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Free symbolic regression of what a refit leaves, by pyoperon where it is installed.

The rival of the tool's laws: no grammar, no place to act, no prior but the length of the formula
(Burlacu, Kronberger & Kommenda 2020). It names nothing.
"""
from __future__ import annotations

from importlib import metadata

import numpy as np

from .columns import Answer, number_columns, seen, solve
from .flexible import inputs_of
from .nominal import moving, Nominal, torque_of
from .signals import Signals

__all__ = ['is_there', 'symbolic', 'symbolic_by']

_SYMBOLS = 'add,sub,mul,aq,sin,tanh,abs,square,exp,constant,variable'
_LENGTH, _SECONDS, _POINTS = 30, 20, 4000


def is_there() -> bool:
    """Whether pyoperon is installed."""
    try:
        from pyoperon.sklearn import SymbolicRegressor  # noqa: F401
    except ImportError:
        return False
    return True


def symbolic_by() -> str:
    """Which code does the symbolic regression here."""
    if not is_there():
        return 'left out: pyoperon is not installed (pip install pyoperon)'
    return f'pyoperon {metadata.version("pyoperon")}'


def symbolic(model: Nominal, run: Signals) -> Answer:
    """A formula of the motion for what refitted numbers leave, chosen by description length."""
    from pyoperon.sklearn import SymbolicRegressor
    columns = number_columns(model, run)[0]
    target = seen([run.effort - torque_of(model, run)], run)[:, 0]
    numbers = solve(seen(columns, run), target)
    left = run.effort - torque_of(model, run) - np.stack(columns, axis=1) @ numbers
    inputs = inputs_of(run)
    middle, size = inputs.mean(axis=0), inputs.std(axis=0) + 1e-12
    filtered = seen([left], run)[:, 0]
    # Both sides through the same filter, as the plain methods here see them.
    rows = seen(list(((inputs - middle) / size).T), run)
    every = max(1, rows.shape[0] // _POINTS)
    scale = float(np.std(filtered)) + 1e-15
    found = SymbolicRegressor(
        allowed_symbols=_SYMBOLS, max_length=_LENGTH, max_time=_SECONDS, n_threads=1,
        optimizer_iterations=5, random_state=1)
    found.fit(rows[::every], filtered[::every] / scale)

    def added(other: Signals) -> np.ndarray:
        given = inputs_of(other)
        if given.shape[1] != middle.size:    # a disc that this recording lacks
            return np.zeros_like(other.time)
        formula = scale * np.asarray(found.predict((given - middle) / size), float).ravel()
        return (np.stack(number_columns(model, other)[0], axis=1) @ numbers
                + np.where(moving(other.velocity) & np.isfinite(formula), formula, 0.0))

    return Answer([], added)
