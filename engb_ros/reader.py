# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The reader of bags and tables that the library finds (entry point `engb.readers`)."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from engb_core.model import Model
    from engb_core.recording import Recording

__all__ = ['read']


def read(path: str | os.PathLike[str], model: Model | None = None) -> Recording:
    """Read a bag or a table.

    Args:
        path: a bag's folder, an .mcap or .db3 file, or a table.
        model: tells the joint's name, and the torque constant where effort is a current.

    Raises:
        InputError: not readable, or something is missing that the table does not tell.
    """
    from engb_ros.tables.open import is_table
    name = None if model is None else model.joint.name
    if not is_table(str(path)):
        from engb_ros.bags.read import read_recording
        return read_recording(path, name, effort_optional=True)
    from engb_ros.tables.measure import measured_of
    from engb_ros.tables.request import Request
    constant = None if model is None else model.motor.torque_constant
    measured, _ = measured_of(path, Request(torque_constant=constant))
    return measured.recording(name or 'motor')
