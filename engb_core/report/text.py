# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Text that is safe to put into a page: what comes from a recording is never trusted."""

from __future__ import annotations

import html
import re
from typing import Any
import unicodedata

__all__ = ['Html', 'breakable', 'clean', 'escape', 'join', 'shorten']


class Html(str):
    """Markup that is already safe; everything else is escaped before it enters a page."""

    __slots__ = ()


def clean(value: Any) -> str:
    """Return `value` as text without control, direction-override and unpaired characters.

    A file name may hold any of them; they could hide or reorder what a reader sees, and lone
    surrogates cannot be encoded at all.
    """
    return ''.join(character if character in '\n\t' or
                   unicodedata.category(character) not in ('Cc', 'Cf', 'Cs', 'Zl', 'Zp')
                   else '\N{REPLACEMENT CHARACTER}' for character in str(value))


def escape(value: Any) -> Html:
    """Return `value` for use between tags and in quoted attributes; Html passes unchanged."""
    return value if isinstance(value, Html) else Html(html.escape(clean(value)))


def join(parts: Any, separator: str = '') -> Html:
    """Return the escaped parts, joined."""
    return Html(separator.join(escape(part) for part in parts))


def breakable(value: Any) -> Html:
    """Return the escaped text with allowed line breaks where names have their seams."""
    return Html(re.sub(r'([_/.\-]+)(?=\w)', r'\1<wbr>', clean(value))
                if not re.search(r'[<>&"\']', clean(value)) else escape(value))


def shorten(value: Any, length: int = 40) -> str:
    """Return `value` with its middle left out where it is longer than `length` characters."""
    text = ' '.join(clean(value).split())
    if len(text) <= length:
        return text
    tail = (length - 1) // 2
    return f'{text[:length - 1 - tail]}…{text[-tail:]}'
