# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The simulated brake behind its drive: plant, drive limits and sensor chain, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
import sys
from typing import NamedTuple, TYPE_CHECKING

from engb_core.bench.sensors import SensorChain, SensorSettings
from engb_core.effects.catalogue import catalogue
from engb_core.errors import InputError
from engb_core.model import EffectSetting, Model
from engb_core.physics.simulation import BrakePlant
from engb_core.text.yaml_text import load_yaml, shown

if TYPE_CHECKING:
    from engb_core.bench.brake import BenchBrake

__all__ = ['DriveSettings', 'Measurement', 'Profile', 'VirtualBrake', 'parse_effects']


# As text of YAML.
_EXAMPLE = '"stribeck_friction: {breakaway_ratio: 1.4, stribeck_velocity: 2.0}"'

# A demand of more than so many times the drive's limit comes from somebody else.
_MEANT = 10.0


class Measurement(NamedTuple):
    """What the drive reports at `time` [s]: position [rad], velocity [rad/s], effort [N·m], and
    what the vehicle does: disc speed [rad/s], pad temperature [°C]. `clamp_force` [N] is a load
    cell's, NaN where the brake has none."""

    time: float
    position: float
    velocity: float
    effort: float
    disc_speed: float
    pad_temperature: float
    clamp_force: float = math.nan


class Profile:
    """A signal given by points, linear between them and held at both ends.

    Args:
        times: increasing [s].
        values: as many.
        name: for messages.

    Raises:
        InputError: lengths differ, nothing given, or times not increasing.
    """

    def __init__(self, times: Sequence[float], values: Sequence[float], name: str) -> None:
        if len(times) != len(values) or not times:
            raise InputError(f'{name}: {len(times)} times and {len(values)} values; give as many '
                             'of each, at least one')
        if any(later <= earlier for earlier, later in zip(times, times[1:], strict=False)):
            raise InputError(f'{name}: times must increase')
        self._times = [float(time) for time in times]
        self._values = [float(value) for value in values]

    def at(self, time: float) -> float:
        """Return the value at `time` [s]."""
        times, values = self._times, self._values
        if time <= times[0]:
            return values[0]
        for index in range(1, len(times)):
            if time < times[index]:
                part = (time - times[index - 1]) / (times[index] - times[index - 1])
                return values[index - 1] + part * (values[index] - values[index - 1])
        return values[-1]


@dataclass(frozen=True)
class DriveSettings:
    """The drive's numbers.

    Attributes:
        rate: samples and commands per second [Hz].
        effort_limit: the drive gives no more [N·m].
        command_timeout: without a command for so long the drive lets go [s].
        physics_step: of the integration [s].
    """

    rate: float = 1000.0
    effort_limit: float = 0.75
    command_timeout: float = 0.1
    physics_step: float = 5e-5


