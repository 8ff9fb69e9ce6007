# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A table made into a recording: columns chosen, units turned into SI, one clock for all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import os
from pathlib import Path
import re
import shlex

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.tables.open import open_table
from engb_core.io.tables.request import Question, Request, settled
from engb_core.io.tables.roles import is_current, QUANTITIES, Roles, roles_of
from engb_core.io.tables.table import Channel, Table
from engb_core.io.tables.units import named, Unit, unit_of, units_of
from engb_core.recording import Recording, Reference, refuse_new_start, Signal
from engb_core.repeated_stamps import one_stamp_each
from engb_core.text.printable import printable

__all__ = ['Measured', 'measured_of']

Array = NDArray[np.float64]

_REFERENCES = ('reference', 'reference_velocity', 'reference_effort')
_JOINT = ('time', 'position', 'velocity', 'effort', *_REFERENCES)
# What a recording is of; all else is optional.
_MEASURED = ('position', 'effort')
_MEANING = {'position': 'the angle or travel of the axis',
            'effort': 'the motor\'s torque or current'}
_SI = Unit('given', 1.0)
# Sampling intervals of benches [s], and how long a motion lasts at least [s]: what tells a time
# without unit.
_INTERVALS, _SHORTEST = (4e-6, 0.06), 1.0
_STEPS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}


@dataclass(frozen=True)
class Measured:
    """A table in SI units on one clock: `time` (n,) [s], `columns` role or topic → (n,).

    `joint_type` is 'prismatic' where position is a length; `told` says in a sentence each which
    column was taken for what; `notes` say what was repaired; `source` is its path.
    """

    name: str
    time: Array
    columns: dict[str, Array]
    joint_type: str
    told: tuple[str, ...]
    notes: tuple[str, ...]
    source: str = ''

    def recording(self, joint: str = 'motor') -> Recording:
        """Return the table as a recording.

        Raises:
            InputError: too few usable samples.
        """
        columns = self.columns
        reference = None
        if 'reference' in columns:
            reference = Reference(self.time, columns['reference'],
                                  columns.get('reference_velocity'),
                                  columns.get('reference_effort'))
        good = np.isfinite(self.time)
        signals = {}
        for name, values in columns.items():
            rows = good & np.isfinite(values)
            if name not in _JOINT and rows.any():
                signals[name] = Signal(self.time[rows], values[rows])
        return Recording.from_samples(
            self.name, self.time, columns['position'], columns.get('effort'),
            columns.get('velocity'), reference, signals, joint, self.notes, self.source)


def measured_of(path: str | os.PathLike[str], request: Request) -> tuple[Measured, Request]:
    """Read a table; returns it and the request with the answers, for the next table.

    Raises:
        InputError: not readable, no column for position or effort, or something that the table
            does not tell and nobody can be asked.
    """
    path = Path(path)
    table = open_table(path)
    roles, request = _columns(table, request)
    units, request = _units(table, roles, request)
    return _on_one_clock(path, table, roles, units, request), request


def _columns(table: Table, request: Request) -> tuple[dict[str, int], Request]:
    given = {role: table.find(column) for role, column in request.columns.items()}
    if request.rate is not None and 'time' in given:
        raise InputError('--rate and --column time=… exclude each other')
    found = roles_of(table, given)
    if request.rate is not None:
        found.chosen.pop('time', None)
    # Without any titles: the usual order, time, position, effort, is only what is proposed.
    untitled = not any(channel.name for channel in table.channels)
    absent = {'effort'} if (request.effort_optional and 'reference' in found.chosen
                            and 'effort' not in found.unclear) else set()
    questions = [_which(table, role, found, place if untitled else 0)
                 for place, role in enumerate(('position', 'effort'), 1)
                 if role not in found.chosen and role not in absent]
    own = any(channel.clocked for channel in table.channels)
    if 'time' not in found.chosen and request.rate is None and not own:
        questions.append(
            Question('which column is time', '--column time=0', ('--column', 'time='))
            if untitled else Question('the rate of the samples [Hz], with no column of time',
                                      '--rate 1000', ('--rate', '')))
    answered = settled(request, questions, table)
    if answered is not request:
        return _columns(table, answered)
    return found.chosen, request


def _which(table: Table, role: str, roles: Roles, usual: int = 0) -> Question:
    if not table.channels:
        raise InputError(f'{table.path}: holds no column')
    places = roles.unclear.get(role) or [
        place for place, channel in enumerate(table.channels)
        if place not in roles.chosen.values() and _may_be(channel, role)][:12]
    if not places:
        raise InputError(
            f'{table.path}: holds no column that could be {role} (there is {table.listing()}); '
            f'{_MEANING[role]} is needed, or, where a title is misleading, --column {role}=… and '
            f'--unit {role}=…')
    titles = [channel.name for channel in table.channels]
    names = [titles[place] if titles[place] and titles.count(titles[place]) == 1 else str(place)
             for place in places]
    proposed = names[usual if usual < len(names) else 0]
    return Question(f'which column is {role} (there is {table.listing()})',
                    f'--column {shlex.quote(f"{role}={proposed}")}', ('--column', f'{role}='),
                    tuple(names))


