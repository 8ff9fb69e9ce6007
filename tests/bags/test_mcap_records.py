# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Records put together by hand, sound and damaged: what is left of the file is told."""

import os
import struct

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.bags import mcap_records as mcap
from engb_core.io.bags.compression import CHUNK_LIMIT
from engb_core.io.bags.mcap_file import McapFile

MOTOR, OTHER = 1, 2


def record(opcode, body, length=None):
    return struct.pack('<BQ', opcode, len(body) if length is None else length) + body


def text(word):
    return struct.pack('<I', len(word)) + word.encode()


SCHEMA = record(mcap.SCHEMA, struct.pack('<H', 1) + text('pkg/msg/Number') + text('') + text(''))
CHANNELS = b''.join(record(mcap.CHANNEL, struct.pack('<HH', key, 1) + text(topic) + text('cdr')
                           + struct.pack('<I', 0))
                    for key, topic in ((MOTOR, '/motor'), (OTHER, '/other')))


def message(time, channel=MOTOR, payload=b'12345678'):
    return record(mcap.MESSAGE, struct.pack('<HIQQ', channel, 0, time, time) + payload)


def chunk(inside, size=None, packed=None, compression='', length=None):
    body = (struct.pack('<QQQI', 0, 0, len(inside) if size is None else size, 0)
            + text(compression)
            + struct.pack('<Q', len(inside) if packed is None else packed) + inside)
    return record(mcap.CHUNK, body, length)


def index(channel, entries):
    return record(mcap.MESSAGE_INDEX, struct.pack('<HI', channel, 16 * len(entries)) + b''.join(
        struct.pack('<QQ', *entry) for entry in entries))


def chunk_index(start):
    return record(8, struct.pack('<QQQ', 0, 0, start) + bytes(32))


def whole(*records, summary=(), closed=True):
    """Return a file of these records; `summary` has the places of chunks, None: there is none."""
    data, places = mcap.MAGIC + SCHEMA + CHANNELS, []
    for entry in records:
        places.append(len(data))
        data += entry
    if closed:
        data += record(mcap.DATA_END, bytes(4))
        start = len(data)
        if summary is None:
            start, summary = 0, ()
        else:
            data += SCHEMA + CHANNELS
        for place in summary:
            data += chunk_index(places[place])
        data += record(mcap.FOOTER, struct.pack('<QQI', start, 0, 0)) + mcap.MAGIC
    return data


def read(folder, data, topics=('/motor',), grown=None):
    """Return the log times that come out, and the notes; `grown`: fill up with zeros to there."""
    path = folder / 'run.mcap'
    path.write_bytes(data)
    if grown:
        os.truncate(path, grown)
    with McapFile(path) as file:
        file.channels()
        times = [int(time) for batch in file.batches(set(topics)) for time in batch.log_time]
        return times, file.notes


BOTH = [message(5), message(6)]
SOUND = chunk(b''.join(BOTH))
LATER = chunk(message(9))


def test_a_sound_file_without_summary_gives_all_messages_and_no_note(tmp_path):
    assert read(tmp_path, whole(SOUND, LATER, summary=None)) == ([5, 6, 9], [])


@pytest.mark.parametrize(('behind', 'expected'), [
    (index(MOTOR, [(5, 0), (6, len(BOTH[0]))]), [5, 6]),
    (index(OTHER, [(5, 0)]), []),           # a chunk of another topic is not even unpacked
    # Indexes that are not to be trusted: the chunk itself is walked through.
    (index(77, [(5, 0)]), [5, 6]),
    (index(MOTOR, []), [5, 6]),
    (index(MOTOR, [(5, 10**6)]), [5, 6]),
    (index(MOTOR, [(5, 3)]), [5, 6]),
    (index(MOTOR, [(5, 0), (6, 10**9)]), [5, 6]),
    (index(MOTOR, [(5, 0), (8, len(BOTH[0]))]), [5, 6]),
    (index(MOTOR, [(5, 0)] * 9), [5, 6]),
    (index(MOTOR, [(5, 0)]) * 2, [5, 6]),
    (record(mcap.MESSAGE_INDEX, struct.pack('<H', MOTOR)), [5, 6]),
    (record(mcap.MESSAGE_INDEX, struct.pack('<HI', MOTOR, 160)), [5, 6]),
])
def test_an_index_is_held_against_the_messages(tmp_path, behind, expected):
    assert read(tmp_path, whole(SOUND, behind)) == (expected, [])


