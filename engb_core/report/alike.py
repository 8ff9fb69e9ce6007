# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Notes that say the same of many recordings, as one note: nobody reads thirty."""

from __future__ import annotations

from collections.abc import Sequence
import re

__all__ = ['alike_together']

# So many recordings are each told by a note of their own.
APART = 3
# Only numbers differ between notes that say the same.
NUMBER = re.compile(r'\d+(\.\d+)?')


def alike_together(notes: Sequence[str]) -> list[str]:
    """Return the notes, each 'recording: text', those that differ but in recording and numbers as
    one 'N recordings: text', with the numbers of the first one, which is named."""
    groups: dict[str, list[str]] = {}
    for note in notes:
        _, colon, text = note.partition(': ')
        groups.setdefault(NUMBER.sub('#', text) if colon else note, []).append(note)
    found: list[str] = []
    for alike in groups.values():
        if len(alike) <= APART:
            found += alike
            continue
        name, _, text = alike[0].partition(': ')
        found.append(f'{len(alike)} recordings: {text} (The numbers are those of {name}.)'
                     if NUMBER.search(text) else f'{len(alike)} recordings: {text}')
    return found
