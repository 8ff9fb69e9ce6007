# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Units of a linear axis: where the joint is prismatic, rad reads m and N·m reads N."""

from __future__ import annotations

from dataclasses import replace
import math
import re

from engb_core.diagnose.diagnosis import Diagnosis, EffectFinding, Unexplained
from engb_core.effects.catalogue import catalogue

__all__ = ['finding_of_slider', 'of_slider', 'unexplained_of_slider']

# How often something repeats per revolution is, along a line, the wave number of a sine.
_REPEATS = re.compile(r'repeats (\d[\d.]*(?:e[-+]?\d+)?) times')
# What a motor's datasheet gives stays a torque constant.
_TORQUE = re.compile(r'\b[Tt]orque\b(?! constant)')
_MILLI = re.compile(r'([-+]?\d[\d.]*(?:e[-+]?\d+)?) mN·m')


def of_slider(diagnosis: Diagnosis) -> Diagnosis:
    """Return the diagnosis with the units and words of a linear axis."""
    timing = diagnosis.timing
    return replace(
        diagnosis, effects=tuple(map(finding_of_slider, diagnosis.effects)),
        unexplained=unexplained_of_slider(diagnosis.unexplained),
        timing=None if timing is None else replace(timing, statement=_text(timing.statement)))


def finding_of_slider(finding: EffectFinding) -> EffectFinding:
    """Return the finding with the units of a linear axis."""
    effect = catalogue().get(finding.effect)
    # The phase of a wave is an angle along a line, too, and a disc turns.
    turning = {entry.name for entry in effect.parameters
               if entry.kind in ('phase', 'disc_speed')} if effect is not None else set()
    parameters = {name: entry if name in turning else replace(entry, unit=_unit(entry.unit))
                  for name, entry in finding.parameters.items()}
    return replace(finding, parameters=parameters, statement=_text(finding.statement))


def unexplained_of_slider(unexplained: Unexplained | None) -> Unexplained | None:
    """Return what is unexplained with the units of a linear axis."""
    if unexplained is None:
        return None
    law = unexplained.law
    if law is not None:
        law = replace(law, line=_text(law.line), statement=_text(law.statement),
                      below=tuple(_text(entry) for entry in law.below),
                      parameters={name: replace(entry, unit=_unit(entry.unit))
                                  for name, entry in law.parameters.items()})
    return replace(unexplained, statement=_text(unexplained.statement), law=law)


def _text(text: str) -> str:
    text = _MILLI.sub(lambda match: f'{float(match[1]) * 1e-3:.3g} N', text)
    text = _REPEATS.sub(
        lambda match: f'repeats every {2.0 * math.pi / float(match[1]):.3g} m', text)
    text = text.replace(' per motor revolution', '')
    text = _TORQUE.sub(lambda match: 'Force' if match[0][0] == 'T' else 'force', text)
    return re.sub(r'\brad\b', 'm', text.replace('kg·m²', 'kg').replace('N·m', 'N'))


def _unit(unit: str) -> str:
    for turning, linear in (('1/rev', '1/m'), ('kg·m²', 'kg'), ('N·m', 'N'), ('rad', 'm')):
        unit = unit.replace(turning, linear)
    return unit
