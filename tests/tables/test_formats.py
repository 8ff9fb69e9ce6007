# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The formats of the field, each written by its own library, read as the same recording."""

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.tables.measure import measured_of
from engb_core.io.tables.request import Request
from engb_core.io.tables.table import damaged

TIME = np.arange(2000) * 1e-3
ANGLE = 90.0 * np.sin(2.0 * TIME)
CURRENT = 2.0 * np.cos(2.0 * TIME)
REQUEST = Request(torque_constant=0.05)


def mdf(path):
    asammdf = pytest.importorskip('asammdf')
    # Current ten times slower, in a group with a clock of its own.
    with asammdf.MDF() as file:
        file.append([asammdf.Signal(ANGLE, TIME, unit='deg', name='MotorAngle')])
        file.append([asammdf.Signal(CURRENT[::10], TIME[::10], unit='A', name='MotorCurrent')])
        file.save(path, overwrite=True)


def mdf3(path):
    asammdf = pytest.importorskip('asammdf')
    with asammdf.MDF(version='3.30') as file:
        file.append([asammdf.Signal(ANGLE, TIME, unit='deg', name='MotorAngle'),
                     asammdf.Signal(CURRENT, TIME, unit='A', name='MotorCurrent')])
        file.save(path, overwrite=True)


def mat73(path):
    # As MATLAB saves with -v7.3: HDF5 behind a head of 512 bytes, columns first.
    h5py = pytest.importorskip('h5py')
    with h5py.File(path, 'w', userblock_size=512) as file:
        for name, values in (('t_s', TIME), ('phi_deg', ANGLE), ('I_A', CURRENT)):
            file.create_dataset(f'log/{name}', data=values[None]).attrs['MATLAB_class'] = b'double'
    with path.open('r+b') as raw:
        raw.write(b'MATLAB 7.3 MAT-file'.ljust(124) + b'\x00\x02IM')


