# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Expressions of compiled Python in C, each with its kind and how tightly it binds."""

from __future__ import annotations

import ast
import math
import types
from typing import Any, TYPE_CHECKING

import numpy as np

from engb_core.errors import InputError
from engb_core.export.kinds import Array, BOOL, joined, Kind, LONG, REAL, TABLE
from engb_core.physics import compiled

if TYPE_CHECKING:
    from engb_core.export.translate import Translator

__all__ = ['Expressions', 'as_kind', 'number']

Value = tuple[str, Kind, int]

_OPERATORS: dict[type, tuple[str, int]] = {
    ast.Add: ('+', 12), ast.Sub: ('-', 12), ast.Mult: ('*', 13), ast.Div: ('/', 13)}
_COMPARISONS: dict[type, str] = {ast.Lt: '<', ast.LtE: '<=', ast.Gt: '>', ast.GtE: '>=',
                                 ast.Eq: '==', ast.NotEq: '!='}
# Binding in C: 16 stands for itself, 3 is a choice.
_WHOLE, _UNARY, _COMPARED, _AND, _OR, _CHOICE = 16, 14, 10, 5, 4, 3
_MATH = {'sin', 'cos', 'tan', 'tanh', 'atan', 'atan2', 'exp', 'log', 'sqrt', 'floor', 'ceil',
         'copysign', 'hypot', 'sinh', 'cosh', 'asin', 'acos', 'pow', 'fabs', 'log1p', 'expm1'}


def number(value: float) -> str:
    """Return a number as C reads it back, bit by bit."""
    if isinstance(value, (bool, int, np.integer)):
        return str(int(value))
    value = float(value)
    if math.isnan(value):
        return 'NAN'
    if math.isinf(value):
        return 'INFINITY' if value > 0 else '(-INFINITY)'
    return repr(value)


