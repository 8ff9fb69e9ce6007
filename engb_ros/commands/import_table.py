"""Turn a table of someone else's bench into a recording that the other commands read.

TABLE is a .csv (any delimiter; .txt and .tsv too), a .npz or a .mat file. Each --column says
which of its columns is what: NAME=COLUMN, where COLUMN is a column's title or its number, counted
from 0; in .npz and .mat an array's name, or NAME.2 / NAME[:,2] for a column of a matrix.

  time      [s]; or leave it out and give --rate
  position  [rad]           effort    [N·m]        velocity  [rad/s], if it was measured
  reference, reference_velocity, reference_effort: what the controller tracked
  anything else ('disc_speed', 'pad_temperature', …) becomes a topic of that name

examples:
  engb import bench.csv --out run1 --column time=t --column position=angle --column effort=torque
  engb import bench.csv --out run1 --column time=0 --column position=1 --column effort=2
  engb import log.mat --out run1 --rate 1000 --column position=q --column effort=i \\
      --scale position=0.0174533 --scale effort=0.0174

--scale NAME=FACTOR multiplies a column: 0.0174533 makes rad of degrees, the torque constant makes
N·m of ampere, 0.001 s of ms. A velocity that isn't given is left out, not invented.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_ros.outputs import recording_output

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ['add_arguments', 'run']

_NEEDED = ('position', 'effort')
_JOINT = ('time', 'position', 'velocity', 'effort')
_REFERENCE = {'reference': 'position', 'reference_position': 'position',
              'reference_velocity': 'velocity', 'reference_effort': 'effort'}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('table', metavar='TABLE', help='a .csv, .npz or .mat file')
    parser.add_argument('--out', required=True, metavar='RECORDING', help='the bag folder to be '
                        'made, or a name ending in .mcap for a single file')
    parser.add_argument('--column', action='append', default=[], metavar='NAME=COLUMN',
                        help='which column is what (repeat)')
    parser.add_argument('--scale', action='append', default=[], metavar='NAME=FACTOR',
                        help='multiply a column to get SI units (repeat)')
    parser.add_argument('--offset', action='append', default=[], metavar='NAME=VALUE',
                        help='add to a column, after scaling, in SI units (repeat)')
    parser.add_argument('--rate', type=float, metavar='HZ',
                        help='samples per second, where the table has no time')
    parser.add_argument('--joint', default='motor', help='the joint\'s name (default: motor)')
    parser.add_argument('--namespace', default='/engb', metavar='/NAME',
                        help='of the topics (default: /engb)')
    parser.add_argument('--force', action='store_true', help='replace a recording that is there')


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    columns = _pairs(arguments.column, '--column')
    scale = {name: _number(value, f'--scale {name}')
             for name, value in _pairs(arguments.scale, '--scale').items()}
    offset = {name: _number(value, f'--offset {name}')
              for name, value in _pairs(arguments.offset, '--offset').items()}
    _check(arguments, columns, {**scale, **offset})
    from engb_ros.bags.tables import read_table
    with recording_output(arguments.out, arguments.force, [arguments.table],
                          f'--out {arguments.out}') as made:
        values = read_table(arguments.table, columns)
        for name in values:
            values[name] = values[name] * scale.get(name, 1.0) + offset.get(name, 0.0)
        time = _time(values, arguments)
        from engb_core.recording import Recording
        recording = Recording.from_samples(arguments.table, time, values['position'],
                                           values['effort'], values.get('velocity'))
        _write(made, arguments, time, values)
    print(f'{arguments.out}: {recording.time.size} samples, {recording.duration:.2f} s at '
          f'{1 / recording.interval:.6g} Hz, joint {arguments.joint}'
          + ('' if recording.velocity is not None else ', no velocity'))
    for note in recording.notes:
        print(f'note: {note}')


def _check(arguments: argparse.Namespace, columns: dict[str, str], changed: dict) -> None:
    missing = [name for name in _NEEDED if name not in columns]
    if missing:
        raise InputError(f'--column {missing[0]}=… is missing; say which column is what')
    if 'time' not in columns and arguments.rate is None:
        raise InputError('--column time=… is missing; give it, or the sampling rate with --rate')
    if arguments.rate is not None and not 0 < arguments.rate < math.inf:
        raise InputError(f'--rate {arguments.rate}: must be above 0 Hz')
    if 'time' in columns and arguments.rate is not None:
        raise InputError('--rate and --column time=… exclude each other')
    for name in changed:
        if name not in columns:
            raise InputError(f'--scale or --offset {name}: no --column of that name')
    if not arguments.joint:
        raise InputError('--joint must not be empty')
    for name in columns:
        if not name.replace('_', 'a').replace('/', 'a').isalnum() or name.startswith('/'):
            raise InputError(f'--column {name}=…: not a topic name; letters, digits and _ only')


def _time(values: dict[str, NDArray[np.float64]], arguments: argparse.Namespace,
          ) -> NDArray[np.float64]:
    import numpy as np
    size = values['position'].size
    if 'time' not in values:
        return np.arange(size) / arguments.rate
    time = values.pop('time')
    good = np.isfinite(time)
    if good.sum() < 2:
        raise InputError(f'{arguments.table}: the column for time holds no numbers')
    if np.ptp(time[good]) == 0:
        raise InputError(f'{arguments.table}: time never changes; choose another column for '
                         'time, or give --rate')
    for name in values:
        values[name] = values[name][good]
    return time[good]


def _write(made: Path, arguments: argparse.Namespace, time: NDArray[np.float64],
           values: dict[str, NDArray[np.float64]]) -> None:
    from engb_ros.bags.write import FloatTable, JointTable, write_bag
    space = '/' + arguments.namespace.strip('/')
    prefix = '' if space == '/' else space
    topics: dict[str, JointTable | FloatTable] = {
        f'{prefix}/joint_states': JointTable(
            time, values['position'], values.get('velocity'), values['effort'], arguments.joint)}
    tracked = {_REFERENCE[name]: column for name, column in values.items() if name in _REFERENCE}
    if 'position' in tracked:
        topics[f'{prefix}/reference'] = JointTable(
            time, tracked['position'], tracked.get('velocity'), tracked.get('effort'),
            arguments.joint)
    elif tracked:
        raise InputError('--column reference=… is missing beside its velocity or effort')
    for name, column in values.items():
        if name not in _JOINT and name not in _REFERENCE:
            topics[f'{prefix}/{name}'] = FloatTable(time, column)
    write_bag(made, topics)


def _pairs(entries: list[str], option: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for entry in entries:
        name, equals, value = entry.partition('=')
        name, value = name.strip(), value.strip()
        if not (equals and name and value):
            example = 'angle' if option == '--column' else '0.0174533'
            raise InputError(f'{option} {entry}: write NAME=VALUE, such as position={example}')
        if name in found:
            raise InputError(f'{option} {name}=…: given twice')
        found[name] = value
    return found


def _number(text: str, option: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f'{option}={text}: must be a finite number')
    return value
