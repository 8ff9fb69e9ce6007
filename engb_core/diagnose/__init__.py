# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""From recordings and a model to a named, sized and checked mismatch.

Upwards: `problem` (recordings as motions, noise), `hypothesis` and `nominal` (what is fitted),
`objective` (predictions and what they cost), `optimise`, `score`, `search`, `numbers`,
`resonance`, `selection`, `unknown`, `findings` and `verdict` (what is said), `experiment`, and
`engine`, which runs them.

Called, the package is the library's function: `engb.diagnose(recording, model)` and
`import engb_core.diagnose.engine` are one name, and both have to work in either order.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any


class _Package(ModuleType):
    """A package that is called like the library's function."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Do what `engb_core.library.diagnose` does."""
        return importlib.import_module('engb_core.library').diagnose(*arguments, **options)


sys.modules[__name__].__class__ = _Package
