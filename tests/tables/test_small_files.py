# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What other programs write beside plain columns: read, passed over, or told in a line."""

import struct
import zlib

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.tables.formats import kind_of, open_here
from engb_core.io.tables.mat_file import check_mat
from engb_core.io.tables.measure import measured_of
from engb_core.io.tables.measurement import Ros1Table
from engb_core.io.tables.request import Request
from engb_core.io.tables.table import Channel, MOST_BYTES, numbers_of, Samples, Table

TIME = np.arange(6.0)


def opened(path):
    """Open a table in this process."""
    return open_here(path, kind_of(path))


def values(table):
    """Return the name, unit and values of all channels."""
    read = table.read(range(len(table.channels)))
    return {(entry.name, entry.unit): read[place].value.tolist()
            for place, entry in enumerate(table.channels)}


# ---- numbers

@pytest.mark.parametrize(('given', 'seconds'), [
    (np.array(['2026-01-01T00:00:01', '2026-01-01T00:00:03.5'], 'datetime64[ns]'), [0.0, 2.5]),
    (np.array([], 'datetime64[us]'), []),
    (np.array([1500, 2500], 'timedelta64[ms]'), [1.5, 2.5]),
])
def test_stamps_become_seconds(tmp_path, given, seconds):
    assert numbers_of(tmp_path, 't', given).tolist() == seconds


def test_texts_are_no_numbers(tmp_path):
    with pytest.raises(InputError, match=r'q holds no numbers \(<U1\)'):
        numbers_of(tmp_path, 'q', ['a', 'b'])


class Claims(Table):
    """A table that claims so many samples, and holds one."""

    def __init__(self, path, channels):
        super().__init__(path, channels)

    def read(self, channels):
        places = list(channels)
        self.check_size(places)
        return {place: Samples(np.ones(1)) for place in places}


