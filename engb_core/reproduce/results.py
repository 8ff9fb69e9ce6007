# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the reproduction found, on both brakes."""

from __future__ import annotations

from dataclasses import dataclass

from engb_core.model import Model
from engb_core.reproduce.beyond_chapter import BeyondResult
from engb_core.reproduce.identification_chapter import StrokesResult
from engb_core.reproduce.nominal_chapter import CoggingEffect, NominalResult
from engb_core.reproduce.self_energizing_chapter import DiscResult
from engb_core.reproduce.truth import Truth
from engb_core.reproduce.validation_chapter import ValidationResult

__all__ = ['BrakeResults', 'LABELS', 'Results']

# How the brakes are called on the page.
LABELS = {'form': 'brake of the model’s form', 'more': 'brake with more physics'}


@dataclass(frozen=True)
class BrakeResults:
    """Chapters 3 to 5 of one brake; `paper_model` is what the paper's way identified."""

    name: str
    truth: Truth
    nominal: NominalResult
    cogging: CoggingEffect
    strokes: StrokesResult
    paper_model: Model
    validation: ValidationResult
    disc: DiscResult

    @property
    def label(self) -> str:
        """How the brake is called on the page."""
        return LABELS[self.name]


@dataclass(frozen=True)
class Results:
    """`form`: of the brake of the model's form; `more`: of that with more physics; `beyond` the
    paper; `seeds` of noise behind each judgement."""

    form: BrakeResults
    more: BrakeResults
    beyond: BeyondResult
    seeds: int

    @property
    def brakes(self) -> tuple[BrakeResults, BrakeResults]:
        """Both brakes."""
        return self.form, self.more
