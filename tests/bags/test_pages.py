# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Pages of a database put together by hand: what is no table of messages is left to SQLite."""

import itertools
import os
import sqlite3

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.bags.sqlite_file import SqliteFile
from engb_core.io.bags.sqlite_pages import PageTable, Unusual

SIZE = 512
# Serial types of whole numbers, and one number each that is stored so.
NUMBERS = {1: b'\5', 2: b'\0\5', 3: b'\0\0\5', 4: b'\0\0\0\5', 5: bytes(5) + b'\5',
           6: bytes(7) + b'\5', 8: b'', 9: b''}


def interior(children, last):
    """Return a page of a table's tree, with its children."""
    page = bytearray(SIZE)
    page[0] = 5
    page[3:5] = len(children).to_bytes(2, 'big')
    page[8:12] = last.to_bytes(4, 'big')
    for number, child in enumerate(children):
        place = SIZE - 8 * (number + 1)
        page[12 + 2 * number:14 + 2 * number] = place.to_bytes(2, 'big')
        page[place:place + 4] = child.to_bytes(4, 'big')
    return bytes(page)


def row(number, topic=1, clock=1, payload=b'12345678', head=b''):
    """Return a cell: row id, and a record of id, topic, time and message."""
    fields = NUMBERS.get(topic, b'') + NUMBERS.get(clock, b'') + payload
    head = head or bytes([5, 0, topic, clock, 12 + 2 * len(payload)])
    record = head + fields
    return bytes([len(record), number]) + record


def leaf(rows):
    page = bytearray(SIZE)
    page[0] = 13
    page[3:5] = len(rows).to_bytes(2, 'big')
    place = SIZE - 24
    for number, cell in enumerate(rows):
        place -= len(cell)
        page[place:place + len(cell)] = cell
        page[8 + 2 * number:10 + 2 * number] = place.to_bytes(2, 'big')
    return bytes(page)


@pytest.fixture
def table(tmp_path):
    """Return what opens a file of these pages, behind a head; the root is the second page."""
    opened = []

    def open_pages(*pages, root=2, size=SIZE):
        path = tmp_path / 'run.db3'
        path.write_bytes(bytes(16) + size.to_bytes(2, 'big') + bytes(SIZE - 18) + b''.join(pages))
        opened.append(os.open(path, os.O_RDWR))
        return PageTable(opened[-1], root)

    yield open_pages
    for file in opened:
        os.close(file)


def read(pages, leaves, strict=True, topics=(5,)):
    return [int(time) for _, _, times, _ in pages.rows(leaves, set(topics), strict)
            for time in times]


def test_leaves_come_in_the_order_of_the_tree(table):
    pages = table(interior([5, 3], 4), leaf([row(3)]), leaf([row(4)]), leaf([row(1), row(2)]))
    assert pages.leaves().tolist() == [5, 3, 4]
    assert pages.all_leaves().tolist() == [3, 4, 5]
    assert read(pages, pages.leaves()) == [5, 5, 5, 5]


@pytest.mark.parametrize('topic', NUMBERS)
def test_whole_numbers_of_every_size_are_read(table, topic):
    pages = table(leaf([row(1, topic, clock) for clock in NUMBERS]))
    assert read(pages, pages.leaves(), topics=({8: 0, 9: 1}.get(topic, 5),)) == [
        5, 5, 5, 5, 5, 5, 0, 1]


@pytest.mark.parametrize('size', [0, 100, 1000])
def test_what_is_no_size_of_a_page_is_refused(table, size):
    with pytest.raises(Unusual, match='no page size'):
        table(leaf([row(1)]), size=size)


def chain(length):
    return [interior([], number + 3) for number in range(length)]


@pytest.mark.parametrize(('pages', 'words'), [
    ([interior([], 99)], 'tree is damaged'),                        # a child beyond the end
    ([interior([], 1)], 'tree is damaged'),                         # the first page as a child
    ([interior([3], 3), leaf([row(1)])], 'tree is damaged'),        # a leaf twice
    ([interior([3], 3), interior([], 4), leaf([row(1)])], 'tree is damaged'),
    ([interior([3, 3, 3], 3), leaf([])], 'tree is damaged'),        # more pages than there are
    ([bytes(SIZE)], 'tree is damaged'),                             # neither leaf nor interior
    ([b'\5\0\0\2\0' + bytes(SIZE - 5)], 'tree is damaged'),         # more cells than find room
    ([interior([3], 3)[:12] + b'\1\xff' + bytes(SIZE - 14)], 'tree is damaged'),
    ([*chain(13), leaf([row(1)])], 'tree is too deep'),
])
def test_a_damaged_tree_is_left_to_the_library(table, pages, words):
    with pytest.raises(Unusual, match=words):
        table(*pages).leaves()


