# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Turn a table of someone else's bench into a recording that the other commands read.

TABLE is a .csv (any delimiter, decimal comma, remarks above the titles), .json (records, columns,
or a record a line), .npz, .mat, .h5, ASAM MDF (.mf4, .mdf), .tdms, .parquet, .arrow or a ROS 1
.bag. Titles such as `phi [deg]`, `I (A)`, `n/min` tell column and unit; what they don't tell is
asked, or said with

  --column NAME=COLUMN   the column's title or its number from 0; M.2 for a column of a matrix
  --unit NAME=UNIT       deg, rev, 4096/rev, rpm, mN·m, A, ms, …

  time      or leave it out and give --rate
  position  effort (a torque, or a current and --torque-constant)  velocity, if it was measured
  reference, reference_velocity, reference_effort: what the controller tracked
  anything else ('disc_speed', 'pad_temperature', …) becomes a topic of that name

examples:
  engb import --list log.mf4
  engb import bench.csv --out run1
  engb import bench.csv --out run1 --column time=t --column position=angle --column effort=torque
  engb import bench.csv --out run1 --unit position=deg effort=A --torque-constant 0.0174
  engb import log.mat --out run1 --rate 1000 --column position=q --column effort=i \\
      --scale position=0.0174533 --scale effort=0.0174

A column that is named without a unit, and has none in its title, is taken to be in SI units.
--scale NAME=FACTOR multiplies it. A velocity that isn't given is left out, not invented.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.io.outputs import recording_output
from engb_core.text.printable import printable
from engb_ros.commands.common import add_progress, Progress
from engb_ros.commands.table_options import add_table_options, request_of

if TYPE_CHECKING:
    from engb_core.io.tables.measure import Measured
    from engb_core.io.tables.request import Request

__all__ = ['add_arguments', 'run', 'write_recording']

_REFERENCES = ('reference', 'reference_velocity', 'reference_effort')
# Seconds of a stamp are signed and have 32 bits.
_LATEST = 2.0 ** 31
_JOINT = ('time', 'position', 'velocity', 'effort', *_REFERENCES)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('table', metavar='TABLE', help='the file; --help lists the formats')
    parser.add_argument('--out', metavar='RECORDING', help='the bag folder to be '
                        'made, or a name ending in .mcap for a single file')
    parser.add_argument('--list', action='store_true', help='only show what the file holds, and '
                        'what would be taken for what')
    add_table_options(parser, several=False)
    parser.add_argument('--joint', default='motor', help='the joint\'s name (default: motor)')
    parser.add_argument('--namespace', default='/engb', metavar='/NAME',
                        help='of the topics (default: /engb)')
    parser.add_argument('--force', action='store_true', help='replace a recording that is there')
    add_progress(parser)


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    if arguments.list:
        print(_listing(arguments.table))
        return
    if not arguments.out:
        raise InputError('--out is missing: name the recording to be made (or give --list)')
    request = request_of(arguments, plain_is_si=True)
    _check(arguments, request)
    from engb_core.io.tables.measure import measured_of
    with Progress(arguments) as progress, recording_output(
            arguments.out, arguments.force, [arguments.table], f'--out {arguments.out}') as made:
        progress(f'reading {arguments.table}{_size(arguments.table)}')
        measured, _ = measured_of(arguments.table, request)
        recording = measured.recording(arguments.joint)
        progress(f'writing {recording.time.size} samples to {arguments.out}')
        write_recording(made, measured, arguments.joint, arguments.namespace)
    for text in measured.told:
        print(text)
    print(f'{printable(arguments.out)}: {recording.time.size} samples, '
          f'{recording.duration:.2f} s at {1 / recording.interval:.6g} Hz, '
          f'joint {printable(arguments.joint)}'
          + ('' if recording.velocity is not None else ', no velocity'))
    for note in recording.notes:
        print(printable(f'note: {note}'))


def _listing(path: str) -> str:
    from engb_core.io.tables.open import open_table
    from engb_core.io.tables.roles import roles_of
    table = open_table(path)
    roles = roles_of(table, {})
    taken = {place: role for role, place in roles.chosen.items()}
    taken |= {place: f'{role}?' for role, places in roles.unclear.items() for place in places}
    rows = [('no.', 'name', 'unit', 'samples', 'taken for')]
    for place, channel in enumerate(table.channels):
        rows.append((str(place), printable(channel.name) or '(no title)',
                     printable(channel.unit) or '–',
                     '–' if channel.size is None else str(channel.size), taken.get(place, '')))
    widths = [max(len(row[column]) for row in rows) for column in range(5)]
    return f'{printable(path)}: {table.kind}, {len(table.channels)} columns\n' + '\n'.join(
        '  '.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows)


def _size(path: str) -> str:
    """Return a file's size in words, where there is one: how long reading takes goes with it."""
    try:
        return f' ({os.path.getsize(path) / 1e6:.0f} MB)'
    except OSError:
        return ''


def _check(arguments: argparse.Namespace, request: Request) -> None:
    for name in (*request.scale, *request.offset):
        if name not in request.columns:
            raise InputError(f'--scale or --offset {name}: no --column of that name')
    if not arguments.joint:
        raise InputError('--joint must not be empty')
    for name in request.columns:
        if not name.replace('_', 'a').replace('/', 'a').isalnum() or name.startswith('/'):
            raise InputError(f'--column {name}=…: not a topic name; letters, digits and _ only')
    if set(request.columns) & set(_REFERENCES[1:]) and 'reference' not in request.columns:
        raise InputError('--column reference=… is missing beside its velocity or effort')


def write_recording(path: Path, measured: Measured, joint: str = 'motor',
                    namespace: str = '/engb') -> None:
    """Write a table as a rosbag2 recording.

    Raises:
        InputError: the path exists, or can't be written.
    """
    import numpy as np

    from engb_core.io.bags.write import FloatTable, JointTable, write_bag
    good = np.isfinite(measured.time)
    time = measured.time[good]
    if time.size and time.min() < 0.0:
        # Times count from a trigger, which a stamp cannot: it counts from 1970 on.
        time = time - time.min()
    if time.size and time.max() >= _LATEST:
        raise InputError(f'time reaches {time.max():.3g} s: a stamp holds {_LATEST:.3g} s at '
                         'most; check the unit of time')
    values = {name: column[good] for name, column in measured.columns.items()}
    space = '/' + namespace.strip('/')
    prefix = '' if space == '/' else space
    topics: dict[str, JointTable | FloatTable] = {
        f'{prefix}/joint_states': JointTable(
            time, values['position'], values.get('velocity'), values.get('effort'), joint)}
    if 'reference' in values:
        topics[f'{prefix}/reference'] = JointTable(
            time, values['reference'], values.get('reference_velocity'),
            values.get('reference_effort'), joint)
    for name, column in values.items():
        if name not in _JOINT:
            topics[f'{prefix}/{name}'] = FloatTable(time, column)
    write_bag(path, topics)
