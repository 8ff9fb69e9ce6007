# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Draws a brake that nobody knows and seals it: a process of its own.

    python -m engb_ros.experiments.draw_brake FOLDER

writes FOLDER/brake.sealed, which the plant reads, and FOLDER/drawing.yaml, the geometry that is on
every drawing; it prints the digest of what the seal holds. No plain truth ever lies on the disk.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
import secrets
import sys

import yaml

from engb_core.io.sealed import digest, sealed
from engb_core.reproduce.blind import drawing
from engb_core.reproduce.drawn_brakes import draw_brake

__all__ = ['DRAWING', 'main', 'SEAL']

SEAL, DRAWING = 'brake.sealed', 'drawing.yaml'


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw one brake into the folder that the only argument names."""
    folder = Path((sys.argv[1:] if arguments is None else arguments)[0])
    folder.mkdir(parents=True, exist_ok=True)
    brake = draw_brake([secrets.randbits(32) for _ in range(4)])
    text = sealed(brake.to_mapping() | {'salt': secrets.token_hex(16)})
    (folder / SEAL).write_text(text, encoding='ascii')
    data = asdict(drawing(brake.mechanism))
    data['clamp_stiffness'] = list(data['clamp_stiffness'])
    (folder / DRAWING).write_text(yaml.safe_dump(data, sort_keys=False), encoding='utf-8')
    print(digest(text))
    return 0


if __name__ == '__main__':
    sys.exit(main())
