# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What `import engb_core as engb` offers: read, diagnose, predict and simulate from Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.diagnose import diagnosis as told
from engb_core.errors import InputError
from engb_core.mechanism.kinematics import Mechanism
from engb_core.model import Model
from engb_core.recording import Recording as Run
from engb_core.recording import Reference, refuse_copies, refuse_new_start, Signal

__all__ = ['Diagnosis', 'Recording', 'diagnose', 'load_model', 'predict', 'read', 'simulate']

Array = NDArray[np.float64]

FilePath = str | os.PathLike[str]


def Recording(time: ArrayLike, position: ArrayLike, effort: ArrayLike,
              velocity: ArrayLike | None = None, *, name: str = 'recording',
              reference: Reference | None = None,
              signals: dict[str, Signal] | None = None) -> Run:
    """Make a recording of arrays, cleaned of samples that are doubled or not finite.

    Args:
        time: (n,) [s], on any clock.
        position: (n,) motor angle [rad] (prismatic: [m]).
        effort: (n,) motor torque [N·m] (prismatic: [N]): torque constant times current.
        velocity: (n,) [rad/s], where the drive gives one.
        name: for reports; each recording of a diagnosis needs its own.
        reference, signals: what was tracked, and side signals, on the clock of `time`.

    Raises:
        InputError: a column that is no row of numbers, columns of different lengths, or fewer
            than 20 usable samples.
    """
    stamp, angle, torque, speed = (
        None if values is None else _numbers(name, key, values) for key, values in (
            ('time', time), ('position', position), ('effort', effort), ('velocity', velocity)))
    shapes = {key: values.shape for key, values in (
        ('time', stamp), ('position', angle), ('effort', torque), ('velocity', speed))
        if values is not None}
    if stamp is None or angle is None:
        raise InputError(f'{name}: time and position are needed, (n,) floats in SI units')
    if len(set(shapes.values())) > 1 or len(shapes['time']) != 1:
        raise InputError(f'{name}: the columns have to be of one length: ' + ', '.join(
            f'{key} {shape}' for key, shape in shapes.items()))
    refuse_new_start(name, stamp)
    return Run.from_samples(name, stamp, angle, torque, speed, reference, signals)


def _numbers(name: str, column: str, values: ArrayLike) -> Array:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise InputError(f'{name}: {column} is no row of numbers ({error}); give (n,) floats in '
                         'SI units') from None


def read(path: FilePath, model: Model | FilePath | None = None, joint: str | None = None) -> Run:
    """Read a recording (a bag's folder, .mcap, .db3) or a table (.csv, .mat, .parquet, …).

    Args:
        path: what to read; needs neither ROS nor engb_ros.
        model: tells the joint's name, and the torque constant where effort is a current; a Model
            or the path of a model file.
        joint: which one of a bag that holds several (None: the model's).

    Raises:
        InputError: not readable, or something is missing that the table does not tell.
    """
    from engb_core.io.tables.open import is_table
    if not isinstance(path, str | os.PathLike):
        raise InputError(f'{_kind(path)} is no path; name a recording\'s file or folder')
    if not os.path.exists(path):
        raise InputError(f'{path}: there is no such file or folder')
    if model is not None:
        model = _model(model)
    name = joint or (None if model is None else model.joint.name)
    if not is_table(str(path)):
        from engb_core.io.bags.read import read_recording
        return read_recording(path, name, effort_optional=True)
    from engb_core.io.tables.measure import measured_of
    from engb_core.io.tables.request import Request
    constant = None if model is None else model.motor.torque_constant
    measured, _ = measured_of(path, Request(
        torque_constant=constant, command=('engb', 'import', str(path))))
    return measured.recording(name or 'motor')


def load_model(path: FilePath) -> Model:
    """Read a model file.

    Args:
        path: of a YAML file, format engb-model/1.

    Raises:
        InputError: missing, or a value that is wrong; the message names it.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f'{_kind(path)} is no path; name a model file')
    return Model.read(path)


@dataclass(frozen=True)
class Diagnosis(told.Diagnosis):
    """A diagnosis that shows itself. `model` is the corrected model (`model.save(path)`)."""

    def to_dict(self) -> dict[str, Any]:
        """Return the mapping of diagnosis.json (docs/diagnosis.schema.json)."""
        from engb_core.diagnose.document import to_document
        return to_document(self)

    def compare(self) -> list[dict[str, Any]]:
        """Return how far the given and the corrected model are off what no fit has seen.

        A row for each recording and quantity: `recording`, `quantity`, `rms_before`, `rms_after`,
        `noise_floor` (None: not known), `unit`; pandas.DataFrame takes it as it is.
        """
        return [{entry.name: getattr(row, entry.name) for entry in fields(row)}
                for row in self.held_out]

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame: a row for each parameter of each effect that was found.

        Columns: `effect`, `probability`, `share` (of the mismatch that it explains), `parameter`,
        `value`, `std` (NaN: not known), `unit` (of both). `compare()` has the errors.

        Raises:
            InputError: pandas is not installed.
        """
        from engb_core.frames import parameter_frame
        return parameter_frame(self)

    def plot(self) -> Any:
        """Return a matplotlib figure: what each model leaves of the effort, over time.

        Raises:
            InputError: matplotlib is not installed.
        """
        try:
            from matplotlib.figure import Figure
        except ImportError:
            raise InputError('plot() needs matplotlib: pip install matplotlib; the report '
                             'and compare() need nothing') from None
        traces = self.evidence.traces
        figure = Figure(figsize=(9.0, 2.6 * max(1, len(traces))), layout='constrained')
        axes = figure.subplots(max(1, len(traces)), squeeze=False)[:, 0]
        for axis, trace in zip(axes, traces, strict=False):
            for words, predicted in (('given model', trace.predicted_before),
                                     ('corrected model', trace.predicted_after)):
                axis.plot(trace.time, np.where(trace.judged, trace.effort - predicted, np.nan),
                          linewidth=0.8, label=words)
            unit = 'N·m' if self.model.joint.type == 'revolute' else 'N'
            axis.set(xlabel='time [s]', ylabel=f'measured − predicted [{unit}]',
                     title=trace.recording + (', held out' if trace.held_out else ''))
            axis.legend(loc='upper right')
        return figure

    def _repr_html_(self) -> str:
        """Return the report in a frame of its own, for notebooks."""
        from html import escape

        from engb_core.report.page import diagnosis_page
        return (f'<iframe srcdoc="{escape(diagnosis_page(self).html())}" '
                'style="width:100%;height:800px;border:0"></iframe>')


