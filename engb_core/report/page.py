# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The diagnosis on one page: verdict, where, what, how much better, how sure, what next."""

from __future__ import annotations

import os

from engb_core.diagnose.diagnosis import Diagnosis
from engb_core.report.details import add_details
from engb_core.report.findings import add_findings
from engb_core.report.improvement import add_improvement
from engb_core.report.layout import Page
from engb_core.report.location import add_location
from engb_core.report.pictures import experiment, Units
from engb_core.report.rivals import add_rivals
from engb_core.report.text import escape, Html
from engb_core.report.verdict import add_verdict, VERDICTS
from engb_core.report.wording import effect_name, enumerate_words, number

__all__ = ['diagnosis_page', 'write_report']


def write_report(path: str | os.PathLike[str], diagnosis: Diagnosis) -> None:
    """Write the diagnosis as one self-contained HTML file, whole or not at all."""
    diagnosis_page(diagnosis).write(path)


def diagnosis_page(diagnosis: Diagnosis, *, backend: str | None = None) -> Page:
    """Return the page of a diagnosis; `backend` as in `Page`."""
    page = Page(f'{VERDICTS[diagnosis.verdict][0]} – engb diagnosis', backend=backend)
    units = Units(diagnosis)
    add_verdict(page, diagnosis)
    add_location(page, diagnosis, units)
    add_findings(page, diagnosis, units)
    add_improvement(page, diagnosis, units)
    add_rivals(page, diagnosis)
    _next(page, diagnosis, units)
    add_details(page, diagnosis, units)
    seconds = diagnosis.evidence.seconds
    page.footer('engb diagnose' + (f', {number(seconds, 2)} s of computation.' if seconds > 0
                                   else '.') + ' Angles and torques are those of the motor; a '
                'positive angle applies the brake.')
    return page


def _next(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    proposal = diagnosis.next_experiment
    if proposal is None:
        return
    page.section('What to measure next')
    names = enumerate_words([effect_name(name) for name in proposal.discriminates])
    page.text(proposal.reason)
    page.call(Html(f'Tells apart: <b>{escape(names)}</b>'),
              Html(f'Reference: {escape(proposal.reference)}'))
    picture = experiment(proposal, units)
    if picture is not None:
        page.figure(picture)
