# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sealed truths: what a recording conceals, kept from the eye until it is opened on purpose."""

from __future__ import annotations

import base64
import hashlib
import json
import os
from pathlib import Path
from typing import Any
import zlib

from engb_core.errors import InputError

__all__ = ['digest', 'opened', 'read_sealed', 'sealed']


def sealed(truth: dict[str, Any]) -> str:
    """Return `truth` as the text of a seal; it should hold a random `salt`."""
    content = json.dumps(truth, sort_keys=True, ensure_ascii=False).encode()
    return base64.b64encode(zlib.compress(content, 9)).decode('ascii') + '\n'


def digest(text: str) -> str:
    """Return the SHA-256 of what a seal holds, without showing it."""
    return hashlib.sha256(_content(text)).hexdigest()


def opened(text: str) -> dict[str, Any]:
    """Return what a seal holds."""
    content: dict[str, Any] = json.loads(_content(text))
    return content


def read_sealed(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return what the seal in a file holds; InputError where there is none."""
    try:
        text = Path(path).read_text(encoding='ascii')
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f'{path}: cannot be read; give a sealed truth') from error
    return opened(text)


def _content(text: str) -> bytes:
    try:
        return zlib.decompress(base64.b64decode(text))
    except ValueError as error:
        raise InputError('truth.sealed is damaged; fetch it again') from error
    except zlib.error as error:
        raise InputError('truth.sealed is damaged; fetch it again') from error
