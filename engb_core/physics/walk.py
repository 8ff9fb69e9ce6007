# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The torque that a whole motion needs, from what the last walk through its samples left there.

A derivative moves one number at a time, and most fits look for the numbers of one effect: what
comes before that effect is then what it was. So a motion passes the stages one after another where
no effect remembers from one stage to another, each as far as something in it has changed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from engb_core.effects.base import ACCELERATION, DIRECTION, INERTIA, LEVEL, LOAD, STAGES
from engb_core.physics.compiled import EffectFunction, kernel, row_of
from engb_core.physics.nominal_torque import N_DELAY, N_INERTIA
from engb_core.physics.plant import (
    nominal_sum,
    Physics,
    set_friction,
    set_load,
    set_numbers,
    torque_without_inertia,
)

__all__ = ['Walk']

Array = NDArray[np.float64]
Places = NDArray[np.int64]

# Where the stage of torques ends.
_TORQUES = STAGES.index('torque') + 1
# The stages that change a quantity of the sample, and its place.
_CHANGED = (('load', LOAD), ('level', LEVEL), ('direction', DIRECTION))


@dataclass
class Walk:
    """What the last walk of one table of samples through the stages came to.

    Whoever else writes into the table has to `forget`.

    Attributes:
        made: what of the physics does not depend on its numbers; None: nothing is known.
        numbers: the nominal numbers, and the parameters of all effects that act before those
            that only add a torque where these are walked with together, as bytes.
        given: of each function that changes a quantity, its parameters as bytes.
        before, after: what each of them found in its quantity (n,), and what it made of that.
        torques: (n,) that they need, without inertia and what is only added [N·m].
        inertial: (n,) that accelerates the shaft, before what is only added [N·m].
        values: (stage, place in it) → (parameters as bytes, values (n,)) of a function whose
            values are only added, or multiply.
        of_motion: the same of a function that looks at the motion alone, by the function.
        recorded: (k, SAMPLE_SIZE) the motion at the recording's own samples (None: nobody has
            asked).
    """

    made: object = None
    numbers: bytes = b''
    given: list[bytes] = field(default_factory=list)
    before: list[Array] = field(default_factory=list)
    after: list[Array] = field(default_factory=list)
    torques: Array = field(default_factory=lambda: np.zeros(0))
    inertial: Array = field(default_factory=lambda: np.zeros(0))
    values: dict[tuple[str, int], tuple[bytes, Array]] = field(default_factory=dict)
    of_motion: dict[EffectFunction, tuple[bytes, Array]] = field(default_factory=dict)
    recorded: Array | None = None

    def forget(self) -> None:
        """Forget the last walk, but not what the motion alone says: nobody changes that."""
        self.made = None

    def torques_of(self, physics: Physics, state: Array, samples: Array) -> Array:
        """Return the torque (n,) that the motor must give [N·m].

        Args:
            physics: model and effects.
            state: their fresh one.
            samples: (n, SAMPLE_SIZE); the columns of the stages are filled in.
        """
        if physics.shares_state:
            self.made = None
        if physics.one_by_one:
            self._by_stages(physics, state, samples)
        else:
            self._by_samples(physics, state, samples)
        torques: Array
        if physics.apart:
            torques = self.torques.copy()
            for place in range(len(physics.apart)):
                torques += self.values_of('torque', place, physics, state, samples)
            if not _with_inertia(samples, torques, physics.nominal[N_INERTIA]):
                # An effect that adds to the inertia has added to what is in the samples.
                self.forget()
        else:
            torques = self.torques + self.inertial
        if physics.shares_state:
            self.forget()
        return torques

    def values_of(self, stage: str, place: int, physics: Physics, state: Array,
                  samples: Array) -> Array:
        """Return the values (n,) of a function that stands at a place of its stage: of those that
        only add a torque, or of those of actuation. Arguments as for `torques_of`."""
        function, effect = (physics.apart if stage == 'torque' else physics.stages[stage])[place]
        parameters = physics.parameters[effect]
        if physics.of_motion[effect]:
            return self._of_motion(function, parameters, state[effect], samples)
        given = parameters.tobytes()
        known = None if self.made is None else self.values.get((stage, place))
        if known is not None and known[0] == given:
            return known[1]
        values = function.values(parameters, state[effect], samples)
        self.values[stage, place] = given, values
        return values

    def _of_motion(self, function: EffectFunction, parameters: Array, state: Array,
                   samples: Array) -> Array:
        """Return the values (n,) of a function that looks at the motion alone."""
        given, known = parameters.tobytes(), self.of_motion.get(function)
        if known is not None and known[0] == given:
            return known[1]
        values = function.values(parameters, state, samples)
        self.of_motion[function] = given, values
        return values

    def _goes_on(self, physics: Physics, numbers: bytes) -> bool:
        """Whether the last walk was with the same numbers; else it begins anew with them."""
        if self.made is physics.functions and self.numbers == numbers:
            return True
        self.made, self.numbers = physics.functions, numbers
        self.values.clear()
        return False

    def _by_samples(self, physics: Physics, state: Array, samples: Array) -> None:
        """Walk each sample through all stages."""
        before = physics.owner[:physics.walked[_TORQUES]]
        numbers = _nominal(physics).tobytes() + physics.parameters[before].tobytes()
        if not self._goes_on(physics, numbers):
            self.torques, self.inertial = np.empty((2, samples.shape[0]))
            _needed(physics.nominal, physics.cogging, physics.functions, physics.walked,
                    physics.owner, physics.parameters, state, samples, self.torques,
                    self.inertial)

    def _by_stages(self, physics: Physics, state: Array, samples: Array) -> None:
        """Walk all samples through one stage after another, from where something has changed."""
        anew = not self._goes_on(physics, _nominal(physics).tobytes())
        functions = [(function, effect, column) for stage, column in _CHANGED
                     for function, effect in physics.stages[stage]]
        given = [physics.parameters[effect].tobytes() for _, effect, _ in functions]
        first = 0 if anew else next((place for place, (old, new) in enumerate(
            zip(self.given, given, strict=True)) if old != new), len(functions))
        if first == len(functions):
            return
        if anew:
            _loaded(physics.nominal, samples)
            self.before, self.after = ([np.zeros(0)] * len(functions) for _ in range(2))
            self.given = [b''] * len(functions)
        rubs = anew or functions[first][2] == LOAD
        begun = -1
        for place, (function, effect, column) in enumerate(functions[first:], first):
            if rubs and column != LOAD:
                _rubbed(physics.nominal, samples)
                rubs, anew = False, True
            if column != begun and not anew:
                # It still holds what came of it.
                samples[:, column] = self.before[place]
            begun = column
            found = samples[:, column].copy()
            parameters = physics.parameters[effect]
            if not physics.of_motion[effect]:
                made = function.values(parameters, state[effect], samples)
            elif column != DIRECTION:
                # It is proportional to what it finds.
                samples[:, column] = 1.0
                made = found * self._of_motion(function, parameters, state[effect], samples)
            elif given[place] == self.given[place] and np.array_equal(found, self.before[place]):
                made = self.after[place]
            else:
                made = function.values(parameters, state[effect], samples)
            self.before[place], self.after[place] = found, made
            samples[:, column] = made
        if rubs:
            _rubbed(physics.nominal, samples)
        self.values.clear()
        self.given = given
        self.torques, self.inertial = np.empty((2, samples.shape[0]))
        if not _summed(physics.nominal, physics.cogging, samples, self.torques, self.inertial):
            # What is in the samples was added to: it is none to go on from.
            self.forget()


