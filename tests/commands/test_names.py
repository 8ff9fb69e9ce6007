# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings of one name are told apart by their folders, and no held-out one is a copy."""

import shutil

import numpy as np
import pytest

import engb_core as library
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.recording import Recording
from engb_ros.commands.inputs import read_inputs, recording_names
from engb_ros.commands.table_options import Request

from .conftest import motion


def table(path, seed=0):
    run = motion(400)
    path.parent.mkdir(parents=True, exist_ok=True)
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(400)
    rows = np.stack([run['time'], run['position'], run['effort'] + noise], 1)
    np.savetxt(path, rows, fmt='%.9g', delimiter=',', comments='',
               header='t [s],phi [rad],M [N·m]')
    return path


def names_of(*paths):
    return [entry.name for entry in read_inputs(
        [str(path) for path in paths], None, None, lambda text: None, Request()).recordings]


def test_tables_of_a_folder_per_day_have_the_folder_s_name_in_front(tmp_path, bag, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for number, place in enumerate(['mon/log.csv', 'tue/log.csv', 'wed/other.csv',
                                    'old/mon/log.csv', 'mon/run1.csv', 'mon/run1.tsv']):
        table(tmp_path / place, number)
    assert names_of('mon/log.csv', 'tue/log.csv', 'wed/other.csv') == [
        'mon/log', 'tue/log', 'other']
    assert recording_names(['mon/log.csv', 'tue/log.csv', 'wed/other.csv', 'run1']) == {
        'mon/log.csv': 'mon_log.mcap', 'tue/log.csv': 'tue_log.mcap',
        'wed/other.csv': 'other.mcap'}
    # As many folders as it takes, a table beside a bag as well, and the suffix within a folder.
    assert names_of('mon/log.csv', 'old/mon/log.csv')[1] == 'old/mon/log'
    shutil.copytree('run1', 'tue/run1')
    assert names_of('run1', 'tue/run1', 'mon/run1.csv')[1:] == ['tue/run1', 'mon/run1']
    assert names_of('mon/run1.csv', 'mon/run1.tsv') == ['run1.csv', 'run1.tsv']


def test_a_diagnosis_writes_each_under_its_name(engb, tmp_path, monkeypatch):
    for number, place in enumerate(['mon/log.csv', 'tue/log.csv']):
        table(tmp_path / place, number)
    Model().write(tmp_path / 'model.yaml')
    given = []

    def stop(recordings, *_, **__):
        given.extend(recordings)
        raise InputError('enough')

    monkeypatch.setattr('engb_core.diagnose.engine.diagnose', stop)
    outcome = engb('diagnose', 'mon/log.csv', 'tue/log.csv', '--model', 'model.yaml', '--out', 'o')
    assert outcome.err == 'engb: enough\n'
    assert [entry.name for entry in given] == ['mon/log', 'tue/log']


def test_two_tables_that_would_be_one_file_are_refused(refused, tmp_path):
    for number, place in enumerate(['a/b_x.csv', 'c/b_x.csv', 'a_b/x.csv', 'c/x.csv']):
        table(tmp_path / place, number)
    refused('model', 'a/b_x.csv', 'c/b_x.csv', 'a_b/x.csv', 'c/x.csv', '--out', 'm.yaml',
            words=['would be written as a_b_x.mcap', 'rename one'])


def test_a_table_given_twice_is_refused(refused, tmp_path):
    table(tmp_path / 'log.csv')
    refused('model', 'log.csv', './log.csv', '--out', 'm.yaml', words=['log.csv: given twice'])


@pytest.mark.parametrize('kind', ['table', 'bag'])
def test_a_copy_is_no_held_out_recording(refused, tmp_path, bag, model_file, kind):
    if kind == 'bag':
        shutil.copytree(bag, tmp_path / 'again')
        given, again = 'run1', 'again'
    else:
        given, again = table(tmp_path / 'log.csv'), tmp_path / 'copy.csv'
        shutil.copy(given, again)
    refused('diagnose', given, '--model', model_file, '--holdout', again, '--out', 'out',
            words=[str(again).rpartition('/')[2].removesuffix('.csv'), 'the same samples as',
                   'hold out a recording of its own'])


def test_in_python_recordings_of_one_name_are_refused_with_the_remedy():
    run = motion()
    one, other = (library.Recording(run['time'], run['position'], run['effort'] + shift)
                  for shift in (0.0, 1e-3))
    with pytest.raises(InputError, match=r"two recordings are called 'recording'.*name="):
        library.diagnose([one, other], Model())
    with pytest.raises(InputError, match=r"two recordings are called 'recording'.*name="):
        library.diagnose(one, Model(), holdout=other)
    copy = Recording.from_samples('copy', run['time'], run['position'], run['effort'])
    with pytest.raises(InputError, match='copy: holds the same samples as recording'):
        library.diagnose(one, Model(), holdout=copy)
