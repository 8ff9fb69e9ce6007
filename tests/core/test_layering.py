# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The science knows no ROS, no file format and no command line; nothing reaches up or in a circle;
modules stay small and say what is public.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / 'engb_core'
FOREIGN = {'rclpy', 'rosbags', 'engb_ros', 'mcap', 'argparse', 'launch', 'ament_index_python',
           'rosidl_runtime_py', 'sensor_msgs', 'std_msgs', 'cantools', 'can'}
# One matter may take so much; two matters are two rooms.
MOST_LINES = 450
# To be split; may not grow meanwhile.
TOO_LONG: dict[str, int] = {}
MODULES = sorted(CORE.rglob('*.py'))
EACH = pytest.mark.parametrize('path', MODULES, ids=[str(path.relative_to(CORE))
                                                     for path in MODULES])


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding='utf-8'), str(path))


def imported(tree: ast.AST) -> set[str]:
    """Return the top-level names of all that is imported, wherever in the module."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.split('.')[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add('engb_core' if node.level else (node.module or '').split('.')[0])
    return found


def public_names(tree: ast.Module) -> list[str] | None:
    """Return what `__all__` lists, None where there is none."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(
                isinstance(target, ast.Name) and target.id == '__all__'
                for target in node.targets):
            return ast.literal_eval(node.value)
    return None


def is_effect(path: Path) -> bool:
    """A file of one effect: its public face is EFFECT, which the catalogue looks for."""
    return path.parent.name == 'effects' and path.stem not in ('__init__', 'base', 'catalogue')


@EACH
def test_nothing_from_the_floors_above(path):
    # Bags are written with rosbags, plain Python, which reads ROS 1's as well.
    allowed = {'rosbags'} if 'io' in path.relative_to(CORE).parts else set()
    assert not imported(tree_of(path)) & (FOREIGN - allowed)


# What reads files needs of the core: errors told in a line, recordings, text from outside.
NEEDED_BY_IO = {'engb_core.blas_threads', 'engb_core.errors', 'engb_core.io',
                'engb_core.recording', 'engb_core.repeated_stamps', 'engb_core.text'}


def test_files_are_a_room_of_their_own():
    for name, needed in needs_of(every_import, MODULES).items():
        rooms = {'.'.join(entry.split('.')[:2]) for entry in needed if entry != 'engb_core'}
        if name.startswith('engb_core.io'):
            assert rooms <= NEEDED_BY_IO, name
        elif name != 'engb_core.library':
            assert 'engb_core.io' not in rooms, f'{name} reads files'


def dotted(path: Path) -> str:
    """Return the dotted name of a module."""
    return '.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__')


def every_import(tree: ast.AST) -> list[ast.AST]:
    """Return all that is imported, also within functions and for the sake of types."""
    return list(ast.walk(tree))


def at_loading(tree: ast.AST) -> list[ast.AST]:
    """Return what is run when the module is loaded (functions and TYPE_CHECKING left out)."""
    found, left = [], [tree]
    while left:
        node = left.pop()
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) or (
                isinstance(node, ast.If) and ast.unparse(node.test) == 'TYPE_CHECKING'):
            continue
        found.append(node)
        left += ast.iter_child_nodes(node)
    return found


def needs_of(looked_at: Callable[[ast.AST], list[ast.AST]],
             paths: list[Path]) -> dict[str, set[str]]:
    """Return which of these modules each of them imports."""
    modules = {dotted(path): path for path in paths}
    needs = {}
    for name, path in modules.items():
        found = set()
        for node in looked_at(tree_of(path)):
            if isinstance(node, ast.ImportFrom) and node.module:
                below = {f'{node.module}.{alias.name}' for alias in node.names} & set(modules)
                found |= below or {node.module}
            elif isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
        needs[name] = (found & set(modules)) - {name}
    return needs


def test_no_circle_of_imports():
    every = MODULES + sorted((ROOT / 'engb_ros').rglob('*.py'))
    TopologicalSorter(needs_of(at_loading, every)).prepare()


def test_the_rooms_of_a_diagnosis_stand_in_an_order():
    """A folder is a room: no two need one another, nor a room what needs it."""
    room = CORE / 'diagnose'
    paths = [path for path in MODULES if path.is_relative_to(room)]
    of = {dotted(path): path.parent.name if path.parent != room else path.stem for path in paths}
    needs: dict[str, set[str]] = {}
    for name, needed in needs_of(every_import, paths).items():
        needs.setdefault(of[name], set()).update(of[entry] for entry in needed)
    TopologicalSorter({name: needed - {name} for name, needed in needs.items()}).prepare()


