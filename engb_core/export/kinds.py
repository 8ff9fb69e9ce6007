# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a value of compiled Python is in C: a number, an array, several at once."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ['Array', 'BOOL', 'Kind', 'LONG', 'REAL', 'Several', 'TABLE', 'VOID', 'declared',
           'joined']

LONG, REAL, VOID = 'long', 'double', 'void'
# What a comparison gives: where it is kept, C has a whole number.
BOOL = 'bool'
# The table of effect functions: C has it under one name, it is not handed over.
TABLE = 'table'


@dataclass(frozen=True)
class Array:
    """An array that is handed over by its address.

    Attributes:
        length: places, None where nobody asks.
        width: of a row, for one of two dimensions; `length` counts rows then.
        item: 'double' or 'long'.
        own: it is a variable of the function, not handed over.
    """

    length: int | None = None
    width: int | None = None
    item: str = REAL
    own: bool = False


@dataclass(frozen=True)
class Several:
    """What a function returns that returns a tuple."""

    kinds: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the structure in C."""
        return 'engb_' + ''.join(kind[0] for kind in self.kinds)

    @property
    def definition(self) -> str:
        """The structure, one line of C."""
        places = ' '.join(f'{kind} v{place};' for place, kind in enumerate(self.kinds))
        return f'typedef struct {{ {places} }} {self.name};'


Kind = str | Array | Several


def joined(one: Kind | None, other: Kind) -> Kind:
    """Return the kind of a variable that holds now one, now the other.

    Raises:
        TypeError: there is none.
    """
    if one is None or one == other:
        return other
    if one in (LONG, REAL) and other in (LONG, REAL):
        return REAL
    if isinstance(one, Several) and isinstance(other, Several) \
            and len(one.kinds) == len(other.kinds):
        return Several(tuple(str(joined(*pair))
                             for pair in zip(one.kinds, other.kinds, strict=True)))
    raise TypeError('a variable is a number here and something else there')


def declared(kind: Kind, name: str, constant: bool = False) -> str:
    """Return the declaration of a variable or argument, without the semicolon."""
    if isinstance(kind, Array):
        if kind.own:
            return f'{kind.item} {name}[{kind.length}]'
        return f'{"const " if constant else ""}{kind.item} *{name}'
    return f'{kind.name if isinstance(kind, Several) else kind} {name}'