def _may_be(channel: Channel, role: str) -> bool:
    unit = unit_of(channel.unit) if channel.unit else None
    return unit is None or unit.quantity in QUANTITIES[role]


def _units(table: Table, roles: dict[str, int], request: Request) -> tuple[dict[str, Unit],
                                                                         Request]:
    """Return each role's unit; what is optional and has none is left out."""
    units: dict[str, Unit] = {}
    questions: list[Question] = []
    unit: Unit | None
    for role, place in list(roles.items()):
        channel = table.channels[place]
        if role in request.units:
            unit = named(request.units[role], f'--unit {role}')
        elif role in request.scale or role not in QUANTITIES:
            unit = _SI
        else:
            unit = unit_of(channel.unit) if channel.unit else None
        allowed = QUANTITIES.get(role, ())
        if unit is not None and unit is not _SI and allowed and unit.quantity not in allowed:
            raise InputError(
                f'{table.path}: {role} cannot be a {unit.quantity} (column {channel.name}'
                f'{f" [{channel.unit}]" if channel.unit else ""}); name another column with '
                f'--column {role}=…, or its unit with --unit {role}=…')
        if unit is not None and unit.quantity == 'counts':
            unit = None
        if unit is not None:
            units[role] = unit
        elif role == 'time' and not (request.plain_is_si and role in request.columns):
            time = _time_unit(table, place)
            if time is None:
                questions.append(_unit_question(table, role, place))
            else:
                units[role] = named(time, 'time')
        elif role in request.columns and request.plain_is_si:
            units[role] = _SI
        elif role not in ('position', 'effort') and role not in request.columns:
            del roles[role]
        elif role == 'effort' and not channel.unit and is_current(channel):
            # In which unit drops out: the constant asked for is torque per one of the column.
            units[role] = named('A', 'effort')
        else:
            questions.append(_unit_question(table, role, place))
    if 'position' not in units and 'velocity' in units and 'time' in units:
        unit = _by_velocity(table, roles, units)
        if unit is not None:
            units['position'] = unit
            questions = [entry for entry in questions if entry.words[1] != 'position=']
    if ('effort' in units and units['effort'].quantity == 'current'
            and request.torque_constant is None):
        questions.append(_constant_question(table, roles['effort'], units.get('position')))
    answered = settled(request, questions, table)
    if answered is not request:
        return _units(table, roles, answered)
    if 'effort' not in units:
        return units, request
    if units['position'].quantity == 'length' and units['effort'].quantity == 'torque':
        raise InputError(f'{table.path}: position is a length and effort a torque; give the '
                         'motor\'s angle, or the force (--scale effort=2π/lead)')
    if units['position'].quantity == 'angle' and units['effort'].quantity == 'force':
        raise InputError(f'{table.path}: position is an angle and effort a force; give the '
                         'torque, or the position of what the force moves')
    return units, request


def _constant_question(table: Table, place: int, position: Unit | None) -> Question:
    channel = table.channels[place]
    linear = position is not None and position.quantity == 'length'
    what = 'force constant [N/A]' if linear else 'torque constant [N·m/A]'
    taken = '' if channel.unit else ', taken as ampere'
    return Question(
        f'the {what} of the motor (column {channel.name or place} is a current{taken}; with 1 '
        'all torques are told in ampere)', '--torque-constant 1', ('--torque-constant', ''),
        default='1')


def _unit_question(table: Table, role: str, place: int) -> Question:
    channel = table.channels[place]
    choices = [unit for quantity in QUANTITIES[role] for unit in units_of(quantity)]
    if channel.unit and (unit := unit_of(channel.unit)) and unit.quantity == 'counts':
        return Question(f'how many counts of {role} (column {channel.name}) make one turn',
                        f'--unit {role}=4096/rev', ('--unit', f'{role}='), ('4096/rev',))
    usual = {'position': 'deg', 'effort': 'A', 'time': 's'}.get(role, choices[0])
    return Question(f'the unit of {role} (column {channel.name or place})',
                    f'--unit {role}={usual}', ('--unit', f'{role}='), tuple(choices))


def _time_unit(table: Table, place: int) -> str | None:
    """Return the one unit with which the samples come as benches take them, or None."""
    time = table.read([place])[place].value
    time = time[np.isfinite(time)]
    steps = np.diff(time)
    steps = steps[steps > 0]
    if steps.size < 2:
        return 's'
    step, whole = float(np.median(steps)), float(np.ptp(time))
    fitting = [name for name, factor in _STEPS.items()
               if _INTERVALS[0] <= step * factor <= _INTERVALS[1]
               and whole * factor >= _SHORTEST]
    return fitting[0] if len(fitting) == 1 else None