@pytest.mark.parametrize('rooms', [('diagnose', 'laws'), ('io', 'text'), ('report',)])
def test_not_even_for_the_sake_of_types(rooms):
    """Who needs what says so, and can be read alone."""
    paths = [path for path in MODULES if path.relative_to(CORE).parts[0] in rooms]
    TopologicalSorter(needs_of(every_import, paths)).prepare()


@EACH
def test_small(path):
    lines = path.read_text(encoding='utf-8').count('\n')
    assert lines <= TOO_LONG.get(path.relative_to(CORE).as_posix(), MOST_LINES), f'{lines} lines'


@EACH
def test_public_names_are_listed(path):
    if path.name == '__init__.py' or is_effect(path):
        pytest.skip('needs no list')
    names = public_names(tree_of(path))
    assert names, 'no __all__'
    assert len(set(names)) == len(names)


def public_functions(tree: ast.Module) -> list[tuple[str, ast.FunctionDef]]:
    names = set(public_names(tree) or ())
    found = []
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name in names:
            found.append((node.name, node))
        elif isinstance(node, ast.ClassDef) and node.name in names:
            found += [(f'{node.name}.{entry.name}', entry) for entry in node.body
                      if isinstance(entry, ast.FunctionDef) and not entry.name.startswith('_')]
    return found


def is_property(function: ast.FunctionDef) -> bool:
    return any(isinstance(entry, ast.Name) and entry.id == 'property'
               for entry in function.decorator_list)


def is_kernel(function: ast.FunctionDef) -> bool:
    """Compiled code is typed by its compiler."""
    return any(isinstance(entry, ast.Name) and entry.id in ('compiled', 'effect_function')
               for entry in function.decorator_list)


@EACH
def test_documented(path):
    tree = tree_of(path)
    assert ast.get_docstring(tree), 'the module has no docstring'
    names = set(public_names(tree) or ())
    bare = [name for name, node in public_functions(tree)
            if not ast.get_docstring(node) and not is_property(node)]
    bare += [node.name for node in tree.body
             if isinstance(node, ast.ClassDef) and node.name in names
             and not ast.get_docstring(node)]
    assert not bare, f'no docstring: {", ".join(bare)}'


@EACH
def test_typed(path):
    untyped = []
    for name, node in public_functions(tree_of(path)):
        if is_kernel(node):
            continue
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        if any(entry.annotation is None for entry in arguments
               if entry.arg not in ('self', 'cls')) or node.returns is None:
            untyped.append(name)
    assert not untyped, f'not typed: {", ".join(untyped)}'


def test_names_that_are_listed_are_there():
    missing = []
    for path in MODULES:
        tree = tree_of(path)
        defined = {name.id for node in ast.walk(tree) for name in
                   ([node] if isinstance(node, ast.Name)
                    and isinstance(node.ctx, ast.Store) else [])}
        defined |= {node.name for node in ast.walk(tree)
                    if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
        defined |= {alias.asname or alias.name for node in ast.walk(tree)
                    if isinstance(node, ast.ImportFrom) for alias in node.names}
        missing += [f'{path.name}: {name}' for name in public_names(tree) or ()
                    if name not in defined]
    assert not missing


# Files of one name in several rooms are of one subject: a node of what it runs, a page of what it
# shows, a command of what it makes, the effect of what is identified; `base` is what all of a room
# share.
ONE_SUBJECT = {'base', 'disturbance_observer', 'excitation', 'findings', 'first_model', 'law',
               'model', 'plant', 'self_energizing', 'verdict'}


def test_no_two_files_of_one_name_mean_different_things():
    paths = [path for room in ('engb_core', 'engb_ros') for path in (ROOT / room).rglob('*.py')
             if path.name != '__init__.py']
    rooms: dict[str, list[str]] = {}
    for path in paths:
        rooms.setdefault(path.stem, []).append(str(path.parent.relative_to(ROOT)))
    twice = {name: found for name, found in rooms.items() if len(found) > 1}
    assert {name: found for name, found in twice.items() if name not in ONE_SUBJECT} == {}
    assert set(twice) >= ONE_SUBJECT, 'delete names that stand once'
