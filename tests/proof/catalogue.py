# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What can be hidden in a truth plant: how each effect is drawn, sized, and described.

A `Hidden` holds one effect with its formulation and shape drawn; `put` writes it into a plant
at a magnitude, `lack` gives the model without it, `describe` the contract's parameters, which
are computed from the formulation where they are not its own numbers. For what lies outside the
library it holds what the mismatch truly depends on (for each variable the names that mean it),
whether it has memory, and the names of the contract that would be physically fair.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from .nominal import Nominal
from .references import DiscProfile
from .truth_plant import Run

__all__ = ['Context', 'Drawer', 'Hidden', 'drawer']

Put = Callable[[np.ndarray, float], None]


@dataclass(frozen=True)
class Context:
    """What the contract's parameters may be computed from."""

    plant: np.ndarray
    base: Nominal
    run: Run
    disc: DiscProfile
    magnitude: float


@dataclass(frozen=True)
class Hidden:
    """One effect, drawn but for its magnitude."""

    effect: str
    formulation: str
    put: Put
    bounds: tuple[float, float]
    describe: Callable[[Context], dict[str, float]]
    lack: Callable[[Nominal, float], Nominal] = field(default=lambda model, magnitude: model)
    locked: tuple[str, ...] = ()
    cutoff: float = 20.0
    needs_disc: bool = False
    depends_on: tuple[tuple[str, ...], ...] = ()
    memory: bool = False
    fair: tuple[str, ...] = ()
    beside: Callable[[Context], np.ndarray] | None = None


Drawer = Callable[[np.random.Generator, Nominal, str], Hidden]
_DRAWERS: dict[str, Drawer] = {}


def drawer(effect: str) -> Callable[[Drawer], Drawer]:
    """Register a function that draws `effect`: (rng, base numbers, motion kind) -> Hidden."""
    def register(function: Drawer) -> Drawer:
        _DRAWERS[effect] = function
        return function
    return register


def known(registry: dict[str, Drawer] = _DRAWERS) -> dict[str, Drawer]:
    """All registered drawers by effect id."""
    return dict(registry)


def wrong_number(model: Nominal, **numbers: float) -> Nominal:
    """The model with some of its numbers replaced."""
    return replace(model, **numbers)
