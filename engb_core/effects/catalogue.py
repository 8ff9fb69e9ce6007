"""All effects, found by looking: adding one is adding a file with an `EFFECT` to this folder."""

from __future__ import annotations

from functools import lru_cache
import importlib
import pkgutil

from engb_core.effects.base import Effect
from engb_core.errors import InputError

__all__ = ['catalogue', 'get_effect']

_NOT_EFFECTS = {'base', 'catalogue'}


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
    return found


def get_effect(effect_id: str) -> Effect:
    """Return one effect.

    Raises:
        InputError: there is none of that id; the message lists those there are.
    """
    effects = catalogue()
    if effect_id not in effects:
        raise InputError(f'unknown effect {effect_id!r}; known: {", ".join(effects)}')
    return effects[effect_id]
