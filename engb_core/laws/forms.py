# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A form of law: where it acts and its factors, with where a fit of its numbers starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from engb_core.effects.base import Parameter
from engb_core.laws.dimensions import divided, Unit, written
from engb_core.laws.grammar import coordinates_of, has_memory, parse

__all__ = ['Atom', 'BASE_UNITS', 'Form', 'Scales', 'Slot']

# Names of a law's parameters in order; the amplitude comes first.
_NAMES = 'abcdefghijkl'


@dataclass(frozen=True)
class Slot:
    """A parameter of an atom: unit, where it starts, its bounds, whether on a logarithm."""

    unit: str
    start: float
    low: float
    high: float
    logarithmic: bool = False


@dataclass(frozen=True)
class Atom:
    """A factor of a law: text with {0}, {1} … for its parameters, its unit, a name for its kind.

    Where `phase`, the last parameter is a phase, which least squares find as well.
    """

    kind: str
    text: str
    slots: tuple[Slot, ...] = ()
    unit: Unit = ()
    phase: bool = False

    def started(self, values: tuple[float, ...]) -> Atom:
        """Return the atom with other starts."""
        return replace(self, slots=tuple(replace(slot, start=value)
                                         for slot, value in zip(self.slots, values, strict=True)))

    def filled(self, shift: float = 0.0) -> str:
        """Return the text with the starts for parameters; a phase moved on by `shift`."""
        values = [float(slot.start) for slot in self.slots]
        if self.phase:
            values[-1] += shift
        return self.text.format(*(f'({value!r})' for value in values))

    @property
    def memory(self) -> bool:
        """Whether it depends on what went before."""
        return has_memory(parse(self.filled()))

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The coordinates in it."""
        return coordinates_of(parse(self.filled()))


BASE_UNITS: Mapping[str, Unit] = {
    'torque': (('N·m', 1),), 'friction_gain': (), 'load_gain': (), 'effort_gain': (),
    'inertia': (('kg·m²', 1),), 'position_shift': (('rad', 1),), 'delay': (('s', 1),),
    'position_delay': (('s', 1),), 'load_shift': (('rad', 1),),
}


@dataclass(frozen=True)
class Form:
    """A law without numbers yet: where it acts, and its factors; the amplitude is `a`."""

    acts_as: str
    factors: tuple[Atom, ...]
    size: float = 1.0

    @property
    def kinds(self) -> tuple[str, ...]:
        """What tells it from other forms, whatever its numbers."""
        return (self.acts_as, *sorted(f'{atom.kind}: {atom.text}' for atom in self.factors))

    @property
    def count(self) -> int:
        """How many parameters it has; a wave of few periods counts as one more."""
        return 1 + sum(len(atom.slots) + (atom.kind == 'slow wave') for atom in self.factors)

    @property
    def goes_on(self) -> bool:
        """Whether it says how it goes on beyond the stroke that was recorded: the position stands
        in waves alone, of several periods each, and waves repeat."""
        along = [atom for atom in self.factors if 'position' in atom.coordinates]
        return bool(along) and all(atom.kind in ('wave', 'turn') for atom in along)

    @property
    def linear(self) -> list[int]:
        """Which of its parameters a least-squares fit finds at once: amplitude and phase."""
        found, place = [0], 1
        for atom in self.factors:
            place += len(atom.slots)
            if atom.phase:
                found.append(place - 1)
        return found

    @property
    def formula(self) -> str:
        """The formula with the names of its parameters."""
        names = iter(_NAMES[1:])
        parts = ['a']
        for atom in self.factors:
            parts.append(atom.text.format(*(next(names) for _ in atom.slots)))
        return ' * '.join(parts)

    def parameters(self) -> tuple[Parameter, ...]:
        """Return what is fitted, the amplitude first; where a fit starts is `none` as well, so
        that no prior draws it anywhere."""
        unit = BASE_UNITS[self.acts_as]
        for atom in self.factors:
            unit = divided(unit, atom.unit)
        found = [Parameter('a', written(unit), -1e9, 1e9, none=0.0,
                           starts=(self.size or 1e-9,))]
        names = iter(_NAMES[1:])
        for atom in self.factors:
            for slot in atom.slots:
                found.append(Parameter(
                    next(names), slot.unit, slot.low, slot.high, none=slot.start,
                    starts=(slot.start,), logarithmic=slot.logarithmic))
        return tuple(found)

    def starts(self) -> tuple[float, ...]:
        """Return where its parameters start, the amplitude first."""
        return (self.size, *(slot.start for atom in self.factors for slot in atom.slots))

    def started(self, values: tuple[float, ...]) -> Form:
        """Return the form with these values as starts."""
        rest, factors = list(values[1:]), []
        for atom in self.factors:
            factors.append(atom.started(tuple(rest[:len(atom.slots)])))
            rest = rest[len(atom.slots):]
        return replace(self, factors=tuple(factors), size=values[0])


@dataclass(frozen=True)
class Scales:
    """How far the coordinates went in the recordings, for starts and bounds.

    `disc`, `temperature` are None where nothing was recorded of them; `angle` is 'rad' or 'm';
    `pulls_both_ways` tells that the load has either sign; `orders` [1/rad] are those of waves over
    the position that the residual shows.
    """

    low: float
    high: float
    speed: float
    load: float
    effort: float
    acceleration: float
    duration: float
    sampling: float
    disc: float | None
    temperature: tuple[float, float] | None
    angle: str = 'rad'
    pulls_both_ways: bool = False
    orders: tuple[float, ...] = ()

    @property
    def stroke(self) -> float:
        return self.high - self.low
