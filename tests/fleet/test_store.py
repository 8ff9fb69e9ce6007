# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Results on disk: what counts as done."""

import json

import pytest

from engb_core.errors import InputError
from engb_ros.fleet.find import Found
from engb_ros.fleet.store import Store

GOOD = [{'status': 'ok', 'message': '', 'value': float('nan'), 'report': '<html>'}]


@pytest.fixture
def found(tmp_path):
    """A recording."""
    path = tmp_path / 'a.mcap'
    path.write_bytes(b'x')
    return Found('a.mcap', path, 'a')


def test_done_stays_done_until_something_changes(tmp_path, found):
    store = Store(str(tmp_path / 'out'), {'m': 1})
    assert store.load(found) is None
    kept = store.save(found, GOOD)
    assert kept[0]['value'] is None
    assert (tmp_path / 'out' / kept[0]['report']).read_text() == '<html>'
    assert store.load(found) == kept
    assert Store(str(tmp_path / 'out'), {'m': 1}).load(found) == kept
    assert Store(str(tmp_path / 'out'), {'m': 2}).load(found) is None
    assert Store(str(tmp_path / 'out'), {'m': 1}, 'still').load(found) is None
    (tmp_path / 'out' / kept[0]['report']).unlink()
    assert store.load(found) is None
    store.save(found, GOOD)
    found.path.write_bytes(b'other')
    assert store.load(found) is None


@pytest.mark.parametrize(('status', 'done'), [('ok', True), ('refused', True), ('fault', False),
                                              ('lost', False)])
def test_faults_are_tried_again(tmp_path, found, status, done):
    store = Store(str(tmp_path / 'out'), {})
    store.save(found, [{'status': status, 'message': 'x'}])
    assert (store.load(found) is not None) == done


@pytest.mark.parametrize('text', ['', '{', '[]', '{"format": 1}', 'null', '\0'])
def test_damaged_results_are_done_again(tmp_path, found, text):
    store = Store(str(tmp_path / 'out'), {})
    store.save(found, GOOD)
    file, = (tmp_path / 'out' / 'results').iterdir()
    assert json.loads(file.read_text())['key'] == 'a.mcap'
    file.write_text(text)
    assert store.load(found) is None


def test_out_that_cannot_be(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(InputError, match='is a file'):
        Store(str(tmp_path / 'file'), {})
    with pytest.raises(InputError, match='cannot be written'):
        Store(str(tmp_path / 'file' / 'x'), {})
