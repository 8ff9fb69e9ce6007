# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What comes out of packed data is bounded, and what does not come out right is told."""

import sys

from backports import zstd
import pytest

from engb_core.errors import InputError
from engb_core.io.bags import compression
from engb_core.io.bags.compression import Damaged, decompress, decompress_head, unpacked

DATA = bytes(range(256)) * 8
PACKED = zstd.compress(DATA)


def decompress_without(monkeypatch, package):
    """Return what unpacks single messages where a package is not installed."""
    monkeypatch.setitem(sys.modules, package, None)
    compression._message_decoder.cache_clear()
    decoder = compression._message_decoder()
    compression._message_decoder.cache_clear()
    return decoder


@pytest.mark.parametrize('installed', [True, False])
def test_one_message_is_unpacked_up_to_a_limit(monkeypatch, installed):
    pytest.importorskip('zstandard')
    unpack = (compression.decompress_message if installed
              else decompress_without(monkeypatch, 'zstandard'))
    assert unpack(PACKED, len(DATA)) == DATA
    with pytest.raises(Damaged, match='a message of more than 2047 bytes'):
        unpack(PACKED, len(DATA) - 1)
    with pytest.raises(Damaged, match='zstd: '):
        unpack(b'nothing of the kind', 100)


@pytest.mark.parametrize(('data', 'method', 'size', 'words'), [
    (DATA, '', 5, 'a chunk holds 2048 bytes instead of 5'),
    (PACKED, 'zstd', 100, 'a chunk holds 101 bytes instead of 100'),
    (PACKED, 'zstd', 5000, 'a chunk holds 2048 bytes instead of 5000'),
    (PACKED, 'bz2', 2048, "unknown compression 'bz2'"),
    (PACKED, 'lz4', 2048, 'lz4: '),
    (DATA, 'zstd', 2048, 'zstd: '),
    (PACKED, 'zstd', 1 << 40, 'a chunk claims 1099511627776 bytes'),
])
def test_what_comes_out_of_a_chunk_has_to_be_what_it_says(data, method, size, words):
    with pytest.raises(Damaged, match=words):
        decompress(data, method, size)


def test_the_beginning_of_a_cut_chunk_is_what_can_be_had():
    assert decompress_head(DATA[:90], '', 2048) == DATA[:90]
    assert DATA.startswith(bytes(decompress_head(PACKED[:-4], 'zstd', 2048)))
    assert decompress_head(b'junk', 'zstd', 2048) == b''
    assert decompress_head(PACKED, 'lz4', 2048) == b''


def test_a_file_that_unpacks_without_end_is_refused_and_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv('TMPDIR', str(tmp_path))
    monkeypatch.setattr('tempfile.tempdir', None)
    path = tmp_path / 'run.mcap.zstd'
    path.write_bytes(zstd.compress(bytes(24 << 20)))
    with pytest.raises(InputError, match='unpacks to more than 16 MiB; not a recording'), \
            unpacked(path, []):
        pass
    assert [entry.name for entry in tmp_path.iterdir()] == ['run.mcap.zstd']
