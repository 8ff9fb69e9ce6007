# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Compiled Python as C: the functions that simulate, translated statement by statement.

What an effect is stands once, in its file. So that a model can run where there is no Python, the
same text becomes C99 here, with the same operations in the same order; the language is the small
one that numba compiles as well: numbers, arrays, `math`, conditions, loops and calls of such
functions. A function is translated for the kinds of its arguments when it is first called.
Nothing of it allocates memory, and nothing recurses.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
import inspect
import textwrap
import types
from typing import Any

from engb_core.errors import InputError
from engb_core.export.expressions import as_kind, Expressions
from engb_core.export.kinds import declared, joined, Kind, LONG, REAL, Several, TABLE, VOID

__all__ = ['Translated', 'Translator', 'helpers_of']

# Python's own of these: the first one where both are alike, a remainder with the divisor's sign.
_HELPERS = '''\
static double engb_min(double a, double b) { return (b < a) ? b : a; }
static double engb_max(double a, double b) { return (b > a) ? b : a; }
static long engb_min_long(long a, long b) { return (b < a) ? b : a; }
static long engb_max_long(long a, long b) { return (b > a) ? b : a; }
static long engb_mod_long(long a, long b) { return ((a % b) + b) % b; }
static double engb_real(long a) { return (double)a; }
static long engb_whole(double a) { return (long)a; }
static double engb_square(double a) { return a * a; }
'''
# How a variable begins.
_NOTHING = {LONG: ' = 0', REAL: ' = 0.0'}
_KEYWORDS = {'auto', 'break', 'case', 'char', 'const', 'continue', 'default', 'do', 'double',
             'else', 'enum', 'extern', 'float', 'for', 'goto', 'if', 'inline', 'int', 'long',
             'register', 'restrict', 'return', 'short', 'signed', 'sizeof', 'static', 'struct',
             'switch', 'typedef', 'union', 'unsigned', 'void', 'volatile', 'while'}


def helpers_of(text: str) -> str:
    """Return the small functions that a C text calls, one line each."""
    lines = [line for line in _HELPERS.splitlines()
             if f'{line.partition("(")[0].split()[-1]}(' in text]
    return '\n'.join([*lines, ''])


class Translated:
    """A function in C: its name, what it returns, and which array arguments it writes into."""

    def __init__(self, name: str, result: Kind, writes: tuple[bool, ...]) -> None:
        self.name, self.result, self.writes = name, result, writes


class Translator:
    """Translates functions and what they call.

    Attributes:
        functions: name → C text of each, what is called before what calls it.
        structures: definitions of structures that functions return.

    Args:
        names: value → name in C of constants that have one, by (module-level name, value).
        table: C name of the table of effect functions, for `call_effect`.
    """

    def __init__(self, names: dict[tuple[str, float], str], table: str = 'engb_functions') -> None:
        self.names, self.table = names, table
        self.functions: dict[str, str] = {}
        self.structures: dict[str, str] = {}
        self._done: dict[tuple[types.FunctionType, tuple[Kind, ...]], Translated] = {}
        self._taken: set[str] = set()
        self._open: list[types.FunctionType] = []

    def function(self, function: Callable[..., Any], kinds: Sequence[Kind],
                 writes: Sequence[str] = ()) -> Translated:
        """Translate a function for arguments of these kinds, and what it calls.

        `writes` names arguments that may be written into though this function does not.

        Raises:
            InputError: there is something in it that is not translated; the message says what.
        """
        plain = plain_function(function)
        key = plain, tuple(kinds)
        if key in self._done:
            return self._done[key]
        if plain in self._open:
            raise InputError(f'{_place(plain)}: calls itself; C for a controller must not')
        self._open.append(plain)
        try:
            body = _Body(self, plain, kinds)
            body.written |= {name for name in writes if name in body.arguments}
            name = self._name_of(plain)
            text, result, written = body.translated(name)
        finally:
            self._open.pop()
        made = Translated(name, result, written)
        self.functions[name] = text
        self._done[key] = made
        return made

    def structure(self, kind: Several) -> None:
        """Have a structure defined."""
        self.structures[kind.name] = kind.definition

    def _name_of(self, function: types.FunctionType) -> str:
        module = function.__module__.rpartition('.')[2]
        name = base = f'engb_{module}_{function.__name__.strip("_")}'
        number = 2
        while name in self._taken:
            name, number = f'{base}_{number}', number + 1
        self._taken.add(name)
        return name


def plain_function(function: Any) -> types.FunctionType:
    """Return the Python function behind a compiled one or an effect's."""
    for attribute in ('definition', 'py_func'):
        function = getattr(function, attribute, function)
    plain: types.FunctionType = function
    return plain


