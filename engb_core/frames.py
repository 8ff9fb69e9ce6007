# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings and diagnoses as tables of pandas, xarray and Arrow, where these are installed."""

from __future__ import annotations

import importlib
from typing import Any, TYPE_CHECKING

import numpy as np

from engb_core.errors import InputError

if TYPE_CHECKING:
    from engb_core.diagnose.diagnosis import Diagnosis
    from engb_core.recording import Array, Recording

__all__ = ['arrow_table', 'data_frame', 'data_set', 'parameter_frame']

_ROTARY = {'time': 's', 'position': 'rad', 'velocity': 'rad/s', 'effort': 'N·m'}
_LINEAR = {'time': 's', 'position': 'm', 'velocity': 'm/s', 'effort': 'N'}
# Side signals whose unit is fixed (docs/contract.md).
_SIGNALS = {'disc_speed': 'rad/s', 'pad_temperature': '°C', 'clamp_force': 'N'}


def data_frame(recording: Recording) -> Any:
    """Return a pandas.DataFrame; see `Recording.to_pandas`."""
    columns = _columns(recording)
    index = _library('pandas').Index(columns.pop('time'), name='time')
    return _library('pandas').DataFrame(columns, index=index)


def data_set(recording: Recording, prismatic: bool = False) -> Any:
    """Return an xarray.Dataset; see `Recording.to_xarray`."""
    columns, units = _columns(recording), _units(prismatic)
    entries = {name: ('time', values, {'units': units[name]} if name in units else {})
               for name, values in columns.items()}
    return _library('xarray').Dataset(
        {name: entry for name, entry in entries.items() if name != 'time'},
        coords={'time': entries['time']},
        attrs={'name': recording.name, 'joint': recording.joint, 'start': recording.start})


def arrow_table(recording: Recording, prismatic: bool = False) -> Any:
    """Return a pyarrow.Table; see `Recording.to_arrow`."""
    arrow, units = _library('pyarrow'), _units(prismatic)
    columns = _columns(recording)
    schema = arrow.schema(
        [arrow.field(name, arrow.float64(),
                     metadata={'unit': units[name]} if name in units else None)
         for name in columns],
        metadata={'name': recording.name, 'joint': recording.joint,
                  'start': repr(recording.start)})
    return arrow.table(columns, schema=schema)


def parameter_frame(diagnosis: Diagnosis) -> Any:
    """Return a pandas.DataFrame; see `engb.Diagnosis.to_pandas`."""
    rows = [{'effect': finding.effect, 'probability': finding.probability,
             'share': finding.share, 'parameter': name, 'value': found.value,
             'std': np.nan if found.std is None else found.std, 'unit': found.unit}
            for finding in diagnosis.effects for name, found in finding.parameters.items()]
    return _library('pandas').DataFrame(rows, columns=[
        'effect', 'probability', 'share', 'parameter', 'value', 'std', 'unit'])


def _columns(recording: Recording) -> dict[str, Array]:
    columns = {'time': recording.time, 'position': recording.position,
               'effort': recording.effort}
    if recording.velocity is not None:
        columns['velocity'] = recording.velocity
    for name, signal in recording.signals.items():
        columns[name] = signal.at(recording.time)
    return columns


def _units(prismatic: bool) -> dict[str, str]:
    return {**(_LINEAR if prismatic else _ROTARY), **_SIGNALS}


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(f'{name} is not installed: pip install {name}') from None
