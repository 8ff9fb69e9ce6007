# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Frames of the drive's bus after the DBC file: numbers in, bytes out, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

from engb_core.errors import InputError
from engb_ros.can.end_to_end import crc_start
from engb_ros.can.libraries import without_file_formats
from engb_ros.files import config_file

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

__all__ = ['DriveCodec', 'DriveCommand', 'DriveStatus', 'DRIVE_DBC', 'dbc_file']

DRIVE_DBC = config_file('engb_drive.dbc')
FLAGS = ('COMMAND_LOST', 'OVER_CURRENT', 'OVER_TEMPERATURE', 'SENSOR_FAULT')
OFF, TORQUE = 0, 1


def dbc_file(name: str) -> Path:
    """Return the DBC file that a parameter names: '' and bare names are the package's own,
    unless a file of that name is in the working folder."""
    path = Path(name)
    if not name:
        return DRIVE_DBC
    own = config_file(name)
    return own if path.name == name and not path.exists() and own.exists() else path


@dataclass(frozen=True)
class DriveCommand:
    """What the drive is asked: `torque` [N·m] in `mode` OFF or TORQUE."""

    torque: float = 0.0
    mode: int = OFF


@dataclass(frozen=True)
class DriveStatus:
    """What the drive reports: angle [rad], speed [rad/s], current [A], flags that are set, and
    what it hears of the vehicle: disc speed [rad/s], pad temperature [°C]."""

    angle: float
    speed: float
    current: float
    mode: int = TORQUE
    flags: tuple[str, ...] = ()
    disc_speed: float = 0.0
    temperature: float = 20.0


