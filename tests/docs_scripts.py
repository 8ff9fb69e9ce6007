# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The scripts that make documents, as modules."""

from __future__ import annotations

import importlib.util
from pathlib import Path
import sys
from types import ModuleType

__all__ = ['docs_script']

DOCS = Path(__file__).resolve().parents[1] / 'docs'


def docs_script(name: str) -> ModuleType:
    """Return docs/NAME.py as a module."""
    found = importlib.util.spec_from_file_location(name, DOCS / f'{name}.py')
    assert found is not None and found.loader is not None
    module = importlib.util.module_from_spec(found)
    sys.modules[name] = module
    found.loader.exec_module(module)
    return module
