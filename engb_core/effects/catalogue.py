# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""All effects, found by looking: adding one is adding a file with an `EFFECT` to this folder.

From outside count as well: files of the user's own folder (`own_effects_folder`; `engb adopt`
writes there) and of folders that a command was given (`read_effects_of`), effects of installed
packages (entry points of the group `engb.effects`), and what the process registered.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from dataclasses import replace
from functools import lru_cache
import importlib
from importlib.metadata import entry_points, EntryPoint
import importlib.util
import os
from pathlib import Path
import pkgutil
import sys

from engb_core.effects.base import Effect
from engb_core.errors import InputError
from engb_core.model import EffectSetting

__all__ = ['GROUP', 'catalogue', 'effect_of_file', 'files_of_effects', 'get_effect',
           'named_as_now', 'own_effects_folder', 'read_effects_of', 'register', 'registered']

GROUP = 'engb.effects'

_NOT_EFFECTS = {'base', 'catalogue'}
# What this process registered, by id.
_REGISTERED: dict[str, Effect] = {}


@lru_cache(maxsize=1)
def catalogue() -> dict[str, Effect]:
    """Return every effect by its id, in alphabetical order of the files."""
    found: dict[str, Effect] = {}
    for module in sorted(pkgutil.iter_modules(importlib.import_module(
            'engb_core.effects').__path__), key=lambda entry: entry.name):
        if module.name in _NOT_EFFECTS:
            continue
        _add(found, importlib.import_module(f'engb_core.effects.{module.name}').EFFECT,
             module.name)
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        _add(found, _installed(entry), f'entry point {entry.value}')
    for path in _files(own_effects_folder()):
        _add(found, effect_of_file(path), str(path))
    for effect in _REGISTERED.values():
        _add(found, effect, 'registered')
    return found


def _add(found: dict[str, Effect], effect: Effect, origin: str) -> None:
    taken = {name for entry in found.values() for name in (entry.id, *entry.formerly)}
    for name in effect.formerly:
        if name in taken:
            raise InputError(f'{origin}: {name}, a former id of {effect.id}, is that of another '
                             'effect; leave it out of formerly')
    if effect.id in taken:
        raise InputError(f'{origin}: there is an effect {effect.id} already; remove the file or '
                         'give it another id')
    found[effect.id] = effect


def _files(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.glob('*.py'))
            if not path.name.startswith(('test_', '_', '.'))]


def register(effect: Effect) -> Effect:
    """Add an effect to the catalogue of this process; return it.

    Raises:
        InputError: it is no Effect, or there is one of that id already.
    """
    if not isinstance(effect, Effect):
        raise InputError(f'{effect!r} is no engb_core.effects.base.Effect')
    if effect.id in catalogue():
        raise InputError(f'there is an effect {effect.id} already; give yours another id')
    _add(dict(catalogue()), effect, 'registered')
    _REGISTERED[effect.id] = effect
    catalogue.cache_clear()
    return effect


@contextlib.contextmanager
def registered(effect: Effect) -> Iterator[Effect]:
    """Have an effect in the catalogue for a while, unless it is there already.

    Raises:
        InputError: there is another one of that id.
    """
    there = catalogue().get(effect.id) is effect
    if not there:
        register(effect)
    try:
        yield effect
    finally:
        if not there:
            del _REGISTERED[effect.id]
            catalogue.cache_clear()


def read_effects_of(folder: str | os.PathLike[str]) -> tuple[str, ...]:
    """Register every effect of a folder's files in this process; return their ids.

    Raises:
        InputError: no folder, no effect in it, or one that can't be read or is there already.
    """
    own = own_effects_folder().resolve()
    found = [effect_of_file(entry) for entry in files_of_effects(folder)
             if entry.resolve().parent != own]
    for effect in found:
        register(effect)
    return tuple(effect.id for effect in found)


def files_of_effects(folder: str | os.PathLike[str]) -> list[Path]:
    """Return the files of a folder that hold an effect each, by name.

    Raises:
        InputError: no folder, or no such file in it.
    """
    path = Path(folder)
    if not path.is_dir():
        raise InputError(f'{path}: no folder; give the folder that holds files of effects')
    files = _files(path)
    if not files:
        raise InputError(f'{path}: holds no effect (a .py file with an EFFECT)')
    return files


def own_effects_folder() -> Path:
    """Return the folder from which effects of the user's own are read; it need not exist."""
    given = os.environ.get('ENGB_EFFECTS')
    if given:
        return Path(given)
    return Path(os.environ.get('XDG_DATA_HOME') or Path.home() / '.local' / 'share') \
        / 'engb' / 'effects'


def effect_of_file(path: Path) -> Effect:
    """Return the `EFFECT` of a Python file.

    Raises:
        InputError: it can't be read, or holds none.
    """
    name = f'engb_own_effects_{path.stem}'
    spec = importlib.util.spec_from_file_location(name, path)
    try:
        if spec is None or spec.loader is None:
            raise ImportError('not a Python file')
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        effect = module.EFFECT
    except Exception as error:
        raise InputError(f'{path}: no effect can be read from it ({error}); mend or remove the '
                         'file') from error
    if not isinstance(effect, Effect):
        raise InputError(f'{path}: EFFECT is no Effect; mend or remove the file')
    return effect


def _installed(entry: EntryPoint) -> Effect:
    try:
        effect = entry.load()
    except Exception as error:
        raise InputError(f'effect {entry.name} of entry point {entry.value} cannot be loaded '
                         f'({error}); mend or uninstall its package') from error
    if not isinstance(effect, Effect):
        raise InputError(f'entry point {entry.value} of group {GROUP} is no Effect; mend or '
                         'uninstall its package')
    return effect


def get_effect(effect_id: str) -> Effect:
    """Return one effect.

    Raises:
        InputError: there is none of that id; the message lists those there are.
    """
    effects = catalogue()
    if effect_id not in effects:
        raise InputError(f'unknown effect {effect_id!r}; known: {", ".join(effects)}')
    return effects[effect_id]


def named_as_now(setting: EffectSetting) -> EffectSetting:
    """Return a model file's setting with the names of this version (docs/versions.md).

    A name that no effect has or had stays as it is: who needs the effect says that it is unknown.

    Raises:
        InputError: a parameter stands there by its old name and by its new one.
    """
    effect = next((entry for entry in catalogue().values()
                   if setting.effect in (entry.id, *entry.formerly)), None)
    if effect is None:
        return setting
    now = {old: parameter.name for parameter in effect.parameters for old in parameter.formerly}
    twice = [old for old in setting.parameters if now.get(old) in setting.parameters]
    if twice:
        raise InputError(f'{setting.effect}: {twice[0]} is the former name of {now[twice[0]]}, '
                         'which is there as well; remove one of the two')
    parameters = {now.get(name, name): value for name, value in setting.parameters.items()}
    return replace(setting, effect=effect.id, parameters=parameters)
