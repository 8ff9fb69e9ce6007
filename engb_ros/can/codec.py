"""Frames of the drive's bus after the DBC file: numbers in, bytes out, and back."""

from __future__ import annotations

from dataclasses import dataclass
import math
import os

from engb_core.errors import InputError
from engb_ros.files import config_file

__all__ = ['DriveCodec', 'DriveCommand', 'DriveStatus', 'DRIVE_DBC']

DRIVE_DBC = config_file('engb_drive.dbc')
FLAGS = ('COMMAND_LOST', 'OVER_CURRENT', 'OVER_TEMPERATURE', 'SENSOR_FAULT')
OFF, TORQUE = 0, 1


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
        path: DBC file with DRIVE_COMMAND, DRIVE_STATUS_1 and DRIVE_STATUS_2.

    Raises:
        InputError: cantools isn't installed, or the file is unreadable or lacks a frame.
    """

    def __init__(self, path: str | os.PathLike = DRIVE_DBC) -> None:
        try:
            import cantools
        except ImportError:
            raise InputError('cantools is not installed; pip install "engb_ros[can]", or rosdep '
                             'key python3-cantools-pip') from None
        try:
            database = cantools.database.load_file(os.fspath(path), database_format='dbc',
                                                   strict=True)
            self.command = database.get_message_by_name('DRIVE_COMMAND')
            self.status_1 = database.get_message_by_name('DRIVE_STATUS_1')
            self.status_2 = database.get_message_by_name('DRIVE_STATUS_2')
        except OSError as error:
            raise InputError(f'{path}: cannot be read ({error.strerror}); give a DBC file'
                             ) from error
        except KeyError as error:
            raise InputError(f'{path}: holds no frame {error}; it needs DRIVE_COMMAND, '
                             'DRIVE_STATUS_1 and DRIVE_STATUS_2') from error
        except Exception as error:   # cantools raises many kinds
            raise InputError(f'{path}: not a valid DBC file ({error})') from error
        self._ranges = {
            message.name: {signal.name: (signal.minimum, signal.maximum)
                           for signal in message.signals}
            for message in (self.command, self.status_1, self.status_2)}

    @staticmethod
    def data_id(message: object) -> int:
        """Return a frame's E2E data ID, attribute E2eDataId of the DBC file."""
        return int(message.dbc.attributes['E2eDataId'].value)

    def encode_command(self, command: DriveCommand) -> bytearray:
        """Return DRIVE_COMMAND, without its protection."""
        return self._encode(self.command, {'MODE': command.mode, 'TORQUE': command.torque})

    def decode_command(self, data: bytes) -> DriveCommand:
        """Return what DRIVE_COMMAND says."""
        values = self.command.decode(data, decode_choices=False)
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
        one = self.status_1.decode(first, decode_choices=False)
        two = self.status_2.decode(second, decode_choices=False)
        return DriveStatus(
            float(one['ANGLE']), float(one['SPEED']), float(two['CURRENT']), int(one['MODE']),
            tuple(flag for flag in FLAGS if two[flag]), float(two['DISC_SPEED']),
            float(two['TEMPERATURE']))

    def _encode(self, message: object, values: dict[str, float]) -> bytearray:
        ranges = self._ranges[message.name]
        filled = {'CRC': 0, 'COUNTER': 0}
        for name, value in values.items():
            if not math.isfinite(value):
                raise ValueError(f'{message.name}.{name} is {value}')
            low, high = ranges[name]
            filled[name] = min(max(value, low), high)
        return bytearray(message.encode(filled))
