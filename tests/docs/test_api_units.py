# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The API says of every argument and every field what it is, its unit and its shape."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
import re

import numpy as np
import pytest

import engb_core as engb
from tests.docs_scripts import docs_script

ROOT = Path(__file__).resolve().parents[2]
ARRAY, SHAPE, UNIT = (re.compile(text) for text in (
    r'Array', r'\([a-z][\w, +-]*,\s*\)|\(n, \w+\)', r'\[[^\]]+\]'))
NUMBER = re.compile(r'(tuple\[)?(float|Array|ArrayLike|NDArray)\b')


def modules() -> tuple[str, ...]:
    """Return the modules of the site's page of the API."""
    return docs_script('make_site').MODULES


def entries(doc: str, section: str) -> dict[str, str]:
    """Return what a docstring's section says, by name."""
    found = re.search(rf'^{section}:\n((?:[ ]{{4}}.*\n|\n)*)', doc + '\n', re.MULTILINE)
    told: dict[str, str] = {}
    for names, text in re.findall(r'^[ ]{4}(\w[\w, ]*):((?:.*\n(?:[ ]{8}.*\n)*))',
                                  found[1] if found else '', re.MULTILINE):
        told |= {name.strip(): ' '.join(text.split()) for name in names.split(',')}
    return told


def lacks(name: str, kind: str, told: dict[str, str]) -> Iterator[str]:
    """Yield what is not said of an argument or a field."""
    if name not in told:
        yield f'{name}: not described'
    elif NUMBER.match(kind):
        if not UNIT.search(told[name]) and 'bool' not in kind:
            yield f'{name}: no unit'
        if ARRAY.search(kind) and not SHAPE.search(told[name]):
            yield f'{name}: no shape'


def public(module: str) -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef]]:
    """Yield the public functions, methods and classes of a module by name."""
    tree = ast.parse((ROOT / (module.replace('.', '/') + '.py')).read_text(encoding='utf-8'))
    names = next(ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign)
                 and getattr(node.targets[0], 'id', '') == '__all__')
    for node in tree.body:
        if getattr(node, 'name', None) in names:
            yield node.name, node
            for entry in getattr(node, 'body', ()) if isinstance(node, ast.ClassDef) else ():
                if isinstance(entry, ast.FunctionDef) and not entry.name.startswith('_'):
                    yield f'{node.name}.{entry.name}', entry


@pytest.mark.parametrize('module', modules())
def test_units_and_shapes_are_told(module):
    missing = []
    for name, node in public(module):
        doc = ast.get_docstring(node) or ''
        if isinstance(node, ast.ClassDef):
            told, wanted = entries(doc, 'Attributes'), [
                (entry.target.id, ast.unparse(entry.annotation)) for entry in node.body
                if isinstance(entry, ast.AnnAssign) and not entry.target.id.startswith('_')]
        else:
            told, wanted = entries(doc, 'Args'), [
                (entry.arg, ast.unparse(entry.annotation) if entry.annotation else '')
                for entry in (*node.args.args, *node.args.kwonlyargs)
                if entry.arg not in ('self', 'cls')]
            given = ast.unparse(node.returns) if node.returns else ''
            if NUMBER.match(given):
                missing += [f'{name}: {text}' for text in lacks('return', given, {
                    'return': doc.split('\n\n')[0]})]
        missing += [f'{name}: {text}' for what, kind in wanted for text in lacks(what, kind, told)]
    assert not missing, '\n'.join(missing)


def test_the_shapes_are_those_that_are_told():
    time = np.arange(0.0, 4.0, 0.005)
    position = 10.0 * (1.0 - np.cos(1.5 * time))
    recording = engb.Recording(time, position, np.sin(time), reference=engb.Reference(
        time, position))
    model = engb.Model.from_mapping({
        'format': 'engb-model/1', 'motor': {'inertia': 7e-5, 'viscous_friction': 1e-3},
        'controller': {'proportional': 0.3, 'derivative': 0.004, 'rate': 200.0}})
    assert engb.predict(recording, model).shape == recording.time.shape
    assert [values.shape for values in engb.simulate(recording, model)] == [time.shape] * 2