class DriveCodec:
    """Encodes and decodes by a DBC file (cantools).

    Values beyond a signal's range are cut to it; a value that is not finite is never encoded.

    Args:
        path: DBC file with the frames DRIVE_COMMAND, DRIVE_STATUS_1 and DRIVE_STATUS_2.
        drive: what stands in the place of DRIVE in their names, where a bus has several drives.

    Raises:
        InputError: cantools isn't installed, or the file is unreadable or lacks a frame, or one
            of the drive's frames shares its identifier or data ID with another frame, or a data
            ID that the CRC cannot tell from it.
    """

    def __init__(self, path: str | os.PathLike[str] = DRIVE_DBC, drive: str = 'DRIVE') -> None:
        try:
            with without_file_formats():
                import cantools
        except ImportError:
            raise InputError('cantools is not installed; pip install "engb_ros[can]", or rosdep '
                             'key python3-cantools-pip') from None
        try:
            # Of CAN, as its format is given; cantools has databases of diagnostics as well.
            database: Any = cantools.database.load_file(
                os.fspath(path), database_format='dbc', strict=True)
            self.command: Message
            self.status_1: Message
            self.status_2: Message
            self.command, self.status_1, self.status_2 = (
                database.get_message_by_name(f'{drive}_{name}')
                for name in ('COMMAND', 'STATUS_1', 'STATUS_2'))
        except OSError as error:
            raise InputError(f'{path}: cannot be read ({error.strerror}); give a DBC file'
                             ) from error
        except KeyError as error:
            there = sorted(message.name.removesuffix('_COMMAND') for message in database.messages
                           if message.name.endswith('_COMMAND'))
            raise InputError(
                f'{path}: holds no frame {error}; a drive called {drive} needs {drive}_COMMAND, '
                f'{drive}_STATUS_1 and {drive}_STATUS_2' + (
                    f' (drives there: {", ".join(there)})' if there else '')) from error
        except Exception as error:   # cantools raises many kinds
            raise InputError(f'{path}: not a valid DBC file ({error})') from error
        frames = (self.command, self.status_1, self.status_2)
        self._check_against_others(path, frames, database.messages)
        self._ranges = {
            message.name: {signal.name: _range(signal) for signal in message.signals}
            for message in frames}

    def _check_against_others(self, path: str | os.PathLike[str], mine: Sequence[Message],
                              every: Sequence[Message]) -> None:
        """Refuse a file in which another frame could pass for one of this drive's."""
        guarded = [frame for frame in every
                   if frame.dbc and frame.dbc.attributes.get('E2eDataId') is not None]
        for frame in mine:
            for other in {id(each): each for each in (*mine, *guarded)}.values():
                if other is frame:
                    continue
                for what, same in (
                        ('identifier', frame.frame_id == other.frame_id),
                        ('E2eDataId', self.data_id(frame) == self.data_id(other))):
                    if same:
                        raise InputError(f'{path}: {frame.name} and {other.name} have the same '
                                         f'{what}; each needs its own')
                if crc_start(self.data_id(frame)) == crc_start(self.data_id(other)):
                    raise InputError(
                        f'{path}: the CRC cannot tell {frame.name} from {other.name}: their '
                        f'E2eDataIds {self.data_id(frame)} and {self.data_id(other)} have one '
                        'remainder; give one of them another')

    @property
    def largest_torque(self) -> float:
        """The largest torque that a command frame can carry [N·m]."""
        low, high = self._ranges[self.command.name]['TORQUE']
        return min(-low, high)

    @property
    def mode_names(self) -> dict[int, str]:
        """What the values of a status frame's MODE are called."""
        choices: Any = self.status_1.get_signal_by_name('MODE').choices or {}
        return {number: str(name).lower() for number, name in choices.items()}

    @staticmethod
    def data_id(message: Message) -> int:
        """Return a frame's E2E data ID, attribute E2eDataId of the DBC file."""
        attribute = message.dbc.attributes.get('E2eDataId') if message.dbc else None
        if attribute is None:
            raise InputError(f'frame {message.name} of the DBC file has no attribute E2eDataId; '
                             'each frame needs its own')
        return int(attribute.value)

    def encode_command(self, command: DriveCommand) -> bytearray:
        """Return DRIVE_COMMAND, without its protection."""
        return self._encode(self.command, {'MODE': command.mode, 'TORQUE': command.torque})

    def decode_command(self, data: bytes) -> DriveCommand:
        """Return what DRIVE_COMMAND says."""
        values = _numbers(self.command, data)
        return DriveCommand(float(values['TORQUE']), int(values['MODE']))

    def encode_status(self, status: DriveStatus) -> tuple[bytearray, bytearray]:
        """Return both status frames, without their protection."""
        first = self._encode(self.status_1, {
            'MODE': status.mode, 'ANGLE': status.angle, 'SPEED': status.speed})
        second = self._encode(self.status_2, {
            'CURRENT': status.current, 'DISC_SPEED': status.disc_speed,
            'TEMPERATURE': status.temperature,
            **{flag: int(flag in status.flags) for flag in FLAGS}})
        return first, second

    def decode_status(self, first: bytes, second: bytes) -> DriveStatus:
        """Return what both status frames of one sample say."""
        one, two = _numbers(self.status_1, first), _numbers(self.status_2, second)
        return DriveStatus(
            float(one['ANGLE']), float(one['SPEED']), float(two['CURRENT']), int(one['MODE']),
            tuple(flag for flag in FLAGS if two[flag]), float(two['DISC_SPEED']),
            float(two['TEMPERATURE']))

    def _encode(self, message: Message, values: dict[str, float]) -> bytearray:
        ranges = self._ranges[message.name]
        filled: dict[str, float] = {'CRC': 0, 'COUNTER': 0}
        for name, value in values.items():
            if not math.isfinite(value):
                raise ValueError(f'{message.name}.{name} is {value}')
            low, high = ranges[name]
            filled[name] = min(max(value, low), high)
        return bytearray(message.encode(filled))


def _numbers(message: Message, data: bytes) -> dict[str, float]:
    values: Any = message.decode(data, decode_choices=False)
    return dict(values)


def _range(signal: Signal) -> tuple[float, float]:
    """Return a signal's range; where the file states none, what its bits can carry."""
    if signal.minimum is not None and signal.maximum is not None:
        return signal.minimum, signal.maximum
    low, high = ((-(1 << signal.length - 1), (1 << signal.length - 1) - 1) if signal.is_signed
                 else (0, (1 << signal.length) - 1))
    return low * signal.scale + signal.offset, high * signal.scale + signal.offset
