# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Parameters: declared with unit, range and description, and complained of in one line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from engb_core.errors import InputError

__all__ = ['ParameterSpec', 'declare', 'path_of', 'shown_default', 'shown_range',
           'values_with']


@dataclass(frozen=True)
class ParameterSpec:
    """One parameter.

    Attributes:
        name: its name.
        default: also says its type.
        description: one line.
        unit: '' where it has none.
        low, high: the range of a number.
        choices: what a text may be.
        live: it can be changed while the node runs.
    """

    name: str
    default: Any
    description: str
    unit: str = ''
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    live: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """Return it as ROS describes it."""
        unit = f' [{self.unit}]' if self.unit else ''
        descriptor = ParameterDescriptor(
            description=f'{self.description}{unit}',
            additional_constraints=('one of ' + ', '.join(self.choices)) if self.choices else '',
            read_only=not self.live)
        if self.low is not None and self.high is not None:
            if isinstance(self.default, float):
                descriptor.floating_point_range.append(FloatingPointRange(
                    from_value=float(self.low), to_value=float(self.high), step=0.0))
            elif isinstance(self.default, int):
                descriptor.integer_range.append(IntegerRange(
                    from_value=int(self.low), to_value=int(self.high), step=1))
        return descriptor

    def check(self, value: Any) -> None:
        """Raise InputError where ROS's own range check doesn't reach (texts, lists, NaN)."""
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f'parameter {self.name} is {value}; it must be a finite number')
        if self.choices and value not in self.choices:
            raise InputError(f'parameter {self.name} is {value!r}; it must be one of '
                             f'{", ".join(self.choices)}')
        if isinstance(self.default, list) and self.default and isinstance(self.default[0], float):
            for item in value:
                bad = not math.isfinite(item)
                if self.low is not None and self.high is not None:
                    bad = bad or not self.low <= item <= self.high
                if bad:
                    raise InputError(f'parameter {self.name} holds {item}; each must lie within '
                                     f'{self.low} and {self.high} {self.unit}')


def shown_default(value: Any) -> str:
    """Return a default as one writes it on a command line."""
    if isinstance(value, bool):
        return 'true' if value else 'false'
    return (value or "''") if isinstance(value, str) else str(value)


def shown_range(spec: ParameterSpec) -> str:
    """Return which values a parameter takes; '' where nothing restricts them."""
    if spec.choices:
        return ', '.join(spec.choices)
    return '' if spec.low is None else f'{spec.low:g} … {spec.high:g}'


def path_of(name: str, text: str) -> Path:
    """Return the path that a parameter gives, `~` expanded: no shell does so behind `:=`.

    Raises:
        InputError: there is no such user.
    """
    try:
        return Path(text).expanduser()
    except RuntimeError:
        raise InputError(f'parameter {name} is {text}: there is no such user here; give a whole '
                         'path') from None


def declare(node: Node, specs: Sequence[ParameterSpec]) -> dict[str, Any]:
    """Declare parameters and return their values by name.

    Raises:
        InputError: a value given from outside has the wrong type or lies outside its range.
    """
    values: dict[str, Any] = {}
    for spec in specs:
        try:
            value = node.declare_parameter(spec.name, spec.default, spec.descriptor()).value
        except InvalidParameterTypeException:
            given = node._parameter_overrides[spec.name].value
            raise InputError(f'parameter {spec.name} is {given!r}; {_wanted(spec, given)}'
                             ) from None
        except InvalidParameterValueException:
            given = node._parameter_overrides[spec.name].value
            raise InputError(f'parameter {spec.name} is {given!r}; it must lie within '
                             f'{spec.low} and {spec.high} {spec.unit}') from None
        if value is None:   # an empty list has no type
            raise InputError(f'parameter {spec.name} is given without a value; '
                             f'{_wanted(spec, value)}')
        value = list(value) if isinstance(spec.default, list) else value
        spec.check(value)
        values[spec.name] = value
    unknown = sorted(set(node._parameter_overrides) - set(values)
                     - {'use_sim_time', 'start_type_description_service'})
    unknown = [name for name in unknown if not name.startswith('qos_overrides.')]
    if unknown:
        node.get_logger().warning(f'unknown parameter {", ".join(unknown)}: ignored; known are '
                                  f'{", ".join(sorted(values))}')
    return values


def values_with(values: dict[str, Any], specs: Sequence[ParameterSpec],
                changes: Sequence[Parameter]) -> dict[str, Any]:
    """Return `values` with parameter changes that ROS proposes, checked by their specs."""
    known = {spec.name: spec for spec in specs}
    changed = dict(values)
    for parameter in changes:
        if parameter.name in known:
            value = parameter.value
            value = list(value) if isinstance(known[parameter.name].default, list) else value
            known[parameter.name].check(value)
            changed[parameter.name] = value
    return changed


def _wanted(spec: ParameterSpec, given: Any) -> str:
    default = spec.default
    if isinstance(default, float) and isinstance(given, int) and not isinstance(given, bool):
        return f'it is a floating-point number: write {given}.0'
    if isinstance(default, list) and default and isinstance(default[0], float):
        return 'it is a list of floating-point numbers: write [1.0, 2.0]'
    kinds = {bool: 'true or false', int: 'a whole number', float: 'a floating-point number',
             str: 'a text', list: 'a list'}
    return f'it must be {kinds[type(default)]}'