def diagnose(recordings: Run | FilePath | Sequence[Run | FilePath], model: Model | FilePath,
             holdout: Run | FilePath | Sequence[Run | FilePath] = (),
             progress: Callable[[str], None] | None = None,
             level: float | None = None, mechanism: Mechanism | None = None) -> Diagnosis:
    """Compare a model with recordings and say what physics it leaves out.

    Args:
        recordings: one or several, which may be fitted; paths are read.
        model: the nominal model, or the path of its file.
        holdout: one or several, judged only; without any, a part of the recordings is kept out
            of every fit.
        progress: is told what is being done, a line each.
        level: of the sets of causes, `EffectFinding.causes`, within 0 and 1 (None: 0.9) [-].
        mechanism: of the brake (`engb_core.control.clamp_force.read_mechanism`); a law that
            repeats along the stroke then says which part turns so.

    Raises:
        InputError: too little motion to judge a model by, units that cannot be right, two
            recordings of one name, or one that is held out and fitted.
    """
    from engb_core.diagnose.cause_sets import checked_level, with_cause_sets
    from engb_core.diagnose.engine import diagnose as found_by
    if level is not None:
        checked_level(level)
    model = _model(model)
    fitted, held = (_several(given, model) for given in (recordings, holdout))
    _refuse_one_name([*fitted, *held])
    refuse_copies(fitted, held)
    found = found_by(fitted, model, held, progress)
    if level is not None:
        found = replace(found, effects=with_cause_sets(found.effects, level))
    if mechanism is not None:
        from engb_core.laws.shafts import with_mechanism
        found = with_mechanism(found, mechanism)
    return Diagnosis(**{entry.name: getattr(found, entry.name) for entry in fields(found)})


def predict(recording: Run | FilePath, model: Model | FilePath) -> Array:
    """Return the effort (n,) [N·m] that the model says the recorded motion needs.

    Args:
        recording: its motion is taken, not its effort; a path is read.
        model: the nominal or a corrected model, or the path of its file.

    Raises:
        InputError: one can't be read, or the model has an unknown effect.
    """
    from engb_core.prediction import predict_effort
    model = _model(model)
    return predict_effort(_run(recording, model), model)


def simulate(recording: Run | FilePath, model: Model | FilePath) -> tuple[Array, Array]:
    """Return position (n,) [rad] and velocity (n,) [rad/s] of the model in the recorded loop.

    Args:
        recording: its reference is tracked, from its first position on; a path is read.
        model: with the controller that closed the loop, or the path of its file.

    Raises:
        InputError: the recording has no reference, or the model no controller.
    """
    from engb_core.physics.simulation import simulate_closed_loop
    model = _model(model)
    return simulate_closed_loop(_run(recording, model), model)


def _several(given: Run | FilePath | Sequence[Run | FilePath], model: Model) -> list[Run]:
    if isinstance(given, Run | str | os.PathLike) or not isinstance(given, Iterable):
        return [_run(given, model)]
    return [_run(entry, model) for entry in given]


def _run(given: Run | FilePath, model: Model) -> Run:
    if isinstance(given, Run):
        return given
    if isinstance(given, str | os.PathLike):
        return read(given, model)
    raise InputError(f'{_kind(given)} is no recording; give an engb.Recording, or the path of a '
                     'bag or a table')


def _model(given: Model | FilePath) -> Model:
    if isinstance(given, Model):
        return given
    if isinstance(given, str | os.PathLike):
        return load_model(given)
    raise InputError(f'{_kind(given)} is no model; give an engb.Model, or the path of a model '
                     'file (engb model makes a first one of a recording)')


def _kind(given: object) -> str:
    return 'None' if given is None else f'an object of type {type(given).__name__}'


def _refuse_one_name(recordings: Sequence[Run]) -> None:
    names = [recording.name for recording in recordings]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f'two recordings are called {twice!r}, by which a report tells them '
                         'apart; give each one of its own: engb.Recording(…, name=…), or '
                         'dataclasses.replace(recording, name=…)')
