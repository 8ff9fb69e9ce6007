# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads tables of text: any delimiter, decimal commas, remarks and units around the titles.

What a line is, is told by the lines below it: the body is where most lines have the same number
of cells, all of them numbers, times or nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
import csv
from dataclasses import dataclass
from datetime import date
import itertools
from pathlib import Path
import re
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.tables.table import Channel, Samples, Table
from engb_core.io.tables.units import parse_title, unit_of
from engb_core.io.tables.vocabulary import count_known

__all__ = ['TEXT_SUFFIXES', 'TextTable', 'clock_seconds']

Array = NDArray[np.float64]

TEXT_SUFFIXES = ('.csv', '.txt', '.tsv', '.dat', '.asc', '.log', '.lvm')
_DELIMITERS = (';', '\t', '|', ',', ' ')
_HEAD = 400                 # lines that are looked at to find delimiter, titles and units
_REMARKS = 50               # of these, titles stand in
_HEAD_BYTES = 1 << 20       # bytes that tell the encoding
# What is no UTF-8 is written in one of these; the first unless words are known in another.
_ENCODINGS = ('cp1252', 'cp1250', 'cp1251', 'cp932', 'gb18030', 'cp949', 'big5')
_TITLE_BYTES = 1 << 14      # bytes in which titles stand, to tell which of them
_LONGEST_LINE = 1 << 20
_CHUNK = 1 << 16            # rows that are turned into numbers at once

# Digits in groups beside a decimal point: 1,234.56.
_GROUPED = re.compile(r'^\s*[+-]?\d{1,3}(?:,\d{3})+\.\d*\s*$')
_COMMA = re.compile(r'^\s*[+-]?(?:\d{1,3}(?:\.\d{3})+|\d*),\d+(?:[eE][+-]?\d+)?\s*$')
_CLOCK = re.compile(
    r'^\s*(?:(?P<y>\d{4})[-/](?P<m>\d\d?)[-/](?P<d>\d\d?)[T ]+'
    r'|(?P<d2>\d\d?)\.(?P<m2>\d\d?)\.(?P<y2>\d{4})[T ]+'
    r'|(?P<m3>\d\d?)/(?P<d3>\d\d?)/(?P<y3>\d{4})[T ]+)?'
    r'(?P<h>\d{1,2}):(?P<min>\d\d):(?P<s>\d\d(?:[.,:]\d+)?)\s*(?:Z|UTC|[+-]\d\d:?\d\d)?\s*$')
# A number with its label before it: `pos:12.3` and `t_ms = 4`, and a line below Markdown's titles.
_LABELLED = re.compile(r'^\s*([^\W\d][^:=]*?)\s*[:=]\s*([^\s:=][^:=]*)$')
_RULE = re.compile(r'^\s*:?-+:?\s*$')
# What labels a row of units in front of them, as the rows of titles and intervals are above it.
_INTERVAL_LABEL = re.compile(r'^(?:sampling )?interval$', re.IGNORECASE)
_UNITS_LABEL = re.compile(r'^(?:units?|einheit(?:en)?)\s*:?$', re.IGNORECASE)


@dataclass(frozen=True)
class _Cells:
    """How a line falls into cells: what stands between them, whether bars stand at its ends too,
    and whether each number has its label before it."""

    delimiter: str
    barred: bool = False
    labelled: bool = False


@dataclass(frozen=True)
class _Layout:
    encoding: str
    cells: _Cells
    comma: bool             # whether numbers have a decimal comma
    first: int              # the first row with numbers, counted without empty lines
    titles: list[str]
    units: list[str]
    clocks: list[bool]      # whether a column holds times of day
    width: int


