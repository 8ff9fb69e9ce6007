# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The science of engb_ros: brake model, identification, diagnosis. Knows no ROS.

As a library: `import engb_core as engb`. Each name below is loaded when it is first used
(docs/library.md).
"""

from __future__ import annotations

import importlib
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    # `diagnose` is a package too, which is called like a function (diagnose/__init__.py).
    from engb_core import diagnose, effects
    from engb_core.errors import InputError
    from engb_core.library import Diagnosis, load_model, predict, read, Recording, simulate
    from engb_core.model import Model
    from engb_core.recording import Reference, Signal

__all__ = ['Diagnosis', 'InputError', 'Model', 'Recording', 'Reference', 'Signal', 'diagnose',
           'effects', 'load_model', 'predict', 'read', 'simulate']

# Public name → where it is defined.
_HOME = {'InputError': 'engb_core.errors', 'Model': 'engb_core.model',
         'Reference': 'engb_core.recording', 'Signal': 'engb_core.recording'}
_PACKAGES = {'diagnose', 'effects'}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    if name in _PACKAGES:
        return importlib.import_module(f'{__name__}.{name}')
    found = getattr(importlib.import_module(_HOME.get(name, 'engb_core.library')), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
