# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings and diagnoses as tables of pandas, xarray and Arrow."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import engb_core as engb
from engb_core.diagnose.diagnosis import EffectFinding, ParameterEstimate
from engb_core.recording import Signal

TIME = 7.0 + np.linspace(0.0, 2.0, 200)


def recording(velocity: bool = True):
    return engb.Recording(
        TIME, np.sin(TIME), np.cos(TIME), -np.sin(TIME) if velocity else None, name='a_run',
        signals={'disc_speed': Signal(TIME[::10], np.arange(20.0)),
                 'other': Signal(TIME[::10], np.ones(20))})


def diagnosis(*effects: EffectFinding):
    return engb.Diagnosis('explained', effects, (), (), None, (), None, engb.Model())


def test_a_frame_has_the_samples_over_time():
    pytest.importorskip('pandas')
    run = recording()
    frame = run.to_pandas()
    assert list(frame.columns) == ['position', 'effort', 'velocity', 'disc_speed', 'other']
    assert frame.index.name == 'time'
    assert np.array_equal(frame.index, run.time)
    for name in ('position', 'effort', 'velocity'):
        assert np.array_equal(frame[name], getattr(run, name))
    assert np.array_equal(frame['disc_speed'], run.signal('disc_speed'))
    assert 'velocity' not in recording(velocity=False).to_pandas()


def test_a_frame_makes_a_recording_again():
    pytest.importorskip('pandas')
    run = recording()
    frame = run.to_pandas().reset_index()
    again = engb.Recording(frame['time'], frame['position'], frame['effort'], frame['velocity'])
    for name in ('time', 'position', 'effort', 'velocity'):
        assert np.array_equal(getattr(again, name), getattr(run, name))


@pytest.mark.parametrize(('prismatic', 'units'), [
    (False, ('s', 'rad', 'rad/s', 'N·m')), (True, ('s', 'm', 'm/s', 'N'))])
def test_a_data_set_knows_its_units(prismatic, units):
    pytest.importorskip('xarray')
    run = recording()
    found = run.to_xarray(prismatic=prismatic)
    assert found.sizes == {'time': 200}
    assert tuple(found[name].attrs['units']
                 for name in ('time', 'position', 'velocity', 'effort')) == units
    assert found['disc_speed'].attrs == {'units': 'rad/s'}
    assert found['other'].attrs == {}
    assert found.attrs == {'name': 'a_run', 'joint': 'motor', 'start': 7.0}
    assert np.array_equal(found['effort'], run.effort)


@pytest.mark.parametrize(('prismatic', 'units'), [
    (False, ('s', 'rad', 'rad/s', 'N·m')), (True, ('s', 'm', 'm/s', 'N'))])
def test_an_arrow_table_knows_its_units(prismatic, units):
    pytest.importorskip('pyarrow')
    run = recording()
    table = run.to_arrow(prismatic=prismatic)
    assert table.column_names == ['time', 'position', 'effort', 'velocity', 'disc_speed', 'other']
    assert tuple(table.schema.field(name).metadata[b'unit'].decode()
                 for name in ('time', 'position', 'velocity', 'effort')) == units
    assert table.schema.field('other').metadata is None
    assert table.schema.metadata[b'name'] == b'a_run'
    assert np.array_equal(table['position'].to_numpy(), run.position)


def test_a_diagnosis_has_a_row_for_each_parameter():
    pytest.importorskip('pandas')
    found = diagnosis(
        EffectFinding('stribeck_friction', 0.9, {
            'breakaway_ratio': ParameterEstimate(1.8, 0.1, ''),
            'stribeck_velocity': ParameterEstimate(2.5, None, 'rad/s')}, 0.6, (), ''),
        EffectFinding('torque_saturation', 0.8, {
            'limit': ParameterEstimate(0.4, 0.01, 'N·m')}, 0.2, (), ''))
    frame = found.to_pandas()
    assert list(frame['effect']) == ['stribeck_friction'] * 2 + ['torque_saturation']
    assert list(frame['parameter']) == ['breakaway_ratio', 'stribeck_velocity', 'limit']
    assert list(frame['value']) == [1.8, 2.5, 0.4]
    assert list(frame['std'])[::2] == [0.1, 0.01]
    assert np.isnan(frame['std'][1])
    assert list(frame['unit']) == ['', 'rad/s', 'N·m']
    assert list(frame['probability']) == [0.9, 0.9, 0.8]
    empty = diagnosis().to_pandas()
    assert len(empty) == 0
    assert list(empty.columns) == list(frame.columns)


@pytest.mark.parametrize('name', ['pandas', 'xarray', 'pyarrow'])
def test_what_is_not_installed_is_told(name, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    run = recording()
    make = {'pandas': run.to_pandas, 'xarray': run.to_xarray, 'pyarrow': run.to_arrow}[name]
    with pytest.raises(engb.InputError, match=f'{name} is not installed: pip install {name}'):
        make()
