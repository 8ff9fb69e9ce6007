"""Compiled scalar code: numba where it is installed, plain Python (slow, same numbers) else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import logging
from uuid import NAMESPACE_OID, uuid5
import warnings

__all__ = ['COMPILED', 'EffectFunction', 'FUNCTION_SLOTS', 'compiled', 'effect_function', 'kernel']

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
    LOOP_SIGNATURE = types.void(ROW, ROW, MATRIX, types.int64)
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

    ROW = MATRIX = INTEGERS = SIGNATURE = FUNCTIONS = LOOP_SIGNATURE = types = _Anything()


@dataclass(frozen=True)
class EffectFunction:
    """One definition of an effect's physics, in the two forms in which it is run.

    Attributes:
        scalar: f(parameters (k,), state (m,), sample (SAMPLE_SIZE,)) → float, for simulation,
            where stages and effects alternate sample by sample.
        loop: f(parameters, state, samples (n, SAMPLE_SIZE), place) runs `scalar` over a recorded
            motion and writes into column `place`.
    """

    scalar: Callable
    loop: Callable

    def __call__(self, parameters: object, state: object, sample: object) -> float:
        return self.scalar(parameters, state, sample)


def effect_function(function: Callable) -> EffectFunction:
    """Compile f(parameters (k,), state (m,), sample (SAMPLE_SIZE,)) -> float, cached on disk.

    The explicit signature makes it a first-class function: kernels take any set of effects
    without being compiled again.
    """
    scalar = function
    if COMPILED:
        scalar = numba.njit(SIGNATURE, cache=True)(function)
        # The loop's cache is keyed by what it closes over. A name made of the code instead of a
        # random one lets the next process find it, and a changed effect miss it.
        code = function.__code__
        scalar._set_uuid(str(uuid5(NAMESPACE_OID, repr(
            (function.__module__, function.__name__, code.co_code, code.co_consts)))))

    def loop(parameters, state, samples, place):
        for row in range(samples.shape[0]):
            samples[row, place] = scalar(parameters, state, samples[row])

    return EffectFunction(scalar, kernel(LOOP_SIGNATURE)(loop))


def compiled(function: Callable) -> Callable:
    """Compile a helper for its arguments at first use, cached on disk."""
    return numba.njit(cache=True)(function) if COMPILED else function


def kernel(signature: object) -> Callable[[Callable], Callable]:
    """Compile a loop with an explicit signature, cached on disk; it releases the GIL."""
    if not COMPILED:
        return lambda function: function
    return numba.njit(signature, cache=True, nogil=True)