class Expressions:
    """Values of one function's expressions; the statements are in translate.py.

    Attributes:
        kinds: variable → its kind, as far as it is known by now.
        written, read: arrays that are written into; names that are used at all.
    """

    def __init__(self, translator: Translator, function: types.FunctionType) -> None:
        self.translator, self.function = translator, function
        self.kinds: dict[str, Kind] = {}
        self.written: set[str] = set()
        self.read: set[str] = set()
        cells = function.__closure__ or ()
        self._outside = {**function.__globals__, **dict(zip(
            function.__code__.co_freevars, (cell.cell_contents for cell in cells), strict=True))}

    def fail(self, node: ast.AST, what: str) -> InputError:
        """Return the error that names the place of what cannot be translated."""
        raise NotImplementedError

    def local(self, name: str) -> str:
        """Return a variable's name in C."""
        raise NotImplementedError

    def value(self, node: ast.expr) -> Value:
        """Return an expression's text, kind and binding.

        Raises:
            InputError: it is not translated.
        """
        found = getattr(self, f'_{type(node).__name__.lower()}', None)
        if found is None:
            raise self.fail(node, f'{type(node).__name__} is not translated to C')
        made: Value = found(node)
        return made

    def kept(self, node: ast.expr) -> Value:
        """Return a value that is reckoned with or kept: a truth is 1 or 0."""
        value = self.value(node)
        return as_kind(value, LONG) if value[1] == BOOL else value

    def truth(self, node: ast.expr) -> Value:
        """Return a condition: of a number, whether it is none (MISRA C, rule 14.4)."""
        value = self.value(node)
        if value[1] == BOOL:
            return value
        nothing = '0.0' if value[1] == REAL else '0'
        return f'{_bound(value, _UNARY)} != {nothing}', BOOL, _COMPARED - 1

    def array(self, node: ast.expr) -> tuple[str, Array]:
        """Return the name of an array and its kind."""
        if isinstance(node, ast.Name):
            kind = self.kinds.get(node.id)
            if isinstance(kind, Array):
                self.read.add(node.id)
                return node.id, kind
        raise self.fail(node, f'{ast.unparse(node)} is no array')

    def place(self, node: ast.Subscript) -> str:
        """Return the place of an array that is written into."""
        name, _ = self.array(node.value)
        self.written.add(name)
        return self._subscript(node)[0]

    def new_array(self, node: ast.expr) -> Array | None:
        """Return the array that an expression such as np.empty(8) makes, None where it is none."""
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
                and isinstance(node.func.value, ast.Name)
                and self._outside.get(node.func.value.id) is np):
            return None
        if node.func.attr != 'empty' or len(node.args) != 1:
            raise self.fail(node, f'np.{node.func.attr} is not translated to C, np.empty(8) is')
        size = self._known(node.args[0])
        if not isinstance(size, int):
            raise self.fail(node, 'the size of an array has to be a constant')
        return Array(size, own=True)

    def _known(self, node: ast.expr) -> Any:
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Name) and node.id not in self.kinds:
            return self._outside.get(node.id)
        return None

    def _constant_value(self, name: str, value: Any) -> Value:
        kind = LONG if isinstance(value, (bool, int, np.integer)) else REAL
        named = self.translator.names.get((name, value))
        if named is not None:
            return named, kind, _WHOLE
        return number(value), kind, _UNARY if value < 0 else _WHOLE

    def _constant(self, node: ast.Constant) -> Value:
        if not isinstance(node.value, (bool, int, float)):
            raise self.fail(node, f'{node.value!r} is no number')
        return self._constant_value('', node.value)

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.kinds:
            self.read.add(node.id)
            if self.kinds[node.id] == TABLE:
                return '', TABLE, _WHOLE
            return self.local(node.id), self.kinds[node.id], _WHOLE
        value = self._outside.get(node.id)
        if isinstance(value, (bool, int, float, np.floating, np.integer)):
            return self._constant_value(node.id, value)
        raise self.fail(node, f'{node.id} is not known before it is used, or no number')

    def _attribute(self, node: ast.Attribute) -> Value:
        if isinstance(node.value, ast.Name) and self._outside.get(node.value.id) in (math, np):
            value = getattr(self._outside[node.value.id], node.attr, None)
            if isinstance(value, float):
                return number(value), REAL, _WHOLE
        raise self.fail(node, f'{ast.unparse(node)} is not translated to C')

    def _subscript(self, node: ast.Subscript) -> Value:
        if isinstance(node.value, ast.Attribute) and node.value.attr == 'shape':
            _, kind = self.array(node.value.value)
            axis = self._known(node.slice)
            size = kind.length if axis == 0 else kind.width
            if size is None:
                raise self.fail(node, 'this size is not known in C')
            return str(size), LONG, _WHOLE
        name, kind = self.array(node.value)
        if isinstance(node.slice, ast.Tuple):
            (row, _, binds), (column, _, _) = (self.value(entry) for entry in node.slice.elts)
            row = f'{row if binds > 13 else f"({row})"} * {kind.width}'
            return (f'{self.local(name)}[{row}]' if column == '0' else
                    f'{self.local(name)}[({row}) + {column}]'), kind.item, _WHOLE
        index, of, _ = self.value(node.slice)
        if of != LONG:
            raise self.fail(node, 'a place in an array has to be a whole number')
        return f'{self.local(name)}[{index}]', kind.item, _WHOLE

    def _binop(self, node: ast.BinOp) -> Value:
        left, right = self.kept(node.left), self.kept(node.right)
        kind = joined(left[1], right[1])
        if isinstance(node.op, ast.Pow):
            if self._known(node.right) == 2:
                return f'engb_square({as_kind(left, REAL)[0]})', REAL, _WHOLE
            return f'pow({as_kind(left, REAL)[0]}, {as_kind(right, REAL)[0]})', REAL, _WHOLE
        if isinstance(node.op, ast.Mod) and kind == LONG:
            return f'engb_mod_long({left[0]}, {right[0]})', LONG, _WHOLE
        if type(node.op) not in _OPERATORS:
            raise self.fail(node, f'{type(node.op).__name__} is not translated to C')
        sign, binds = _OPERATORS[type(node.op)]
        if isinstance(node.op, ast.Div):
            kind = REAL
        left, right = as_kind(left, kind), as_kind(right, kind)
        # As Python groups them, and in brackets wherever two operators meet (MISRA C, rule 12.1).
        return f'{_bound(left, binds, alike=True)} {sign} {_bound(right, _UNARY)}', kind, binds

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            return f'!{_bound(self.truth(node.operand), _UNARY)}', BOOL, _UNARY
        value = self.kept(node.operand)
        if isinstance(node.op, ast.USub):
            inner = _bound(value, _UNARY)
            return f'-({inner})' if inner.startswith('-') else f'-{inner}', value[1], _UNARY
        if isinstance(node.op, ast.UAdd):
            return value
        raise self.fail(node, f'{type(node.op).__name__} is not translated to C')

    def _compare(self, node: ast.Compare) -> Value:
        terms = [self.kept(entry) for entry in (node.left, *node.comparators)]
        parts = []
        for left, operator, right in zip(terms, node.ops, terms[1:], strict=False):
            if type(operator) not in _COMPARISONS:
                raise self.fail(node, f'{type(operator).__name__} is not translated to C')
            kind = joined(left[1], right[1])
            left, right = as_kind(left, kind), as_kind(right, kind)
            parts.append(f'{_bound(left, _UNARY)} {_COMPARISONS[type(operator)]} '
                         f'{_bound(right, _UNARY)}')
        if len(parts) > 1:
            parts = [f'({part})' for part in parts]
        return ' && '.join(parts), BOOL, _COMPARED - 1 if len(parts) == 1 else _AND

    def _boolop(self, node: ast.BoolOp) -> Value:
        sign, binds = ('&&', _AND) if isinstance(node.op, ast.And) else ('||', _OR)
        return f' {sign} '.join(_bound(self.truth(entry), _UNARY)
                                for entry in node.values), BOOL, binds

    def _ifexp(self, node: ast.IfExp) -> Value:
        test, then, other = self.truth(node.test), self.kept(node.body), self.kept(node.orelse)
        kind = joined(then[1], other[1])
        then, other = as_kind(then, kind), as_kind(other, kind)
        return (f'{_bound(test, _UNARY)} ? {_bound(then, _UNARY)} : {_bound(other, _UNARY)}',
                kind, _CHOICE)

    def _call(self, node: ast.Call) -> Value:
        if node.keywords:
            raise self.fail(node, 'arguments by name are not translated to C')
        if isinstance(node.func, ast.Attribute):
            return self._math(node)
        if not isinstance(node.func, ast.Name):
            raise self.fail(node, f'{ast.unparse(node.func)} cannot be called in C')
        name = node.func.id
        target = self._outside.get(name)
        if target is compiled.call_effect:
            return self._effect_call(node)
        if target is None and name in ('min', 'max', 'abs', 'int', 'float', 'bool'):
            return self._builtin(node, name)
        from engb_core.export.translate import plain_function
        plain = plain_function(target)
        if not isinstance(plain, types.FunctionType):
            raise self.fail(node, f'{name} cannot be called in C')
        given: list[str] = []
        kinds: list[Kind] = []
        arrays: list[str] = []
        for entry in node.args:
            if isinstance(entry, ast.Name) and isinstance(self.kinds.get(entry.id), Array):
                array, kind = self.array(entry)
                given.append(self.local(array))
                kinds.append(Array(kind.length, kind.width, kind.item))
                arrays.append(array)
            else:
                text, of, _ = self.kept(entry)
                given += [text] if text else []
                kinds.append(of)
                arrays.append('')
        made = self.translator.function(plain, kinds)
        self.written |= {array for array, writes in zip(arrays, made.writes, strict=True)
                         if writes and array}
        return f'{made.name}({", ".join(given)})', made.result, _WHOLE

    def _math(self, node: ast.Call) -> Value:
        function = node.func
        assert isinstance(function, ast.Attribute)
        if not (isinstance(function.value, ast.Name)
                and self._outside.get(function.value.id) is math):
            raise self.fail(node, f'{ast.unparse(function)} cannot be called in C')
        given = ', '.join(as_kind(self.kept(entry), REAL)[0] for entry in node.args)
        if function.attr in ('isnan', 'isinf', 'isfinite'):
            return f'{function.attr}({given}) != 0', BOOL, _COMPARED - 1
        if function.attr not in _MATH:
            raise self.fail(node, f'math.{function.attr} is not translated to C')
        return f'{function.attr}({given})', REAL, _WHOLE

    def _builtin(self, node: ast.Call, name: str) -> Value:
        if name == 'bool':
            return self.truth(node.args[0])
        values = [self.kept(entry) for entry in node.args]
        text, kind, _ = values[0]
        if name == 'int':
            return (f'(long){text}', LONG, _UNARY) if values[0][2] == _WHOLE else (
                f'engb_whole({text})', LONG, _WHOLE)
        if name == 'float':
            return as_kind(values[0], REAL)
        if name == 'abs':
            return (f'labs({text})', LONG, _WHOLE) if kind == LONG else (
                f'fabs({text})', REAL, _WHOLE)
        if len(values) < 2:
            raise self.fail(node, f'{name} of one thing is not translated to C')
        for value in values[1:]:
            kind = joined(kind, value[1])
        text, *others = (as_kind(value, kind)[0] for value in values)
        for other in others:
            text = f'engb_{name}{"_long" if kind == LONG else ""}({text}, {other})'
        return text, kind, _WHOLE

    def _effect_call(self, node: ast.Call) -> Value:
        """call_effect(functions, index, parameters, effect, state, sample), by the table."""
        _, index, parameters, effect, state, sample = node.args
        places = []
        row = self.value(effect)
        for entry in (parameters, state):
            name, kind = self.array(entry)
            places.append(f'&{self.local(name)}[{_bound(row, _UNARY)} * {kind.width}]')
        name, _ = self.array(sample)
        self.written |= {self.array(state)[0], name}
        return (f'{self.translator.table}[{self.value(index)[0]}]({places[0]}, {places[1]}, '
                f'{self.local(name)})'), REAL, _WHOLE


def _bound(value: Value, binds: int, alike: bool = False) -> str:
    """Return the text, in brackets where it binds less tightly than asked for; `alike`: and where
    it binds more tightly, unless it is one whole."""
    stands = value[2] >= _UNARY or (value[2] == binds if alike else value[2] >= binds)
    return value[0] if stands else f'({value[0]})'


def as_kind(value: Value, kind: Kind) -> Value:
    """Return a value as C has it where this kind is asked for: a whole number is made a real one
    by name (MISRA C, rule 10.3)."""
    text, of, binds = value
    if of == BOOL and kind != BOOL:
        one, none = ('1.0', '0.0') if kind == REAL else ('1', '0')
        return f'({text}) ? {one} : {none}', kind, _CHOICE
    if kind != REAL or of != LONG:
        return value
    if text.lstrip('-').isdigit():
        return f'{text}.0', REAL, binds
    if binds < _WHOLE:
        return f'engb_real({text})', REAL, _WHOLE       # rule 10.8
    return f'(double){text}', REAL, _UNARY
