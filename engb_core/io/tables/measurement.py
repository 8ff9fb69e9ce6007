# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads the measurement formats of the field: ASAM MDF, TDMS, Parquet and Arrow, ROS 1 bags."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from engb_core.errors import InputError
from engb_core.io.tables.needs import needed
from engb_core.io.tables.table import Channel, damaged, MOST_BYTES, numbers_of, Samples, Table
from engb_core.io.tables.units import parse_title

__all__ = ['ColumnarTable', 'MdfTable', 'Ros1Table', 'TdmsTable']

_NUMBERS = 'fiub'
# A ROS message's fields that are looked into.
_DEEPEST = 4


class MdfTable(Table):
    """ASAM MDF 3 and 4, by asammdf: each channel group has a time of its own."""

    kind = 'ASAM MDF'

    def __init__(self, path: Path) -> None:
        asammdf = needed('asammdf', path, self.kind)
        try:
            self._file = asammdf.MDF(path)
            found, self._places = [], []
            for index, group in enumerate(self._file.groups):
                master = self._file.masters_db.get(index)
                count = int(group.channel_group.cycles_nr)
                # asammdf makes room for the flags of all samples, whatever the file holds.
                flags = count * int(getattr(group.channel_group, 'invalidation_bytes_nr', 0) or 0)
                if flags > MOST_BYTES:
                    raise InputError(f'{path}: says that a group has {flags >> 20} MiB of '
                                     'invalidation bytes; the file is damaged')
                for place, channel in enumerate(group.channels):
                    if place == master:
                        continue
                    conversion = getattr(channel, 'conversion', None)
                    unit = channel.unit or getattr(conversion, 'unit', '') or ''
                    found.append(Channel(channel.name, str(unit).strip()
                                         or parse_title(channel.name)[1], count, str(index),
                                         master is not None))
                    self._places.append((index, place))
        except InputError:
            raise
        except Exception as error:      # asammdf raises what it likes on a broken file
            raise damaged(path, f'not a usable {self.kind} file', error) from error
        super().__init__(path, found)

    def read(self, channels: Iterable[int]) -> dict[int, Samples]:
        """Return physical values and times from the measurement's start."""
        found = {}
        channels = list(channels)
        self.check_size(channels)
        for place in channels:
            group, index = self._places[place]
            name = self.channels[place].name
            try:
                signal = self._file.get(group=group, index=index,
                                        ignore_invalidation_bits=False)
            except Exception as error:      # as above
                raise damaged(self.path, f'{name} cannot be read', error) from error
            found[place] = Samples(
                numbers_of(self.path, name, signal.samples),
                np.asarray(signal.timestamps, float) if self.channels[place].clocked else None)
        return found


class TdmsTable(Table):
    """National Instruments' TDMS, by npTDMS; a waveform brings its own time."""

    kind = 'TDMS'

    def __init__(self, path: Path) -> None:
        nptdms = needed('nptdms', path, self.kind, 'npTDMS')
        try:
            self._file = nptdms.TdmsFile.open(path)
            found, self._channels = [], []
            for group in self._file.groups():
                for channel in group.channels():
                    if channel.dtype is None or channel.dtype.kind not in _NUMBERS + 'M':
                        continue
                    unit = str(channel.properties.get('unit_string', '')
                               or channel.properties.get('NI_UnitDescription', '')).strip()
                    found.append(Channel(
                        f'{group.name}/{channel.name}' if len(self._file.groups()) > 1
                        else channel.name, unit or parse_title(channel.name)[1], len(channel),
                        group.name, bool(channel.properties.get('wf_increment'))))
                    self._channels.append(channel)
        except Exception as error:      # npTDMS raises what it likes on a broken file
            raise damaged(path, f'not a usable {self.kind} file', error) from error
        super().__init__(path, found)
        starts = [self._start(place) for place, entry in enumerate(found) if entry.clocked]
        self._first = min(starts, default=0.0)

    def _start(self, place: int) -> float:
        """Return when a waveform starts [s]: its trigger's time, and its offset from there."""
        properties = self._channels[place].properties
        start = properties.get('wf_start_time')
        seconds = 0.0
        if start is not None:
            seconds = float(np.datetime64(start, 'ns').astype(np.int64)) * 1e-9
        return seconds + float(properties.get('wf_start_offset', 0.0) or 0.0)

    def read(self, channels: Iterable[int]) -> dict[int, Samples]:
        """Return scaled values and, of waveforms, their times."""
        found = {}
        channels = list(channels)
        self.check_size(channels)
        for place in channels:
            channel = self._channels[place]
            try:
                values = numbers_of(self.path, channel.name, channel[:])
            except InputError:
                raise
            except Exception as error:      # npTDMS raises what it likes on a broken file
                raise damaged(self.path, f'{channel.name} cannot be read', error) from error
            time: np.ndarray | None = None
            if self.channels[place].clocked:
                time = (self._start(place) - self._first + np.arange(values.size)
                        * float(channel.properties['wf_increment']))
            found[place] = Samples(values, time)
        return found


