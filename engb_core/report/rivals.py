# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How sure the diagnosis is: the hypotheses that were weighed against each other."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from engb_core.diagnose.diagnosis import Diagnosis
from engb_core.report.layout import bar, Column, Page
from engb_core.report.wording import effect_names, number, percent, probability, quantity

__all__ = ['add_rivals', 'hypothesis_name']

# Rows that a reader takes in at once; the details hold all.
CANDIDATES = 6


def add_rivals(page: Page, diagnosis: Diagnosis) -> None:
    """Add the table of hypotheses with their probabilities."""
    candidates = sorted(diagnosis.evidence.candidates, key=lambda entry: -entry.probability)
    if not candidates:
        return
    page.section({'consistent': 'What was tried',
                  'unexplained': 'Why none of the known effects'}.get(
                      diagnosis.verdict, 'How sure, and why not something else'))
    held = [entry.held_out_rms for entry in candidates]
    count = ('One hypothesis was' if len(candidates) == 1
             else f'{len(candidates)} hypotheses were')
    page.text(f'{count} fitted together with the nominal numbers and '
              'judged on data that the fit had not seen. The probability below compares these '
              'alone. The one that is told with a name counts as well how often the cause is '
              'something else and its formula does not quite fit: of names told with 90 % about '
              'nine in ten are right.')
    unit = next((row.unit for row in diagnosis.held_out if row.quantity == 'effort'), 'N·m')
    best = min((value for value in held if np.isfinite(value)), default=math.nan)
    named = tuple(sorted(entry.effect for entry in diagnosis.effects))
    shown = candidates[:CANDIDATES]
    rows = [(hypothesis_name(diagnosis, entry.effects), probability(entry.probability),
             bar(entry.probability), quantity(entry.held_out_rms, unit), percent(entry.share),
             entry.remark or _why_not(entry.held_out_rms, best)) for entry in shown]
    unknown = diagnosis.verdict == 'unexplained'
    chosen = [index for index, entry in enumerate(shown)
              if tuple(sorted(entry.effects)) == named and not unknown]
    rest = 1 - sum(entry.probability for entry in candidates)
    if rest >= 0.01:
        rows.append(('None of these', probability(rest), bar(rest), '–', '–', ''))
        chosen += [len(rows) - 1] if unknown else []
    page.table([Column('Hypothesis'), Column('Among these', number=True), Column('', kind='bars'),
                Column('Held-out rms', number=True), Column('Explains', number=True),
                Column('Remark', kind='wrap')],
               rows, chosen=chosen)


def hypothesis_name(diagnosis: Diagnosis, effects: Sequence[str]) -> str:
    """Return a hypothesis's name; the one without effects says that nothing is missing only where
    nothing is."""
    if not effects and diagnosis.verdict != 'consistent':
        return 'No effect added'
    return effect_names(effects, start=True)


def _why_not(rms: float, best: float) -> str:
    if not (math.isfinite(rms) and math.isfinite(best) and best > 0):
        return ''
    ratio = rms / best
    if ratio < 1.005:
        return ''
    return (f'held-out error {percent(ratio - 1)} above the best' if ratio < 2 else
            f'held-out error {number(ratio, 2)} times the best')
