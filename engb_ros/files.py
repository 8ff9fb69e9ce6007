# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Files that come with the package, found however it is installed."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

__all__ = ['NOMINAL_MODEL', 'TRUE_BRAKE', 'config_file']


def config_file(name: str) -> Path:
    """Return the path of a file in `engb_ros/config`."""
    return Path(str(files('engb_ros'))) / 'config' / name


TRUE_BRAKE = config_file('brake.yaml')
NOMINAL_MODEL = config_file('nominal.yaml')
