# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A hypothesis: a set of effects on top of the nominal model, as a vector of numbers to fit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
import itertools
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.fit_steps import weak_prior
from engb_core.diagnose.nominal import DELAY, NominalNumber, with_numbers
from engb_core.diagnose.onset import Onset
from engb_core.effects.base import Effect, Parameter, Scene
from engb_core.model import EffectSetting, Model
from engb_core.physics.plant import effects_of, Physics, physics_of, with_values

__all__ = ['Hypothesis', 'Variant', 'scaled', 'usual_angle', 'variants_of']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Variant:
    """An effect with its constants fixed: what is fitted are its parameters.

    With an `onset` it begins to act within the recordings.
    """

    effect: Effect
    constants: tuple[float, ...]
    onset: Onset | None = None

    @property
    def sizing(self) -> Parameter:
        return self.effect.parameters[0]

    @property
    def scalable(self) -> bool:
        """Whether the effect acts in proportion to its size, which least squares can find."""
        return self.sizing.none is not None and not self.sizing.logarithmic

    @property
    def number_only(self) -> bool:
        """Whether a number of the model file is wrong, and no physics missing: not where it
        changes while the brake is in use."""
        return self.effect.number_only and self.onset is None

    def reaches(self, sizes: Array) -> bool:
        """Whether sizes (1,), or (2,) with a phase, found by least squares are on this side of
        none: friction that falls with speed can't be had from an effect by which it only rises."""
        if not self.scalable or sizes.size != 1:
            return True
        sizing = self.sizing
        return bool(min(max(sizing.none + sizes[0], sizing.low), sizing.high) != sizing.none)

    def starts(self) -> list[dict[str, float]]:
        """Return where a fit may start: every combination of the parameters' starts, each as
        name → value. A size that acts in proportion is found by least squares instead."""
        first = 0 if self.sizing.logarithmic else 1
        others = [entry for entry in self.effect.parameters[first:] if entry.kind != 'phase']
        values = [entry.starts or (1.0,) for entry in others]
        return [dict(zip((entry.name for entry in others), combination, strict=True))
                for combination in itertools.product(*values)]


# The starts of the effects' distances and speeds are those of a motor's stroke.
USUAL_STROKE = 30.0     # rad
USUAL_SPEED = 50.0      # rad/s
LEAST_STROKE = 4.0      # rad


def variants_of(effect: Effect, scene: Scene) -> list[Variant]:
    """Return the effect's variants for what was recorded, those of its other forms last."""
    others = [variant for form in effect.forms if form.applies is None or form.applies(scene)
              for variant in variants_of(form, scene)]
    if effect.written is None:
        # An adopted law starts where it was found.
        effect = scaled(effect, scene)
    found = []
    for fixed in effect.variants:
        if fixed.get('by_temperature') and scene.temperature_range is None:
            continue
        values = {**effect.defaults, **fixed}
        if effect.set_constants is not None:
            values |= effect.set_constants(scene)
        found.append(Variant(effect, tuple(float(values[name]) for name, _ in effect.constants)))
    return found + others


def usual_angle(scene: Scene) -> float:
    """Return by what positions are divided so that a slider's stroke is as long as a motor's is
    usually: 1 for what turns."""
    if scene.joint_type == 'revolute':
        return 1.0
    low, high = scene.position_range
    return (high - low) / USUAL_STROKE


def scaled(effect: Effect, scene: Scene) -> Effect:
    """Return the effect with starts and bounds for a slider or a short swing."""
    low, high = scene.position_range
    if scene.joint_type == 'revolute' and high - low >= LEAST_STROKE:
        return effect
    scales = {'rad': (high - low) / USUAL_STROKE, 'rad/s': scene.speed / USUAL_SPEED}
    parameters = tuple(
        _of_waves(entry, usual_angle(scene)) if entry.unit == '1/rev' else
        entry if entry.kind in ('phase', 'disc_speed') or entry.unit not in scales else
        replace(entry, low=entry.low * min(scales[entry.unit], 1.0),
                starts=tuple(start * scales[entry.unit] for start in entry.starts))
        for entry in effect.parameters)
    return replace(effect, parameters=parameters)