def _nominal(physics: Physics) -> Array:
    """Return the nominal numbers without the delay, which acts behind all stages."""
    nominal = physics.nominal.copy()
    nominal[N_DELAY] = 0.0
    return nominal


@kernel
def _needed(nominal: Array, cogging: Array, functions: object, bounds: Places, owner: Places,
            parameters: Array, state: Array, samples: Array, torques: Array, inertial: Array,
            ) -> None:
    for row in range(samples.shape[0]):
        sample = row_of(samples, row)
        # What moves the load knows that of the sample before, as in a simulation.
        sample[LOAD] = samples[row - 1, LOAD] if row > 0 else 0.0
        torques[row] = torque_without_inertia(nominal, cogging, functions, bounds, owner,
                                              parameters, state, sample)
        inertial[row] = sample[INERTIA] * sample[ACCELERATION]


# What `torque_without_inertia` does to a sample, for all of them stage by stage.

@kernel
def _loaded(nominal: Array, samples: Array) -> None:
    for row in range(samples.shape[0]):
        sample = row_of(samples, row)
        set_numbers(nominal, sample)
        set_load(nominal, sample, 0.0)


@kernel
def _rubbed(nominal: Array, samples: Array) -> None:
    for row in range(samples.shape[0]):
        set_friction(nominal, row_of(samples, row))


@kernel
def _summed(nominal: Array, cogging: Array, samples: Array, torques: Array, inertial: Array,
            ) -> bool:
    """Write the torques and what accelerates the shaft, (n,) each; return whether its inertia is
    the model's throughout."""
    constant = True
    for row in range(samples.shape[0]):
        sample = row_of(samples, row)
        torques[row] = nominal_sum(nominal, cogging, sample)
        inertial[row] = sample[INERTIA] * sample[ACCELERATION]
        constant = constant and sample[INERTIA] == nominal[N_INERTIA]
    return constant


@kernel
def _with_inertia(samples: Array, torques: Array, inertia: float) -> bool:
    """Add to the torques (n,) what accelerates the shaft; return whether its inertia is `inertia`
    throughout."""
    constant = True
    for row in range(samples.shape[0]):
        torques[row] += samples[row, INERTIA] * samples[row, ACCELERATION]
        constant = constant and samples[row, INERTIA] == inertia
    return constant
