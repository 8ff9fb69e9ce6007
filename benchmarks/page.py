# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Measured tables in pages: between `<!-- measured NAME -->` and `<!-- end -->`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
import re

__all__ = ['markdown', 'write_table']


def markdown(lines: Iterable[Sequence[str]]) -> str:
    """Return lines as a Markdown table."""
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines)


def write_table(page: Path, name: str, text: str) -> None:
    """Put `text` in the place of the measured table `name`; ValueError where there is none."""
    before = page.read_text(encoding='utf-8')
    pattern = re.compile(rf'(<!-- measured {name} -->\n).*?(<!-- end -->)', re.DOTALL)
    if not pattern.search(before):
        raise ValueError(f'{page}: no line <!-- measured {name} -->')
    page.write_text(pattern.sub(lambda match: f'{match[1]}{text}\n{match[2]}', before),
                    encoding='utf-8')