def _of_waves(parameter: Parameter, angle: float) -> Parameter:
    """Return how often something repeats, for positions that are an angle times `angle`."""
    return replace(parameter, low=parameter.low / angle, high=parameter.high / angle,
                   starts=tuple(start / angle for start in parameter.starts))


@dataclass(frozen=True)
class Hypothesis:
    """Effects and free nominal numbers; its vector holds numbers first, then effect parameters.

    Logarithmic parameters stand as logarithms in the vector. A parameter that is to be found per
    recording stands once for every run. Effects of the model file that begin within the
    recordings are named in `given_onsets`.
    """

    model: Model
    numbers: tuple[NominalNumber, ...]
    variants: tuple[Variant, ...]
    runs: int = 1
    given_onsets: tuple[tuple[str, Onset], ...] = ()
    _places: tuple[tuple[int, int, int], ...] = field(init=False, repr=False, compare=False)
    _given: tuple[tuple[Effect, list[float]], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        places: list[tuple[int, int, int]] = []   # variant, parameter, run (−1: all)
        for index, variant in enumerate(self.variants):
            for place, parameter in enumerate(variant.effect.parameters):
                if parameter.per_recording:
                    places += [(index, place, run) for run in range(self.runs)]
                else:
                    places.append((index, place, -1))
        object.__setattr__(self, '_places', tuple(places))
        object.__setattr__(self, '_given', tuple(effects_of(self.model)))

    @property
    def ids(self) -> tuple[str, ...]:
        return tuple(variant.effect.id for variant in self.variants)

    @property
    def has_unnamed(self) -> bool:
        """Whether any of its effects is a description without a name."""
        return any(variant.effect.unnamed for variant in self.variants)

    @property
    def onsets(self) -> tuple[tuple[str, Onset], ...]:
        """The effects that begin within the recordings, (id, onset) each."""
        return (*self.given_onsets, *((variant.effect.id, variant.onset)
                                      for variant in self.variants if variant.onset is not None))

    @property
    def size(self) -> int:
        return len(self.numbers) + len(self._places)

    @property
    def places(self) -> tuple[tuple[int, int, int], ...]:
        """(variant, parameter, run or −1) of each effect entry of the vector."""
        return self._places

    def parameter(self, entry: int) -> Parameter:
        """Return the effect parameter at vector place `entry` (counted after the numbers)."""
        variant, place, _ = self._places[entry]
        return self.variants[variant].effect.parameters[place]

    def start_of_numbers(self) -> Array:
        """Return the model file's numbers, as the vector has them."""
        vector = physics_of(self.model, ()).nominal
        given = {effect.id: values for effect, values in self._given}
        return np.array([_inward((given[number.effect] if number.effect else vector)[number.place],
                                 number.logarithmic) for number in self.numbers])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the vector, (size,) each."""
        return (np.array([_inward(entry.low, entry.logarithmic) for entry in self._entries]),
                np.array([_inward(entry.high, entry.logarithmic) for entry in self._entries]))

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Centre and standard deviation of what is believed of the vector beforehand, (size,)
        each."""
        known = [weak_prior(self.parameter(entry)) for entry in range(len(self._places))]
        return (np.array([*self.start_of_numbers(), *(centre for centre, _ in known)]),
                np.array([*(number.spread for number in self.numbers),
                          *(width for _, width in known)]))

    def values(self, vector: Array, variant: int, run: int) -> list[float]:
        """Return the parameters and constants of one effect for one run, in the effect's order."""
        offset = len(self.numbers)
        values: dict[int, float] = {}
        for entry, (owner, place, which) in enumerate(self._places):
            if owner == variant and which in (-1, run):
                parameter = self.parameter(entry)
                values[place] = _outward(vector[offset + entry], parameter.logarithmic)
        return [values[place] for place in sorted(values)] + list(self.variants[variant].constants)

    def named(self, vector: Array, variant: int, run: int = 0) -> dict[str, float]:
        """Return the parameters and constants of one effect for one run by their names."""
        return dict(zip(self.variants[variant].effect.names,
                        self.values(vector, variant, run), strict=True))

    def given(self, effect: str) -> dict[str, float]:
        """Return what the file holds of an effect, by the names of its values; {} for nothing."""
        return next((dict(zip(entry.names, values, strict=True))
                     for entry, values in self._given if entry.id == effect), {})

    def throughout(self) -> Hypothesis:
        """Return the hypothesis on a recording that is yet to come: what began within those at
        hand acts all the time."""
        return replace(self, given_onsets=(), variants=tuple(
            replace(variant, onset=None) for variant in self.variants))

    def before(self, effect: str, onset: Onset | None) -> tuple[Hypothesis, NDArray[np.int64]]:
        """Return the hypothesis without an effect, as it is before that begins, and which entries
        of the vector it keeps."""
        kept = tuple(index for index, variant in enumerate(self.variants)
                     if (variant.effect.id, variant.onset) != (effect, onset))
        entries = [len(self.numbers) + entry for entry, (owner, _, _) in enumerate(self._places)
                   if owner in kept]
        model = self.model
        if (effect, onset) in self.given_onsets:
            model = replace(model, effects=tuple(
                entry for entry in model.effects if entry.effect != effect))
        return (Hypothesis(model, self.numbers, tuple(self.variants[index] for index in kept),
                           self.runs, tuple(entry for entry in self.given_onsets
                                            if entry != (effect, onset))),
                np.array([*range(len(self.numbers)), *entries], int))

    @cached_property
    def _made(self) -> Physics:
        """The physics as far as it does not depend on the vector; what the file holds already
        acts in every hypothesis."""
        return physics_of(self.model, [*self._given, *(
            (variant.effect, [0.0] * len(variant.effect.parameters) + list(variant.constants))
            for variant in self.variants)])

    @cached_property
    def _entries(self) -> tuple[NominalNumber | Parameter, ...]:
        """What each entry of the vector is."""
        return (*self.numbers, *map(self.parameter, range(len(self._places))))

    @cached_property
    def _logarithms(self) -> NDArray[np.bool_]:
        """Which entries of the vector are logarithms, (size,)."""
        return np.array([entry.logarithmic for entry in self._entries], np.bool_)

    @cached_property
    def _rows(self) -> list[int]:
        """Which of the file's effects each number is a parameter of, −1 for none."""
        rows = {effect.id: row for row, (effect, _) in enumerate(self._given)}
        return [rows[number.effect] if number.effect else -1 for number in self.numbers]

    def physics(self, vector: Array, run: int) -> Physics:
        """Return the physics of one run at `vector`."""
        values = vector.copy()
        values[self._logarithms] = np.exp(vector[self._logarithms])
        nominal, parameters = self._made.nominal.copy(), self._made.parameters.copy()
        for number, row, value in zip(self.numbers, self._rows, values, strict=False):
            if row < 0:
                nominal[number.place] = value
            else:
                parameters[row, number.place] = value
        for value, (owner, place, which) in zip(values[len(self.numbers):], self._places,
                                                strict=True):
            if which in (-1, run):
                parameters[len(self._given) + owner, place] = value
        return with_values(self._made, nominal, parameters)

    def corrected(self, vector: Array, run: int = 0) -> Model:
        """Return the model file with the fitted numbers and effects filled in."""
        numbers = {number.name: float(_outward(vector[place], number.logarithmic))
                   for place, number in enumerate(self.numbers)}
        model = with_numbers(self.model, numbers)
        given = [entry for entry in model.effects if entry.effect != DELAY]
        settings = []
        delay = numbers.pop(DELAY, 0.0) + sum(
            entry.parameters['delay'] for entry in self.model.effects if entry.effect == DELAY)
        if delay:
            settings.append(EffectSetting(DELAY, {'delay': delay}))
        for index, variant in enumerate(self.variants):
            if variant.effect.only_here:
                continue
            values = self.named(vector, index, run)
            for parameter in variant.effect.parameters:
                if parameter.kind == 'phase':
                    values[parameter.name] = math.remainder(values[parameter.name], 2.0 * math.pi)
            settings.append(EffectSetting(variant.effect.id, values)
                            if variant.effect.written is None else variant.effect.written(values))
        return replace(model, effects=(*given, *settings))


def _inward(value: float, logarithmic: bool) -> float:
    return math.log(max(value, 1e-300)) if logarithmic else value


def _outward(value: float, logarithmic: bool) -> float:
    return math.exp(value) if logarithmic else value