def ros1(path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import get_typestore, Stores
    store = get_typestore(Stores.ROS1_NOETIC)
    kinds, name = store.types, 'sensor_msgs/msg/JointState'
    with Writer(path) as writer:
        connection = writer.add_connection('/joint_states', name, typestore=store)
        for index, time in enumerate(TIME):
            stamp = 1_700_000_000_000_000_000 + int(np.rint(1e9 * time))
            header = kinds['std_msgs/msg/Header'](index, kinds['builtin_interfaces/msg/Time'](
                stamp // 10**9, stamp % 10**9), '')
            writer.write(connection, stamp, store.serialize_ros1(kinds[name](
                header, ['motor'], np.deg2rad(ANGLE[index:index + 1]), np.zeros(0),
                0.05 * CURRENT[index:index + 1]), name))


def tdms(path):
    nptdms = pytest.importorskip('nptdms')
    with nptdms.TdmsWriter(path) as writer:
        for name, values, unit in (('angle', ANGLE, 'deg'), ('current', CURRENT, 'A')):
            writer.write_segment([nptdms.ChannelObject('bench', name, values, properties={
                'wf_increment': 1e-3, 'wf_start_offset': 0.0, 'unit_string': unit})])


def parquet(path):
    pa = pytest.importorskip('pyarrow')
    from pyarrow import parquet as writer
    writer.write_table(pa.table({'t [s]': TIME, 'phi [deg]': ANGLE, 'I [A]': CURRENT}), path)


def arrow(path):
    pa = pytest.importorskip('pyarrow')
    from pyarrow import feather
    feather.write_feather(pa.table({'time_ms': 1e3 * TIME, 'phi_deg': ANGLE, 'I_A': CURRENT}),
                          str(path))


def arrow_stream(path):
    pa = pytest.importorskip('pyarrow')
    table = pa.table({'time_ms': 1e3 * TIME, 'phi_deg': ANGLE, 'I_A': CURRENT})
    with pa.ipc.new_stream(str(path), table.schema) as writer:
        writer.write_table(table)


def ros1_numbers(path):
    """A topic a number, of two rates; the units stand in the topics' names."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import get_typestore, Stores
    store, name = get_typestore(Stores.ROS1_NOETIC), 'std_msgs/msg/Float64'
    with Writer(path) as writer:
        for topic, times, values in (('/motor/angle_deg', TIME, ANGLE),
                                     ('/motor/current_A', TIME[::7], CURRENT[::7])):
            connection = writer.add_connection(topic, name, typestore=store)
            for time, value in zip(times, values, strict=True):
                writer.write(connection, 1_700_000_000_000_000_000 + int(np.rint(1e9 * time)),
                             store.serialize_ros1(store.types[name](value), name))


def simulink(path):
    """What a Scope block logs as a structure with time: an array of structs with labels."""
    from scipy.io import savemat
    signals = np.zeros(2, [('values', object), ('label', object)])
    signals[0], signals[1] = (ANGLE, 'phi [deg]'), (CURRENT, 'I [A]')
    savemat(path, {'ScopeData': {'time': TIME, 'signals': signals}})


def logger(path):
    """Remarks above the titles look like rows of samples."""
    rows = ['Logger 7', 'Date,2026-01-01', 'Rate,1000', 'Offset,0,', '', 'X,Angle,Current',
            's,deg,A']
    rows += [f'{t:.4e},{a:.8e},{i:.8e}' for t, a, i in zip(TIME, ANGLE, CURRENT, strict=True)]
    path.write_text('\n'.join(rows) + '\n')


def hdf5(path):
    h5py = pytest.importorskip('h5py')
    with h5py.File(path, 'w') as file:
        for name, values, unit in (('run/time', TIME, 's'), ('run/angle', ANGLE, 'deg'),
                                   ('run/current', CURRENT, 'A')):
            file[name] = values
            file[name].attrs['unit'] = unit


def mat5(path):
    from scipy.io import savemat
    savemat(path, {'log': {'t_s': TIME, 'phi_deg': ANGLE, 'I_A': CURRENT}})


def plotjuggler(path):
    rows = ['__time,/drive/position_deg,/drive/current_A']
    for index, time in enumerate(TIME):
        rows.append(f'{1.7e9 + time:.6f},{ANGLE[index]:.9f},')
        if index % 5 == 2:
            rows.append(f'{1.7e9 + time + 2e-4:.6f},,{2.0 * np.cos(2.0 * (time + 2e-4)):.9f}')
    path.write_text('\n'.join(rows) + '\n')


def iso(path):
    rows = ['Bench 3;;', '', 'Zeit;phi/°;I/A']
    rows += [f'2026-11-23T23:59:{59 - 1 + (0.5 + t) % 1:09.6f};{a:.7f};{i:.7f}'.replace('.', ',')
             for t, a, i in zip(TIME[:500], ANGLE, CURRENT, strict=False)]
    path.write_text('\n'.join(rows) + '\n', encoding='cp1252')


@pytest.mark.parametrize(('write', 'name'), [
    (mdf, 'a.mf4'), (mdf3, 'a.mdf'), (mat73, 'a.mat'), (ros1, 'a.bag'),
    (tdms, 'a.tdms'), (parquet, 'a.parquet'), (arrow, 'a.arrow'),
    (hdf5, 'a.h5'), (mat5, 'a.mat'), (plotjuggler, 'a.csv'), (iso, 'a.csv'),
    (arrow_stream, 'a.arrow'), (ros1_numbers, 'a.bag'), (simulink, 'a.mat'), (logger, 'a.csv')])
def test_read_alike(tmp_path, write, name):
    path = tmp_path / name
    write(path)
    measured, _ = measured_of(path, REQUEST)
    recording = measured.recording()
    time = recording.time
    if write is iso:
        assert recording.interval == pytest.approx(1e-3, rel=1e-3)
        return
    assert recording.duration > 1.9
    start = 0.0 if write is not plotjuggler else recording.start - 1.7e9
    start = start if abs(start) < 1.0 else 2e-3
    np.testing.assert_allclose(recording.position,
                               np.deg2rad(90.0 * np.sin(2.0 * (time + start))), atol=6e-3)
    np.testing.assert_allclose(recording.effort, 0.1 * np.cos(2.0 * (time + start)), atol=6e-4)


@pytest.mark.parametrize(('write', 'name'), [
    (mdf, 'a.mf4'), (mdf3, 'a.mdf'), (mat73, 'a.mat'), (ros1, 'a.bag'), (parquet, 'a.parquet'),
    (arrow, 'a.arrow'), (hdf5, 'a.h5'), (mat5, 'a.mat'), (arrow_stream, 'a.arrow')])
def test_a_file_that_was_cut_off_is_told_with_the_remedy(tmp_path, write, name):
    path = tmp_path / name
    write(path)
    path.write_bytes(path.read_bytes()[:700])
    with pytest.raises(InputError) as told:
        measured_of(path, REQUEST)
    text = str(told.value)
    assert text.startswith(f'{path}: ') and 'write or copy the file again' in text
    assert '()' not in text and '\n' not in text


def test_an_error_without_words_is_told_by_its_kind(tmp_path):
    assert '(AssertionError)' in str(damaged(tmp_path, 'cannot be read', AssertionError()))
