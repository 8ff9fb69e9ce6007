"""Scores as text for a terminal."""
from __future__ import annotations

__all__ = ['as_text']


def _percent(value: float | None) -> str:
    return '  –  ' if value is None else f'{100.0 * value:5.1f} %'


def _line(name: str, entry: dict | None) -> str:
    if entry is None:
        return f'{name:34s}  –'
    low, high = entry['interval']
    return (f'{name:34s}{_percent(entry["share"])}  {entry["hits"]}/{entry["of"]}  '
            f'[{100 * low:.1f}, {100 * high:.1f}]')


def _number(value: float | None, digits: int = 3) -> str:
    return '–' if value is None else f'{value:.{digits}f}'


def as_text(summary: dict) -> str:
    """A page of text."""
    lines = [f'{summary["cases"]} cases']
    lines += [_line(f'named first, {key}', value)
              for key, value in summary['named_first'].items() if value]
    lines += [_line('both of a pair', summary['pairs_both']),
              _line('one of a pair first', summary['pairs_first']),
              _line('false alarms (clean)', summary['false_alarms']),
              _line('confident wrong name (outside)', summary['confident_wrong_outside']),
              _line('singles with a false second name', summary['singles_with_false_extra']),
              _line('harm (held-out made worse)', summary['harm'])]
    for key, value in summary['held_out_removed'].items():
        energy = summary['held_out_energy_removed'][key]
        lines.append(f'{"held-out error removed, " + key:34s}{_percent(value)}  '
                     f'(energy {_percent(energy).strip()})')
    where, fit = summary['localisation'], summary['parameters']
    lines.append(f'localisation: precision {_number(where["precision"], 2)}, '
                 f'recall {_number(where["recall"], 2)}')
    zones = where['zones']
    if zones['count']:
        lines.append(f'zones named: {zones["count"]}, with {_percent(zones["energy"]).strip()} of '
                     f'the mismatch in {_percent(zones["time"]).strip()} of the time in motion; '
                     f'said and true share differ by {_percent(zones["said_error"]).strip()}')
    lines.append(f'parameters: median error {_percent(fit["median_error"]).strip()} (deviation '
                 f'{_percent(fit["median_deviation"]).strip()}), truth inside 2 std '
                 f'{_percent(fit["coverage"]).strip()}')
    for name, row in fit['by_parameter'].items():
        lines.append(f'  {name:56s}{_percent(row["median_error"])} '
                     f'({_percent(row["median_deviation"])}) inside {_percent(row["coverage"])} '
                     f'of {row["cases"]}')
    sure = summary['calibration']
    lines.append(f'calibration: expected error {_number(sure["expected_error"])} '
                 f'of {sure["claims"]} claims')
    lines += [f'  said {b["said"]:.2f} right {b["right"]:.2f} ({b["claims"]})'
              for b in sure['bins']]
    time = summary['seconds']
    lines.append(f'seconds: mean {_number(time["mean"], 1)}, most {_number(time["max"], 1)}')
    lines.append('first claims by truth:')
    for truth, row in sorted(summary['confusion'].items()):
        said = ', '.join(f'{k} {v}' for k, v in sorted(row.items(), key=lambda kv: -kv[1]))
        lines.append(f'  {truth:32s}{said}')
    for miss in summary['misses']:
        held = ', '.join(f'{e} ({form})' for e, form in zip(miss['hidden'], miss['as'],
                                                            strict=True)) or 'nothing'
        said = ', '.join(f'{e} {p:.2f}' for e, p in miss['claims']) or 'nothing'
        lines.append(f'missed: {miss["case"]} {miss["stratum"]} {miss["motion"]}'
                     f'{" refitted" if miss["refitted"] else ""}: held {held}; said {said}')
    lines += [f'failed: {f["case"]}: {f["failure"]}' for f in summary['failures']]
    return '\n'.join(lines)
