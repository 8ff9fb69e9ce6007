# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Machines to be exported, and what each does in a drive of two seconds, here and in C."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from pathlib import Path
import subprocess

import numpy as np
import pytest

from engb_core.effect_check import MODEL
from engb_core.effects.base import LOAD, POSITION, VELOCITY
from engb_core.effects.catalogue import catalogue
from engb_core.export.c_model import CModel
from engb_core.export.fmu import compiler, FLAGS
from engb_core.model import Cogging, EffectSetting, Model
from engb_core.physics.simulation import BrakePlant
from tests.core.loops import drawn, model_with

STEP = 1e-3
TIME = np.arange(0.0, 2.0, STEP)
# Into the load and out of it, with reversals, while a disc runs up and a pad gets warm.
EFFORT = 0.12 * np.sin(2.0 * TIME) + 0.05 * np.sin(11.0 * TIME) + 0.02 * np.sin(40.0 * TIME)
DISC, WARMTH = 20.0 * TIME, 20.0 + 60.0 * TIME
EFFECTS = [effect for effect in catalogue().values() if effect.made_of is None]
LAWS = {
    'torque': ('a * abs(load) * sin(k * position + c)', {'a': 0.03, 'k': 1.25, 'c': 3.84}),
    'friction_gain': ('a * tanh(since_reversal / d) + b * lag(abs(velocity), t)',
                      {'a': 0.4, 'd': 1.5, 'b': 0.002, 't': 0.05}),
    'load_gain': ('a * heat(abs(velocity), t)', {'a': 0.002, 't': 0.4}),
    'effort_gain': ('-a * effort**2', {'a': 4.0}),
    'inertia': ('a * cos(position)', {'a': 2e-5}),
    'position_shift': ('a * sin(position + c)', {'a': 0.05, 'c': 0.4}),
    'load_shift': ('a * heat(abs(load * velocity), t)', {'a': 0.02, 't': 0.4}),
    'delay': ('a + b * abs(velocity)', {'a': 0.003, 'b': 2e-5}),
}


def with_law(acts_as: str) -> Model:
    """Return the model with a law of this place."""
    formula, values = LAWS[acts_as]
    return replace(MODEL, effects=(EffectSetting('law', dict(values), formula, acts_as, {
        'position': (-10.0, 80.0), 'velocity': (-200.0, 200.0)}),))


def machines() -> dict[str, Model]:
    """Return the nominal model, a rich one, and one for each effect and each place of a law."""
    rich = replace(MODEL, cogging=(Cogging(7.0, 1e-3, 0.3), Cogging(1.0, 5e-4)),
                   friction=replace(MODEL.friction, load_curvature=-0.4, reference_load=0.2))
    return {'nominal': MODEL, 'rich': rich,
            **{effect.id: model_with(effect, drawn(effect, 0)) for effect in EFFECTS},
            **{f'law_{acts_as}': with_law(acts_as) for acts_as in LAWS}}


def simulated(model: Model) -> np.ndarray:
    """Return position, velocity and load torque (n, 3) after each step of the drive, here."""
    plant = BrakePlant(model)
    rows = []
    for effort, disc, warmth in zip(EFFORT, DISC, WARMTH, strict=True):
        plant.advance(float(effort), STEP, float(disc), float(warmth))
        rows.append((plant.position, plant.velocity, plant.load_torque))
    return np.array(rows)


def differs(one: np.ndarray, other: np.ndarray) -> float:
    """Return by how much two runs differ, each column over its largest value."""
    size = np.maximum(np.abs(one).max(axis=0), 1e-12)
    return float((np.abs(one - other).max(axis=0) / size).max())


def compiled_library(folder: Path, made: CModel, *flags: str) -> ctypes.CDLL:
    """Compile a model's C without any warning, and load it."""
    found = compiler()
    if found is None:
        pytest.skip('no C compiler (cc, gcc, clang)')
    (folder / 'engb_model.h').write_text(made.header, encoding='utf-8')
    (folder / 'engb_model.c').write_text(made.source, encoding='utf-8')
    subprocess.run([found, *FLAGS, '-fvisibility=default', '-Wall', '-Wextra', '-Werror',
                    '-pedantic', *flags, '-o', 'model.so', 'engb_model.c', '-lm'], cwd=folder,
                   check=True)
    return ctypes.CDLL(str(folder / 'model.so'))


class PlantInC:
    """An exported plant, as compiled."""

    def __init__(self, library: ctypes.CDLL, made: CModel, model: Model) -> None:
        rows = len(model.effects) + 1
        sizes = [1, _size(made, 'NOMINAL_SIZE'), 3 * len(model.cogging) + 1,
                 rows * _size(made, 'PARAMETER_SIZE'), rows * _size(made, 'STATE_SIZE')]
        self._sample = sum(sizes)
        self._memory = (ctypes.c_double * (self._sample + _size(made, 'SAMPLE_SIZE')
                                           + _size(made, 'LOOP_SIZE')))()
        self._library = library
        for name, count in (('init', 1), ('advance', 4), ('recorded', 2), ('acted', 2),
                            ('loop', 3)):
            function = getattr(library, f'engb_plant_{name}')
            function.argtypes = [ctypes.c_void_p, *[ctypes.c_double] * count]
            function.restype = None if name in ('init', 'advance') else ctypes.c_double

    def begin(self, position: float) -> None:
        self._library.engb_plant_init(self._memory, position)

    def advance(self, effort: float, duration: float, disc: float, warmth: float) -> None:
        self._library.engb_plant_advance(self._memory, effort, duration, disc, warmth)

    def recorded(self, effort: float, duration: float) -> float:
        return float(self._library.engb_plant_recorded(self._memory, effort, duration))

    def loop(self, angle: float, speed: float, push: float) -> float:
        return float(self._library.engb_plant_loop(self._memory, angle, speed, push))

    def __getattr__(self, name: str) -> float:
        """Return position, velocity or load, out of the sample."""
        return float(self._memory[self._sample + PLACES[name]])


PLACES = {'position': POSITION, 'velocity': VELOCITY, 'load': LOAD}


def run_in_c(library: ctypes.CDLL, made: CModel, model: Model) -> np.ndarray:
    """Return what `simulated` does, from the compiled model."""
    plant = PlantInC(library, made, model)
    plant.begin(0.0)
    found = []
    for effort, disc, warmth in zip(EFFORT, DISC, WARMTH, strict=True):
        plant.advance(effort, STEP, disc, warmth)
        found.append([plant.position, plant.velocity, plant.load])
    return np.array(found)


def _size(made: CModel, name: str) -> int:
    line = next(line for line in made.header.splitlines() if line.startswith(
        f'#define ENGB_{name} '))
    return int(line.split()[-1])
