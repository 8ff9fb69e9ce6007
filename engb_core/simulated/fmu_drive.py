# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""An FMU driven along a real recording: what it does becomes a simulator's recording.

The unit is a machine that takes an effort and gives a position (FMI 2 or 3, co-simulation). A
loop makes it follow the real motion: feedforward of a first model of the real recording, and
feedback as fast as a diagnosis compares. What the unit needs for that motion is its recording.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math
import os
from pathlib import Path
import shutil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.identify.first_model import first_model
from engb_core.model import Model
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import friction_torques, load_torques
from engb_core.recording import Recording, Reference
from engb_core.signals.motion import motion_of

__all__ = ['recording_of_fmu']

Array = NDArray[np.float64]

# What the variables of other people's units are called; asked in this order.
_NAMES = {'effort': ('effort', 'torque', 'tau', 'motor_torque', 'force', 'u'),
          'position': ('position', 'angle', 'phi', 'theta', 'q', 'x', 's')}
_UNITS = {'effort': {'N.m': 1.0, 'N': 1.0, 'mN.m': 1e-3, 'kN': 1e3},
          'position': {'rad': 1.0, 'm': 1.0, 'deg': math.pi / 180.0, 'mm': 1e-3}}
_SIDE = ('disc_speed', 'pad_temperature')
# [rad/s] The loop follows what a diagnosis compares (20 Hz), and is slow against its own samples.
_FASTEST, _OF_SAMPLES = 2.0 * math.pi * 20.0, 0.2
# [s] in which the unit is brought to where the real recording begins.
_LEAD_IN = 1.0


@dataclass(frozen=True)
class _Variable:
    name: str
    reference: int
    scale: float


def recording_of_fmu(path: str | os.PathLike[str], real: Recording,
                     names: Mapping[str, str] | None = None,
                     progress: Callable[[str], None] | None = None) -> Recording:
    """Return what a unit needs to move as the real machine did.

    Args:
        path: the .fmu file.
        real: the recording whose motion it follows; its disc speed and pad temperature are given
            to the unit where it has such inputs.
        names: 'effort' and 'position' → the unit's names of them, where they can't be told.
        progress: is told what is being done.

    Raises:
        InputError: fmpy is not installed, the unit can't be read or run, or its variables can't
            be told.
    """
    try:
        import fmpy
    except ImportError:
        raise InputError(f'{path}: an FMU needs FMPy: pip install fmpy') from None
    if not Path(path).is_file():
        raise InputError(f'{path}: there is no such file')
    tell = progress or (lambda text: None)
    try:
        description = fmpy.read_model_description(str(path))
    except Exception as error:
        raise InputError(f'{path}: is no FMU that can be read ({_line(error)})') from error
    if description.coSimulation is None:
        raise InputError(f'{path}: is for model exchange only; export it for co-simulation')
    effort = _variable(path, description, 'effort', 'input', names or {})
    position = _variable(path, description, 'position', 'output', names or {})
    tell('a first model of the real recording, to drive the FMU with')
    model = first_model([real]).model
    folder = fmpy.extract(str(path))
    try:
        tell('driving the FMU along the real motion')
        return _driven(fmpy, folder, description, effort, position, real, model, str(path))
    except InputError:
        raise
    except Exception as error:
        raise InputError(f'{path}: cannot be run ({_line(error)}); a unit without a binary for '
                         'this machine: `fmpy compile`') from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


def _variable(path: str | os.PathLike[str], description: Any, role: str, causality: str,
              names: Mapping[str, str]) -> _Variable:
    offered = {entry.name: entry for entry in description.modelVariables
               if entry.causality == causality and entry.type in ('Real', 'Float64')}
    wanted = names.get(role)
    if wanted is None:
        lower = {name.lower().split('.')[-1]: name for name in offered}
        wanted = next((lower[name] for name in _NAMES[role] if name in lower), None)
    if wanted is None and len(offered) == 1:
        wanted = next(iter(offered))
    if wanted is None or wanted not in offered:
        raise InputError(f'{path}: which {causality} is the {role}? Say --fmu-variable '
                         f'{role}=NAME, one of {", ".join(offered) or "none"}')
    entry = offered[wanted]
    unit = entry.unit or (getattr(entry.declaredType, 'unit', None)
                          if entry.declaredType is not None else None)
    known = _UNITS[role]
    if unit and unit not in known:
        raise InputError(f'{path}: {wanted} is in {unit}; what is understood is '
                         f'{", ".join(known)}')
    return _Variable(wanted, entry.valueReference, known.get(unit, 1.0) if unit else 1.0)


