# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Tables of other people's benches."""

import numpy as np
import pytest
from scipy.io import savemat

from engb_core.errors import InputError
from engb_core.io.tables.measure import measured_of
from engb_core.io.tables.open import open_table
from engb_core.io.tables.request import Request


def read_table(path, columns):
    """Return the columns asked for: name in the result → title or number."""
    table = open_table(path)
    places = {name: table.find(wanted) for name, wanted in columns.items()}
    read = table.read(places.values())
    return {name: read[place].value for name, place in places.items()}


WANTED = {'time': 't', 'position': 'q'}
TEXTS = {
    'comma': 't,q\n0,1.5\n1,2.5\n2,-3e-2\n',
    'semicolon': 't;q;x\n0;1.5;a\n1;2.5;b\n2;-0.03;c\n',
    'decimal comma': 't;q\n0;1,5\n1;2,5\n2;-0,03\n',
    'tab, other case': 'T\tQ\n0\t1.5\n1\t2.5\n2\t-0.03\n',
    'spaces, comment': '# t q\n0   1.5\n 1   2.5\n2   -3e-2 \n',
    'units and a remark': 'bench 7, day 3, run 1\nt,q\ns,rad\n0,1.5\n1,2.5\n2,-0.03\n',
    'quotes, BOM, CRLF': '\ufeff"t","q"\r\n"0","1.5"\r\n\r\n1,2.5\r\n2,-0.03\r\n',
}


@pytest.mark.parametrize('name', TEXTS)
def test_text(tmp_path, name):
    path = tmp_path / 'a.csv'
    path.write_text(TEXTS[name], encoding='utf-8', newline='')
    table = read_table(path, WANTED)
    assert table['time'].tolist() == [0, 1, 2]
    assert table['position'].tolist() == [1.5, 2.5, -0.03]


def test_text_by_number_and_with_holes(tmp_path):
    path = tmp_path / 'a.txt'
    path.write_text('0,1\n1,\n2,x\n3,nan\n4\n5,6\n')
    table = read_table(path, {'time': '0', 'position': '1'})
    np.testing.assert_array_equal(table['position'], [1, *[np.nan] * 4, 6])


def test_npz_and_mat(tmp_path):
    time, data = np.arange(3.0), np.arange(6.0).reshape(3, 2)
    np.savez(tmp_path / 'a.npz', t=time, data=data)
    savemat(tmp_path / 'a.mat', {'t': time[:, None], 'data': data, 'log': {'q': data[:, 1]}})
    for name in ('a.npz', 'a.mat'):
        table = read_table(tmp_path / name, {'time': 't', 'position': 'data.1',
                                             'effort': 'data[:,0]'})
        assert table['time'].tolist() == [0, 1, 2]
        assert table['position'].tolist() == [1, 3, 5]
        assert table['effort'].tolist() == [0, 2, 4]
    assert read_table(tmp_path / 'a.mat', {'q': 'log.q'})['q'].tolist() == [1, 3, 5]


@pytest.mark.parametrize(('name', 'content', 'columns', 'words'), [
    ('a.csv', b't,q\n0,1\n', {'x': 'angle'}, ['angle', 't, q']),
    ('a.csv', b'0,1\n', {'x': '2'}, ['0 to 1']),
    ('a.csv', b't,t\n0,1\n', {'x': 't'}, ['several', 'number']),
    ('a.csv', b't,q\n0,a\n1,b\n', {'x': 'q'}, ['no numbers', "'a'"]),
    ('a.csv', b't,q\n', {'x': 'q'}, ['no row']),
    ('a.csv', b'', {'x': 'q'}, ['empty']),
    ('a.csv', bytes(range(256)), {'x': 'q'}, ['not a text']),
    ('a.npz', b'PK\x03\x04junk', {'x': 'q'}, ['npz']),
    ('a.mat', b'junk' * 100, {'x': 'q'}, ['mat']),
    ('a.xlsx', b'junk', {'x': 'q'}, ['.csv', '.npz', '.mat', '.mf4']),
])
def test_errors(tmp_path, name, content, columns, words):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_table(path, columns)
    for word in [name, *words]:
        assert word in str(caught.value), str(caught.value)


