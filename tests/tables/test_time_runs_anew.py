# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A log that starts anew within one file is two runs; samples that come late are sorted."""

import numpy as np
import pytest

import engb_core as engb
from engb_core.errors import InputError
from engb_core.io.tables.measure import measured_of
from engb_core.io.tables.request import Request

TIME = np.arange(1000) * 1e-3


def table(folder, time):
    path = folder / 'bench.csv'
    np.savetxt(path, np.stack([time, np.sin(9.0 * time), np.cos(9.0 * time)], 1), fmt='%.6f',
               delimiter=',', comments='', header='t [s],phi [rad],M [N·m]')
    return path


def late(rows):
    """Return the order in which rows are written where these come after all up to row 700."""
    order = np.arange(TIME.size)
    return np.concatenate([np.setdiff1d(order[:700], rows), rows, order[700:]])


@pytest.mark.parametrize(('time', 'row', 'back'), [
    (np.concatenate([TIME, TIME]), 1001, '0.999'),
    (np.concatenate([TIME, TIME + 4e-4]), 1001, '0.9986'),
    (np.concatenate([TIME[:600], TIME[200:]]), 601, '0.399'),
    (np.concatenate([TIME + 5.0, TIME + 4.5]), 1001, '1.499'),
], ids=['again', 'interleaved', 'in part', 'reaching back'])
def test_time_that_runs_anew_is_refused_with_the_row(tmp_path, time, row, back):
    path = table(tmp_path, time)
    words = (rf'bench.csv: time jumps back by {back} s at row {row} of its {time.size} rows.*'
             rf'rows 1 to {row - 1} and those from {row} on')
    with pytest.raises(InputError, match=words):
        measured_of(path, Request())
    with pytest.raises(InputError, match=f'recording: time jumps back by {back} s at row {row}'):
        engb.Recording(time, np.sin(time), np.cos(time))


@pytest.mark.parametrize('order', [
    late(np.arange(300, 400)), late(np.array([650])), late(np.arange(600, 650, 2)),
    np.random.default_rng(1).permutation(TIME.size), np.arange(TIME.size)[::-1]],
    ids=['a block', 'one sample', 'every other', 'at random', 'backwards'])
def test_what_comes_late_is_sorted(tmp_path, order):
    recording = measured_of(table(tmp_path, TIME[order]), Request())[0].recording()
    np.testing.assert_allclose(recording.time, TIME, atol=1e-9)
    np.testing.assert_allclose(recording.position, np.sin(9.0 * TIME), atol=1e-6)


def test_stamps_that_jitter_are_sorted(tmp_path):
    jitter = TIME + np.random.default_rng(2).normal(0.0, 3e-3, TIME.size)
    recording = measured_of(table(tmp_path, jitter), Request())[0].recording()
    assert recording.time.size == TIME.size


HEAD = 't [s],phi [rad],M [N·m]\n'


@pytest.mark.parametrize(('text', 'words'), [
    ('', 'bench.csv: the file is empty; export'),
    (HEAD, 'bench.csv: holds no row of numbers; a table has one per sample'),
    (HEAD + '0,1,2\n', 'bench.csv: the column for time holds one number; export a row per sample'),
    (HEAD + ''.join(f'{n / 100},{n},{n * n}\n' for n in range(10)),
     'bench.csv: holds 10 usable samples, at least 20 are needed; record a longer run')])
def test_what_is_too_little_is_told_with_path_and_remedy(tmp_path, text, words):
    path = tmp_path / 'bench.csv'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(InputError, match=words) as caught:
        measured_of(path, Request())[0].recording()
    assert str(caught.value).startswith(str(path))


def test_a_table_that_is_not_there_is_told_so(tmp_path):
    with pytest.raises(InputError, match='gone.csv: there is no such file; give a recording'):
        measured_of(tmp_path / 'gone.csv', Request())