def _by_velocity(table: Table, roles: dict[str, int], units: dict[str, Unit]) -> Unit | None:
    """Return the unit of position that agrees with the recorded velocity's, if just one does."""
    read = table.read([roles['time'], roles['position'], roles['velocity']])
    time, position, velocity = (read[roles[role]].value
                                for role in ('time', 'position', 'velocity'))
    if not time.size == position.size == velocity.size:
        return None
    good = np.isfinite(time) & np.isfinite(position) & np.isfinite(velocity)
    time, position, velocity = time[good], position[good], velocity[good]
    if time.size < 20 or np.any(np.diff(time) <= 0):
        return None
    integral = np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(
        time * units['time'].factor)) * units['velocity'].factor
    moved = position[1:] - position[0]
    moved, integral = moved - moved.mean(), integral - integral.mean()
    if not np.any(moved) or not np.any(integral):
        return None
    ratio = float(integral @ moved / (moved @ moved))
    if np.corrcoef(moved, integral)[0, 1] < 0.95:
        return None
    names = (('rad', 'deg', 'rev') if units['velocity'].quantity == 'speed' else ('m', 'mm'))
    return next((unit for unit in map(unit_of, names)
                 if unit is not None and abs(ratio / unit.factor - 1.0) < 0.1), None)


def _on_one_clock(path: Path, table: Table, roles: dict[str, int], units: dict[str, Unit],
                  request: Request) -> Measured:
    read = table.read(sorted(set(roles.values()) | set(_clocks(table, roles).values())))
    clocks = _clocks(table, roles)
    told: list[str] = []
    notes: list[str] = []
    series: dict[str, tuple[Array, Array]] = {}
    for role, place in roles.items():
        if role == 'time':
            continue
        values = read[place].value * units[role].factor + units[role].offset
        if role == 'effort' and units[role].quantity == 'current' \
                and request.torque_constant is not None:
            values = values * request.torque_constant
        values = values * request.scale.get(role, 1.0) + request.offset.get(role, 0.0)
        time = read[place].time
        if time is None and place in clocks:
            time = read[clocks[place]].value * request.scale.get('time', 1.0)
            first = time[np.isfinite(time)]
            # Stamps since 1970 in nanoseconds lose their digits unless they count from here.
            zero = first[0] if first.size and abs(first[0]) > 1e6 * np.ptp(first) else 0.0
            time = (time - zero) * units['time'].factor + request.offset.get('time', 0.0)
        if time is None:
            if request.rate is None:
                raise InputError(f'{path}: no time beside {table.channels[place].name}; name its '
                                 'column with --column time=…, or give --rate')
            time = np.arange(values.size) / request.rate
        if time.size != values.size:
            raise InputError(f'{path}: columns of different length ({role} {values.size}, time '
                             f'{time.size})')
        series[role] = (time, values)
        told.append(_sentence(table, role, place, units[role], request))
    for role in [role for role in _MEASURED if role in series]:
        _refuse_dead_clock(path, series[role][0])
        refuse_new_start(str(path), series[role][0])
    time, columns = _with_a_stamp_each(*_aligned(series, notes), notes)
    joint_type = 'prismatic' if units['position'].quantity == 'length' else 'revolute'
    if joint_type == 'revolute':
        for role in ('position', 'reference'):
            if role in columns:
                columns[role] = _unwrapped(columns[role], role, notes)
    if 'time' in roles:
        told.insert(0, _sentence(table, 'time', roles['time'], units['time'], request))
    return Measured(printable(path.stem), time, columns, joint_type, tuple(told), tuple(notes),
                    str(path))


def _refuse_dead_clock(path: Path, time: Array) -> None:
    good = time[np.isfinite(time)]
    if good.size < 2:
        count = 'one number' if good.size else 'no numbers'
        raise InputError(f'{path}: the column for time holds {count}; export a row per sample, or '
                         'name another column with --column time=…')
    if np.ptp(good) == 0:
        raise InputError(f'{path}: time never changes; choose another column for time, or give '
                         '--rate')


def _clocks(table: Table, roles: dict[str, int]) -> dict[int, int]:
    """Return channel → the channel that holds its times: of its own group and length first."""
    if 'time' not in roles:
        return {}
    chosen = roles['time']
    like = _last(table.channels[chosen].short)
    found = {}
    for role, place in roles.items():
        channel = table.channels[place]
        if role == 'time' or channel.clocked:
            continue
        found[place] = chosen
        own = table.channels[chosen]
        if channel.size != own.size or channel.group != own.group:
            beside = [number for number, entry in enumerate(table.channels)
                      if entry.size == channel.size and entry.group == channel.group
                      and _last(entry.short) == like]
            if len(beside) == 1:
                found[place] = beside[0]
    return found


