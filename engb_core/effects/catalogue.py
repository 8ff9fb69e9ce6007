"""All effects, found by looking: adding one is adding a file with an `EFFECT` to this folder.

Files of the user's own folder (`own_effects_folder`) count as well; `engb adopt` writes there.
"""

from __future__ import annotations

from functools import lru_cache
import importlib
import importlib.util
import os
from pathlib import Path
import pkgutil
import sys

from engb_core.effects.base import Effect
from engb_core.errors import InputError

__all__ = ['catalogue', 'get_effect', 'own_effects_folder', 'register']

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
        effect = importlib.import_module(f'engb_core.effects.{module.name}').EFFECT
        found[effect.id] = effect
    for path in sorted(own_effects_folder().glob('*.py')):
        if path.name.startswith(('test_', '_', '.')):
            continue
        effect = _own(path)
        if effect.id in found:
            raise InputError(f'{path}: there is an effect {effect.id} already; remove the file or '
                             'give it another id')
        found[effect.id] = effect
    for effect in _REGISTERED.values():
        if effect.id in found:
            raise InputError(f'there is an effect {effect.id} already; give yours another id')
        found[effect.id] = effect
    return found


def register(effect: Effect) -> Effect:
    """Add an effect to the catalogue of this process; return it.

    Raises:
        InputError: it is no Effect, or there is one of that id already.
    """
    if not isinstance(effect, Effect):
        raise InputError(f'{effect!r} is no engb_core.effects.base.Effect')
    if effect.id in catalogue():
        raise InputError(f'there is an effect {effect.id} already; give yours another id')
    _REGISTERED[effect.id] = effect
    catalogue.cache_clear()
    return effect


def own_effects_folder() -> Path:
    """Return the folder from which effects of the user's own are read; it need not exist."""
    given = os.environ.get('ENGB_EFFECTS')
    if given:
        return Path(given)
    return Path(os.environ.get('XDG_DATA_HOME') or Path.home() / '.local' / 'share') \
        / 'engb' / 'effects'


def _own(path: Path) -> Effect:
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


def get_effect(effect_id: str) -> Effect:
    """Return one effect.

    Raises:
        InputError: there is none of that id; the message lists those there are.
    """
    effects = catalogue()
    if effect_id not in effects:
        raise InputError(f'unknown effect {effect_id!r}; known: {", ".join(effects)}')
    return effects[effect_id]
