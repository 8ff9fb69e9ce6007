# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Compiled scalar code: numba where it is installed, plain Python (slow, same numbers) else.

Effects are compiled one by one, kernels once; a kernel calls effects by their addresses. So any
set of effects runs without being compiled again, and nothing is compiled or loaded before it is
first called. Machine code is kept on disk (code_cache.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
import logging
import threading
from typing import Any, Protocol, TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from engb_core.physics.code_cache import CodeCache

__all__ = ['COMPILED', 'EffectFunction', 'Numbers', 'PARAMETER_SIZE', 'WHY_NOT', 'call_effect',
           'compiled', 'effect_function', 'handles', 'kernel', 'row_of']

Array = NDArray[np.float64]
_Function = TypeVar('_Function', bound=Callable[..., object])

# Places for the parameters and constants of one effect.
PARAMETER_SIZE = 112
_COMPILING = threading.Lock()

try:
    import numba

    COMPILED, WHY_NOT = True, ''
except ImportError as error:
    # One that is installed may not start beside another version of numpy.
    COMPILED = False
    WHY_NOT = ('numba is not installed' if isinstance(error, ModuleNotFoundError)
               and error.name == 'numba' else f'numba does not start ({error})')
    logging.getLogger(__name__).info(
        '%s: simulation and diagnosis work, about 100 times slower '
        '(pip install numba, or apt install python3-numba)', WHY_NOT)


class Numbers(Protocol):
    """Numbers by their places, as compiled code reads and writes them: a row of an array."""

    def __getitem__(self, place: int, /) -> float:
        """Return the number at `place`."""

    def __setitem__(self, place: int | slice, value: float, /) -> None:
        """Put a number to `place`."""


# f(parameters (PARAMETER_SIZE,), state (STATE_SIZE,), sample (SAMPLE_SIZE,)) → value.
Definition = Callable[[Numbers, Numbers, Numbers], float]


class EffectFunction:
    """One definition of an effect's physics, as Python and as compiled code.

    Attributes:
        definition: f(parameters (PARAMETER_SIZE,), state (STATE_SIZE,), sample (SAMPLE_SIZE,))
            → float.
        whole: the same values (n,) of samples (n, SAMPLE_SIZE), by a faster way than sample by
            sample; None where there is none.
    """

    def __init__(self, definition: Definition) -> None:
        self.definition = definition
        self.whole: Callable[[Array, Array, Array], Array] | None = None
        self._callback: Any = None

    @cached_property
    def address(self) -> int:
        """Where the compiled function begins in memory."""
        with _COMPILING:
            # Whoever comes second must not free the code that the first one is about to call.
            if self._callback is None:
                self._callback = _callback(self.definition)
        return int(self._callback.address)

    def __call__(self, parameters: Array, state: Array, sample: Array) -> float:
        """Return the function's value for one sample; arrays as `definition` has them."""
        return _one(handles([self]), parameters[None], state[None], sample)

    def loop(self, parameters: Array, state: Array, samples: Array, place: int) -> None:
        """Run over samples (n, SAMPLE_SIZE) and write the values into column `place`."""
        samples[:, place] = self.values(parameters, state, samples)

    def values(self, parameters: Array, state: Array, samples: Array) -> Array:
        """Return the values (n,) of samples (n, SAMPLE_SIZE), one after another."""
        if self.whole is not None:
            return self.whole(parameters, state, samples)
        return self.sample_by_sample(parameters, state, samples)

    def sample_by_sample(self, parameters: Array, state: Array, samples: Array) -> Array:
        """Return the values (n,) of samples (n, SAMPLE_SIZE) as `definition` says them."""
        values = np.empty(samples.shape[0])
        _each(handles([self]), parameters[None], state[None], samples, values)
        return values


def effect_function(definition: Definition) -> EffectFunction:
    """Make f(parameters, state, sample) -> float callable from kernels."""
    return EffectFunction(definition)


def handles(functions: Sequence[EffectFunction]) -> object:
    """Return what a kernel takes for a set of effect functions: see `call_effect`."""
    if COMPILED:
        return np.array([function.address for function in functions], np.int64)
    return tuple(function.definition for function in functions)


def compiled(function: _Function) -> _Function:
    """Compile a helper for its arguments at first use, cached on disk."""
    # Inlined wherever it is called: handing over eight arrays costs as much as a step.
    return _dispatcher(function, forceinline=True) if COMPILED else function


def kernel(function: _Function) -> _Function:
    """Compile a loop for its arguments at first use, cached on disk; it releases the GIL.

    As `compiled`, but a kernel is called from Python only, with arrays that are C-contiguous.
    """
    return _dispatcher(function) if COMPILED else function


if TYPE_CHECKING:
    # What numba makes of these has no types.
    def _dispatcher(function: _Function, **options: bool) -> _Function: ...
    def _callback(definition: Definition) -> Any: ...
    def call_effect(functions: object, index: int, parameters: Array, effect: int, state: Array,
                    sample: Numbers) -> float: ...
    def row_of(matrix: Array, index: int) -> Array: ...
elif COMPILED:
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    _POINTER = types.CPointer(types.float64)
    _ENTRY = types.float64(_POINTER, _POINTER, _POINTER)
    # Division by nothing gives infinity or nan, as in C: a kernel cannot raise out of a callback.
    _OPTIONS = {'nogil': True, 'error_model': 'numpy'}

    def _dispatcher(function: Callable, **options: bool) -> Callable:
        made = numba.njit(**_OPTIONS, **options)(function)
        made._cache = CodeCache(function, repr(options))
        return made

    def _callback(definition: Callable):
        from numba.core.ccallback import CFunc

        from engb_core.effects.base import SAMPLE_SIZE, STATE_SIZE
        # As above: to hand over three arrays takes as long as most effects.
        scalar = numba.njit(**_OPTIONS, forceinline=True)(definition)
        carray, size = numba.carray, PARAMETER_SIZE

        def entry(parameters, state, sample):
            return scalar(carray(parameters, size), carray(state, STATE_SIZE),
                          carray(sample, SAMPLE_SIZE))

        entry.__module__ = definition.__module__
        entry.__qualname__ = definition.__qualname__
        made = CFunc(entry, (_ENTRY.args, _ENTRY.return_type), {},
                     {'nopython': True, 'error_model': 'numpy'})
        made._cache = CodeCache(entry, 'callback, inlined')
        made.compile()
        return made

    @intrinsic
    def call_effect(typing_context, functions, index, parameters, effect, state, sample):
        """Return functions[index](parameters[effect], state[effect], sample)."""
        arguments = (functions, index, parameters, effect, state, sample)

        def generate(context, builder, signature, values):
            found = [context.make_array(kind)(context, builder, value)
                     if isinstance(kind, types.Array) else value
                     for kind, value in zip(signature.args, values, strict=True)]
            functions, index, parameters, effect, state, sample = found

            def row(matrix):
                width = builder.extract_value(matrix.shape, 1)
                return builder.gep(matrix.data, [builder.mul(effect, width)])

            double = ir.DoubleType()
            kind = ir.FunctionType(double, [double.as_pointer()] * 3)
            address = builder.load(builder.gep(functions.data, [index]))
            function = builder.inttoptr(address, kind.as_pointer())
            return builder.call(function, [row(parameters), row(state), sample.data])

        return types.float64(*arguments), generate
    @intrinsic
    def row_of(typing_context, matrix, index):
        """Return matrix[index], lent: nobody counts who holds it."""
        kind = types.Array(types.float64, 1, 'C')

        def generate(context, builder, signature, values):
            source = context.make_array(signature.args[0])(context, builder, values[0])
            width = builder.extract_value(source.shape, 1)
            lent = context.make_array(kind)(context, builder)
            context.populate_array(
                lent, data=builder.gep(source.data, [builder.mul(values[1], width)]),
                shape=[width], strides=[builder.extract_value(source.strides, 1)],
                itemsize=source.itemsize, meminfo=None)
            return lent._getvalue()

        return kind(matrix, index), generate
else:
    def row_of(matrix, index):
        """Return matrix[index]."""
        return matrix[index]

    def call_effect(functions, index, parameters, effect, state, sample):
        """Return functions[index](parameters[effect], state[effect], sample)."""
        return functions[index](parameters[effect], state[effect], sample)


@kernel
def _one(functions: object, parameters: Array, state: Array, sample: Array) -> float:
    return call_effect(functions, 0, parameters, 0, state, sample)


@kernel
def _each(functions: object, parameters: Array, state: Array, samples: Array, values: Array,
          ) -> None:
    for row in range(samples.shape[0]):
        values[row] = call_effect(functions, 0, parameters, 0, state, row_of(samples, row))
