"""Compiled scalar code: numba where it is installed, plain Python (slow, same numbers) where not."""

from __future__ import annotations

from collections.abc import Callable
import logging
import warnings

__all__ = ['COMPILED', 'FUNCTION_SLOTS', 'compiled', 'effect_function', 'kernel']

# How many effect functions one model can hold (an effect brings one to three).
FUNCTION_SLOTS = 12

try:
    import numba
    from numba import types

    COMPILED = True
    warnings.filterwarnings('ignore', message='First-class function type feature')
    ROW = types.Array(types.float64, 1, 'C')
    MATRIX = types.Array(types.float64, 2, 'C')
    INTEGERS = types.Array(types.int64, 1, 'C')
    SIGNATURE = types.float64(ROW, ROW, ROW)
    FUNCTIONS = types.UniTuple(types.FunctionType(SIGNATURE), FUNCTION_SLOTS)
except ImportError:
    COMPILED = False
    logging.getLogger(__name__).info(
        'numba is not installed: simulation and diagnosis work, about 100 times slower '
        '(pip install numba, or apt install python3-numba)')

    class _Anything:
        def __getattr__(self, name: str) -> _Anything:
            return self

        def __call__(self, *arguments: object) -> _Anything:
            return self

    ROW = MATRIX = INTEGERS = SIGNATURE = FUNCTIONS = types = _Anything()


def effect_function(function: Callable) -> Callable:
    """Compile f(parameters (k,), state (m,), sample (SAMPLE_SIZE,)) -> float, cached on disk.

    The explicit signature makes it a first-class function: kernels take any set of effects
    without being compiled again.
    """
    return numba.njit(SIGNATURE, cache=True)(function) if COMPILED else function


def compiled(function: Callable) -> Callable:
    """Compile a helper for its arguments at first use, cached on disk."""
    return numba.njit(cache=True)(function) if COMPILED else function


def kernel(signature: object) -> Callable[[Callable], Callable]:
    """Compile a loop with an explicit signature, cached on disk; it releases the GIL."""
    if not COMPILED:
        return lambda function: function
    return numba.njit(signature, cache=True, nogil=True)
