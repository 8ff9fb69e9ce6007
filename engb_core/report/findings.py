# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the mismatch is: each effect with its numbers and pictures, or what is known of it."""

from __future__ import annotations

from engb_core.diagnose.diagnosis import CauseSet, Diagnosis, EffectFinding, ResidualOver
from engb_core.report.effect_pictures import effect_pictures
from engb_core.report.law import add_law
from engb_core.report.layout import Column, Page
from engb_core.report.location import add_zones
from engb_core.report.pictures import residual_over, Units
from engb_core.report.wording import (
    capital,
    coordinate,
    effect_name,
    enumerate_words,
    estimate,
    parameter_name,
    percent,
    probability,
)

__all__ = ['add_findings']


def add_findings(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    """Add each effect with its numbers and the picture that convinces, or what is known.

    Where there are as many pictures as effects, the i-th picture belongs to the i-th effect.
    """
    pictures = list(diagnosis.evidence.residual_over)
    if diagnosis.verdict == 'consistent':
        if pictures:
            page.section('No structure is left')
        _pictures(page, pictures, units)
        return
    if not diagnosis.effects:
        page.section('What is known about it')
        _unexplained(page, diagnosis, units)
        _timing(page, diagnosis)
        _pictures(page, pictures, units)
        return
    page.section('What it is')
    paired = len(pictures) == len(diagnosis.effects)
    shown: list[str] = []
    for index, finding in enumerate(diagnosis.effects):
        _effect(page, finding)
        for figure in effect_pictures(finding.effect, diagnosis.evidence.traces, diagnosis.model,
                                      units):
            page.figure(figure)
        if paired and pictures[index].coordinate not in shown:
            # Where two effects show over the same coordinate, it is the same picture.
            shown.append(pictures[index].coordinate)
            _pictures(page, pictures[index:index + 1], units)
    if not paired:
        _pictures(page, pictures, units)
    if diagnosis.unexplained and diagnosis.verdict == 'partly_explained':
        page.subsection('What remains')
        _unexplained(page, diagnosis, units)
    _timing(page, diagnosis)


def _timing(page: Page, diagnosis: Diagnosis) -> None:
    if diagnosis.timing is not None:
        page.subsection('Timing within a sample')
        page.text(diagnosis.timing.statement)


def _pictures(page: Page, pictures: list[ResidualOver], units: Units) -> None:
    for picture in pictures:
        page.figure(residual_over(picture, units))


def _effect(page: Page, finding: EffectFinding) -> None:
    page.subsection(effect_name(finding.effect, start=True))
    page.text(finding.statement)
    facts = [('Share of the mismatch', percent(finding.share)),
             ('Probability', probability(finding.probability))]
    if finding.causes is not None:
        facts.append(('Set of causes', _causes(finding.causes)))
    facts += [(parameter_name(name), estimate(value))
              for name, value in finding.parameters.items()]
    page.table([Column('Quantity'), Column('Value')], facts, kind='compact')
    rivals = [(name, value) for name, value in finding.alternatives if value >= 0.01]
    if rivals:
        named = enumerate_words([f'{effect_name(name)} ({probability(value)})'
                                 for name, value in rivals[:4]], 'or')
        page.text(f'These recordings cannot rule out {named}.' if rivals[0][1] > 0.1 else
                  f'Possible, but far less likely: {named}.')
    if any(value.std is None for value in finding.parameters.values()):
        page.text('"Not determined" means that the recordings do not contain the motion that '
                  'would fix this number; take the value as a guess.', kind='caption')


def _causes(causes: CauseSet) -> str:
    """Return the causes that are open, and at which level."""
    names = [effect_name(name) for name in causes.effects]
    words = enumerate_words([*names, 'another cause'] if causes.another else names, 'or')
    return f'{words} (level {causes.level:.3g})'


def _unexplained(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    left = diagnosis.unexplained
    if left is None:
        page.text('Nothing more can be said about it from these recordings.')
        return
    if left.statement:
        page.text(left.statement)
    parity = {'odd': 'it changes sign with the direction of motion, as friction does',
              'even': 'it is the same in both directions, as a load is',
              'none': 'it is neither the same nor opposite in the two directions'}
    facts = [f'It holds {percent(left.share)} of the mismatch.']
    if left.depends_on:
        facts.append('It depends on '
                     f'{enumerate_words(coordinate(name) for name in left.depends_on)}.')
    if left.parity_in_velocity in parity:
        facts.append(capital(parity[left.parity_in_velocity]) + '.')
    facts.append('It has memory: the same position, speed and load give different torques, '
                 'depending on what went before.' if left.memory else
                 'No memory was found: the present state decides.')
    page.notes(facts)
    if left.law is not None:
        add_law(page, left.law, units)
    if left.where:
        add_zones(page, left.where)