FORMS = [row(number % 100, *pair, payload=b'') for number, pair in enumerate(
    [*itertools.product(NUMBERS, NUMBERS), (1, 12)])]


@pytest.mark.parametrize(('pages', 'words', 'left'), [
    ([leaf([row(1)]), interior([], 2)], 'no leaf of a table', [5]),
    ([leaf([row(1)]), leaf([row(1, head=b'\5\0\1\1\7')])], 'not in rosbag2', [5]),
    ([leaf([row(1)]), leaf([row(2, topic=14)])], 'not in rosbag2', [5]),
    ([leaf([row(1)]), leaf([row(2, payload=b'12345678')[:-1] + b'\0', row(3, clock=13)])],
     'not in rosbag2', [5, 5]),
])
def test_rows_of_another_form_are_passed_over_where_the_file_is_cut(table, pages, words, left):
    opened = table(*pages)
    leaves = np.arange(2, 2 + len(pages))
    with pytest.raises(Unusual, match=words):
        read(opened, leaves)
    assert read(opened, leaves, strict=False) == left


def test_more_forms_than_a_recorder_writes_are_left_to_the_library(table):
    pages = [leaf(FORMS[first:first + 22]) for first in range(0, len(FORMS), 22)]
    opened = table(*pages)
    leaves = np.arange(2, 2 + len(pages))
    with pytest.raises(Unusual, match='too many forms'):
        read(opened, leaves)
    # Of the 64 pairs of forms each topic 5 has six, with times of every form.
    assert sorted(read(opened, leaves, strict=False)) == sorted(6 * [5, 5, 5, 5, 5, 5, 0, 1])


def test_leaves_that_lie_far_apart_are_read_one_by_one(table, tmp_path):
    opened = table(leaf([row(1)]))
    with (tmp_path / 'run.db3').open('r+b') as file:
        file.seek(3000 * SIZE)
        file.write(leaf([row(2, payload=b'1234')]))
    assert read(opened, np.array([2, 3001])) == [5, 5]
    with pytest.raises(Unusual, match='a page is missing'):
        read(opened, np.array([2, 3002]))


def test_a_file_that_gets_shorter_meanwhile_is_left_to_the_library(table, tmp_path):
    opened = table(interior([3], 4), leaf([row(1)]), leaf([row(2)]))
    leaves = opened.leaves()
    os.truncate(tmp_path / 'run.db3', 3 * SIZE)
    with pytest.raises(Unusual, match='a page is missing'):
        read(opened, leaves)


def database(path, script):
    base = sqlite3.connect(path)
    base.executescript('CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, '
                       'type TEXT, serialization_format TEXT);' + script)
    base.close()
    return path


MESSAGES = ('CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, '
            'timestamp INTEGER NOT NULL, data BLOB NOT NULL);')
TOPIC = "INSERT INTO topics VALUES (1, '/motor', 'pkg/msg/Number', 'cdr');"


@pytest.mark.parametrize(('script', 'words'), [
    ('', 'no table of messages'),
    ('CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, '
     'data BLOB AS (zeroblob(1000000000)));', 'messages has columns that are computed'),
])
def test_what_computes_instead_of_holding_is_refused(tmp_path, script, words):
    with pytest.raises(InputError, match=words):
        SqliteFile(database(tmp_path / 'run.db3', script))


def test_topics_whose_name_is_no_text_are_left_out_and_a_topic_that_is_not_there_gives_nothing(
        tmp_path):
    path = database(tmp_path / 'run.db3', MESSAGES + TOPIC
                    + "INSERT INTO topics VALUES (2, x'00', 'pkg/msg/Number', 'cdr');")
    with SqliteFile(path) as file:
        assert [channel.topic for channel in file.channels()] == ['/motor']
        assert list(file.batches({'/other'})) == []


def test_rows_of_another_type_are_left_out_beside_sound_ones(tmp_path):
    path = database(tmp_path / 'run.db3', MESSAGES + TOPIC + TOPIC.replace('1', '2').replace(
        'motor', 'other') + "INSERT INTO messages VALUES (1, 1, 5, x'01'), (2, 1, 6, 'text'), "
        "(3, 1, 'noon', x'02'), (4, 1, 7, x'03');")
    with SqliteFile(path) as file:
        found = list(file.batches({'/motor', '/other'}))
    assert [batch.log_time.tolist() for batch in found] == [[5, 7]]
    path = database(tmp_path / 'bad.db3', MESSAGES + TOPIC
                    + "INSERT INTO messages VALUES (2, 1, 6, 'text');")
    with SqliteFile(path) as file:
        assert list(file.batches({'/motor'})) == []
