# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Diagnose many recordings and compare the units: one page, tables, and a report for each.

Writes into DIR: survey.html (start here), survey.csv (a row per recording), effects.csv (a row
per number), both as .parquet too where pyarrow is installed, reports/ and results/. Started again
with the same DIR it goes on where it stopped; one bad bag never stops the rest.

examples:
  engb survey recordings --model nominal.yaml --out fleet
  engb survey recordings --model nominal.yaml --out fleet --units units.csv --jobs 8
  engb survey recordings --model nominal.yaml --out fleet --scheduler tcp://10.0.0.5:8786

All recordings below the folders count, each once. A recording's unit is the folder it lies in
(DIR/wheel_1/run_a is of wheel_1), and for a bag of several brakes also the namespace; or give
--units, a table with columns recording (its path below the folder, its name, or a pattern such as
wheel_3/*), unit, mileage [km]. With --scheduler the work is done by an existing Dask cluster,
which has to have this package, and the recordings under the same paths.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import os
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.io.outputs import claimed_folder
from engb_core.text.printable import printable
from engb_ros.commands.common import (
    add_model,
    add_progress,
    Progress,
    read_model,
    tell_what_is_missing,
)

if TYPE_CHECKING:
    from engb_core.fleet.rows import Entry
    from engb_ros.fleet.find import Found
    from engb_ros.fleet.store import Store
    tell_what_is_missing()

__all__ = ['add_arguments', 'run']

_BACKENDS = {'zoom': 'plotly', 'still': 'matplotlib', 'table': 'table', 'none': None}
OUTPUTS = ('survey.html', 'survey.csv', 'effects.csv', 'survey.parquet', 'effects.parquet')
_MANY = 100     # a report that zooms takes 5 MB, still pictures 0.3 MB


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('folders', nargs='+', metavar='DIR', help='folders with recordings')
    add_model(parser)
    parser.add_argument('--out', required=True, metavar='DIR', help='where the results go')
    parser.add_argument('--units', metavar='TABLE.csv',
                        help='which recording is of which unit, at which mileage')
    parser.add_argument('--jobs', type=int, metavar='N', help='processes on this machine '
                        '(default: one per processor)')
    parser.add_argument('--scheduler', metavar='tcp://HOST:PORT', help='a Dask cluster to work on')
    parser.add_argument('--timeout', type=float, default=900.0, metavar='SECONDS',
                        help='give up a recording after that long, on this machine '
                        '(default: %(default)s)')
    parser.add_argument('--reports', choices=list(_BACKENDS), help='figures of the recordings\' '
                        f'reports (default: zoom, 5 MB each, up to {_MANY} recordings; still, '
                        '0.3 MB each, beyond)')
    parser.add_argument('--fresh', action='store_true', help='do everything again')
    add_progress(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the command; status 2 where not one recording could be diagnosed."""
    from engb_ros.fleet.find import find_recordings, LeftOut, read_units
    from engb_ros.fleet.store import Store
    if arguments.jobs is not None and arguments.jobs < 1:
        raise InputError(f'--jobs {arguments.jobs}: must be at least 1')
    if not arguments.timeout > 0:
        raise InputError(f'--timeout {arguments.timeout}: must be above 0 s')
    model = read_model(arguments.model).to_mapping()
    left = LeftOut()
    recordings = find_recordings(arguments.folders, left)
    if arguments.units:
        units = os.path.realpath(arguments.units)
        left.tables[:] = [name for name in left.tables if os.path.realpath(name) != units]
    if arguments.units:
        recordings = read_units(arguments.units, recordings)
    figures = arguments.reports or ('zoom' if len(recordings) <= _MANY else 'still')
    inputs = [arguments.model, *([arguments.units] if arguments.units else []),
              *(recording.path for recording in recordings)]
    with Progress(arguments) as progress, claimed_folder(
            arguments.out, OUTPUTS, inputs) as folder:
        store = Store(folder, model, _version() + figures)
        done: dict[str, list[dict[str, Any]]] = {}
        if not arguments.fresh:
            done = {recording.key: results for recording in recordings
                    if (results := store.load(recording)) is not None}
        todo = [recording for recording in recordings if recording.key not in done]
        resumed = len(done)
        for recording, results in _diagnosed(todo, model, figures, store, arguments):
            done[recording.key] = results
            progress(f'{len(done)} of {len(recordings)}: {recording.key}: {_told(results)}')
        entries = _entries(recordings, done)
        progress('writing the survey')
        _write(store.folder, entries)
    print(_summary(entries, resumed))
    for text in left.told():
        print(printable(f'note: {text}'))
    print(printable(f'survey: {Path(arguments.out) / "survey.html"}'))
    if not any(entry.good for entry in entries):
        print(printable(f'engb: none of the {len(entries)} recordings could be diagnosed, the '
                        f'first because: {entries[0].result["message"]}'), file=sys.stderr)
        return 2
    return 0


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version
    try:
        return version('engb_ros')
    except PackageNotFoundError:
        return 'source'


def _diagnosed(
    todo: list[Found], model: dict[str, Any], figures: str, store: Store,
    arguments: argparse.Namespace,
) -> Iterator[tuple[Found, list[dict[str, Any]]]]:
    """Diagnose what is still to do; yield each recording with its results, already kept."""
    from engb_ros.fleet.task import diagnose_task, failed
    if not todo:
        return
    tasks = [{'path': os.path.abspath(recording.path), 'model': model,
              'figures': _BACKENDS[figures]} for recording in todo]
    if arguments.scheduler:
        from engb_ros.fleet.dask_cluster import run_on_dask
        outcomes = run_on_dask(tasks, diagnose_task, arguments.scheduler)
    else:
        from engb_ros.fleet.processes import run_processes
        outcomes = run_processes(tasks, diagnose_task, arguments.jobs or os.cpu_count() or 1,
                                 arguments.timeout)
    for index, outcome in outcomes:
        results = [failed('lost', outcome)] if isinstance(outcome, str) else outcome
        yield todo[index], store.save(todo[index], results)


def _told(results: list[dict[str, Any]]) -> str:
    return '; '.join(result['document']['verdict'] if result['status'] == 'ok'
                     else f'{result["status"]}: {result["message"]}' for result in results)


def _entries(recordings: list[Found], done: dict[str, list[dict[str, Any]]]) -> list[Entry]:
    from engb_core.fleet.rows import Entry
    found = []
    for recording in recordings:
        for result in done[recording.key]:
            space = result.get('namespace')
            found.append(Entry(recording.key, recording.unit + (space or ''), recording.mileage,
                               result))
    return found


def _write(folder: Path, entries: list[Entry]) -> None:
    from engb_core.fleet.rows import effect_rows, recording_rows
    from engb_core.fleet.survey_page import survey_page
    from engb_ros.fleet.row_files import write_table
    write_table(folder / 'survey', recording_rows(entries))
    write_table(folder / 'effects', effect_rows(entries))
    survey_page(entries).write(folder / 'survey.html')


def _summary(entries: list[Entry], resumed: int) -> str:
    from collections import Counter

    from engb_core.fleet.common_causes import causes_of
    good = [entry for entry in entries if entry.good]
    units = {entry.unit for entry in good}
    lines = [f'{len(entries)} recordings, {len(good)} diagnosed, {len(units)} units'
             + (f'; {resumed} were done before' if resumed else '')]
    for cause in causes_of(entries):
        if cause.on:
            kind = 'common cause' if cause.common else 'on ' + ', '.join(cause.on[:4])
            lines.append(f'   {cause.effect}: {len(cause.on)} of {len(units)} units ({kind})')
        else:
            count = sum(cause.effect in entry.claimed for entry in good)
            lines.append(f'   {cause.effect}: {count} of {len(good)} recordings (of no unit in '
                         'half of its own)')
    reasons = Counter(entry.result['status'] for entry in entries if not entry.good)
    for status, count in reasons.items():
        lines.append(f'   {count} {status}: see survey.csv')
    return '\n'.join(map(printable, lines))
