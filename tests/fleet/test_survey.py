# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb survey`: bags in, tables and a page out; resumable; one bad bag stops no other."""

import csv
import json
import os
import shutil
import signal
import threading
import time

import pytest

from engb_core.io.bags.write import JointTable, write_bag

from .conftest import motion, start


@pytest.fixture
def folder(tmp_path):
    """Two units with a good recording each, a bad one, and a bag of two wheels."""
    root = tmp_path / 'data'
    run = motion(800, 200.0)

    def states(day):
        time_ = 1.7e9 + 86400 * day + run['time']
        return JointTable(time_, run['position'], run['velocity'], run['effort'])

    for name, day in (('unit_a', 0), ('unit_b', 1)):
        write_bag(root / name / 'run', {'/engb/joint_states': states(day)})
    write_bag(root / 'car' / 'run', {'/left/joint_states': states(2),
                                     '/right/joint_states': states(2)})
    (root / 'unit_a' / 'broken.mcap').write_bytes(b'nonsense')
    return root


def rows(path):
    """Read a table back."""
    with open(path, encoding='utf-8', newline='') as file:
        return list(csv.DictReader(file))


def test_survey_and_resume(engb, folder, model_file, tmp_path):
    call = ('survey', folder, '--model', model_file, '--out', 'fleet', '--jobs', '1',
            '--reports', 'table')
    outcome = engb(*call)
    assert (outcome.status, outcome.err) == (0, ''), outcome
    assert '5 recordings, 4 diagnosed' in outcome.out
    table = rows('fleet/survey.csv')
    assert {(row['unit'], row['status']) for row in table} == {
        ('unit_a', 'refused'), ('unit_a', 'ok'), ('unit_b', 'ok'), ('car/left', 'ok'),
        ('car/right', 'ok')}
    good = [row for row in table if row['status'] == 'ok']
    assert all((tmp_path / 'fleet' / row['report']).exists() for row in good)
    page = (tmp_path / 'fleet' / 'survey.html').read_text()
    assert all(row['report'] in page for row in good)
    assert rows('fleet/effects.csv')
    results = sorted((tmp_path / 'fleet' / 'results').iterdir())
    before = [file.stat().st_mtime_ns for file in results]
    again = engb(*call)
    assert '4 were done before' in again.out
    assert [file.stat().st_mtime_ns for file in results] == before
    assert rows('fleet/survey.csv') == table
    assert json.loads(results[0].read_text())['format'] == 'engb-survey-result/1'


def test_a_survey_without_any_diagnosis_is_told_as_one(engb, model_file, tmp_path):
    (tmp_path / 'data').mkdir()
    (tmp_path / 'data' / 'broken.mcap').write_bytes(b'nonsense')
    (tmp_path / 'data' / 'log.csv').write_text('t,phi,M')
    outcome = engb('survey', 'data', '--model', model_file, '--out', 'fleet', '--jobs', '1',
                   '--reports', 'none')
    assert outcome.status == 2
    assert len(outcome.err.splitlines()) == 1
    assert 'none of the 1 recordings could be diagnosed' in outcome.err
    assert 'broken.mcap' in outcome.err
    assert '1 recordings, 0 diagnosed' in outcome.out and 'log.csv left out' in outcome.out
    assert (tmp_path / 'fleet' / 'survey.html').exists()


def test_parquet_holds_the_same(engb, folder, model_file):
    try:
        from pyarrow import parquet
    except ImportError as why:   # missing, or made for another numpy
        pytest.skip(str(why))
    engb('survey', folder, '--model', model_file, '--out', 'fleet', '--jobs', '1', '--reports',
         'none')
    table = parquet.read_table('fleet/survey.parquet').to_pylist()
    assert [row['recording'] for row in table] == [
        row['recording'] for row in rows('fleet/survey.csv')]
    assert {type(row['duration_s']) for row in table} <= {float, type(None)}


