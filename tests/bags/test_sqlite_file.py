# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Databases: pages by numpy where they are as rosbag2 writes them, SQLite's library elsewhere."""

from pathlib import Path
import sqlite3

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.bags import sqlite_pages
from engb_core.io.bags.read import read_recording
from engb_core.io.bags.sqlite_file import SqliteFile

from .samples import JOINT_STATE, joint_state, Run, storage_file


@pytest.fixture
def library(monkeypatch):
    """Count how often the library has to read the messages."""
    calls = []
    original = SqliteFile._by_library

    def counted(self, *arguments):
        calls.append(arguments)
        return original(self, *arguments)

    monkeypatch.setattr(SqliteFile, '_by_library', counted)
    return calls


def change(folder: Path, script: str) -> None:
    """Run SQL on a bag's database."""
    base = sqlite3.connect(storage_file(folder))
    base.executescript(script)
    base.close()


def test_pages_are_enough_for_a_usual_bag(tmp_path, library):
    run = Run(size=3000).long().floats('/engb/disc_speed', np.arange(3000.0))
    recording = read_recording(run.write(tmp_path / 'run', 'sqlite3'))
    np.testing.assert_array_equal(recording.position, run.position)
    np.testing.assert_array_equal(recording.signals['disc_speed'].value, np.arange(3000.0))
    assert not library


def test_large_messages_of_other_topics_do_not_matter(tmp_path, library):
    run = Run(size=3000).long()
    for index in range(0, 3000, 300):
        run.add('/camera', 'std_msgs/msg/String', int(run.stamp[index]) + 5, bytes(20_000))
    np.testing.assert_array_equal(read_recording(run.write(tmp_path / 'run', 'sqlite3')).position,
                                  run.position)
    assert not library


def test_messages_larger_than_a_page(tmp_path, library):
    run = Run()
    names = [f'joint_{index}' for index in range(200)] + ['motor']
    for index in range(run.size):
        values = np.full(201, run.position[index])
        run.add('/engb/joint_states', JOINT_STATE, int(run.stamp[index]), joint_state(
            int(run.stamp[index]), names, values, values, values))
    np.testing.assert_array_equal(read_recording(run.write(tmp_path / 'run', 'sqlite3')).position,
                                  run.position)
    assert library


def test_a_change_of_form_midway_loses_and_doubles_nothing(tmp_path, library, monkeypatch):
    monkeypatch.setattr(sqlite_pages, '_PAGES', 20)
    run = Run(size=5000).long()
    folder = run.write(tmp_path / 'run', 'sqlite3')
    change(folder, 'UPDATE messages SET data = 5 WHERE id = 4500')
    recording = read_recording(folder)
    assert recording.time.size == 4999
    assert recording.notes == ()
    assert library[0][1] > 0        # it went on from the middle


@pytest.mark.parametrize('script', [
    'ALTER TABLE messages ADD COLUMN extra INTEGER DEFAULT 1',
    '''ALTER TABLE messages RENAME TO old;
       CREATE TABLE messages(id TEXT, topic_id INTEGER, timestamp INTEGER, data BLOB);
       INSERT INTO messages SELECT * FROM old; DROP TABLE old;''',
])
def test_unusual_tables(tmp_path, script):
    run = Run().joint_states()
    folder = run.write(tmp_path / 'run', 'sqlite3')
    change(folder, script)
    np.testing.assert_array_equal(read_recording(folder).position, run.position)


@pytest.mark.parametrize('script', ['PRAGMA page_size=512; VACUUM', 'PRAGMA page_size=65536; '
                                    'VACUUM', 'DELETE FROM messages WHERE id % 2 = 0',
                                    'UPDATE messages SET id = id + 1000000000000'])
def test_other_pages(tmp_path, library, script):
    run = Run(size=2000).long()
    folder = run.write(tmp_path / 'run', 'sqlite3')
    change(folder, script)
    recording = read_recording(folder)
    if 'DELETE' in script:
        assert recording.time.size == 1000
    else:
        np.testing.assert_array_equal(recording.position, run.position)
    # Row ids beyond 35 bits are left to the library.
    assert bool(library) == ('1000000000000' in script)


