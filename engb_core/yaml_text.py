# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""YAML from anywhere: bounded in depth and size, each key once; nothing that it says is run."""

from __future__ import annotations

from collections.abc import Hashable
import reprlib
from typing import Any

import yaml

from engb_core.errors import InputError

__all__ = ['load_yaml', 'shown']

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


class _Loader(_Base):
    """Plain data only, and no key twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        """Return a mapping; the later of two equal keys would win in silence."""
        seen: set[Hashable] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != 'tag:yaml.org,2002:merge':
                if (key.tag, key.value) in seen:
                    raise InputError(f'key {shown(key.value)} is given twice, again at line '
                                     f'{key.start_mark.line + 1}; remove one')
                seen.add((key.tag, key.value))
        return super().construct_mapping(node, deep)
