# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The numbers of a brake model: read, checked, written (contract, section 2)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
import math
import os
from pathlib import Path
import tempfile
from typing import Any

import yaml

from engb_core.errors import InputError
from engb_core.text.yaml_text import check_keys, key_text, list_at, load_yaml, number_at, shown

__all__ = ['Cogging', 'Controller', 'EffectSetting', 'Friction', 'Joint', 'LoadTorque', 'Model',
           'Motor']

FORMAT = 'engb-model/1'

# A model file has a kilobyte; one with as many harmonics as may be has 10.
_LARGEST = 256 << 10
_MOST_HARMONICS = 100
# [Hz] No drive closes its loop faster, and no recording that is faster can be judged.
_FASTEST_LOOP = 1e5


@dataclass(frozen=True)
class Joint:
    """Which joint it is.

    Attributes:
        name: in JointState.
        type: 'revolute' (rad, N·m) or 'prismatic' (m, N for every rad, N·m below).
    """

    name: str = 'motor'
    type: str = 'revolute'


@dataclass(frozen=True)
class Motor:
    """The motor, with all that moves with it.

    Attributes:
        torque_constant: K_T [N·m/A].
        inertia: J [kg·m²] of all that moves, at the motor.
        viscous_friction: B [N·m·s/rad].
    """

    torque_constant: float = 0.0174
    inertia: float = 6.813e-5
    viscous_friction: float = 1.125e-3


@dataclass(frozen=True)
class LoadTorque:
    """T_L(θ): a polynomial of s = θ − contact_angle, or amplitude·sin(θ + phase).

    Attributes:
        form: 'polynomial' or 'sinusoid'.
        coefficients: p0, p1, … [N·m, N·m/rad, N·m/rad², …]; 0 below the contact angle.
        contact_angle: [rad], where the load begins; None: s = θ everywhere.
        amplitude: of the sinusoid [N·m].
        phase: of the sinusoid [rad].
    """

    form: str = 'polynomial'
    coefficients: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    contact_angle: float | None = None
    amplitude: float = 0.0
    phase: float = 0.0


@dataclass(frozen=True)
class Friction:
    """T_C = (coulomb + load_gain·|T_L|)·sat(ω / saturation_velocity), from (13) and (42).

    With a `load_curvature` what goes with load is a parabola that crosses this line at
    `reference_load` (load_friction.py).

    Attributes:
        coulomb: C₀ [N·m].
        load_gain: C₁ [-]: friction by load torque.
        saturation_velocity: ω_s [rad/s], up to which friction rises in proportion.
        load_curvature: [-], −1 to 1, 0: friction is a straight line over the load.
        reference_load: [N·m], where parabola and straight line cross.
    """

    coulomb: float = 0.0
    load_gain: float = 0.0
    saturation_velocity: float = 0.5
    load_curvature: float = 0.0
    reference_load: float = 0.0


@dataclass(frozen=True)
class Cogging:
    """One harmonic of T_cog: amplitude·sin(order·θ + phase).

    Attributes:
        order: [cycles per revolution] (prismatic: [rad/m]).
        amplitude: [N·m].
        phase: [rad].
    """

    order: float
    amplitude: float
    phase: float = 0.0


@dataclass(frozen=True)
class Controller:
    """The loop that was closed while recording: PID on e = θ_d − θ.

    Attributes:
        proportional: [N·m/rad].
        integral: [N·m/(rad·s)].
        derivative: [N·m·s/rad].
        effort_limit: [N·m], of the loop's output.
        rate: [Hz], of its cycles.
    """

    proportional: float = 0.0
    integral: float = 0.0
    derivative: float = 0.0
    effort_limit: float = math.inf
    rate: float = 1000.0