def test_npz_errors(tmp_path):
    path = tmp_path / 'a.npz'
    np.savez(path, t=np.arange(3.0), m=np.ones((3, 2)), s=np.array(['a']), short=np.ones(2))
    for columns, word in (({'x': 'q'}, 't, m.0, m.1, short'), ({'x': 'm'}, 'm.0'),
                          ({'x': 'm.2'}, 'm.1'), ({'x': 's'}, 'no column')):
        with pytest.raises(InputError, match='a.npz') as caught:
            read_table(path, columns)
        assert word in str(caught.value)
    with pytest.raises(InputError, match='no such file|cannot be read'):
        read_table(tmp_path / 'none.csv', {'x': 'q'})
    with pytest.raises(InputError, match='folder'):
        read_table(tmp_path, {'x': 'q'})


def test_without_titles_the_usual_order_is_proposed(tmp_path):
    path = tmp_path / 'bare.csv'
    path.write_text(''.join(f'{n / 1000:.3f},{n % 7},{n % 3}\n' for n in range(100)))
    with pytest.raises(InputError, match='--column position=1 --column effort=2 --column time=0'):
        measured_of(path, Request())


def test_a_current_taken_as_a_torque_is_told(tmp_path):
    path = tmp_path / 'bench.csv'
    path.write_text('t,phi,current\n' + ''.join(
        f'{n / 1000:.3f},{n % 7},{n % 3}\n' for n in range(100)))
    columns = {'time': 't', 'position': 'phi', 'effort': 'current'}
    measured, _ = measured_of(path, Request(columns=columns, plain_is_si=True))
    assert '--torque-constant' in measured.told[-1]


def bench(head, row):
    """Return a table of 300 samples with these titles."""
    return head + ''.join(row(n / 100.0, 90.0 * np.sin(n / 9.0), np.cos(n / 9.0))
                          for n in range(300))


def test_a_column_of_two_alike_titles_is_proposed_by_its_number(tmp_path):
    """The command that the line prints has to work."""
    path = tmp_path / 'bench.csv'
    path.write_text(bench('t [s],phi [deg],phi [deg],I [A]\n',
                          lambda t, phi, i: f'{t},{phi},{phi},{i}\n'))
    with pytest.raises(InputError, match=r'--column position=1 .*position may be 1, 2') as told:
        measured_of(path, Request(torque_constant=1.0))
    assert 'phi [deg]' in str(told.value)
    measured_of(path, Request(torque_constant=1.0, columns={'position': '1'}))


@pytest.mark.parametrize('clue', ['t [s],phi [deg],n [rpm]', 't [s],phi [deg],T_coil [°C]'])
def test_no_column_is_proposed_whose_unit_says_that_it_is_something_else(tmp_path, clue):
    path = tmp_path / 'bench.csv'
    path.write_text(bench(clue + '\n', lambda t, phi, i: f'{t},{phi},{i}\n'))
    with pytest.raises(InputError) as told:
        measured_of(path, Request(torque_constant=1.0))
    text = str(told.value)
    assert 'holds no column that could be effort' in text and clue.split(',')[2] in text
    assert 'torque or current' in text and 'effort=t' not in text and 'effort=phi' not in text


def test_digits_in_groups_are_one_number(tmp_path):
    path = tmp_path / 'bench.csv'
    path.write_text('t;q\n0;1,234.5\n1;-12,345,678.25\n2;900.0\n')
    assert read_table(path, WANTED)['position'].tolist() == [1234.5, -12345678.25, 900.0]


def test_a_column_that_is_mostly_text_is_no_column_of_numbers(tmp_path):
    path = tmp_path / 'bench.csv'
    path.write_text('t,q\n' + ''.join(f'{n},{"1.5" if n % 3 == 0 else "OVER"}\n'
                                      for n in range(300)))
    with pytest.raises(InputError, match="column q holds numbers in 100 rows and text, such as "
                       "'OVER', in 200"):
        read_table(path, WANTED)