def test_a_table_that_claims_more_than_is_read_at_once_is_refused(tmp_path):
    table = Claims(tmp_path, [Channel('q', size=MOST_BYTES // 8), Channel('t', size=1)])
    assert table.read([0])[0].value.tolist() == [1.0]
    with pytest.raises(InputError, match='hold 400 MiB, more than the 400 MiB'):
        table.read([0, 1])


def test_a_table_without_any_column_names_none(tmp_path):
    with pytest.raises(InputError, match="no column 'q'; there is none"):
        Claims(tmp_path, []).find('q')


# ---- arrays

def test_fields_of_hdf5_that_are_no_signals_are_passed_over(tmp_path):
    h5py = pytest.importorskip('h5py')
    path = tmp_path / 'a.h5'
    with h5py.File(path, 'w') as file:
        table = np.zeros(6, [('t', 'f8'), ('pair', 'f8', (2,)), ('name', 'S3')])
        table['t'] = TIME
        file['log'] = table
        file['log'].attrs['unit'] = b's'
        file['gain'] = 2.0 * TIME
        file['gain'].attrs['units'] = np.array([], 'S1')
        file['empty'] = TIME
        file['empty'].attrs['MATLAB_empty'] = 1
        file['note'] = 'a remark'
    assert values(opened(path)) == {
        ('log/t', 's'): TIME.tolist(), ('gain', ''): (2.0 * TIME).tolist()}


def test_a_struct_with_a_field_of_units_tells_them(tmp_path):
    from scipy.io import savemat
    path = tmp_path / 'a.mat'
    savemat(path, {'angle': {'data': TIME, 'unit': 'deg'}, 'other': {'data': TIME, 'unit': 3.0}})
    found = values(opened(path))
    assert found['angle.data', 'deg'] == TIME.tolist()
    assert found['other.data', ''] == TIME.tolist()


def test_more_columns_than_signals_are_no_column(tmp_path):
    path = tmp_path / 'a.npz'
    np.savez(path, picture=np.ones((300, 300)), cube=np.ones((3, 3, 3)))
    with pytest.raises(InputError, match='holds no column of numbers; it holds picture, cube'):
        opened(path)
    np.savez(path)
    with pytest.raises(InputError, match='it holds nothing'):
        opened(path)


# ---- MATLAB's files of version 5, element by element

def element(kind, body, order='<', size=None):
    return struct.pack(f'{order}II', kind, len(body) if size is None else size) + body + bytes(
        -len(body) % 8)


def matrix(inner=b'', array_class=6, order='<'):
    return element(14, element(6, struct.pack(f'{order}II', array_class, 0), order) + inner, order)


def mat(folder, *elements, order='<'):
    path = folder / 'a.mat'
    path.write_bytes(b'MATLAB 5.0'.ljust(124) + b'\0\1' + (b'IM' if order == '<' else b'MI')
                     + b''.join(elements))
    return path


def packed(body):
    data = zlib.compress(body)
    return struct.pack('<II', 15, len(data)) + data


def cells(deep):
    inner = b''
    for _ in range(deep):
        inner = matrix(inner, array_class=1)
    return inner


@pytest.mark.parametrize('order', '<>')
def test_a_sound_mat_file_passes_in_either_byte_order(tmp_path, order):
    check_mat(mat(tmp_path, matrix(order=order), order=order), 1 << 20)


def test_packed_variables_are_looked_into(tmp_path):
    check_mat(mat(tmp_path, packed(matrix() + element(2, b'abc')), packed(cells(31))), 1 << 20)
    with pytest.raises(InputError, match='nested more than 32 deep'):
        check_mat(mat(tmp_path, packed(cells(33))), 1 << 20)


@pytest.mark.parametrize(('elements', 'most', 'words'), [
    ([cells(33)], 1 << 20, 'nested more than 32 deep'),
    ([bytes(3 << 20)], 2 << 20, 'holds more than the 2 MiB that are read at once'),
    ([packed(bytes(3 << 20))], 2 << 20, 'unpacks to more than the 2 MiB'),
    ([packed(bytes(3 << 19)), packed(bytes(3 << 19))], 2 << 20, 'unpacks to more than the 2 MiB'),
    ([element(15, b'not packed')], 1 << 20, 'not a usable .mat file'),
])
def test_a_mat_file_without_sense_is_refused_before_it_is_read(tmp_path, elements, most, words):
    with pytest.raises(InputError, match=words):
        check_mat(mat(tmp_path, *elements), most)


def test_other_versions_and_cut_packed_variables_pass(tmp_path):
    path = tmp_path / 'a.mat'
    path.write_bytes(bytes(200))
    check_mat(path, 10)
    check_mat(mat(tmp_path, packed(matrix())[:-4]), 1 << 20)


# ---- measurement files

def test_tdms_without_numbers_and_with_clocks_of_their_own(tmp_path):
    nptdms = pytest.importorskip('nptdms')
    path = tmp_path / 'a.tdms'
    start = np.datetime64('2026-01-01T00:00:00', 'us')
    channels = [('angle', TIME, 'deg', start), ('current', 2.0 * TIME, 'A', start + 500_000)]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject('bench', 'remark', ['a', 'b'])] + [
            nptdms.ChannelObject('bench', name, data, properties={
                'wf_increment': 0.5, 'wf_start_time': begin, 'NI_UnitDescription': unit})
            for name, data, unit, begin in channels])
    table = opened(path)
    assert [(entry.name, entry.unit, entry.clocked) for entry in table.channels] == [
        ('angle', 'deg', True), ('current', 'A', True)]
    read = table.read([0, 1])
    assert read[0].time.tolist() == (0.5 * TIME).tolist()
    assert read[1].time.tolist() == (0.5 + 0.5 * TIME).tolist()


def test_a_waveform_beside_a_column_without_time_is_told(tmp_path):
    nptdms = pytest.importorskip('nptdms')
    path = tmp_path / 'a.tdms'
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([
            nptdms.ChannelObject('bench', 'angle', TIME, properties={
                'wf_increment': 0.5, 'unit_string': 'deg'}),
            nptdms.ChannelObject('bench', 'torque', TIME, properties={'unit_string': 'Nm'})])
    with pytest.raises(InputError, match='no time beside torque; name its column with --column'):
        measured_of(path, Request())


def test_a_table_without_columns_is_told(tmp_path):
    nptdms = pytest.importorskip('nptdms')
    path = tmp_path / 'a.tdms'
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject('bench', 'remark', ['a', 'b'])])
    with pytest.raises(InputError, match='holds no column'):
        measured_of(path, Request())


