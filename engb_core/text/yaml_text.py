# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""YAML from anywhere: bounded in depth and size, each key once; nothing that it says is run."""

from __future__ import annotations

from collections.abc import Hashable
import math
import reprlib
from typing import Any

import yaml

from engb_core.errors import InputError

__all__ = ['check_keys', 'key_text', 'list_at', 'load_yaml', 'number_at', 'shown']

# Model files and bags' metadata nest five deep; libyaml's own recursion ends in a crash at some
# ten thousand, Python's at a thousand.
_DEPTH = 50
_NODES = 100_000
_Base: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)

_short = reprlib.Repr()
_short.maxstring = _short.maxother = _short.maxlong = 60
_short.maxlevel = 2
_short.maxdict = _short.maxlist = 3


def shown(value: Any) -> str:
    """Return a value out of a file for a message: short, whatever it holds."""
    return _short.repr(value)


def load_yaml(text: str) -> Any:
    """Return what a YAML text holds, as plain data.

    Raises:
        InputError: not YAML, nested too deep, too large, or a key given twice; names the line.
    """
    try:
        depth = 0
        for number, event in enumerate(yaml.parse(text, _Base)):
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
            if depth > _DEPTH or number > _NODES:
                what = 'nested too deep' if depth > _DEPTH else 'too long'
                mark = event.start_mark
                line = f' at line {mark.line + 1}' if mark else ''
                raise InputError(f'{what}{line}; mend the file')
        return yaml.load(text, _Loader)
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as error:
        mark = getattr(error, 'problem_mark', None)
        line = f' at line {mark.line + 1}' if mark else ''
        raise InputError(f'not valid YAML{line}; mend the file') from error


def check_keys(data: dict[Any, Any], allowed: set[str], where: str) -> None:
    """Raise InputError for a key of a mapping that is not among those allowed at this place."""
    for key in data:
        if key not in allowed:
            name = f'{where}.{key_text(key)}' if where else key_text(key)
            raise InputError(f'unknown key {name}; known here: {", ".join(sorted(allowed))}')


def key_text(key: Any) -> str:
    """Return a key for a message: most are text, which needs no quotes."""
    text = shown(key)
    return text[1:-1] if isinstance(key, str) else text


def list_at(value: Any, where: str) -> list[Any]:
    """Return the list that stands at a place, [] where nothing does; InputError for others."""
    if value is None:
        return []
    if not isinstance(value, list):
        raise InputError(f'{where} must be a list')
    return value


def number_at(value: Any, where: str) -> float:
    """Return the finite number that stands at a place; InputError for others."""
    if isinstance(value, str):
        # YAML 1.1 reads 1e-5 (no dot) as text; a person means the number.
        try:
            value = float(value)
        except ValueError:
            raise InputError(f'{where} is {shown(value)}; write a plain number in SI '
                             'units') from None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f'{where} is {shown(value)}; write a plain number in SI units')
    try:
        number = float(value)
    except OverflowError:
        number = math.inf       # an integer of hundreds of digits
    if not math.isfinite(number):
        raise InputError(f'{where} is {number}; it must be finite')
    return number


class _Loader(_Base):  # type: ignore[misc]
    """Plain data only, and no key twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return a mapping; the later of two equal keys would win in silence."""
        seen: set[Hashable] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != 'tag:yaml.org,2002:merge':
                if (key.tag, key.value) in seen:
                    raise InputError(f'key {shown(key.value)} is given twice, again at line '
                                     f'{key.start_mark.line + 1}; remove one')
                seen.add((key.tag, key.value))
        made: dict[Any, Any] = super().construct_mapping(node, deep)
        return made
