# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where the mismatch is: over the coordinates and over time."""

from __future__ import annotations

from collections import defaultdict

from engb_core.diagnose.diagnosis import Diagnosis, Trace, Zone
from engb_core.report.layout import Column, folded_points, MAIN_POINTS, Page
from engb_core.report.pictures import close_up, numbered, overlay, Units
from engb_core.report.text import breakable, shorten
from engb_core.report.wording import capital, percent, zone_range

__all__ = ['add_location', 'add_zones']

# Rows that a reader takes in at once; the rest is folded.
INTERVALS, ZONES = 6, 8


def add_location(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    """Add the shares over coordinates, the marked overlay, a close-up and the intervals."""
    traces = _ordered(diagnosis)
    if not traces and not diagnosis.time and not diagnosis.where:
        return
    consistent = diagnosis.verdict == 'consistent'
    page.section('What was compared' if consistent else 'Where it happens')
    if diagnosis.where and not consistent:
        first = max(diagnosis.where, key=lambda zone: zone.share)
        place = zone_range(first)
        verb = 'lies at' if any(character.isdigit() for character in place) else 'comes while'
        page.text(f'{percent(first.share)} of the mismatch {verb} {place}.')
        add_zones(page, diagnosis.where)
    if traces:
        page.figure(overlay(traces[0], diagnosis.time, units), points=MAIN_POINTS)
        strongest = [entry for _, entry in numbered(diagnosis.time, traces[0].recording)[:1]]
        picture = close_up(traces[0], strongest[0], units) if strongest else None
        if picture is not None:
            page.figure(picture, points=MAIN_POINTS)
    if diagnosis.time and not consistent:
        _intervals(page, diagnosis)
    if len(traces) > 1:
        points = folded_points(7 * (len(traces) - 1))
        page.begin_details(f'The other recordings ({len(traces) - 1})')
        for trace in traces[1:]:
            page.figure(overlay(trace, diagnosis.time, units), points=points)
        page.end_details()


def _ordered(diagnosis: Diagnosis) -> list[Trace]:
    """The recording with most of the mismatch first, held-out ones before others."""
    weight: defaultdict[str, float] = defaultdict(float)
    for entry in diagnosis.time:
        weight[entry.recording] += entry.share
    return sorted((trace for trace in diagnosis.evidence.traces if trace.time.size),
                  key=lambda trace: (-weight[trace.recording], not trace.held_out))


def add_zones(page: Page, zones: tuple[Zone, ...]) -> None:
    """Add bars of the share in each range of a coordinate, the largest first."""
    ranked = sorted(zones, key=lambda zone: -zone.share)[:ZONES]
    page.shares([(capital(zone_range(zone)), zone.share, percent(zone.share)) for zone in ranked],
                colour='before')
    page.text('Each bar is the share of the mismatch (energy of the residual above the noise) '
              'within that range; ranges of different coordinates overlap.', kind='caption')


def _intervals(page: Page, diagnosis: Diagnosis) -> None:
    ranked = sorted(diagnosis.time, key=lambda entry: -entry.share)
    several = len({entry.recording for entry in ranked}) > 1

    def label(rank: int) -> str:
        entry = ranked[rank]
        place = f', {shorten(entry.recording, 32)}' if several else ''
        return f'{rank + 1}:  {entry.begin:.2f}–{entry.end:.2f} s{place}'
    total = sum(entry.share for entry in ranked)
    spread = sum(entry.share for entry in ranked[:INTERVALS]) < 0.35 and len(ranked) > INTERVALS
    if spread:
        page.text(f'It is spread over {len(ranked)} short intervals, which together hold '
                  f'{percent(min(total, 1.0))} of the mismatch; no single one holds more than '
                  f'{percent(ranked[0].share)}.')
    else:
        page.shares([(label(rank), entry.share, percent(entry.share))
                     for rank, entry in enumerate(ranked[:INTERVALS])], colour='mark')
    if len(ranked) > INTERVALS:
        page.begin_details(f'All {len(ranked)} intervals')
        page.table([Column('Rank'), Column('From [s]', number=True),
                    Column('To [s]', number=True), Column('Share', number=True),
                    Column('Recording')],
                   [(str(rank), f'{entry.begin:.2f}', f'{entry.end:.2f}', percent(entry.share),
                     breakable(shorten(entry.recording, 60)))
                    for rank, entry in enumerate(ranked[:200], 1)], kind='compact')
        page.end_details()