class ColumnarTable(Table):
    """Parquet and Arrow (Feather), by pyarrow."""

    def __init__(self, path: Path, kind: str) -> None:
        self.kind = kind
        needed('pyarrow', path, kind)
        import pyarrow.feather
        import pyarrow.parquet
        try:
            if kind == 'Parquet':
                self._file: Any = pyarrow.parquet.ParquetFile(path)
                schema, rows = self._file.schema_arrow, self._file.metadata.num_rows
            else:
                self._file = _arrow_table(path)
                schema, rows = self._file.schema, self._file.num_rows
        except (pyarrow.ArrowException, OSError) as error:
            raise damaged(path, f'not a usable {kind} file', error) from error
        self._names = schema.names
        super().__init__(path, [
            Channel(field.name, _arrow_unit(field) or parse_title(field.name)[1], rows)
            for field in schema])

    def read(self, channels: Iterable[int]) -> dict[int, Samples]:
        """Return columns; a null is not finite."""
        import pyarrow
        places = list(channels)
        self.check_size(places)
        names = list(dict.fromkeys(self._names[place] for place in places))
        try:
            table = (self._file.read(columns=names) if self.kind == 'Parquet'
                     else self._file.select(names))
            columns = {name: table.column(name).to_numpy() for name in names}
        except (pyarrow.ArrowException, OSError) as error:
            raise damaged(self.path, 'cannot be read', error) from error
        return {place: Samples(numbers_of(self.path, self._names[place],
                                          columns[self._names[place]])) for place in places}


def _arrow_table(path: Path) -> Any:
    """Open an Arrow file, or a stream, which the same programs write under the same name."""
    import pyarrow.feather
    with path.open('rb') as file:
        head = file.read(6)
    if head == b'ARROW1' or head.startswith(b'FEA1'):
        return pyarrow.feather.read_table(path, memory_map=True)
    with pyarrow.memory_map(str(path)) as source:
        return pyarrow.ipc.open_stream(source).read_all()


def _arrow_unit(field: Any) -> str:
    if field.metadata:
        for key in (b'unit', b'units'):
            if key in field.metadata:
                return str(field.metadata[key].decode('utf-8', 'replace'))
    # A stamp is given out in seconds.
    return 's' if str(field.type).startswith(('timestamp', 'duration')) else ''


class Ros1Table(Table):
    """ROS 1 bags, by rosbags: each number of each message is a channel, timed by its header."""

    kind = 'ROS 1 bag'

    def __init__(self, path: Path) -> None:
        rosbags = needed('rosbags.highlevel', path, self.kind, 'rosbags')
        found: list[Channel] = []
        self._paths: list[tuple[str, tuple[Any, ...]]] = []
        try:
            self._reader = rosbags.AnyReader([path])
            self._reader.open()
            for connection in {entry.topic: entry for entry in
                               self._reader.connections}.values():
                first = next(self._reader.messages([connection]), None)
                if first is None:
                    continue
                message = self._reader.deserialize(first[2], first[0].msgtype)
                for way, unit in _fields(message):
                    name = connection.topic + ''.join(f'/{part}' for part in way)
                    if way == ('data',):
                        # A topic of one number: it is the topic's name that tells the unit.
                        unit = unit or parse_title(connection.topic)[1]
                    found.append(Channel(name, unit, connection.msgcount, connection.topic, True))
                    self._paths.append((connection.topic, way))
        except Exception as error:      # rosbags raises what it likes on a broken file
            raise damaged(path, f'not a usable {self.kind}', error) from error
        super().__init__(path, found)

    def read(self, channels: Iterable[int]) -> dict[int, Samples]:
        """Return fields of messages and the messages' times."""
        found = {}
        places = list(channels)
        self.check_size(places)
        for topic in dict.fromkeys(self._paths[place][0] for place in places):
            here = [place for place in places if self._paths[place][0] == topic]
            times: list[float] = []
            rows: list[list[float]] = []
            try:
                start = self._reader.start_time
                for connection, stamp, raw in self._reader.messages(
                        [entry for entry in self._reader.connections if entry.topic == topic]):
                    message = self._reader.deserialize(raw, connection.msgtype)
                    stamped = getattr(getattr(message, 'header', None), 'stamp', None)
                    if stamped is not None and stamped.sec:
                        stamp = stamped.sec * 1_000_000_000 + stamped.nanosec
                    times.append((stamp - start) * 1e-9)
                    rows.append([_value(message, self._paths[place][1]) for place in here])
            except Exception as error:      # as above
                raise damaged(self.path, f'{topic} cannot be read', error) from error
            values = np.array(rows, float).reshape(len(times), len(here))
            for index, place in enumerate(here):
                found[place] = Samples(values[:, index], np.array(times))
        return found


_JOINT_UNITS = {'position': 'rad', 'velocity': 'rad/s', 'effort': 'N·m'}


def _fields(message: Any, way: tuple[Any, ...] = (),
            deep: int = _DEEPEST) -> list[tuple[tuple[Any, ...], str]]:
    """Return the ways to a message's numbers, each with its unit where the type tells it."""
    if 'JointState' in getattr(message, '__msgtype__', ''):
        return [((field, index), unit) for field, unit in _JOINT_UNITS.items()
                for index in range(len(getattr(message, field)))]
    found = []
    for field in getattr(message, '__dataclass_fields__', {}):
        if field in ('header', '__msgtype__'):
            continue
        value = getattr(message, field)
        if isinstance(value, (bool, int, float, np.number)):
            found.append(((*way, field), ''))
        elif hasattr(value, '__dataclass_fields__') and deep:
            found += _fields(value, (*way, field), deep - 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind in _NUMBERS and value.size <= 16:
            found += [((*way, field, index), '') for index in range(value.size)]
    return found


def _value(message: Any, way: tuple[Any, ...]) -> float:
    try:
        for part in way:
            message = message[part] if isinstance(part, int) else getattr(message, part)
        return float(message)
    except (IndexError, AttributeError, TypeError, ValueError):
        return float('nan')