@dataclass(frozen=True)
class EffectSetting:
    """One effect that a diagnosis added.

    Attributes:
        effect: its id.
        parameters: numbers, or lists of them, by name; units are those of the effect's file.
        formula: of a law (engb_core/laws).
        acts_as: what a law's formula gives.
        within: the range of each coordinate within which a law was seen.
    """

    effect: str
    parameters: dict[str, Any] = field(default_factory=dict)
    formula: str = ''
    acts_as: str = ''
    within: dict[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Model:
    """All numbers of a model file.

    Attributes:
        motor: inertia, viscous friction and torque constant.
        load_torque: over the motor's angle.
        friction: dry friction.
        cogging: its harmonics.
        controller: the loop that was closed while recording; None: not known.
        effects: what a diagnosis added.
        joint: name and kind; decides about rad or m.
    """

    motor: Motor = Motor()
    load_torque: LoadTorque = LoadTorque()
    friction: Friction = Friction()
    cogging: tuple[Cogging, ...] = ()
    controller: Controller | None = None
    effects: tuple[EffectSetting, ...] = ()
    joint: Joint = Joint()

    def refuse_negative_friction(self) -> None:
        """Raise InputError where friction would drive the motion. Least squares leave such numbers
        in a file where there is next to no friction, and it may be diagnosed all the same; but
        nothing is to be moved or simulated by it."""
        _refuse_negative(self.motor, 'motor', {'viscous_friction': 'N·m·s/rad'})
        _refuse_negative(self.friction, 'friction', {'coulomb': 'N·m', 'load_gain': ''})

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Model:
        """Read a model file.

        Args:
            path: of a YAML file.

        Raises:
            InputError: missing file, not YAML, an unknown key, a value of a wrong kind or range.
        """
        path = Path(path)
        try:
            with path.open(encoding='utf-8') as file:
                text = file.read(_LARGEST + 1)
        except (OSError, UnicodeDecodeError, ValueError) as error:
            reason = getattr(error, 'strerror', None) or 'not a text file'
            raise InputError(f'{path}: cannot be read ({reason}); give a model file '
                             f'(YAML, format: {FORMAT})') from error
        if len(text) > _LARGEST:
            raise InputError(f'{path}: larger than {_LARGEST >> 10} KiB; no model file is '
                             f'(YAML, format: {FORMAT})')
        try:
            data = load_yaml(text)
        except InputError as error:
            raise InputError(f'{path}: {error}') from error
        try:
            return cls.from_mapping(data)
        except InputError as error:
            raise InputError(f'{path}: {error}') from error

    @classmethod
    def from_mapping(cls, data: Any) -> Model:
        """Build a model from the file's mapping.

        Args:
            data: as YAML gives it, in SI units.

        Raises:
            InputError: names the field that is wrong.
        """
        if not isinstance(data, dict):
            raise InputError(f'no mapping on top; a model file starts with "format: {FORMAT}"')
        check_keys(data, {'format', 'joint', 'motor', 'load_torque', 'friction', 'cogging',
                      'controller', 'effects'}, '')
        if data.get('format') != FORMAT:
            raise InputError(f'format is {shown(data.get("format"))}; it must be {FORMAT}')
        if 'motor' not in data:
            raise InputError('motor is missing; give torque_constant, inertia, viscous_friction')
        joint = _section(Joint, data.get('joint'), 'joint')
        if joint.type not in ('revolute', 'prismatic'):
            raise InputError(f'joint.type is {shown(joint.type)}; it must be revolute or '
                             'prismatic')
        motor = _section(Motor, data['motor'], 'motor', required=('inertia', 'viscous_friction'))
        if motor.inertia <= 0:
            raise InputError(f'motor.inertia is {motor.inertia}; it must be above 0 kg·m²')
        if motor.torque_constant <= 0:
            raise InputError('motor.torque_constant must be above 0 N·m/A')
        friction = _section(Friction, data.get('friction'), 'friction')
        if friction.saturation_velocity <= 0:
            raise InputError('friction.saturation_velocity must be above 0 rad/s')
        if not -1.0 <= friction.load_curvature <= 1.0:
            raise InputError(f'friction.load_curvature is {friction.load_curvature}; it must lie '
                             'within -1 and 1')
        if friction.load_curvature and friction.reference_load <= 0:
            raise InputError('friction.reference_load must be above 0 N·m where there is a '
                             'load_curvature')
        controller = None
        if data.get('controller') is not None:
            controller = _section(Controller, data['controller'], 'controller')
            _refuse_negative(controller, 'controller', {
                'proportional': 'N·m/rad', 'integral': 'N·m/(rad·s)', 'derivative': 'N·m·s/rad'})
            if controller.rate <= 0 or controller.effort_limit <= 0:
                raise InputError('controller.rate and controller.effort_limit must be above 0')
            if controller.rate > _FASTEST_LOOP:
                raise InputError(f'controller.rate is {controller.rate:g}; it must be at most '
                                 f'{_FASTEST_LOOP:g} Hz')
        if len(list_at(data.get('cogging'), 'cogging')) > _MOST_HARMONICS:
            raise InputError(f'cogging holds {len(data["cogging"])} harmonics; at most '
                             f'{_MOST_HARMONICS} are computed')
        cogging = tuple(_section(Cogging, entry, f'cogging[{index}]',
                                 required=('order', 'amplitude'))
                        for index, entry in enumerate(list_at(data.get('cogging'), 'cogging')))
        effects = tuple(_effect(entry, f'effects[{index}]')
                        for index, entry in enumerate(list_at(data.get('effects'), 'effects')))
        if effects:
            # Here, since effects are made of what a model file is.
            from engb_core.effects.catalogue import named_as_now
            effects = tuple(map(named_as_now, effects))
        return cls(motor, _load_torque(data.get('load_torque')), friction, cogging, controller,
                   effects, joint)

    def to_mapping(self) -> dict[str, Any]:
        """Return the model file's mapping; the inverse of `from_mapping`."""
        load: dict[str, Any] = {'form': self.load_torque.form}
        if self.load_torque.form == 'sinusoid':
            load |= {'amplitude': float(self.load_torque.amplitude),
                     'phase': float(self.load_torque.phase)}
        else:
            angle = self.load_torque.contact_angle
            load |= {'coefficients': [float(value) for value in self.load_torque.coefficients],
                     'contact_angle': None if angle is None else float(angle)}
        friction = _floats(self.friction)
        if self.friction.load_curvature == 0.0:
            del friction['load_curvature'], friction['reference_load']
        data: dict[str, Any] = {
            'format': FORMAT,
            'joint': dataclasses.asdict(self.joint),
            'motor': _floats(self.motor),
            'load_torque': load,
            'friction': friction,
            'cogging': [_floats(entry) for entry in self.cogging],
        }
        if self.controller is not None:
            data['controller'] = _floats(self.controller)
        data['effects'] = [_effect_mapping(entry) for entry in self.effects]
        return data

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model file, whole or not at all: `write`, as libraries call it.

        Args:
            path: of the file; one that is there is replaced.
        """
        self.write(path)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the model file, whole or not at all.

        Args:
            path: of the file; one that is there is replaced.
        """
        path = Path(path)
        text = yaml.safe_dump(self.to_mapping(), sort_keys=False, allow_unicode=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f'.{path.name}.')
        try:
            with os.fdopen(handle, 'w', encoding='utf-8') as file:
                file.write(text)
            os.chmod(temporary, 0o644)
            os.replace(temporary, path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise


def _section(kind: type, data: Any, where: str, required: tuple[str, ...] = ()) -> Any:
    if data is None:
        data = {}
    if not isinstance(data, dict):
        raise InputError(f'{where} must be a mapping')
    fields = {entry.name: entry for entry in dataclasses.fields(kind)}
    check_keys(data, set(fields), where)
    for name in required:
        if name not in data:
            raise InputError(f'{where}.{name} is missing')
    values: dict[str, Any] = {}
    for name, value in data.items():
        if fields[name].type == 'str':
            if not isinstance(value, str):
                raise InputError(f'{where}.{name} is {shown(value)}; it must be text')
            values[name] = value
        elif name == 'effort_limit' and isinstance(value, float) and value == math.inf:
            values[name] = value
        else:
            values[name] = number_at(value, f'{where}.{name}')
    return kind(**values)


def _refuse_negative(section: Any, where: str, units: dict[str, str]) -> None:
    """Raise InputError where a number that would feed energy into a motion is below 0."""
    for name, unit in units.items():
        value = getattr(section, name)
        if value < 0:
            raise InputError(f'{where}.{name} is {value:g}; it must be at least 0'
                             + (f' {unit}' if unit else ''))


def _load_torque(data: Any) -> LoadTorque:
    if data is None:
        return LoadTorque()
    if not isinstance(data, dict):
        raise InputError('load_torque must be a mapping')
    form = data.get('form', 'polynomial')
    if form == 'sinusoid':
        check_keys(data, {'form', 'amplitude', 'phase'}, 'load_torque')
        if 'amplitude' not in data:
            raise InputError('load_torque.amplitude is missing; form: sinusoid takes amplitude '
                             '[N·m] and phase [rad]')
        return LoadTorque(form, amplitude=number_at(data['amplitude'], 'load_torque.amplitude'),
                          phase=number_at(data.get('phase', 0.0), 'load_torque.phase'))
    if form != 'polynomial':
        raise InputError(f'load_torque.form is {shown(form)}; it must be polynomial or sinusoid')
    check_keys(data, {'form', 'coefficients', 'contact_angle'}, 'load_torque')
    values = list_at(data.get('coefficients', [0.0] * 4), 'load_torque.coefficients')
    if not 1 <= len(values) <= 12:
        raise InputError('load_torque.coefficients must hold 1 to 12 numbers (p0, p1, …)')
    angle = data.get('contact_angle')
    return LoadTorque(
        form,
        tuple(number_at(value, f'load_torque.coefficients[{index}]')
              for index, value in enumerate(values)),
        None if angle is None else number_at(angle, 'load_torque.contact_angle'))


def _effect(data: Any, where: str) -> EffectSetting:
    if not isinstance(data, dict) or not isinstance(data.get('effect'), str):
        raise InputError(f'{where} must hold effect: <name> and parameters: {{…}}')
    law = {'formula', 'acts_as', 'within'} if data['effect'] == 'law' else set()
    check_keys(data, {'effect', 'parameters'} | law, where)
    parameters = data.get('parameters') or {}
    if not isinstance(parameters, dict):
        raise InputError(f'{where}.parameters must be a mapping')
    values: dict[str, Any] = {}
    for name, value in parameters.items():
        here = f'{where}.parameters.{key_text(name)}'
        if isinstance(value, list):
            values[str(name)] = [number_at(item, here) for item in value]
        else:
            values[str(name)] = number_at(value, here)
    if not law:
        return EffectSetting(data['effect'], values)
    texts = {name: data.get(name, '') for name in ('formula', 'acts_as')}
    for name, text in texts.items():
        if not isinstance(text, str):
            raise InputError(f'{where}.{name} is {text!r}; it must be text')
    return EffectSetting(data['effect'], values, texts['formula'], texts['acts_as'],
                         _ranges(data.get('within'), f'{where}.within'))


def _ranges(data: Any, where: str) -> dict[str, tuple[float, float]]:
    if data is None:
        return {}
    if not isinstance(data, dict):
        raise InputError(f'{where} must be a mapping of coordinates to [lowest, highest]')
    found = {}
    for name, span in data.items():
        if not isinstance(span, list) or len(span) != 2:
            raise InputError(f'{where}.{name} must be [lowest, highest]')
        low, high = (number_at(value, f'{where}.{name}') for value in span)
        found[str(name)] = (low, high)
    return found


def _effect_mapping(entry: EffectSetting) -> dict[str, Any]:
    mapping: dict[str, Any] = {'effect': entry.effect}
    if entry.formula:
        mapping |= {'formula': entry.formula, 'acts_as': entry.acts_as}
    mapping['parameters'] = _plain(entry.parameters)
    if entry.within:
        mapping['within'] = {name: [float(low), float(high)]
                             for name, (low, high) in entry.within.items()}
    return mapping


def _floats(section: Any) -> dict[str, float]:
    return {name: float(value) for name, value in dataclasses.asdict(section).items()}


def _plain(parameters: dict[str, Any]) -> dict[str, Any]:
    return {name: [float(item) for item in value] if isinstance(value, (list, tuple))
            else float(value) for name, value in parameters.items()}
