# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The mutants of a module, by the operators of cosmic-ray."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

__all__ = ['Mutant', 'mutants']

ARITHMETIC = {'Add', 'Sub', 'Mul', 'Div'}
OTHER_ARITHMETIC = {'FloorDiv', 'Mod', 'Pow'}
BITS = {'LShift', 'RShift', 'BitOr', 'BitAnd', 'BitXor'}
BINARY = 'core/ReplaceBinaryOperator_'
Place = tuple[int, int]


@dataclass(frozen=True)
class Mutant:
    """One change of one module.

    Attributes:
        place: the function that it is in, with its class; '' in none.
        was, becomes: what stands there, without what is alike before and after on whole lines.
        source: the whole module's text, changed.
    """

    place: str
    was: str
    becomes: str
    source: str


def mutants(source: str) -> Iterator[Mutant]:
    """Give every mutant of a module's text that can be told from it and is a program.

    Annotations are left alone: nothing evaluates them. An operator of arithmetic becomes +, -, *
    or /, one of bits another one of bits: shifting a float only raises, which any test would see.
    `is` does not become `==`: what is compared so (None, members of an enumeration, truths) is
    equal to itself alone.
    """
    tree = get_ast(source)
    syntax = ast.parse(source)
    annotations = list(_annotations(syntax))
    for name in operator_names():
        operator_class = get_operator(name)
        if operator_class.arguments() or not _makes_sense(name):
            continue
        operator = operator_class()
        places = [place for node in ast_nodes(tree)
                  for place in operator.mutation_positions(node)]
        for number, (begin, end) in enumerate(places):
            if any(first <= tuple(begin) and tuple(end) <= last for first, last in annotations):
                continue
            changed = mutate_code(source, operator, number)
            if changed and _is_another_program(changed, syntax):
                was, becomes = _difference(source, changed)
                yield Mutant(_definition(syntax, begin[0]), was, becomes, changed)


def _makes_sense(operator: str) -> bool:
    if operator.endswith(('_Is_Eq', '_IsNot_NotEq')):
        return False
    if not operator.startswith(BINARY):
        return True
    before, after = operator.removeprefix(BINARY).split('_')
    return after in (BITS if before in BITS else ARITHMETIC)


def _is_another_program(changed: str, syntax: ast.Module) -> bool:
    try:
        return ast.dump(ast.parse(changed)) != ast.dump(syntax)
    except SyntaxError:
        return False


def _annotations(syntax: ast.Module) -> Iterator[tuple[Place, Place]]:
    for node in ast.walk(syntax):
        for name in ('annotation', 'returns'):
            part = getattr(node, name, None)
            if isinstance(part, ast.expr):
                yield ((part.lineno, part.col_offset),
                       (part.end_lineno or 0, part.end_col_offset or 0))


def _definition(syntax: ast.AST, line: int) -> str:
    """Return the dotted name of what is defined around a line."""
    for node in ast.iter_child_nodes(syntax):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            first = min([node.lineno, *(entry.lineno for entry in node.decorator_list)])
            if first <= line <= (node.end_lineno or line):
                inner = _definition(node, line)
                return f'{node.name}.{inner}' if inner else node.name
    return ''


def _difference(source: str, changed: str) -> tuple[str, str]:
    """Return the lines that differ, before and after."""
    before, after = source.splitlines(), changed.splitlines()
    while before and after and before[0] == after[0]:
        del before[0], after[0]
    while before and after and before[-1] == after[-1]:
        del before[-1], after[-1]
    return ('\n'.join(line.strip() for line in before),
            '\n'.join(line.strip() for line in after))