class TextTable(Table):
    """A text with one row per sample."""

    kind = 'text'

    def __init__(self, path: Path) -> None:
        try:
            self._layout = _layout(path)
        except csv.Error as error:
            raise InputError(f'{path}: not a table ({error})') from error
        layout = self._layout
        titles = layout.titles or [''] * layout.width
        super().__init__(path, (
            Channel(title, 's' if clock else unit or parse_title(title)[1])
            for title, unit, clock in itertools.zip_longest(
                titles, layout.units[:len(titles)], layout.clocks[:len(titles)], fillvalue='')))

    def read(self, channels: Iterable[int]) -> dict[int, Samples]:
        """Return columns; a cell without a number is not finite."""
        places = list(channels)
        parts: dict[int, list[Array]] = {place: [] for place in places}
        found = dict.fromkeys(places, 0)
        # Cells of text are counted, not kept: a damaged file may hold nothing else.
        strange = dict.fromkeys(places, 0)
        example: dict[int, str] = {}
        total = 0
        days: dict[int, int] = {}
        try:
            for rows in _chunks(self._rows()):
                total += len(rows)
                for place in places:
                    column = [row[place] if place < len(row) else '' for row in rows]
                    values = _numbers(column, self._layout.comma, days, place)
                    good = np.isfinite(values)
                    found[place] += int(good.sum())
                    bad = [text.strip() for text, fine in zip(column, good, strict=True)
                           if not fine and text.strip()
                           and text.strip().casefold() not in ('nan', 'inf', '-inf')]
                    if bad:
                        example.setdefault(place, bad[0])
                    strange[place] += len(bad)
                    parts[place].append(values)
        except csv.Error as error:
            raise InputError(f'{self.path}: not a table ({error})') from error
        if not total:
            raise InputError(f'{self.path}: holds no row of numbers; a table has one per sample, '
                             'below its titles: export it again with its samples')
        for place in places:
            if found[place] > strange[place]:
                continue
            name = self.channels[place].name or str(place)
            text = example.get(place)
            what = ('no numbers at all' if text is None
                    else f'numbers in {found[place]} rows and text, such as {text!r}, in '
                    f'{strange[place]}' if found[place] else f'no numbers but {text!r}')
            raise InputError(f'{self.path}: column {name} holds {what}; name another one with '
                             '--column, or correct the table')
        return {place: Samples(np.concatenate(values)) for place, values in parts.items()}

    def _rows(self) -> Iterator[list[str]]:
        layout = self._layout
        with self.path.open(encoding=layout.encoding, errors='replace', newline='') as file:
            rows = _split(_filled(_lines(self.path, file)), layout.cells)
            for row in itertools.islice(rows, layout.first, None):
                if row and not row[0].lstrip().startswith('#'):
                    yield row


def clock_seconds(text: str, days: dict[int, int] | None = None, place: int = 0) -> float | None:
    """Return a time of day, with or without its date, in seconds [s], or None if it is none.

    `days` remembers the first date of each column, from which the seconds count: so they keep
    their fine digits.
    """
    match = _CLOCK.match(text)
    if match is None:
        return None
    group = match.groupdict()
    whole = 0
    for end in ('', '2', '3'):
        if group[f'y{end}']:
            try:
                whole = date(int(group[f'y{end}']), int(group[f'm{end}']),
                             int(group[f'd{end}'])).toordinal()
            except ValueError:
                return None
    first = whole if days is None else days.setdefault(place, whole)
    seconds = float(group['s'].replace(',', '.').replace(':', '.'))
    minutes = 60 * int(group['h']) + int(group['min'])
    return 86400.0 * (whole - first) + 60.0 * minutes + seconds


def _layout(path: Path) -> _Layout:
    encoding = _encoding(path)
    with path.open(encoding=encoding, errors='replace', newline='') as file:
        head = list(itertools.islice(_filled(_lines(path, file)), _HEAD))
    labels, best, most, chosen = [], _as_rows(head, _Cells(',')), (-1, 0), _Cells(',')
    for delimiter in _DELIMITERS:
        cells, titles = _cells(head, delimiter)
        try:
            rows = _as_rows(head, cells)
        except csv.Error:
            continue
        width = _width(rows)
        # Text that a wrong delimiter leaves between numbers counts against it.
        body = 0 if width < 2 else sum(
            width + 4 * sum(map(_is_number, row)) - 2 * sum(bool(cell.strip()) for cell in row)
            for row in rows if len(row) == width and _is_body(row))
        score = (body, width)
        if score > most:
            labels, best, most, chosen = titles, rows, score, cells
    width = _width(best)
    blanks = chosen.delimiter == ' '
    comma = not blanks and any(_COMMA.match(cell) for row in best for cell in row)
    comma = comma or blanks and sum(
        bool(_COMMA.match(cell)) for row in best[-50:] for cell in row) > 0
    first = _first(best, width)
    titles, units = (labels, []) if labels else _titles(best[:first], width)
    clocks = [clock_seconds(cell) is not None for cell in best[first]] if first < len(best) else []
    return _Layout(encoding, chosen, comma, first, titles, units, clocks,
                   max(width, len(titles)))


