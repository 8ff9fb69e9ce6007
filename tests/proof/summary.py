# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Scores as text for a terminal."""
from __future__ import annotations

from .cause_sets import as_lines

__all__ = ['as_text']


def _percent(value: float | None) -> str:
    return '  –  ' if value is None else f'{100.0 * value:5.1f} %'


def _line(name: str, entry: dict | None) -> str:
    if entry is None:
        return f'{name:42s}  –'
    low, high = entry['interval']
    return (f'{name:42s}{_percent(entry["share"])}  {entry["hits"]}/{entry["of"]}  '
            f'[{100 * low:.1f}, {100 * high:.1f}]')


def _number(value: float | None, digits: int = 3) -> str:
    return '–' if value is None else f'{value:.{digits}f}'


def _held_out(summary: dict) -> list[str]:
    lines = [_line('held-out made worse', summary['worse']),
             _line('harm (materially worse, all cases)', summary['harm'])]
    lines += [f'{"held-out error removed, " + key.replace("_", " "):42s}{_percent(value)}'
              for key, value in summary['held_out_removed'].items()]
    return lines


def _outside(summary: dict) -> list[str]:
    lines = [_line(f'confident wrong name, {stratum}', entry)
             for stratum, entry in summary['confident_wrong'].items()]
    for stratum, told in summary['variables'].items():
        if told:
            lines.append(f'variables told right, {stratum}: {_percent(told["told"]).strip()}, '
                         f'{told["beside"]:.2f} others beside; memory '
                         f'{_percent(told["memory"]).strip()} of {told["cases"]}')
    return lines


def _fit(summary: dict) -> list[str]:
    where, fit, sure = summary['localisation'], summary['parameters'], summary['calibration']
    lines = [f'localisation: precision {_number(where["precision"], 2)} '
             f'(chance {_number(where["chance"], 2)}), recall {_number(where["recall"], 2)}']
    zones = where['zones']
    if zones['count']:
        lines.append(f'zones named: {zones["count"]}, with {_percent(zones["energy"]).strip()} of '
                     f'the mismatch in {_percent(zones["time"]).strip()} of the time in motion; '
                     f'said and true share differ by {_percent(zones["said_error"]).strip()}')
    begun = summary['onset']
    if begun['begins'] or begun['invented']:
        lines.append(f'onset in mid-recording: told in {begun["told"]} of {begun["begins"]}, off '
                     f'by {_number(begun["median_error"], 2)} s (median) and '
                     f'{_number(begun["most_error"], 2)} s (most); told where the effect acts '
                     f'throughout: {begun["invented"]} of {begun["throughout"]}')
    lines.append(f'parameters: {fit["numbers"]} found, median error '
                 f'{_percent(fit["median_error"]).strip()} (deviation '
                 f'{_percent(fit["median_deviation"]).strip()}), truth inside 2 std '
                 f'{_percent(fit["coverage"]).strip()}')
    for name, row in fit['by_parameter'].items():
        lines.append(f'  {name:56s}{_percent(row["median_error"])} '
                     f'({_percent(row["median_deviation"])}) inside {_percent(row["coverage"])} '
                     f'of {row["cases"]}')
    lines.append(f'calibration: expected error {_number(sure["expected_error"])} (by chance '
                 f'alone {_number(sure["by_chance"])}), Brier {_number(sure["brier"])} of '
                 f'{sure["claims"]} claims')
    lines += [f'  claims said with {b["from"]:.2f} to {b["to"]:.2f}: {b["right"]} of '
              f'{b["claims"]} right (said {b["said"]:.2f})' for b in sure['bands']]
    return lines + as_lines(summary['cause_sets'])


def as_text(summary: dict) -> str:
    """A page of text."""
    strata = ', '.join(f'{count} {name}' for name, count in summary['strata_of'].items())
    lines = [f'{summary["cases"]} cases: {strata}', _line('right, all strata', summary['right'])]
    lines += [_line(f'named first, {key}', value)
              for key, value in summary['named_first'].items() if value]
    lines += [_line('both of a pair', summary['pairs_both']),
              _line('one of a pair first', summary['pairs_first']),
              _line('all of three', summary['triples_all']),
              _line('one of three first', summary['triples_first']),
              _line('something said on a clean recording', summary['false_alarms']),
              _line('  a name given on a clean recording', summary['claims_on_clean']),
              *_outside(summary),
              _line('singles with a false second name', summary['singles_with_false_extra']),
              *_held_out(summary), *_fit(summary)]
    lines += [_line(f'right, {tag.replace("_", " ")}', entry)
              for tag, entry in summary['by_tag'].items()]
    time = summary['seconds']
    lines.append(f'seconds: median {_number(time["median"], 1)}, 95th percentile '
                 f'{_number(time["p95"], 1)}, most {_number(time["max"], 1)}')
    lines.append('first claims by truth:')
    for truth, row in sorted(summary['confusion'].items()):
        said = ', '.join(f'{k} {v}' for k, v in sorted(row.items(), key=lambda kv: -kv[1]))
        lines.append(f'  {truth:32s}{said}')
    for miss in summary['misses']:
        held = ', '.join(f'{e} ({form})' if form else e
                         for e, form in zip(miss['hidden'], miss['as'], strict=True)) or 'nothing'
        said = ', '.join(f'{e} {p:.2f}' for e, p in miss['claims']) or (
            f'nothing ({miss["verdict"]})')
        lines.append(f'missed: {miss["case"]} {miss["stratum"]} {miss["motion"]}'
                     f'{" refitted" if miss["refitted"] else ""}: held {held}; said {said}')
    lines += [f'failed: {f["case"]}: {f["failure"]}' for f in summary['failures']]
    return '\n'.join(lines)
