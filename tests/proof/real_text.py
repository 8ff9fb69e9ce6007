# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What `engb prove --real` found, as a page of text."""
from __future__ import annotations

from collections import Counter

__all__ = ['LIKELY', 'as_text', 'sums_of']

# From here on a claim says that a cause is likelier there than not.
LIKELY = 0.5


def _as_expected(expected: list[dict]) -> list[str]:
    lines = ['expected, and what was said of the nominal model:'] if expected else []
    for entry in expected:
        if 'beside' in entry:
            beside = ', '.join(f'{name} {p:.2f}' for name, p in entry['beside']) or 'nothing'
            lines.append(f'  beside it, at {LIKELY:g} and more: {beside}')
            continue
        said = f'{entry["said"]} {entry["probability"]:.2f}' if entry['said'] is not None else (
            f'not named; in the set {" or ".join(entry["in_set"])}' if entry['in_set'] else
            'not named')
        if entry['value'] is not None:
            said += (f'; {entry["parameter"]} {entry["value"]:.3g}, expected '
                     f'{entry["low"]:.3g} to {entry["high"]:.3g}')
        sure = 'sure' if entry['sure'] else 'likely'
        lines.append(f'  {" or ".join(entry["names"])} ({sure}): {said}')
    return lines


def _rung(rung: dict) -> str:
    force, places = rung['force'], (rung['position']['holdout'], rung['driven']['holdout'])
    fit = f'{"–":>9s}' if force['train'] is None else f'{100 * force["train"]:7.2f} %'
    told = ''.join(f'{"–":>10s}' if place is None else f'{place:10.3g}' for place in places)
    return (f'  {rung["rung"]:44s}{fit}{100 * force["holdout"]:8.2f} %'
            f'{100 * rung["moving"]["holdout"]:8.2f} %{told}')


def _spread(found: dict) -> list[str]:
    if not found['rows']:
        return ['its numbers on each recording: the tool changed none']
    if found['folds'] < 2:
        return ['its numbers on each recording: one recording has no spread']
    lines = [f'its numbers, fitted anew to {found["folds"]} {found["kind"]} '
             '(those that tell a number from nothing):',
             f'  {"":40s}{"value":>10s}{"told ±":>10s}{"tell it":>9s}{"apart by":>10s}'
             f'{"own ±":>10s}{"ratio":>7s}{"mean":>10s}{"by scatter ±":>14s}']
    for row in found['rows']:
        label = ' '.join(part for part in (row['effect'].replace('_', ' '),
                                           row['number'].replace('_', ' ')) if part)
        cells = [_number(row[key], width) for key, width in (
            ('spread', 10), ('own', 10), ('ratio', 7), ('mean', 10), ('scatter', 14))]
        lines.append(f'  {label:40s}{_number(row["value"], 10)}{_number(row["told"], 10)}'
                     f'{row["telling"]:9d}{"".join(cells)}')
    if found['idle']:
        lines.append(f'  told, but without influence here: {", ".join(found["idle"])}')
    return lines


def sums_of(rows: list[dict]) -> list[str]:
    """How often each verdict was given, a line for one term taken out and one for two."""
    lines = []
    for count, words in ((1, 'one term'), (2, 'two terms')):
        given = Counter(row['verdict'] for row in rows if len(row['taken']) == count)
        if given:
            lines.append(f'{words} taken out, {given.total()} models: '
                         + ', '.join(f'{verdict} {n}' for verdict, n in given.most_common()))
    return lines


def _number(value: float | None, width: int) -> str:
    return f'{"–":>{width}s}' if value is None else f'{value:{width}.3g}'


def _transfer(one: dict) -> list[str]:
    found = one['transfer']
    if found is None:
        return []
    numbers = '; '.join(f'{entry["number"]} {entry["first"]:.4g} there, {entry["here"]:.4g} here'
                        for entry in found['numbers'])
    return [f'another unit of the machine of {found["of"]}, held out (as above):',
            *(_rung(rung) for rung in found['rungs']), f'  numbers refitted: {numbers}']


def as_text(result: dict) -> str:
    """A page of text."""
    lines = []
    for one in result['sets']:
        lines += [f'{one["name"]}, recordings: {one["train"]} to fit, {one["holdout"]} held out',
                  f'{"relative force error":46s}{"fit":>9s}{"held out":>10s}{"moving":>10s}'
                  '   position, held out: in the loop, driven by the recorded effort '
                  f'(moving: held out, up to {one["band"]:.0f} Hz)']
        for rung in one['ladder']:
            lines.append(_rung(rung))
        for entry in one['published']:
            numbers = [entry['train'], entry['holdout']]
            told = [f'{"–":>9s}' if n is None else f'{100 * n:7.2f} %'
                    if entry['measure'] == 'force' else f'   {n:.3g} rms' for n in numbers]
            lines.append(f'  published, {entry["who"]}: {" ".join(told)}')
        lines += [*_spread(one['spread']), *_transfer(one), *_as_expected(one['expected'])]
        lines.append('taken out, and what was named:')
        wide = max((len(row['text']) for row in one['rows']), default=0) + len(', refitted')
        for row in one['rows']:
            names = ', '.join(f'{name} {p:.2f}' for name, p in row['claims']) or 'nothing'
            kind = ', refitted' if row['refitted'] else ''
            found = '' if row['said'] is None or row['value'] is None else \
                f'; {row["parameter"]} {row["said"]:.4g} (taken: {row["value"]:.4g})'
            held = f'{row["times_best"]:.2f} → {row["after_times_best"]:.2f} times the best'
            lines.append(f'  {row["text"] + kind:{wide}s}  {row["verdict"] or "":12s}{names}'
                         f'{found}; held out {held}')
        lines += sums_of(one['rows'])
    return '\n'.join(lines)

