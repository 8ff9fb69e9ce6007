# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Marks single files as this program's own, so that only these are written again."""

from __future__ import annotations

import hashlib
from pathlib import Path
import zipfile

__all__ = ['is_signed', 'sign']

_SIGNED = b'# Written by engb; sha256 of the rest: '
_ARCHIVE = b'engb-prediction/1'


def sign(path: Path) -> None:
    """Mark a finished file, so that it is known again."""
    if path.suffix == '.npz':
        with zipfile.ZipFile(path, 'a') as archive:
            archive.comment = _ARCHIVE
        return
    content = path.read_bytes()
    path.write_bytes(_SIGNED + hashlib.sha256(content).hexdigest().encode() + b'\n' + content)


def is_signed(path: Path) -> bool:
    """Whether a file is as `sign` left it."""
    try:
        if path.suffix == '.npz':
            with zipfile.ZipFile(path) as archive:
                return archive.comment == _ARCHIVE
        head, _, rest = path.read_bytes().partition(b'\n')
        return head == _SIGNED + hashlib.sha256(rest).hexdigest().encode()
    except (OSError, ValueError, zipfile.BadZipFile):
        return False