def _first(rows: list[list[str]], width: int) -> int:
    """Return the number of the first row of samples; as many as there are if there is none.

    A remark such as `Rate,1000` looks like one as well, but titles or units come below it.
    """
    titles = [number for number, row in enumerate(rows[:_REMARKS])
              if len(row) == width and width > 1 and all(cell.strip() for cell in row)
              and not any(map(_is_number, row))]
    below = titles[-1] + 1 if titles else 0
    return next((number for number, row in enumerate(rows)
                 if number >= below and _is_body(row) and any(cell.strip() for cell in row)
                 and len(row) in (width, width - 1) and not row[0].lstrip().startswith('#')),
                len(rows))


def _encoding(path: Path) -> str:
    with path.open('rb') as file:
        head = file.read(_HEAD_BYTES)
    if head.startswith((b'\xff\xfe', b'\xfe\xff')):
        return 'utf-16'
    if b'\0' in head:
        raise InputError(f'{path}: not a text file; give a .csv in UTF-8')
    try:
        head.decode('utf-8')
    except UnicodeDecodeError as error:
        # A character may be cut in two at the end of what was read.
        if error.start < len(head) - 4:
            titles = head[:_TITLE_BYTES]
            return max(_ENCODINGS, key=lambda name: count_known(titles.decode(name, 'replace')))
    return 'utf-8-sig'


def _lines(path: Path, file: TextIO) -> Iterator[str]:
    """Yield a text's lines; the cells of one that never ends would take hours."""
    while line := file.readline(_LONGEST_LINE + 1):
        if len(line) > _LONGEST_LINE:
            raise InputError(f'{path}: has a line of more than {_LONGEST_LINE >> 20} MiB; a table '
                             'has one row per sample')
        yield line


def _filled(lines: Iterable[str]) -> Iterator[str]:
    return (line for line in lines if line.strip())


def _cells(head: list[str], delimiter: str) -> tuple[_Cells, list[str]]:
    """Say how lines fall into cells, and return the labels before the numbers, if there are."""
    barred = delimiter == '|' and all(
        line.strip().startswith('|') and line.strip().endswith('|') for line in head)
    cells = _Cells(delimiter, barred)
    last = head[-_REMARKS:]
    try:
        rows = _as_rows(last, cells)
    except csv.Error:
        return cells, []
    labels = {tuple(match[1] if (match := _LABELLED.match(cell)) and _is_number(match[2]) else ''
                    for cell in row) for row in rows}
    if len(labels) != 1 or len(titles := labels.pop()) < 2 or not all(titles):
        return cells, []
    return _Cells(delimiter, barred, labelled=True), list(titles)


def _as_rows(head: list[str], cells: _Cells) -> list[list[str]]:
    return [row for line in head for row in _split([line], cells)]


def _split(lines: Iterable[str], cells: _Cells) -> Iterator[list[str]]:
    if cells.barred:
        lines = (line.strip().strip('|') for line in lines)
    rows: Iterable[list[str]] = (
        (line.split() for line in lines) if cells.delimiter == ' '
        else csv.reader(lines, delimiter=cells.delimiter, skipinitialspace=True))
    for row in rows:
        yield [_unlabelled(cell) for cell in row] if cells.labelled else row


def _unlabelled(cell: str) -> str:
    match = _LABELLED.match(cell)
    return match[2] if match else cell


