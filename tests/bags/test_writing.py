# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A bag while it is being written: topics it does not know, parts, a disk that takes no more."""

import contextlib
import resource

import pytest
from rosbags.rosbag2 import Reader
import yaml

from engb_core.errors import InputError
from engb_core.io.bags.mcap_file import McapFile
from engb_core.io.bags.writing import BagWriter

from .samples import FLOAT64, float64


def test_only_known_topics_are_written(tmp_path):
    writer = BagWriter(tmp_path / 'run')
    assert writer.add_topic('/motor', FLOAT64)
    assert writer.add_topic('/motor', FLOAT64)      # a second time changes nothing
    assert not writer.add_topic('/theirs', 'their_msgs/msg/Thing')
    for topic in ('/motor', '/theirs'):
        writer.write(topic, 5, float64(1.5))
    assert writer.close() == 1
    with Reader(tmp_path / 'run') as bag:
        assert [(entry.topic, time) for entry, time, _ in bag.messages()] == [('/motor', 5)]


def test_a_closed_bag_takes_no_more_and_may_be_closed_again(tmp_path):
    writer = BagWriter(tmp_path / 'run')
    writer.add_topic('/motor', FLOAT64)
    writer.write('/motor', 5, float64(1.5))
    assert writer.close() == 1
    before = (tmp_path / 'run' / 'run.mcap').read_bytes()
    writer.write('/motor', 6, float64(1.5))
    writer.finish_chunk()
    assert writer.close() == 1
    assert (tmp_path / 'run' / 'run.mcap').read_bytes() == before


def test_each_part_of_a_bag_knows_all_topics(tmp_path):
    writer = BagWriter(tmp_path / 'run', split_time=1e-6)
    for topic in ('/motor', '/load'):       # two of one type
        writer.add_topic(topic, FLOAT64)
    for time in range(0, 4000, 500):
        writer.write('/motor' if time % 1000 else '/load', time + 1, float64(time))
    assert writer.close() == 8
    with Reader(tmp_path / 'run') as bag:
        assert [time for _, time, _ in bag.messages()] == list(range(1, 4000, 500))
    bag = yaml.safe_load((tmp_path / 'run' / 'metadata.yaml').read_text())[
        'rosbag2_bagfile_information']
    assert sum(part['message_count'] for part in bag['files']) == 8
    assert len(bag['files']) > 1
    for name in bag['relative_file_paths']:
        with McapFile(tmp_path / 'run' / name) as part:
            assert [channel.topic for channel in part.channels()] == ['/motor', '/load']


@contextlib.contextmanager
def full_disk(size):
    """Let no file of this process grow beyond `size` [bytes], as on a disk that is full."""
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


@pytest.mark.parametrize('step', ['write', 'finish_chunk', 'close'])
def test_a_disk_that_takes_no_more_leaves_what_was_written_before(tmp_path, step):
    writer = BagWriter(tmp_path / 'run')
    writer.add_topic('/motor', FLOAT64)
    writer.write('/motor', 5, float64(1.5))
    writer.finish_chunk()
    large = bytes(2 << 20) if step == 'write' else bytes(1 << 19)
    file = tmp_path / 'run' / 'run.mcap'
    with full_disk(file.stat().st_size + 100), pytest.raises(
            InputError, match=r'run: cannot be written \(File too large\); free space'):
        writer.write('/motor', 6, large)
        if step == 'finish_chunk':
            writer.finish_chunk()
        writer.close()
    assert not writer.is_open
    writer.write('/motor', 7, float64(1.5))         # nothing goes on behind it
    with McapFile(file) as bag:
        assert [time for batch in bag.batches({channel.topic for channel in bag.channels()})
                for time in batch.log_time] == [5]


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(InputError, match='cannot be made'):
        BagWriter(tmp_path / 'file' / 'run')
    BagWriter(tmp_path / 'run').close()
    with pytest.raises(InputError, match='exists already'):
        BagWriter(tmp_path / 'run')