def test_names_of_files_are_text_in_every_table(engb, model_file, tmp_path):
    """A unit's folder may be called like a formula, and hold a byte that is no UTF-8."""
    for name in (b'=cmd|\' /C calc\'!A0', b'b\xffse', b'-2+3', b'a\x1b[31m\nb'):
        folder = tmp_path / 'data' / os.fsdecode(name)
        folder.mkdir(parents=True)
        (folder / 'run.mcap').write_bytes(b'nonsense')
    outcome = engb('survey', 'data', '--model', model_file, '--out', 'fleet', '--jobs', '1',
                   '--reports', 'none')
    # Nothing was diagnosed.
    assert outcome.status == 2 and outcome.err.count('\n') == 1
    table = rows('fleet/survey.csv')
    assert {row['unit'] for row in table} == {
        "'=cmd|' /C calc'!A0", 'b\\xffse', "'-2+3", 'a\\x1b[31m\\x0ab'}
    assert not any(cell.startswith(('=', '+', '-', '@')) for row in table
                   for cell in row.values())
    page = (tmp_path / 'fleet' / 'survey.html').read_text(encoding='utf-8')
    assert 'b\\xffse' in page and '\x1b' not in page


def test_an_interrupted_survey_goes_on(folder, model_file, tmp_path):
    for number in range(4):
        shutil.copytree(folder / 'unit_b' / 'run', folder / f'unit_{number}' / 'run')
    call = ('survey', folder, '--model', model_file, '--out', tmp_path / 'fleet', '--jobs', '1',
            '--reports', 'none')
    process = start(*call)
    results = tmp_path / 'fleet' / 'results'
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and not (
            results.exists() and any(file.suffix == '.json' for file in results.iterdir())):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, 'engb: interrupted\n')
    assert not [file for file in results.iterdir() if file.suffix != '.json']
    process = start(*call)
    out, err = process.communicate(timeout=240)
    assert (process.returncode, err) == (0, '')
    assert 'were done before' in out
    keys = [row['recording'] + row['namespace'] for row in rows(tmp_path / 'fleet/survey.csv')]
    assert len(keys) == len(set(keys)) == 9


@pytest.mark.timeout(900)
def test_on_a_cluster_whose_worker_is_killed(engb, folder, model_file, tmp_path):
    """Every recording is in the result once, whoever worked on it when the worker died."""
    distributed = pytest.importorskip('distributed', reason='the package distributed is missing')
    for number in range(4):
        shutil.copytree(folder / 'unit_b' / 'run', folder / f'unit_{number}' / 'run')
    results, killed = tmp_path / 'fleet' / 'results', []

    def kill(process):
        deadline = time.monotonic() + 300
        while time.monotonic() < deadline and not killed:
            if results.exists() and any(results.glob('*.json')):
                os.kill(process, signal.SIGKILL)
                killed.append(process)
            time.sleep(0.02)

    with distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True,
                                  dashboard_address=None, protocol='tcp://') as cluster, \
            distributed.Client(cluster, set_as_default=False) as client:
        process = next(iter(client.run(os.getpid).values()))
        killer = threading.Thread(target=kill, args=(process,))
        killer.start()
        outcome = engb('survey', folder, '--model', model_file, '--out', 'fleet', '--reports',
                       'none', '--scheduler', cluster.scheduler_address)
        killer.join()
    assert outcome.status == 0, outcome
    assert killed == [process]
    table = rows('fleet/survey.csv')
    assert sorted(row['status'] for row in table) == ['ok'] * 8 + ['refused']
    assert len({row['recording'] + row['namespace'] for row in table}) == 9


@pytest.mark.parametrize(('change', 'words'), [
    (['--jobs', '0'], ['--jobs']), (['--timeout', '-1'], ['--timeout']),
    (['--units', 'none.csv'], ['none.csv']), (['--out', 'model.yaml'], ['--out', 'file'])])
def test_wrong_requests(refused, folder, model_file, change, words):
    refused('survey', folder, '--model', model_file, '--out', 'fleet', *change, words=words)
    assert not os.path.exists('fleet')
    refused('survey', 'nowhere', '--model', model_file, '--out', 'fleet', words=['nowhere'])
