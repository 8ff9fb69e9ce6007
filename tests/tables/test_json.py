# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Tables of JSON, as loggers of robots write them."""

import json
import random

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.tables.open import open_table
from engb_core.io.tables.roles import roles_of
from tests.fuzz.mutations import damage_bytes

RECORDS = [{'timestamp': 0.01 * k, 'position': 0.1 * k, 'torque': float(k % 7),
            'torque_enable': True, 'goal_position': 0.2 * k} for k in range(40)]


def written(tmp_path, text, name='log.json'):
    path = tmp_path / name
    path.write_text(text, 'utf8')
    return path


@pytest.mark.parametrize('text', [
    json.dumps(RECORDS),
    json.dumps({'motor': 'sts3250', 'kp': 32, 'entries': RECORDS}),
    '\n'.join(json.dumps(record) for record in RECORDS) + '\n',
    json.dumps({name: [record[name] for record in RECORDS] for name in RECORDS[0]}),
])
def test_records_and_columns_are_read_alike(tmp_path, text):
    table = open_table(written(tmp_path, text))
    names = [channel.name for channel in table.channels]
    assert names == list(RECORDS[0])
    assert table.read([1])[1].value == pytest.approx(0.1 * np.arange(40))
    roles = roles_of(table, {})
    assert {role: names[place] for role, place in roles.chosen.items()} == {
        'time': 'timestamp', 'position': 'position', 'effort': 'torque'}


def test_objects_and_short_lists_within_a_record_are_columns(tmp_path):
    records = [{'t': 0.1 * k, 'joint': {'q': [k, 2 * k]}, 'name': 'a'} for k in range(5)]
    table = open_table(written(tmp_path, json.dumps(records)))
    assert [channel.name for channel in table.channels] == ['t', 'joint.q.0', 'joint.q.1']
    assert table.read([2])[2].value.tolist() == [0.0, 2.0, 4.0, 6.0, 8.0]


def test_what_a_record_lacks_is_no_number(tmp_path):
    records = [{'t': 0.0, 'q': 1.0}, {'t': 0.1}, {'t': 0.2, 'q': None}, {'t': 0.3, 'q': 10 ** 400}]
    table = open_table(written(tmp_path, json.dumps(records)))
    assert np.isfinite(table.read([1])[1].value).tolist() == [True, False, False, False]


@pytest.mark.parametrize('text, reason', [
    ('{"t": [0, 1', 'not usable JSON'),
    ('[' * 100_000, 'not usable JSON'),
    ('{"motor": "sts3250"}', 'holds no column of numbers'),
    ('3', 'holds no column of numbers'),
])
def test_what_is_no_table_is_told(tmp_path, text, reason):
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=f'log.json: .*{reason}'):
        open_table(path)


def test_what_would_not_fit_into_memory_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr('engb_core.io.tables.json_file.MOST_BYTES', 100)
    with pytest.raises(InputError, match='too large for JSON'):
        open_table(written(tmp_path, json.dumps(RECORDS)))


@pytest.mark.parametrize('seed', range(60))
def test_damaged_ones_are_read_or_told(tmp_path, seed):
    text = json.dumps({'entries': RECORDS}, indent=seed % 2 or None)
    path = tmp_path / 'log.json'
    path.write_bytes(damage_bytes(text.encode(), random.Random(seed)))
    try:
        table = open_table(path)
        table.read(range(len(table.channels)))
    except InputError as error:
        assert str(error).startswith(str(path))
        assert '\n' not in str(error)
