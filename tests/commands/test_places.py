# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Places to write to that are no usual ones, and what happens in the moment of writing."""

import json
import os
import signal
import threading

import pytest

from engb_core.errors import InputError
from engb_core.io import outputs
from engb_core.io.outputs import claimed_folder, file_output, folder_output, recording_output


def write(folder, text='x'):
    with folder_output(folder, ['result']) as scratch:
        (scratch / 'result').write_text(text)


def test_a_pipe_and_a_folder_in_the_place_of_a_file_are_refused(tmp_path):
    os.mkfifo(tmp_path / 'pipe.yaml')
    (tmp_path / 'folder.yaml').mkdir()
    for name, words in (('pipe.yaml', 'is there and no file'),
                        ('folder.yaml', 'is a folder; name'),
                        ('a.txt', 'the name must end in .yaml')):
        with pytest.raises(InputError, match=words), file_output(tmp_path / name, '.yaml'):
            pass


def test_a_folder_that_is_claimed_may_not_be_a_file(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(InputError, match='is a file; name a folder'), claimed_folder(
            tmp_path / 'file', ['result']):
        pass


def test_work_that_ends_before_its_result_leaves_no_list_of_results(tmp_path):
    with pytest.raises(KeyboardInterrupt), claimed_folder(tmp_path / 'out', ['result']) as folder:
        (folder / 'part').write_text('x')
        raise KeyboardInterrupt
    assert [entry.name for entry in (tmp_path / 'out').iterdir()] == ['part']


def test_a_mount_point_is_not_replaced():
    with pytest.raises(InputError, match='/proc: is a mount point; name a folder in it'), \
            recording_output('/proc', replace=True):
        pass


def test_a_bag_that_is_packed_as_a_whole_keeps_the_name_of_its_form(tmp_path):
    with recording_output(tmp_path / 'run.mcap') as made:
        made.with_name('run.mcap.zstd').write_text('packed')
    assert [entry.name for entry in tmp_path.iterdir()] == ['run.mcap.zstd']


@pytest.mark.parametrize('text', [
    json.dumps({'format': 'another/1', 'files': {'result': 'x'}}), '[]', '{', None, 'long'])
def test_a_list_that_is_none_makes_files_somebody_s_own(tmp_path, text):
    write(tmp_path / 'out')
    place = tmp_path / 'out' / outputs.LIST
    place.unlink()
    if text is None:
        place.mkdir()
    elif text == 'long':
        with place.open('w') as file:
            file.truncate(outputs._LIST_LIMIT + 1)
    else:
        place.write_text(text)
    with pytest.raises(InputError, match='holds result, which engb did not write there'):
        write(tmp_path / 'out', 'y')
    assert (tmp_path / 'out' / 'result').read_text() == 'x'


def test_a_signal_that_is_ignored_stays_ignored_while_files_take_their_places(tmp_path):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with outputs.undisturbed():
            signal.raise_signal(signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_signal_that_came_meanwhile_is_handed_on(tmp_path):
    came = []
    before = signal.signal(signal.SIGHUP, lambda number, frame: came.append(number))
    try:
        with outputs.undisturbed():
            signal.raise_signal(signal.SIGHUP)
            assert came == []
        assert came == [signal.SIGHUP]
    finally:
        signal.signal(signal.SIGHUP, before)


def test_results_are_written_from_a_thread_as_well(tmp_path):
    thread = threading.Thread(target=write, args=(tmp_path / 'out',))
    thread.start()
    thread.join()
    assert (tmp_path / 'out' / 'result').read_text() == 'x'


def test_an_error_within_names_the_place_that_was_named(tmp_path):
    with pytest.raises(InputError) as told, file_output(tmp_path / 'a.yaml', '.yaml') as made:
        raise InputError(f'{made.parent / "a.yaml"}: no space')
    assert str(told.value) == f'--out {tmp_path / "a.yaml"}: no space'
    with pytest.raises(InputError) as told, file_output(tmp_path / 'a.yaml', '.yaml'):
        raise InputError('run1: damaged')
    assert str(told.value) == 'run1: damaged'
    assert list(tmp_path.iterdir()) == []
