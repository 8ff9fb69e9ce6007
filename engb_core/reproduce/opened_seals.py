# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Brakes that were drawn by another process and sealed: identified first, opened last."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from engb_core.bench.settings import BenchSettings
from engb_core.report.layout import Column, Page
from engb_core.reproduce.blind import judge, NUMBERS, summarise

__all__ = ['open_brakes', 'SealedBrakes', 'sealed_section']


@dataclass(frozen=True)
class SealedBrakes:
    """What became of the sealed brakes.

    Attributes:
        digests: SHA-256 of each seal's content, as told before the brake was identified.
        table: of `blind.summarise`.
        origin: how their recordings were made.
    """

    digests: tuple[str, ...]
    table: dict[str, dict[str, Any]]
    origin: str

    def mapping(self) -> dict[str, Any]:
        """Return it for a JSON file."""
        return {'digests': list(self.digests), 'origin': self.origin, 'ways': self.table}


def open_brakes(entries: Sequence[tuple[str, Mapping[str, Any], Mapping[str, Any]]],
                origin: str) -> SealedBrakes:
    """Judge what was found by what the seals hold.

    Args:
        entries: of each brake the seal's digest, what was found (`blind.estimate_brake`), and
            the seal's content: a bench brake's numbers.
        origin: how the recordings were made.
    """
    outcomes = [outcome for _, found, truth in entries for outcome in judge(
        found, BenchSettings.from_mapping(
            {name: value for name, value in truth.items() if name != 'salt'}))]
    return SealedBrakes(tuple(digest for digest, _, _ in entries), summarise(outcomes), origin)


def sealed_section(page: Page, sealed: SealedBrakes) -> None:
    """Add the section on the sealed brakes."""
    page.section('Sealed brakes')
    ways = list(sealed.table)
    page.text(f'{len(sealed.digests)} brakes, each drawn by a process of its own: every number '
              'within ±30 % of the chosen one, K_T too, the contact between 2 and 9 rad. '
              f'{sealed.origin} Classical reading first: the loop rests on what step test and '
              'slow strokes gave. The seals were opened last.')
    rows = []
    for name, symbol in NUMBERS.items():
        rows.append([symbol, *(_cell(sealed.table[way]['numbers'].get(name)) for way in ways)])
    rows.append(['load curve', *(_cell(sealed.table[way]['load']) for way in ways)])
    rows.append(['contact told as found', *(
        f'{sealed.table[way]["contact"]["determined"]}, of these beyond 2 %: '
        f'{sealed.table[way]["contact"]["beyond_2_percent"]}'
        if 'contact_angle' in sealed.table[way]['numbers'] else '' for way in ways)])
    rows.append(['cogging order right', *(
        f'{sealed.table[way]["orders_right"]} of {sealed.table[way]["brakes"]}'
        for way in ways)])
    page.table([Column('Number'), *(Column(way) for way in ways)], rows,
               caption='Error: median and worst over the brakes, of the load as rms over its '
                       'largest value. Then how many of the two-sigma intervals (of the load’s '
                       'band: of its angles) hold the truth; 95 % would. The paper’s way has '
                       'intervals for J and B, from the steps’ scatter, and for P and μ only.')
    page.begin_details('Digests of the seals')
    page.code('\n'.join(sealed.digests))
    page.end_details()


def _cell(entry: Mapping[str, Any] | None) -> str:
    if entry is None:
        return ''
    text = f'{100 * entry["median"]:.2g} % ({100 * entry["worst"]:.2g} %)'
    if entry['coverage'] is not None:
        text += f'; holds {100 * entry["coverage"]:.0f} %'
    return text
