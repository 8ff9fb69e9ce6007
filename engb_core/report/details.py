# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The folded part of the diagnosis page: numbers, all candidates, notes, the model file."""

from __future__ import annotations

import math

import yaml

from engb_core.diagnose.diagnosis import Diagnosis, NominalChange, ParameterEstimate
from engb_core.report.alike import alike_together
from engb_core.report.layout import Column, Page
from engb_core.report.pictures import Units
from engb_core.report.rivals import hypothesis_name
from engb_core.report.text import clean
from engb_core.report.wording import (
    capital,
    estimate,
    parameter_name,
    percent,
    probability,
    quantity,
    zone_range,
)

__all__ = ['add_details']

# More rows than these would be read with the file, not on the page.
ROWS = 200


def add_details(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    """Add the section of details."""
    evidence = diagnosis.evidence
    page.section('Details', kind='folded')
    if evidence.nominal:
        page.begin_details('Nominal numbers before and after')
        page.text('The nominal numbers were refitted together with the effects, since they may '
                  'have absorbed a part of them.', kind='muted')
        page.table([Column('Number'), Column('As given', number=True),
                    Column('Refitted', number=True), Column('Change', number=True)],
                   [(parameter_name(entry.name), quantity(entry.before, entry.unit, 4),
                     estimate(ParameterEstimate(entry.after, entry.std, entry.unit)),
                     _change(entry)) for entry in evidence.nominal])
        page.end_details()
    if evidence.candidates:
        _candidates(page, diagnosis)
    if diagnosis.unexplained is not None and diagnosis.verdict in ('explained', 'consistent'):
        left = diagnosis.unexplained
        page.begin_details('What remains unexplained')
        page.text(left.statement or 'No structure is left that a name could be given to.')
        page.text(f'It holds {percent(left.share)} of the mismatch.')
        page.notes([capital(f'{zone_range(zone)}: {percent(zone.share)}') for zone in left.where])
        page.end_details()
    if evidence.notes:
        page.begin_details(f'Notes on the input ({len(evidence.notes)})')
        page.notes(alike_together(evidence.notes)[:ROWS])
        page.end_details()
    page.begin_details('Corrected model (model.yaml)' if units.corrected else
                       'Model (model.yaml), numbers refitted')
    page.code(yaml.safe_dump(diagnosis.model.to_mapping(), sort_keys=False, allow_unicode=True))
    page.end_details()
    page.begin_details('How to run it')
    _how_to_run(page, diagnosis, units)
    page.end_details()


def _candidates(page: Page, diagnosis: Diagnosis) -> None:
    candidates = sorted(diagnosis.evidence.candidates, key=lambda entry: -entry.probability)
    unit = next((row.unit for row in diagnosis.held_out if row.quantity == 'effort'), 'N·m')
    page.begin_details(f'All hypotheses that were weighed ({len(candidates)})')
    page.table([Column('Hypothesis'), Column('Among these', number=True),
                Column('Held-out rms', number=True), Column('Explains', number=True),
                Column('Remark', kind='wrap')],
               [(hypothesis_name(diagnosis, entry.effects), probability(entry.probability),
                 quantity(entry.held_out_rms, unit), percent(entry.share), entry.remark)
                for entry in candidates[:ROWS]])
    page.end_details()


def _how_to_run(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    outputs = f'the motor {units.effort_name} that the recorded motion needs'
    if diagnosis.model.controller is not None:
        outputs += ' and the simulated closed loop'
    model = 'The corrected model' if units.corrected else 'The model'
    page.text(f'{model} predicts any other recording of this brake: {outputs}.')
    page.code('engb predict RECORDING --model model.yaml --out prediction.npz')
    page.text('It can be given to the next diagnosis, to see whether something is left:')
    page.code('engb diagnose RECORDING --model model.yaml --out again')


def _change(entry: NominalChange) -> str:
    if entry.before == 0 or not math.isfinite(entry.after / entry.before):
        return clean('–')
    change = 100 * (entry.after / entry.before - 1)
    return f'{"+" if change >= 0 else "−"}{abs(change):.1f}\u202f%'
