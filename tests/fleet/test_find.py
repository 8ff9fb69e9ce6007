# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which recordings there are, of which unit."""

import os

import pytest

from engb_core.errors import InputError
from engb_core.io.outputs import LIST
from engb_ros.fleet.find import find_recordings, LeftOut, read_units


@pytest.fixture
def tree(tmp_path):
    """Recordings of all forms; their content doesn't matter here."""
    root = tmp_path / 'data'
    for name in ('wheel_1/run_a/metadata.yaml', 'wheel_1/run_a/run_a_0.mcap',
                 'wheel_1/run_a/run_a_1.mcap', 'wheel_2/morning.mcap', 'wheel_2/evening.db3',
                 'wheel_2/notes.txt', 'wheel_3/deep/split/split_0.mcap',
                 'wheel_3/deep/split/split_1.mcap', 'alone.mcap.zstd', '.hidden/x.mcap',
                 'wheel_2/.part.mcap'):
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b'x')
    return root


def test_every_recording_once(tree):
    found = find_recordings([str(tree)])
    assert {entry.key: entry.unit for entry in found} == {
        'alone.mcap.zstd': 'data', 'wheel_1/run_a': 'wheel_1', 'wheel_2/evening.db3': 'wheel_2',
        'wheel_2/morning.mcap': 'wheel_2', 'wheel_3/deep/split': 'wheel_3/deep'}
    assert len({entry.slug for entry in found}) == 5
    assert [entry.key for entry in found] == sorted(entry.key for entry in found)


def test_folders_that_overlap_and_recordings_by_name(tree):
    twice = find_recordings([str(tree), str(tree / 'wheel_1')])
    assert len(twice) == 5
    wheels = find_recordings([str(tree / 'wheel_1'), str(tree / 'wheel_2')])
    assert {entry.key: entry.unit for entry in wheels} == {
        'wheel_1/run_a': 'wheel_1', 'wheel_2/evening.db3': 'wheel_2',
        'wheel_2/morning.mcap': 'wheel_2'}
    single = find_recordings([str(tree / 'wheel_1' / 'run_a')])
    assert [(entry.key, entry.unit) for entry in single] == [('run_a', 'run_a')]
    file = find_recordings([str(tree / 'wheel_2' / 'morning.mcap')])
    assert [entry.key for entry in file] == ['morning']


def test_slugs_are_file_names(tree):
    odd = tree / 'Rad ü' / 'a b%"<.mcap'
    odd.parent.mkdir()
    odd.write_bytes(b'x')
    slugs = [entry.slug for entry in find_recordings([str(tree)])]
    assert all(slug.isascii() and '/' not in slug and ' ' not in slug for slug in slugs)


def test_units_table(tree, tmp_path):
    table = tmp_path / 'units.csv'
    table.write_text('recording,unit,mileage\nwheel_1/*,front left,1200\nmorning,x,\n'
                     'evening.db3,,7e3\n', encoding='utf-8')
    found = {entry.key: (entry.unit, entry.mileage)
             for entry in read_units(str(table), find_recordings([str(tree)]))}
    assert found['wheel_1/run_a'] == ('front left', 1200.0)
    assert found['wheel_2/morning.mcap'] == ('x', None)
    assert found['wheel_2/evening.db3'] == ('wheel_2', 7000.0)
    assert found['alone.mcap.zstd'] == ('data', None)


@pytest.mark.parametrize(('text', 'word'), [
    ('name,unit\n', 'column recording'), ('recording,km\n', 'unit or mileage'),
    ('recording,mileage\na,12 km\n', 'line 2'), ('', 'no titles'), ('recording,mileage\na,nan\n',
                                                                    'nan')])
def test_units_table_errors(tree, tmp_path, text, word):
    table = tmp_path / 'units.csv'
    table.write_text(text)
    with pytest.raises(InputError, match=word):
        read_units(str(table), find_recordings([str(tree)]))
    with pytest.raises(InputError, match='cannot be read'):
        read_units(str(tmp_path / 'none.csv'), [])


def test_nothing_found(tmp_path):
    with pytest.raises(InputError, match='no recording'):
        find_recordings([str(tmp_path)])
    with pytest.raises(InputError, match='no such folder'):
        find_recordings([str(tmp_path / 'x')])


def test_what_is_passed_by_is_told(tmp_path, monkeypatch):
    """Folders that may not be read, as whoever owns them all never sees one, and tables."""
    (tmp_path / 'locked').mkdir()
    (tmp_path / 'day').mkdir()
    (tmp_path / 'day' / 'log.csv').write_text('t,phi,M\n')
    (tmp_path / 'day' / 'notes.txt').write_text('rain')
    scan = os.scandir

    def scandir(path):
        if os.path.basename(path) == 'locked':
            raise PermissionError(13, 'Permission denied', str(path))
        return scan(path)

    monkeypatch.setattr(os, 'scandir', scandir)
    with pytest.raises(InputError, match=r'no recording in there .*locked may not be read: change '
                       r'the rights.*day/log.csv left out.*engb import'):
        find_recordings([str(tmp_path)])
    with pytest.raises(InputError, match='locked may not be read'):
        find_recordings([str(tmp_path / 'locked')])
    (tmp_path / 'run.mcap').write_bytes(b'')
    left = LeftOut()
    assert [entry.key for entry in find_recordings([str(tmp_path)], left)] == ['run.mcap']
    assert len(left.told()) == 2
    # What a program of this package wrote beside its results is no table of a bench.
    (tmp_path / 'day' / LIST).write_text('{}')
    assert len((left := LeftOut()).told()) == 0 and find_recordings([str(tmp_path / 'day'),
                                                                     str(tmp_path)], left)
    assert left.tables == []