def _width(rows: list[list[str]]) -> int:
    """Return how many cells the rows of the body have: those most rows with numbers have."""
    counts = Counter(len(row) for row in rows if _is_body(row))
    return counts.most_common(1)[0][0] if counts else max(map(len, rows), default=0)


def _is_body(row: list[str]) -> bool:
    """Whether a row may be one of samples: a number or time in it, and other text only beside."""
    numbers = sum(_is_number(cell) for cell in row)
    texts = sum(bool(cell.strip()) for cell in row) - numbers
    return numbers > 0 and texts <= numbers


def _is_number(text: str) -> bool:
    if _COMMA.match(text) or _GROUPED.match(text) or clock_seconds(text) is not None:
        return True
    try:
        float(text)
    except ValueError:
        return False
    return True


def _titles(above: list[list[str]], width: int) -> tuple[list[str], list[str]]:
    """Return the titles, and the units where a row of them stands below."""
    rows: list[list[str]] = []
    for row in reversed(above):
        cells = [cell.strip() for cell in row]
        if cells and cells[0] == '#':
            cells = cells[1:]
        elif cells:
            cells[0] = cells[0].lstrip('#%').strip()
        if len(cells) == width + 1 and not cells[-1]:
            cells = cells[:-1]
        if len(cells) != width:
            if not rows and row[0].lstrip().startswith('#'):
                continue        # a remark between the titles and the numbers
            break
        if not all(map(_RULE.match, cells)):
            rows.insert(0, cells)
    if not rows:
        last = [cell.strip().lstrip('#').strip() for cell in above[-1]] if above else []
        return (last, []) if len(last) > 1 else ([], [])
    units: list[str] = []
    if len(rows) > 1:
        rows = _without_labels(rows, above)
    if len(rows) > 1 and _are_units(rows[-1]):
        units = [re.sub(r'^[\[(<]|[\])>]$', '', cell).strip() for cell in rows[-1]]
        rows = rows[:-1]
    return rows[-1], units


def _without_labels(rows: list[list[str]], above: list[list[str]]) -> list[list[str]]:
    """Return the rows of titles, the last one that of their units if there is one, without cells
    that say in front of a row what stands in it: below these is what the channel behind them is
    written over, time where an interval is told among the rows `above` the numbers."""
    labels = {place for place, cell in enumerate(rows[-1]) if _UNITS_LABEL.match(cell)}
    if not labels:
        return rows
    over_time = {place for row in above for place, cell in enumerate(row)
                 if place in labels and _INTERVAL_LABEL.match(cell.strip())}
    return [[known if place in over_time else '' if place in labels else cell
             for place, cell in enumerate(row)]
            for row, known in zip(rows[-2:], ('time', 's'), strict=True)]


def _are_units(row: list[str]) -> bool:
    cells = [re.sub(r'^[\[(<]|[\])>]$', '', cell).strip() for cell in row]
    filled = [cell for cell in cells if cell]
    return bool(filled) and 2 * sum(unit_of(cell) is not None for cell in filled) > len(filled)


def _chunks(rows: Iterator[list[str]]) -> Iterator[list[list[str]]]:
    while chunk := list(itertools.islice(rows, _CHUNK)):
        yield chunk


def _numbers(column: list[str], comma: bool, days: dict[int, int], place: int) -> Array:
    """Return a column's cells as numbers (n,), not finite where there is none."""
    plain = [_with_point(text) for text in column] if comma else column
    try:
        return np.array(plain, float)
    except ValueError:
        pass
    values = np.full(len(column), np.nan)
    for index, text in enumerate(plain):
        if _GROUPED.match(text):
            text = text.replace(',', '')
        try:
            values[index] = float(text)
        except ValueError:
            seconds = clock_seconds(column[index], days, place) if ':' in text else None
            if seconds is not None:
                values[index] = seconds
    return values


def _with_point(text: str) -> str:
    if ',' in text and '.' in text:
        text = text.replace('.', '')
    return text.replace(',', '.')