def _last(name: str) -> str:
    return re.split(r'[/.]', name.casefold())[-1]


def _sentence(table: Table, role: str, place: int, unit: Unit, request: Request) -> str:
    channel = table.channels[place]
    text = f'{role}: column {printable(channel.name) or place}'
    if unit is _SI:
        factor = request.scale.get(role)
        if factor:
            return f'{text}, times {factor:g}'
        # A title that says current, and nobody said a unit.
        doubt = (' (taken as a torque in N·m; of a current give --unit effort=A and '
                 '--torque-constant)' if role == 'effort' and is_current(channel) else '')
        return f'{text}, as it is{doubt}'
    written = request.units.get(role) or channel.unit
    if not written:
        text += f', taken as {_spelt(unit)}'
    elif written not in channel.name:
        text += f' [{printable(written)}]'
    if unit.quantity == 'current':
        text += f', times {request.torque_constant:g} N·m/A' if request.torque_constant != 1.0 \
            else ', told in ampere: where N·m is written, read A'
    return text


def _spelt(unit: Unit) -> str:
    return next((name for name in units_of(unit.quantity) if unit_of(name) == unit), 'SI')


def _aligned(series: Mapping[str, tuple[Array, Array]], notes: list[str],
             ) -> tuple[Array, dict[str, Array]]:
    """Bring all onto the clock of position or effort, whichever is slower.

    The other way round, the slower one would be invented between its samples.
    """
    first = next(iter(series.values()))[0]
    if all(time is first or np.array_equal(time, first, equal_nan=True)
           for time, _ in series.values()):
        holes = [np.isfinite(values) for role, (_, values) in series.items() if role in _MEASURED]
        if np.logical_and.reduce(holes).sum() >= 0.5 * min(part.sum() for part in holes):
            return first.copy(), {role: values.copy() for role, (_, values) in series.items()}
    whole = {role: _finite(time, values) for role, (time, values) in series.items()}
    measured = [role for role in _MEASURED if role in whole]
    master = max(measured, key=lambda role: _interval(whole[role][0]))
    time = whole[master][0]
    begin = max(whole[role][0][0] for role in measured)
    end = min(whole[role][0][-1] for role in measured)
    time = time[(time >= begin) & (time <= end)]
    if time.size < 2:
        raise InputError('position and effort were never recorded at the same time')
    columns = {role: np.interp(time, *entry) for role, entry in whole.items()}
    rates = ', '.join(f'{role} {1.0 / _interval(entry[0]):.4g} Hz'
                      for role, entry in whole.items())
    notes.append(f'signals of several rates ({rates}) brought onto the clock of {master}')
    return time, columns


def _with_a_stamp_each(time: Array, columns: dict[str, Array], notes: list[str],
                       ) -> tuple[Array, dict[str, Array]]:
    """Return rows whose times were written with too few digits with a time each: all that is told
    of a row, what was tracked as well, has the same."""
    rows = np.flatnonzero(np.isfinite(time))
    if np.any(np.diff(time[rows]) < 0.0):
        return time, columns
    told = [columns[role] for role in ('position', 'effort', 'velocity') if role in columns]
    kept, stamps, repaired = one_stamp_each(time[rows], [values[rows] for values in told])
    if not repaired:
        return time, columns
    notes += repaired
    return stamps, {role: values[rows[kept]] for role, values in columns.items()}


def _finite(time: Array, values: Array) -> tuple[Array, Array]:
    good = np.flatnonzero(np.isfinite(time) & np.isfinite(values))
    order = good[np.argsort(time[good], kind='stable')]
    kept, stamps, _ = one_stamp_each(time[order], [values[order]])
    if stamps.size < 2:
        raise InputError('a signal holds fewer than two samples')
    return stamps, values[order[kept]]


def _interval(time: Array) -> float:
    return float(np.median(np.diff(time)))


def _unwrapped(position: Array, role: str, notes: list[str]) -> Array:
    """Undo the wrapping of an angle at a full turn: a jump by a turn that stays within one."""
    good = np.isfinite(position)
    values = position[good]
    turn = 2.0 * np.pi
    if values.size < 2 or np.ptp(values) > turn * 1.001 or np.ptp(values) < 0.9 * turn:
        return position
    jumps = np.abs(np.diff(values))
    if not np.any(jumps > 0.75 * turn) or np.quantile(jumps, 0.95) > 0.25 * turn:
        return position
    notes.append(f'{role} jumps by a turn {int(np.sum(jumps > 0.75 * turn))} times: unwrapped')
    out = position.copy()
    out[good] = np.unwrap(values)
    return out

