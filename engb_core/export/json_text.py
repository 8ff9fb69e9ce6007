# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model as JSON: the model file's mapping, with what each effect is."""

from __future__ import annotations

import json
import math
from typing import Any

from engb_core.effects.catalogue import get_effect
from engb_core.model import Model

__all__ = ['json_text']


def json_text(model: Model) -> str:
    """Return {"model": …, "effects": […]}: `Model.from_mapping` reads the first, programs that
    know no YAML both; infinity, which JSON lacks, is left out."""
    mapping = model.to_mapping()
    controller = mapping.get('controller', {})
    if not math.isfinite(controller.get('effort_limit', 0.0)):
        del controller['effort_limit']
    told: list[dict[str, Any]] = []
    for entry in model.effects:
        effect = get_effect(entry.effect)
        if effect.made_of is not None:
            effect, _ = effect.made_of(entry)
        told.append({
            'effect': effect.id, 'title': effect.title, 'equation': effect.equation,
            'reference': effect.reference, 'stages': list(effect.stages),
            'units': {one.name: one.unit for one in effect.parameters}
            | ({} if effect.written is not None else dict(effect.constants))})
    return json.dumps({'model': mapping, 'effects': told}, ensure_ascii=False, indent=1,
                      allow_nan=False) + '\n'
