# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What each form of law would do to the filtered effort, to first order: columns for screening.

A factor is computed once for all recordings by the same stack machine that runs it afterwards;
products of factors are products of their columns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.effects.base import (
    ACCELERATION,
    DIRECTION,
    EFFORT,
    INERTIA,
    LEVEL,
    LOAD,
    LOAD_GAIN,
    POSITION,
    STATE_SIZE,
    VELOCITY,
    VISCOUS,
)
from engb_core.effects.law import law_value
from engb_core.laws.forms import Atom, Form, Scales
from engb_core.laws.grammar import parse
from engb_core.laws.machine import program_of
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques
from engb_core.signals.position_error import at_recorded_samples, carried

__all__ = ['Columns', 'recorded_range', 'scales_of']

Array = NDArray[np.float64]

_QUARTER = 0.5 * np.pi
_OF_THE_SENSOR = ('position_shift', 'position_delay')
# Share of the stroke over which slopes along the angle are taken.
_SLOPE = 1e-4
# Part of its largest size from which on a load pulls to the other side as well.
BOTH_WAYS = 0.05


def scales_of(fitter: Fitter) -> Scales:
    """Return how far the coordinates went."""
    problem = fitter.problem
    scene, runs = problem.scene, problem.runs
    acceleration = max(float(np.quantile(np.abs(run.motion.acceleration), 0.99)) for run in runs)
    disc = scene.disc_speed_range
    nominal = nominal_vector(problem.model)
    loads = np.concatenate([load_torques(nominal, run.motion.position) for run in runs])
    return Scales(
        low=scene.position_range[0], high=scene.position_range[1], speed=scene.speed,
        load=scene.largest_load, effort=scene.largest_effort, acceleration=acceleration,
        duration=scene.duration, sampling=scene.sampling,
        disc=None if disc is None else max(abs(disc[0]), abs(disc[1])) or None,
        temperature=scene.temperature_range,
        angle='rad' if scene.joint_type == 'revolute' else 'm',
        pulls_both_ways=bool(min(loads.max(), -loads.min()) > BOTH_WAYS * np.abs(loads).max()))


def recorded_range(fitter: Fitter, name: str) -> tuple[float, float]:
    """Return the least and the largest value of a coordinate of the motion that was recorded."""
    parts = [getattr(run.motion, name) for run in fitter.problem.runs]
    return (min(float(part.min()) for part in parts), max(float(part.max()) for part in parts))


class Columns:
    """Columns of forms on top of one fit."""

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self._runs = fitter.problem.runs
        self._samples: list[Array] = []
        self._speeds = recorded_range(fitter, 'velocity')
        self._slope_step = _SLOPE * max(float(np.ptp(run.motion.position)) for run in self._runs)
        sensitivities: dict[str, list[Array]] = {}
        for index, run in enumerate(self._runs):
            samples = run.samples.copy()
            physics = fit.hypothesis.physics(fit.vector, index)
            effort = effort_of_motion(samples, run.motion.step, physics)
            samples[:, EFFORT] = effort
            self._samples.append(samples)
            moved = samples.copy()
            moved[:, POSITION] += self._slope_step
            effort_of_motion(moved, run.motion.step, physics)
            direction = samples[:, DIRECTION]
            through = 1.0 + samples[:, LOAD_GAIN] * np.sign(samples[:, LOAD]) * direction
            stiffness = (moved[:, LOAD] - samples[:, LOAD]) / self._slope_step * through
            for name, values in (
                    ('torque', np.ones(effort.size)), ('effort_gain', -effort),
                    ('friction_gain', samples[:, LEVEL] * direction),
                    ('load_gain', samples[:, LOAD] * through),
                    ('delay', np.gradient(effort, run.motion.step)),
                    ('load_shift', stiffness)):
                sensitivities.setdefault(name, []).append(values)
        self._sensitivities = sensitivities
        self._known: dict[tuple[str, bool], list[Array]] = {}
        self._recorded = [at_recorded_samples(run.recording, run.motion, samples)
                          for run, samples in zip(self._runs, self._samples, strict=True)]

    def of(self, form: Form) -> Array:
        """Return how the filtered effort changes per unit of the form's amplitude, (m, 1), or
        (m, 2) where a phase is free: at the phase it starts at and a quarter turn on."""
        shifts = (0.0, _QUARTER) if any(atom.phase for atom in form.factors) else (0.0,)
        return np.stack([self._filtered(form, shift) for shift in shifts]).T

    def _filtered(self, form: Form, shift: float) -> Array:
        parts = []
        for index, run in enumerate(self._runs):
            raw = form.acts_as in _OF_THE_SENSOR
            factors = [self._factor(atom, shift, raw)[index] for atom in form.factors]
            value = factors[0] if factors else np.ones(
                (self._recorded if raw else self._samples)[index].shape[0])
            for factor in factors[1:]:
                value = value * factor
            if form.acts_as == 'position_delay':
                value = value * self._recorded[index][:, VELOCITY]
            parts.append(run.comparison(self._acting(form, value, shift, index)))
        return np.concatenate(parts)

    def _acting(self, form: Form, value: Array, shift: float, index: int) -> Array:
        if form.acts_as == 'inertia':
            slope = np.zeros(value.size)
            for atom in form.factors:
                own = self._factor(atom, shift)[index]
                ahead = self._evaluated(atom, shift, index, self._slope_step)
                rest = np.divide(value, own, out=np.zeros(value.size), where=own != 0.0)
                slope += rest * (ahead - own) / self._slope_step
            samples = self._samples[index]
            return value * samples[:, ACCELERATION] + 0.5 * slope * samples[:, VELOCITY] ** 2
        if form.acts_as in _OF_THE_SENSOR:
            run, samples = self._runs[index], self._samples[index]
            smooth, rate, curve = carried(run.recording, run.motion, value)
            return (self._sensitivities['load_shift'][index] * smooth
                    + samples[:, VISCOUS] * rate + samples[:, INERTIA] * curve)
        return self._sensitivities[form.acts_as][index] * value

    def _factor(self, atom: Atom, shift: float, raw: bool = False) -> list[Array]:
        """Return a factor's values on each run's grid, or at its recorded samples."""
        key = atom.filled(shift if atom.phase else 0.0), raw
        if key not in self._known:
            self._known[key] = [self._evaluated(atom, shift, index, raw=raw)
                                for index in range(len(self._runs))]
        return self._known[key]

    def _evaluated(self, atom: Atom, shift: float, index: int, moved: float = 0.0,
                   raw: bool = False) -> Array:
        text = atom.filled(shift if atom.phase else 0.0)
        # Friction's direction is known here, whatever the law acts as.
        parameters = program_of(parse(text), 'torque', {'velocity': self._speeds})
        samples = self._recorded[index] if raw else self._samples[index]
        if moved:
            samples = samples.copy()
            samples[:, POSITION] += moved
        return law_value.values(parameters, np.zeros(STATE_SIZE), samples)
