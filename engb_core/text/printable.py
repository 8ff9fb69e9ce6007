# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Text that any terminal takes: no control characters, nothing that it cannot show."""

from __future__ import annotations

import codecs
import contextlib
from typing import Any
import unicodedata

__all__ = ['make_printable', 'printable']

# What the program itself prints beyond ASCII, for terminals that don't have it.
_PLAIN = {'→': '->', '…': '...', '–': '-', '—': '-', '\N{MINUS SIGN}': '-', '·': '.', '×': 'x',
          '’': '\'', '“': '"', '”': '"', '█': '#', '\u202f': ' ', '\u00a0': ' ', '←': '<-',
          '≤': '<=', '≥': '>=', 'θ': 'theta', 'ω': 'omega', 'π': 'pi', 'µ': 'u', '²': '2',
          '³': '3', '°': 'deg', '±': '+-'}
_HANDLER = 'engb_plain'


def printable(text: str) -> str:
    """Return `text` with control characters, marks that reorder text, and bytes that are no UTF-8
    written as escapes (\\x1b): a name out of a file must not steer the terminal."""
    if text.isprintable():
        return text
    return ''.join(_shown(character) for character in text)


def make_printable(*streams: Any) -> None:
    """Have text streams replace what they cannot encode instead of failing."""
    codecs.register_error(_HANDLER, _plainly)
    for stream in streams:
        with contextlib.suppress(AttributeError, ValueError, OSError):
            stream.reconfigure(errors=_HANDLER)


def _shown(character: str) -> str:
    kind = unicodedata.category(character)
    if kind[0] != 'C' or kind == 'Co':
        return character
    code = ord(character)
    if 0xdc80 <= code <= 0xdcff:        # a byte that was no UTF-8, as Python carries it along
        return f'\\x{code - 0xdc00:02x}'
    return f'\\x{code:02x}' if code < 0x100 else f'\\u{code:04x}' if code < 0x10000 else (
        f'\\U{code:08x}')


def _plainly(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start:error.end]
    plain = ''.join(_PLAIN.get(character, character) for character in text)
    return printable(plain).encode('ascii', 'backslashreplace').decode(), error.end