@pytest.mark.parametrize(('records', 'summary', 'expected', 'words'), [
    ((SOUND, record(0, b''), LATER), (0, 2), [5, 6, 9], '(no record): that part is left out'),
    ((SOUND, record(0, b''), LATER), (), [5, 6], '(no record): read up to there'),
    ((SOUND, chunk(message(7), length=10**6), LATER), (0, 2), [5, 6, 9],
     'a chunk claims 1000000 bytes): that part is left out'),
    ((SOUND, chunk(message(7), packed=10**6), LATER), (), [5, 6, 9],
     'a chunk claims more bytes than its record): that part is left out'),
    ((SOUND, chunk(message(7), compression='rar'), LATER), (), [5, 6, 9],
     "unknown compression 'rar'): that part is left out"),
    ((SOUND, chunk(message(7), size=11), LATER), (), [5, 6, 9],
     'instead of 11): that part is left out'),
    ((SOUND, record(mcap.CHUNK, b'\0' * 30 + b'\xff' * 10), LATER), (), [5, 6, 9],
     'a chunk record is damaged'),
    ((chunk(message(5) + record(mcap.MESSAGE, b'short')), LATER), (), [5, 9],
     'is damaged inside, its last 14 bytes are left out'),
    ((message(5), record(mcap.MESSAGE, b'short')), (), [5], 'a message record is damaged'),
])
def test_damage_costs_its_part_and_is_told(tmp_path, records, summary, expected, words):
    times, notes = read(tmp_path, whole(*records, summary=summary))
    assert times == expected
    assert len(notes) == 1 and words in notes[0]


def test_a_chunk_that_is_cut_off_gives_its_whole_messages(tmp_path):
    cut = chunk(b''.join(BOTH))[:-3]
    times, notes = read(tmp_path, whole(LATER, cut, closed=False))
    assert times == [9, 5]
    assert 'is cut off' in notes[0]


@pytest.mark.parametrize(('last', 'words'), [
    (record(mcap.CHUNK, b'', 1 << 40), 'is cut off'),
    (record(mcap.MESSAGE, struct.pack('<HIQQ', MOTOR, 0, 7, 7), CHUNK_LIMIT + 5),
     'a message claims 268435461 bytes'),
])
def test_what_claims_more_than_a_chunk_holds_is_not_read(tmp_path, last, words):
    times, notes = read(tmp_path, whole(SOUND, last, closed=False), grown=CHUNK_LIMIT + (1 << 20))
    assert times == [5, 6]
    assert words in notes[0]


def test_a_summary_that_would_be_larger_than_any_is_not_read(tmp_path):
    path = tmp_path / 'run.mcap'
    path.write_bytes(whole(SOUND, closed=False))
    with path.open('r+b') as file:
        file.seek(1 << 27)
        file.write(record(mcap.FOOTER, struct.pack('<QQI', 8, 0, 0)) + mcap.MAGIC)
    with McapFile(path) as file:
        assert [channel.topic for channel in file.channels()] == ['/motor', '/other']
        times = [time for batch in file.batches({'/motor'}) for time in batch.log_time]
        assert times == [5, 6]
        assert 'no record' in file.notes[0]


def test_a_file_that_unpacks_without_end_is_refused(tmp_path):
    bomb = chunk(message(7), size=CHUNK_LIMIT)
    with pytest.raises(InputError, match=r'unpacks to more than 512 MiB; not a recording'):
        read(tmp_path, whole(SOUND, bomb, bomb))


def test_a_cut_record_ends_the_walk():
    found = mcap.scan(message(5) + message(6)[:12], mcap.Directory(), None)
    assert found.log_time[MOTOR].tolist() == [5] and not found.whole
    found = mcap.scan(message(5) + b'\5\0', mcap.Directory(), {OTHER})
    assert found.log_time == {} and not found.whole and found.end == len(message(5))


@pytest.mark.parametrize('offset', [-1, 10**7])
def test_an_index_that_points_outside_is_none(offset):
    data = np.frombuffer(message(5) + message(6), np.uint8)
    entries = np.array([[5, 0], [6, offset]], np.int64).view(np.uint64)
    assert mcap.gather(data, MOTOR, entries) is None
    times, rows = mcap.gather(data, MOTOR, np.array([[5, 0], [6, 39]], np.uint64))
    assert times.tolist() == [5, 6] and rows.tobytes() == b'1234567812345678'