def test_rows_in_a_write_ahead_log_count(tmp_path):
    run = Run().joint_states()
    folder = run.write(tmp_path / 'run', 'sqlite3')
    base = sqlite3.connect(storage_file(folder))
    base.execute('PRAGMA journal_mode=WAL')
    base.execute('PRAGMA wal_autocheckpoint=0')
    with base:
        base.execute('INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?, ?)', (
            int(run.stamp[-1]) + 10**6, joint_state(int(run.stamp[-1]) + 10**6, ['motor'], [7.0],
                                                    [0.0], [0.0])))
    recording = read_recording(folder)
    assert recording.time.size == 301
    assert recording.position[-1] == 7.0
    base.close()


def test_a_view_instead_of_the_table_is_refused(tmp_path):
    folder = Run().joint_states().write(tmp_path / 'run', 'sqlite3')
    change(folder, '''ALTER TABLE messages RENAME TO old;
                      CREATE VIEW messages AS SELECT * FROM old;''')
    with pytest.raises(InputError, match='not a rosbag2 database'):
        read_recording(folder)


def test_old_bags_without_type_hashes(tmp_path):
    """The tables as they were before Iron."""
    run = Run().joint_states()
    base = sqlite3.connect(tmp_path / 'old.db3')
    base.executescript('''
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                            serialization_format TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
                              timestamp INTEGER NOT NULL, data BLOB NOT NULL);
        INSERT INTO topics VALUES(4, '/engb/joint_states', 'sensor_msgs/msg/JointState', 'cdr');
        INSERT INTO topics VALUES(300, '/x', 'std_msgs/msg/Float64', 'cdr');''')
    with base:
        base.executemany('INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)', [
            (4, message.log_time, message.data) for message in run.messages] + [
            (300, int(run.stamp[0]), b'\0\1\0\0' + bytes(8))])
    base.close()
    recording = read_recording(tmp_path / 'old.db3')
    np.testing.assert_array_equal(recording.position, run.position)
    assert list(recording.signals) == ['x']


def damaged(path: Path, page: int, offset: int, value: bytes) -> None:
    """Overwrite bytes of a page, counted from 1."""
    data = bytearray(path.read_bytes())
    size = int.from_bytes(data[16:18], 'big')
    size = 65536 if size == 1 else size
    place = (page - 1) * size + offset
    data[place:place + len(value)] = value
    path.write_bytes(data)


def root_of(path: Path) -> int:
    base = sqlite3.connect(path)
    root, = base.execute("SELECT rootpage FROM sqlite_master WHERE name='messages'").fetchone()
    base.close()
    return root


# What is damaged: of the table's root or of one of its leaves, where, and to what.
DAMAGE = {
    'the root is no page of a table': ('root', 0, b'\x07'),
    'the root counts more cells than it holds': ('root', 3, b'\xff\xff'),
    'a cell of the root lies beyond it': ('root', 12, b'\xff\xff'),
    'the last child does not exist': ('root', 8, b'\x7f\xff\xff\xff'),
    'the last child is the root itself': ('root', 8, None),
    'a leaf is no page of a table': ('leaf', 0, b'\x63'),
    'a leaf counts more cells than it holds': ('leaf', 3, b'\xff\xff'),
    'a cell of a leaf lies beyond it': ('leaf', 8, b'\xff\xff'),
    'a cell of a leaf lies in its head': ('leaf', 8, b'\x00\x00'),
}


@pytest.mark.parametrize('what', DAMAGE)
def test_damage_costs_samples_and_brings_no_wrong_ones(tmp_path, what):
    """Whatever comes out of a damaged tree was recorded, in its order; else a line names the
    file."""
    run = Run(size=3000).long()
    folder = run.write(tmp_path / 'run', 'sqlite3')
    file = storage_file(folder)
    root = root_of(file)
    with open(file, 'rb') as opened:
        leaves = sqlite_pages.PageTable(opened.fileno(), root).leaves()
    place, offset, value = DAMAGE[what]
    page = root if place == 'root' else int(leaves[leaves.size // 2])
    damaged(file, page, offset, root.to_bytes(4, 'big') if value is None else value)
    try:
        recording = read_recording(folder)
    except InputError as error:
        assert file.name in str(error) or str(folder) in str(error)
        return
    known = np.isin(recording.position, run.position)
    assert known.all(), f'{(~known).sum()} of {known.size} positions were never recorded'
    assert (np.diff(recording.time) > 0.0).all()
    # A row that passes for another topic's is missed by nobody; more are told.
    assert recording.time.size >= 2999 or recording.notes
    if place == 'leaf':
        assert recording.time.size > 1400