def test_units_in_arrow_s_metadata_and_stamps_are_taken(tmp_path):
    pa = pytest.importorskip('pyarrow')
    from pyarrow import feather
    stamps = np.datetime64('2026-01-01', 'ns') + (1e9 * TIME).astype('timedelta64[ns]')
    fields = [pa.field('when', pa.timestamp('ns')),
              pa.field('phi', pa.float64(), metadata={'units': 'deg'}),
              pa.field('I', pa.float64(), metadata={'note': 'of the motor'})]
    path = tmp_path / 'a.arrow'
    feather.write_feather(pa.table([pa.array(stamps), pa.array(TIME), pa.array(2.0 * TIME)],
                                   schema=pa.schema(fields)), str(path))
    assert values(opened(path)) == {('when', 's'): TIME.tolist(), ('phi', 'deg'): TIME.tolist(),
                                    ('I', ''): (2.0 * TIME).tolist()}


def test_messages_in_messages_are_looked_into_and_a_topic_without_any_is_not(tmp_path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import get_typestore, Stores
    store = get_typestore(Stores.ROS1_NOETIC)
    kinds, path = store.types, tmp_path / 'a.bag'
    vector = kinds['geometry_msgs/msg/Vector3']
    wrench = kinds['geometry_msgs/msg/Wrench'](vector(1.0, 2.0, 3.0), vector(4.0, 5.0, 6.0))
    with Writer(path) as writer:
        name = 'geometry_msgs/msg/Wrench'
        writer.add_connection('/silent', name, typestore=store)
        connection = writer.add_connection('/force', name, typestore=store)
        stop = writer.add_connection('/stop', 'std_msgs/msg/String', typestore=store)
        for time in (1_000_000_000, 1_500_000_000):
            writer.write(connection, time, store.serialize_ros1(wrench, name))
            writer.write(stop, time, store.serialize_ros1(
                kinds['std_msgs/msg/String']('now'), 'std_msgs/msg/String'))
    table = Ros1Table(path)
    assert [entry.name for entry in table.channels] == [
        f'/force/{part}/{axis}' for part in ('force', 'torque') for axis in 'xyz']
    read = table.read([0, 5])
    assert read[0].value.tolist() == [1.0, 1.0] and read[5].value.tolist() == [6.0, 6.0]
    assert read[5].time.tolist() == [0.0, 0.5]


# ---- text

@pytest.mark.parametrize(('text', 'expected'), [
    ('t;q\n0;1.234,5\n1;-12.345,75\n2;0,5\n', [1234.5, -12345.75, 0.5]),
    ('t,q,\n0,1,\n1,2,\n2,3,\n', [1.0, 2.0, 3.0]),              # a comma behind the last column
    ('t,q,\n0,1\n1,2\n2,3\n', [1.0, 2.0, 3.0]),                 # … of the titles only
    ('t,q\n0,1\n1,2\n# stopped here\n2,3\n', [1.0, 2.0, 3.0]),
    ('t,q\n# bench 7, day 3, run 1\n0,1\n1,2\n2,3\n', [1.0, 2.0, 3.0]),
])
def test_texts_of_other_habits(tmp_path, text, expected):
    path = tmp_path / 'a.csv'
    path.write_text(text)
    table = opened(path)
    place = table.find('q')
    assert table.read([place])[place].value.tolist() == expected


def test_a_character_cut_in_two_where_the_head_ends_is_still_utf_8(tmp_path):
    row = '0,1\n'
    head = 't [s],q [°]\n'.encode()
    filled = head + (row * ((1 << 18) - 4)).encode()
    filled += b'1,2 ' + b' ' * ((1 << 20) - len(filled) - 5) + '°\n3,4\n'.encode()
    path = tmp_path / 'a.csv'
    path.write_bytes(filled)
    assert [entry.name for entry in opened(path).channels] == ['t [s]', 'q [°]']


def test_a_line_without_end_is_told(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t,q\n0,1\n1,2\n' + '3' * (2 << 20) + '\n')
    with pytest.raises(InputError, match='has a line of more than 1 MiB'):
        opened(path).read([1])
