# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""MCAP files of other writers: without chunks, without an index, lz4, with checksums."""

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.bags.read import read_recording

from .samples import JOINT_STATE, Run

writer = pytest.importorskip('mcap.writer', reason='the package mcap is not installed')
make_reader = pytest.importorskip('mcap.reader').make_reader


def write(path, run, **options):
    """Write a run's messages with mcap's own writer."""
    with path.open('wb') as file:
        out = writer.Writer(file, **options)
        out.start('ros2', 'test')
        channels = {}
        for message in run.messages:
            if message.topic not in channels:
                schema = out.register_schema(message.type, 'ros2msg', b'')
                channels[message.topic] = out.register_channel(message.topic, 'cdr', schema)
            out.add_message(channels[message.topic], message.log_time, message.data,
                            message.log_time)
        out.finish()
    return path


PLAIN = writer.CompressionType.NONE
OPTIONS = {
    'usual': {},
    'no chunks': {'use_chunking': False},
    'lz4': {'compression': writer.CompressionType.LZ4},
    'checksums': {'compression': PLAIN, 'enable_crcs': True},
    'no index': {'compression': PLAIN, 'index_types': writer.IndexType.NONE},
    'no summary': {'use_statistics': False, 'use_summary_offsets': False,
                   'repeat_channels': False, 'repeat_schemas': False,
                   'index_types': writer.IndexType.NONE},
    'index, but no channels in the summary': {'repeat_channels': False, 'repeat_schemas': False},
    'small chunks': {'chunk_size': 2000},
}


@pytest.mark.parametrize('name', OPTIONS)
def test_other_writers(tmp_path, name):
    run = Run(size=2000).long().floats('/engb/disc_speed', np.arange(2000.0))
    path = write(tmp_path / 'run.mcap', run, **OPTIONS[name])
    recording = read_recording(path)
    np.testing.assert_array_equal(recording.position, run.position)
    np.testing.assert_array_equal(recording.signals['disc_speed'].value, np.arange(2000.0))
    assert recording.notes == ()


@pytest.mark.parametrize('name', OPTIONS)
def test_other_writers_cut_off(tmp_path, name):
    run = Run(size=2000).long()
    path = write(tmp_path / 'run.mcap', run, **OPTIONS[name])
    data = path.read_bytes()
    path.write_bytes(data[:int(0.7 * len(data))])
    try:
        recording = read_recording(path)
    except InputError as error:
        assert name in ('lz4',)     # one lz4 chunk can't be taken apart
        assert 'run.mcap' in str(error)
        return
    np.testing.assert_array_equal(recording.position, run.position[:recording.time.size])
    assert recording.notes


def test_a_wrong_checksum_costs_the_chunk(tmp_path):
    run = Run(size=2000).long()
    path = write(tmp_path / 'run.mcap', run, compression=PLAIN, enable_crcs=True,
                 chunk_size=20_000)
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(data)
    recording = read_recording(path)
    assert 1000 < recording.time.size < 2000
    assert any('checksum' in note for note in recording.notes)


def test_an_index_that_lies_is_not_believed(tmp_path):
    run = Run(size=2000).long()
    path = write(tmp_path / 'run.mcap', run, compression=PLAIN, enable_crcs=False)
    data = bytearray(path.read_bytes())
    # The last message index record: opcode 7; change an offset in the midst of it.
    place = data.rindex((run.messages[1500].log_time).to_bytes(8, 'little'))
    data[place + 8:place + 16] = (123).to_bytes(8, 'little')
    path.write_bytes(data)
    np.testing.assert_array_equal(read_recording(path).position, run.position)


def test_json_messages_are_refused(tmp_path):
    path = tmp_path / 'run.mcap'
    with path.open('wb') as file:
        out = writer.Writer(file)
        out.start('', 'test')
        schema = out.register_schema(JOINT_STATE, 'jsonschema', b'{}')
        channel = out.register_channel('/joint_states', 'json', schema)
        out.add_message(channel, 1, b'{}', 1)
        out.finish()
    with pytest.raises(InputError, match='json.*cdr'):
        read_recording(path)


def test_a_chunk_that_claims_too_much_is_passed_over(tmp_path):
    """A bomb: the chunk's size field is the damaged one."""
    run = Run(size=2000).long()
    path = write(tmp_path / 'run.mcap', run, chunk_size=50_000)
    data = bytearray(path.read_bytes())
    with path.open('rb') as file:
        first = make_reader(file).get_summary().chunk_indexes[1].chunk_start_offset
    data[first + 9 + 16:first + 9 + 24] = (1 << 45).to_bytes(8, 'little')
    path.write_bytes(data)
    recording = read_recording(path)
    assert 1000 < recording.time.size < 2000
    assert any('claims' in note for note in recording.notes)
