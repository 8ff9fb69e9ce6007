# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb survey` where all or none is done before: what it tells, without a diagnosis."""

import pytest

from engb_core.model import Model
from engb_ros.commands import survey
from engb_ros.fleet.find import find_recordings
from engb_ros.fleet.store import Store
from engb_ros.fleet.task import failed

from .test_statistics import bad, entry


@pytest.fixture
def recordings(tmp_path):
    """Four files of as many units, none of them a bag."""
    for unit in 'abcd':
        (tmp_path / 'data' / unit).mkdir(parents=True)
        (tmp_path / 'data' / unit / 'run.mcap').write_bytes(b'x')
    return find_recordings([str(tmp_path / 'data')])


def call(model_file, *more):
    return ('survey', 'data', '--model', model_file, '--out', 'fleet', *more)


def test_what_is_done_is_counted_by_effect_and_by_reason(engb, recordings, model_file, tmp_path):
    store = Store(tmp_path / 'fleet', Model.read(model_file).to_mapping(),
                  survey._version() + 'zoom')
    effect = [('stribeck_friction', 0.9, {'breakaway_ratio': 1.5})]
    for recording, result in zip(recordings, (
            entry('a', 0, effects=effect), entry('b', 1, effects=effect),
            entry('c', 2, effects=effect), bad('d')), strict=True):
        store.save(recording, [dict(result.result)])
    outcome = engb(*call(model_file))
    assert (outcome.status, outcome.err) == (0, '')
    assert outcome.out.splitlines()[:3] == [
        '4 recordings, 3 diagnosed, 3 units; 4 were done before',
        '   stribeck_friction: 3 of 3 units (common cause)', '   1 refused: see survey.csv']
    assert '<script>alert' not in (tmp_path / 'fleet' / 'survey.html').read_text()


@pytest.mark.parametrize('scheduler', [(), ('--scheduler', 'tcp://127.0.0.1:1')])
def test_what_is_to_do_is_handed_out_and_kept(engb, recordings, model_file, monkeypatch, tmp_path,
                                              scheduler):
    """One worker's result, one that was refused, one that was lost with its worker."""
    handed = []

    def work(tasks, function, *settings):
        handed.append((len(tasks), settings))
        yield 1, [failed('refused', 'no joint states')]
        yield 0, [dict(entry('a', 0).result)]
        yield 3, [failed('fault', 'KeyError')]
        yield 2, 'its worker was killed'

    monkeypatch.setattr('engb_ros.fleet.processes.run_processes', work)
    monkeypatch.setattr('engb_ros.fleet.dask_cluster.run_on_dask', work)
    (tmp_path / 'units.csv').write_text('recording,unit,mileage_km\n*,left,5\n')
    outcome = engb(*call(model_file, *scheduler, '--timeout', '7', '--jobs', '2', '--units',
                         'units.csv', '--fresh', '--verbose'))
    assert outcome.status == 0, outcome
    assert handed == [(4, ('tcp://127.0.0.1:1',) if scheduler else (2, 7.0))]
    assert '4 recordings, 1 diagnosed, 1 units' in outcome.out
    for status in ('refused', 'fault', 'lost'):
        assert f'1 {status}: see survey.csv' in outcome.out
    assert '2 of 4: a/run.mcap: consistent' in outcome.err
    assert '4 of 4: c/run.mcap: lost: its worker was killed' in outcome.err
    # What was refused is done; what went wrong is tried again.
    monkeypatch.setattr('engb_ros.fleet.processes.run_processes', lambda tasks, *_: iter(
        [(place, [dict(entry('x', 9).result)]) for place in range(len(tasks))]))
    again = engb(*call(model_file))
    assert '4 recordings, 3 diagnosed, 3 units; 2 were done before' in again.out


@pytest.mark.parametrize(('more', 'words'), [
    (('--jobs', '0'), ['--jobs 0: must be at least 1']),
    (('--timeout', '0'), ['--timeout 0.0: must be above 0 s']),
    (('--timeout', 'nan'), ['--timeout nan: must be above 0 s']),
])
def test_numbers_without_sense_are_refused(refused, recordings, model_file, more, words):
    refused(*call(model_file, *more), words=words)


def test_a_source_tree_that_is_not_installed_has_a_version_too(monkeypatch):
    import importlib.metadata

    def missing(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, 'version', missing)
    assert survey._version() == 'source'


def test_a_worker_tells_what_went_wrong_and_never_raises(monkeypatch, tmp_path):
    from engb_ros.fleet import task
    given = {'path': str(tmp_path / 'a.mcap'), 'model': Model().to_mapping(), 'figures': None}
    assert task.diagnose_task(given)[0]['status'] == 'refused'

    def broken(error):
        def call(*_):
            raise error
        return call

    for where, error, status, told in (
            ('engb_core.io.bags.read.joint_namespaces', OSError('gone'), 'fault', 'OSError: gone'),
            ('engb_ros.fleet.task._diagnosed', MemoryError(), 'fault', 'not enough memory'),
            ('engb_ros.fleet.task._diagnosed', ZeroDivisionError('x'), 'fault', 'ZeroDivision')):
        with monkeypatch.context() as patch:
            patch.setattr('engb_core.io.bags.read.joint_namespaces', lambda path: [])
            patch.setattr(where, broken(error))
            result, = task.diagnose_task(given)
        assert result['status'] == status and result['message'].startswith(told)
    with monkeypatch.context() as patch:
        patch.setattr('engb_core.io.bags.read.joint_namespaces', lambda path: ['left', 'right'])
        patch.setattr('engb_ros.fleet.task._diagnosed', lambda given, space: {'namespace': space})
        assert [one['namespace'] for one in task.diagnose_task(given)] == ['left', 'right']