def _place(function: types.FunctionType) -> str:
    return f'{function.__module__}.{function.__qualname__}'


class _Body(Expressions):
    """One function on its way to C."""

    def __init__(self, translator: Translator, function: types.FunctionType,
                 kinds: Sequence[Kind]) -> None:
        super().__init__(translator, function)
        try:
            text = textwrap.dedent(inspect.getsource(function))
        except OSError as error:
            raise InputError(f'{_place(function)}: its source cannot be read, so it cannot '
                             'become C; keep the effect in a file') from error
        definition = ast.parse(text).body[0]
        assert isinstance(definition, ast.FunctionDef)
        self._definition = definition
        self._first = function.__code__.co_firstlineno - 1
        self.arguments = [entry.arg for entry in definition.args.args]
        self.kinds = dict(zip(self.arguments, kinds, strict=True))
        self.result: Kind = VOID

    def translated(self, name: str) -> tuple[str, Kind, tuple[bool, ...]]:
        """Return the text, what it returns, and which arguments it writes into."""
        statements = self._definition.body
        lines: list[str] = []
        # Until no variable turns out to be a real number that was a whole one before.
        while True:
            before = dict(self.kinds), self.result
            lines = self._block(statements, 1)
            if (self.kinds, self.result) == before:
                break
        given = ', '.join(declared(self.kinds[entry], self.local(entry),
                                   entry not in self.written) for entry in self.arguments
                          if self.kinds[entry] != TABLE)
        variables = [f'    {declared(kind, self.local(entry))}'
                     f'{_NOTHING.get(str(kind), "")};'
                     for entry, kind in self.kinds.items()
                     if entry not in self.arguments and entry in self.read]
        unused = [f'    (void){self.local(entry)};' for entry in self.arguments
                  if entry not in self.read and self.kinds[entry] != TABLE]
        note = ast.get_docstring(self._definition) or ''
        comment = [f'/* {_place(self.function)}'
                   + (f': {note.splitlines()[0]}' if note else '') + ' */']
        kind = self.result.name if isinstance(self.result, Several) else self.result
        text = '\n'.join([*comment, f'static {kind} {name}({given or "void"})', '{', *variables,
                          *unused, *lines, '}', ''])
        return text, self.result, tuple(entry in self.written for entry in self.arguments)

    def fail(self, node: ast.AST, what: str) -> InputError:
        """Return the error that names the place of what cannot be translated."""
        line = self._first + getattr(node, 'lineno', 1)
        return InputError(f'{_place(self.function)}, line {line}: {what}; effects that become C '
                          'hold numbers, arrays, math, if, for, while and calls')

    def local(self, name: str) -> str:
        """Return a variable's name in C."""
        return f'{name}_' if name in _KEYWORDS or name.startswith('engb_') else name

    def _block(self, statements: Sequence[ast.stmt], depth: int) -> list[str]:
        return [f'{"    " * depth}{line}' if line else line
                for entry in statements for line in self._statement(entry)]

    def _inner(self, statements: Sequence[ast.stmt]) -> list[str]:
        return self._block(statements, 1)

    def _statement(self, node: ast.stmt) -> list[str]:
        if isinstance(node, ast.Pass) or (isinstance(node, ast.Expr)
                                          and isinstance(node.value, ast.Constant)):
            return []
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            return [f'{self.value(node.value)[0]};']
        if isinstance(node, ast.Return):
            return self._return(node)
        if isinstance(node, ast.Assign):
            first, *others = node.targets
            lines = self._assign(first, node.value)
            return lines + [line for other in others
                            for line in self._assign(other, _loaded(first))]
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            return self._assign(node.target, node.value)
        if isinstance(node, ast.AugAssign):
            return self._assign(node.target, ast.copy_location(
                ast.BinOp(_loaded(node.target), node.op, node.value), node))
        if isinstance(node, ast.If):
            lines = [f'if ({self.truth(node.test)[0]}) {{', *self._inner(node.body)]
            if node.orelse:
                lines += ['} else {', *self._inner(node.orelse)]
            return [*lines, '}']
        if isinstance(node, ast.While) and not node.orelse:
            return [f'while ({self.truth(node.test)[0]}) {{', *self._inner(node.body), '}']
        if isinstance(node, ast.For) and not node.orelse:
            return self._for(node)
        if isinstance(node, ast.Break):
            return ['break;']
        if isinstance(node, ast.Continue):
            return ['continue;']
        raise self.fail(node, f'{type(node).__name__} is not translated to C')

    def _return(self, node: ast.Return) -> list[str]:
        if node.value is None:
            return ['return;']
        if isinstance(node.value, ast.Tuple):
            values = [self.kept(entry) for entry in node.value.elts]
            made = Several(tuple(str(kind) for _, kind, _ in values))
            self.result = made if self.result == VOID else joined(self.result, made)
            assert isinstance(self.result, Several)
            self.translator.structure(self.result)
            places = ', '.join(text for text, _, _ in values)
            return [f'return ({self.result.name}){{{places}}};']
        value = self.kept(node.value)
        self.result = value[1] if self.result == VOID else joined(self.result, value[1])
        return [f'return {as_kind(value, self.result)[0]};']

    def _assign(self, target: ast.expr, value: ast.expr) -> list[str]:
        if isinstance(target, ast.Tuple):
            return self._unpack(target, value)
        if isinstance(target, ast.Name):
            made = self.new_array(value)
            if made is not None:
                self.kinds[target.id] = made
                return []
            found = self.kept(value)
            self.hold(target, found[1])
            text, _, _ = as_kind(found, self.kinds[target.id])
            return [f'{self.local(target.id)} = {text};']
        if isinstance(target, ast.Subscript):
            _, array = self.array(target.value)
            text, _, _ = as_kind(self.kept(value), array.item)
            if isinstance(target.slice, ast.Slice):
                return self._fill(target, text)
            return [f'{self.place(target)} = {text};']
        raise self.fail(target, 'this cannot be assigned to in C')

    def hold(self, target: ast.Name, kind: Kind) -> None:
        """Note that a variable holds a value of this kind."""
        try:
            self.kinds[target.id] = joined(self.kinds.get(target.id), kind)
        except TypeError as error:
            raise self.fail(target, f'{target.id}: {error}') from error

    def _fill(self, target: ast.Subscript, text: str) -> list[str]:
        array, kind = self.array(target.value)
        piece = target.slice
        assert isinstance(piece, ast.Slice)
        if piece.step is not None or (piece.upper is None and kind.length is None):
            raise self.fail(target, 'this slice has no end in C')
        self.written.add(array)
        first = self.value(piece.lower)[0] if piece.lower is not None else '0'
        end = self.value(piece.upper)[0] if piece.upper is not None else str(kind.length)
        return [f'for (long engb_at = {first}; engb_at < {end}; ++engb_at) {{',
                f'    {self.local(array)}[engb_at] = {text};', '}']

    def _unpack(self, target: ast.Tuple, value: ast.expr) -> list[str]:
        if isinstance(value, ast.Tuple) and len(value.elts) == len(target.elts):
            values = [self.kept(entry)[:2] for entry in value.elts]
            lines = ['{'] + [f'    const {kind} engb_v{place} = {text};'
                             for place, (text, kind) in enumerate(values)]
            kinds, source = [kind for _, kind in values], 'engb_v{}'
        else:
            text, kind, _ = self.value(value)
            if not isinstance(kind, Several) or len(kind.kinds) != len(target.elts):
                raise self.fail(target, 'what is taken apart here is no tuple')
            lines = ['{', f'    const {kind.name} engb_v = {text};']
            kinds, source = list(kind.kinds), 'engb_v.v{}'
        for place, (entry, kind) in enumerate(zip(target.elts, kinds, strict=True)):
            if isinstance(entry, ast.Name):
                self.hold(entry, kind)
                where = self.local(entry.id)
            else:
                assert isinstance(entry, ast.Subscript)
                where = self.place(entry)
            lines.append(f'    {where} = {source.format(place)};')
        return [*lines, '}']

    def _for(self, node: ast.For) -> list[str]:
        call = node.iter
        if not (isinstance(node.target, ast.Name) and isinstance(call, ast.Call)
                and isinstance(call.func, ast.Name) and call.func.id == 'range'):
            raise self.fail(node, 'only for … in range(…) is translated')
        given = [self.value(entry)[0] for entry in call.args]
        first, end = ('0', given[0]) if len(given) == 1 else (given[0], given[1])
        step = ast.literal_eval(call.args[2]) if len(given) == 3 else 1
        self.hold(node.target, LONG)
        at, limit = f'engb_at_{node.target.id}', f'engb_end_{node.target.id}'
        body = self._inner(node.body)
        if node.target.id in self.read:
            # A variable of its own: Python's may be changed within the loop, and stays after it.
            body = [f'    {self.local(node.target.id)} = {at};', *body]
        return ['{', f'    const long {limit} = {end};',
                f'    for (long {at} = {first}; {at} {"<" if step > 0 else ">"} {limit}; '
                f'{at} += {step}) {{', *(f'    {line}' for line in body), '    }', '}']


def _loaded(target: ast.expr) -> ast.expr:
    """Return what stands left of += as an expression that is read."""
    copy = ast.parse(ast.unparse(target), mode='eval').body
    return ast.copy_location(copy, target)