class VirtualBrake:
    """A brake to command and to measure, in steps of one sample.

    Args:
        model: the true numbers, effects included.
        drive: the drive's numbers.
        sensors: the sensor chain's numbers.
        disc_speed, pad_temperature: over time, [rad/s] and [°C].
        bench: a brake with a drive, a heating pad and a load cell of its own, which runs in the
            place of the model's; the model then says no more than the joint's name.
    """

    def __init__(self, model: Model, drive: DriveSettings | None = None,
                 sensors: SensorSettings | None = None, disc_speed: Profile | None = None,
                 pad_temperature: Profile | None = None,
                 bench: BenchBrake | None = None) -> None:
        self.model = model
        self.drive = drive or DriveSettings()
        self.period = 1.0 / self.drive.rate
        self.samples = 0
        self.torque = 0.0
        self.rejected = 0
        self._bench = bench
        self._plant = bench or BrakePlant(model, step=self.drive.physics_step)
        self._sensors = SensorChain(sensors or SensorSettings())
        self._disc_speed = disc_speed or Profile([0.0], [0.0], 'disc_speed')
        self._pad_temperature = pad_temperature or Profile([0.0], [20.0], 'pad_temperature')
        self._command_age = math.inf

    @property
    def plant(self) -> BrakePlant | BenchBrake:
        """The brake itself, whose true state no drive would show."""
        return self._plant

    def command(self, torque: float) -> bool:
        """Demand `torque` [N·m]; what is too much is cut. What is not finite, or beyond all that a
        controller of this drive would ask for, is dropped: return False then. What controllers ask
        of a drive that gives nothing, its limit does not tell."""
        limit = self.drive.effort_limit
        if not abs(torque) <= (_MEANT * limit or sys.float_info.max):   # NaN too
            self.rejected += 1
            return False
        self.torque = min(max(float(torque), -limit), limit)
        self._command_age = 0.0
        return True

    def advance(self) -> Measurement:
        """Go on by one sample and return what the drive reports then.

        Raises:
            InputError: the numbers of the brake let its motion leave all bounds.
        """
        time = self.samples * self.period
        if self._command_age > self.drive.command_timeout:
            self.torque = 0.0
        self._command_age += self.period
        disc_speed = self._disc_speed.at(time)
        temperature = self._pad_temperature.at(time)
        self._plant.advance(self.torque, self.period, disc_speed, temperature)
        self.samples += 1
        time = self.samples * self.period
        bench = self._bench
        if isinstance(self._plant, BrakePlant):
            torque = self._plant.measured_effort(self.torque, self.period)
            angle = self._plant.measured_position(self.period)
        else:
            torque, angle = self._plant.effort, self._plant.position
        if not math.isfinite(angle + torque):
            raise InputError(self._runs_away(time))
        position, velocity, effort = self._sensors.measure(time, angle, torque)
        if bench is None:
            return Measurement(time, position, velocity, effort, disc_speed, temperature)
        return Measurement(time, position, velocity, effort, disc_speed, bench.pad_temperature,
                           bench.load_cell())

    def _runs_away(self, time: float) -> str:
        effects = '; '.join(
            f'{entry.effect} ({", ".join(f"{name} {value:g}" for name, value in numbers)})'
            for entry in self.model.effects if (numbers := entry.parameters.items()))
        source = f'effects: with {effects}' if effects and self._bench is None else 'brake:'
        return (f'{source} the simulated motion is beyond all numbers {time:.3g} s after the '
                'start; give values that a machine has, or a smaller physics_step')


def _refuse_wrong_sign(setting: EffectSetting) -> None:
    """Raise InputError where a value is below nought that by its nature cannot be, or an inertia,
    a speed, a distance is none at all. How large one may be is a matter of the machine."""
    effect = catalogue().get(setting.effect)
    for entry in effect.parameters if effect is not None else ():
        value = setting.parameters.get(entry.name, entry.high)
        none = entry.low > 0.0 and entry.unit != '-'
        if value < 0.0 <= entry.low or none and value == 0.0:
            unit = '' if entry.unit == '-' else f' {entry.unit}'
            raise InputError(f'effects: {setting.effect}.{entry.name} is {value:g}{unit}; it must '
                             + ('be above 0' if none else 'not be below 0'))


def parse_effects(text: str) -> tuple[EffectSetting, ...]:
    """Read effects written as YAML: 'stribeck_friction: {breakaway_ratio: 1.4, …}'.

    Raises:
        InputError: not such a mapping, or a value that no machine can have.
    """
    if not text.strip():
        return ()
    try:
        data = load_yaml(text)
    except InputError as error:
        raise InputError(f'effects {shown(text)}: {error}; write {_EXAMPLE}') from None
    if not isinstance(data, dict):
        raise InputError(f'effects {shown(text)}: write {_EXAMPLE}')
    settings = []
    for name, parameters in data.items():
        parameters = parameters or {}
        if not isinstance(parameters, dict):
            raise InputError(f'effects: {name} needs {{parameter: value}}')
        values = {}
        for key, value in parameters.items():
            try:
                values[str(key)] = float(value)
            except (TypeError, ValueError):
                raise InputError(f'effects: {name}.{key} is {shown(value)}; it must be a number'
                                 ) from None
            if not math.isfinite(values[str(key)]):
                raise InputError(f'effects: {name}.{key} is {value}; it must be finite')
        settings.append(EffectSetting(str(name), values))
        _refuse_wrong_sign(settings[-1])
    return tuple(settings)
