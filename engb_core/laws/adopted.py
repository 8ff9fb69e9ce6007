# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""An adopted law: an effect of the library whose physics is a formula of the grammar."""

from __future__ import annotations

from collections.abc import Mapping

from engb_core.effects.base import Effect, Parameter
from engb_core.effects.law import law_effect
from engb_core.laws.grammar import coordinates_of, parse, printed, with_values
from engb_core.model import EffectSetting

__all__ = ['adopted_effect']


def adopted_effect(id: str, title: str, formula: str, acts_as: str,
                   parameters: tuple[Parameter, ...], reference: str,
                   within: Mapping[str, tuple[float, float]] | None = None) -> Effect:
    """Return the effect of an adopted law; what `engb adopt` writes calls this.

    Args:
        id: its name in diagnoses and model files.
        title: as a person says it.
        formula: of the grammar (engb_core/laws/grammar.py).
        acts_as: where it acts, one of `ACTS_AS` (engb_core/laws/machine.py).
        parameters: of the formula, in order of appearance, with units and bounds.
        reference: where it was found.
        within: coordinate → range in which it acts as the formula says; held beyond.

    Raises:
        InputError: the formula is not of the grammar, or can't act there.
    """
    law = law_effect(formula, acts_as, parameters, dict(within or {}), largest=0.1)
    names = [entry.name for entry in parameters]

    def statement(values: Mapping[str, float]) -> str:
        filled = printed(with_values(parse(formula), {name: values[name] for name in names}), 3)
        return f'{title}: {acts_as.replace("_", " ")} {filled}.'

    coordinates = coordinates_of(parse(formula))
    return Effect(
        id=id, title=title, parameters=parameters, stages=law.stages, equation=law.equation,
        reference=reference, statement=statement,
        reveals=coordinates[0] if coordinates else 'time', constants=law.constants,
        defaults=law.defaults, warp=law.warp, correction=law.correction,
        late_position=law.late_position,
        written=lambda values: EffectSetting(id, {name: values[name] for name in names}))
