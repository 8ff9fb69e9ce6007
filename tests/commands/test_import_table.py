# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb import`: tables become recordings."""

import numpy as np
import pytest
from scipy.io import savemat

from engb_core.io.bags.read import read_recording

from .conftest import motion

COLUMNS = ['--column', 'time=t', '--column', 'position=q', '--column', 'effort=i']


@pytest.fixture
def table(tmp_path):
    """A bench's table in degrees, ampere and milliseconds."""
    run = motion(400)
    path = tmp_path / 'bench.csv'
    data = np.column_stack([1e3 * run['time'], np.rad2deg(run['position']), run['velocity'],
                            run['effort'] / 0.0174, np.arange(400)])
    np.savetxt(path, data, '%.17g', ',', header='t,q,w,i,temperature', comments='')
    return path


def test_round_trip_with_units(engb, table):
    run = motion(400)
    outcome = engb('import', table, '--out', 'run1', *COLUMNS, '--column', 'velocity=w',
                   '--column', 'pad_temperature=temperature', '--column', 'reference=q',
                   '--scale', f'position={np.pi / 180}', '--scale', 'effort=0.0174',
                   '--scale', 'time=0.001', '--scale', f'reference={np.pi / 180}',
                   '--offset', 'pad_temperature=20', '--joint', 'servo')
    assert (outcome.status, outcome.err) == (0, '')
    assert '400 samples' in outcome.out and 'servo' in outcome.out
    recording = read_recording('run1')
    assert recording.joint == 'servo'
    for name in ('time', 'position', 'velocity', 'effort'):
        np.testing.assert_allclose(getattr(recording, name), run[name], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(recording.reference.position, run['position'])
    np.testing.assert_allclose(recording.signal('pad_temperature'), 20 + np.arange(400))


def test_missing_velocity_is_left_out(engb, table):
    assert engb('import', table, '--out', 'deep/run.mcap', *COLUMNS, '--scale',
                'time=0.001').status == 0
    assert read_recording('deep/run.mcap').velocity is None


@pytest.mark.parametrize('suffix', ['npz', 'mat'])
def test_arrays_and_a_rate(engb, tmp_path, suffix):
    run = motion(400)
    path = tmp_path / f'bench.{suffix}'
    arrays = {'q': run['position'][:, None], 'm': np.column_stack([run['time'], run['effort']])}
    if suffix == 'npz':
        np.savez(path, **arrays)
    else:
        savemat(path, arrays)
    outcome = engb('import', path, '--out', 'run', '--rate', '1000', '--column', 'position=q',
                   '--column', 'effort=m.1', '--namespace', 'front_left')
    assert outcome.status == 0, outcome
    recording = read_recording('run', namespace='/front_left')
    np.testing.assert_array_equal(recording.effort, run['effort'])
    np.testing.assert_allclose(recording.time, run['time'], atol=1e-9)


@pytest.mark.parametrize(('change', 'words'), [
    (['--column', 'velocity=speed'], ['speed', 't, q, w, i, temperature']),
    (['--column', 'velocity'], ['NAME=VALUE']),
    (['--column', 'position=w'], ['position', 'twice']),
    (['--column', 'a b=w'], ['topic name']),
    (['--column', 'reference_velocity=w'], ['--column reference=']),
    (['--scale', 'position=1deg'], ['position=1deg', 'finite']),
    (['--scale', 'velocity=2'], ['velocity', '--column']),
    (['--rate', '100'], ['--rate', 'exclude']),
    (['--joint', ''], ['--joint']),
    (['--column', 'velocity=9'], ['9']),
])
def test_wrong_requests(refused, tmp_path, table, change, words):
    refused('import', table, '--out', 'run1', *COLUMNS, *change, words=words)
    assert [entry.name for entry in tmp_path.iterdir()] == ['bench.csv']


def test_what_is_missing_is_named(refused, table):
    refused('import', table, '--out', 'run1', words=['the unit of position (column q)',
                                                     '--unit', 'position=deg',
                                                     '--torque-constant', 'taken as ampere'])
    refused('import', table, '--out', 'run1', '--column', 'time=t', words=[
        'engb import', '--column time=t --torque-constant 1 --unit position=deg'])
    bare = table.with_name('bare.csv')
    bare.write_text('q,i\n' + ''.join(f'{n},1\n' for n in range(100)))
    refused('import', bare, '--out', 'run1', *COLUMNS[2:], words=['time', '--rate'])
    refused('import', table, words=['--out'])
    refused('import', table, '--out', 'run1', *COLUMNS[2:], '--rate', '0', words=['--rate'])
    refused('import', 'none.csv', '--out', 'run1', *COLUMNS, words=['none.csv'])


def test_bad_samples(refused, engb, tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t,q,i\n' + ''.join(f'{n},nan,1\n' for n in range(100)))
    refused('import', path, '--out', 'run1', *COLUMNS, words=['a.csv'])
    path.write_text('t,q,i\n1,1,1\n')
    refused('import', path, '--out', 'run1', *COLUMNS, words=['a.csv'])
    path.write_text('t,q,i\n' + ''.join(f'{n},{n},1\n' for n in range(100)) + 'nan,1,1\n5,x,2\n')
    assert engb('import', path, '--out', 'run1', *COLUMNS).status == 0
    assert read_recording('run1').time.size == 100


def test_an_existing_recording_stays(engb, refused, table):
    (table.parent / 'run1').mkdir()
    refused('import', table, '--out', 'run1', *COLUMNS, words=['run1', 'exists'])
    assert engb('import', table, '--out', 'run1', '--force', *COLUMNS).status == 0
    assert read_recording('run1').time.size == 400