def _driven(fmpy: Any, folder: str, description: Any, effort: _Variable, position: _Variable,
            real: Recording, model: Model, path: str) -> Recording:
    unit = fmpy.instantiate_fmu(folder, description, 'CoSimulation')
    third = description.fmiVersion.startswith('3')
    set_values = unit.setFloat64 if third else unit.setReal
    get_values = unit.getFloat64 if third else unit.getReal
    if third:
        unit.enterInitializationMode(startTime=0.0)
    else:
        unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
    unit.exitInitializationMode()

    def where() -> float:
        return position.scale * float(get_values([position.reference])[0])

    begin = where()
    step = real.interval
    wanted, given = _wanted(real, model, begin, step)
    sides = _sides(description, real, wanted.shape[0], step)
    inertia = model.motor.inertia
    fast = min(_FASTEST, _OF_SAMPLES / step)
    gains = inertia * fast ** 2, 2.0 * inertia * fast
    rows, before = np.empty((wanted.shape[0], 2)), begin
    for row in range(wanted.shape[0]):
        here = where()
        rate = (here - before) / step
        before = here
        torque = (given[row] + gains[0] * (wanted[row, 0] - here)
                  + gains[1] * (wanted[row, 1] - rate))
        if not math.isfinite(torque):
            raise InputError(f'{path}: runs away at {row * step:.3f} s when it is driven; is '
                             f'{effort.name} a torque of the same sign as {position.name}?')
        rows[row] = here, torque
        set_values([effort.reference], [torque / effort.scale])
        for reference, values in sides:
            set_values([reference], [float(values[row])])
        unit.doStep(currentCommunicationPoint=row * step, communicationStepSize=step)
    unit.terminate()
    unit.freeInstance()
    time = np.arange(wanted.shape[0], dtype=np.float64) * step - _LEAD_IN
    signals = {name: signal for name, signal in real.signals.items() if name in _SIDE}
    # Effort acts from its sample to the next; position is that of the sample.
    return Recording.from_samples(
        Path(path).stem, time, rows[:, 0], rows[:, 1],
        reference=Reference(time, wanted[:, 0], wanted[:, 1]), signals=signals)


def _wanted(real: Recording, model: Model, begin: float, step: float) -> tuple[Array, Array]:
    """Return position and speed to follow (n, 2), a move to the start before them, and the
    feedforward (n,) of the first model."""
    motion = motion_of(real)
    time = np.arange(-_LEAD_IN, real.time[-1], step)
    place, speed, acceleration = (np.interp(time, motion.time, values) for values in (
        motion.position, motion.velocity, motion.acceleration))
    before = time < 0.0
    part = (time[before] + _LEAD_IN) / _LEAD_IN
    way = float(motion.position[0]) - begin
    place[before] = begin + way * 0.5 * (1.0 - np.cos(np.pi * part))
    speed[before] = way * 0.5 * np.pi / _LEAD_IN * np.sin(np.pi * part)
    acceleration[before] = way * 0.5 * (np.pi / _LEAD_IN) ** 2 * np.cos(np.pi * part)
    nominal = nominal_vector(model)
    load = load_torques(nominal, place)
    given = (model.motor.inertia * acceleration + model.motor.viscous_friction * speed + load
             + friction_torques(nominal, load, speed))
    return np.column_stack([place, speed]), given


def _sides(description: Any, real: Recording, size: int, step: float
           ) -> Sequence[tuple[int, Array]]:
    time = np.arange(size, dtype=np.float64) * step - _LEAD_IN
    return [(entry.valueReference, real.signals[entry.name].at(time))
            for entry in description.modelVariables
            if entry.causality == 'input' and entry.name in _SIDE and entry.name in real.signals]
