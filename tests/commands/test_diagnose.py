# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb diagnose` around the engine: what is read, written, printed."""

import dataclasses
import json
import sys
from types import ModuleType

import jsonschema
import numpy as np
import pytest

from engb_core.diagnose import cause_sets
from engb_core.diagnose.diagnosis import (
    CauseSet,
    Diagnosis,
    EffectFinding,
    Interval,
    NextExperiment,
    ParameterEstimate,
    QualityOfFit,
    Unexplained,
    Zone,
)
from engb_core.diagnose.document import to_document
from engb_core.errors import InputError
from engb_core.io.bags.write import JointTable, write_bag
from engb_core.io.outputs import folder_output, LIST
from engb_core.model import Model

from .conftest import motion, ROOT

SCHEMA = ROOT / 'engb_core' / 'diagnose' / 'diagnosis.schema.json'
FILES = [LIST, 'diagnosis.json', 'model.yaml', 'next_experiment.csv', 'report.html']

ZONE = Zone('velocity', -2.0, 2.0, 'rad/s', 0.71)
DIAGNOSIS = Diagnosis(
    verdict='explained',
    effects=(
        EffectFinding('torque_offset', 0.93, {}, 0.1, (), 'An offset.'),
        EffectFinding('stribeck_friction', 0.97, {
            'breakaway_ratio': ParameterEstimate(1.42, 0.03, '-'),
            'stribeck_velocity': ParameterEstimate(np.float64(2.0), None, 'rad/s'),
        }, 0.83, (('presliding_friction', 0.12),), 'Friction falls by 42 %.',
            causes=CauseSet(0.9, ('stribeck_friction', 'presliding_friction'), True)),
    ),
    time=(Interval('run1', 1.0, 2.0, 0.07),),
    where=(ZONE,),
    unexplained=Unexplained(0.04, ('position',), 'none', False, (ZONE,), 'A rest.'),
    held_out=(QualityOfFit('run2', 'effort', 0.021, 0.0049, 0.0046, 'N·m'),),
    next_experiment=NextExperiment('To tell them apart', ('a', 'b'), 'a ladder',
                                   np.arange(3.0), np.array([0, 0.5, 1])),
    model=Model(),
)


@pytest.fixture
def engine(monkeypatch):
    """An engine that gives back what the test put into `result`, and keeps what it was given."""
    module = ModuleType('engb_core.diagnose.engine')
    module.result = DIAGNOSIS

    def diagnose(recordings, model, holdout=(), progress=None):
        module.given = recordings, model, holdout
        progress('thinking')
        if isinstance(module.result, Exception):
            raise module.result
        return module.result

    module.diagnose = diagnose
    page = ModuleType('engb_core.report.page')
    page.write_report = lambda path, diagnosis: path.write_text('<html>')
    monkeypatch.setitem(sys.modules, 'engb_core.diagnose.engine', module)
    monkeypatch.setitem(sys.modules, 'engb_core.report.page', page)
    return module


@pytest.mark.parametrize('change', [
    {},
    {'effects': (), 'verdict': 'consistent', 'unexplained': None, 'next_experiment': None,
     'time': (), 'where': ()},
    {'effects': (dataclasses.replace(
        DIAGNOSIS.effects[1], share=1.2, probability=np.nan,
        parameters={'a': ParameterEstimate(np.inf, 1.0, '-'),
                    'b': ParameterEstimate(1.0, np.nan, '-')}),)},
    {'where': (dataclasses.replace(ZONE, begin=-np.inf),),
     'held_out': (QualityOfFit('r', 'position', 1, 2, np.nan, 'rad'),)},
])
def test_document_fits_the_schema(change):
    document = to_document(dataclasses.replace(DIAGNOSIS, **change))
    jsonschema.validate(document, json.loads(SCHEMA.read_text()))
    json.dumps(document, allow_nan=False)
    shares = [effect['share'] for effect in document['effects']]
    assert shares == sorted(shares, reverse=True)


def test_results_and_summary(engb, engine, bag, model_file, tmp_path):
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'deep/result')
    assert (outcome.status, outcome.err) == (0, '')
    for words in ('explained', 'stribeck_friction', '0.97', 'presliding_friction 0.12',
                  'Friction falls by 42 %', '0.021 → 0.0049 N·m', '0.0046', 'A rest.',
                  'deep/result/report.html', 'deep/result/next_experiment.csv'):
        assert words in outcome.out
    folder = tmp_path / 'deep' / 'result'
    assert sorted(entry.name for entry in folder.iterdir()) == FILES
    assert sorted(entry.name for entry in folder.parent.iterdir()) == ['result']
    assert json.loads((folder / 'diagnosis.json').read_text())['verdict'] == 'explained'
    assert Model.read(folder / 'model.yaml') == Model()
    assert (folder / 'next_experiment.csv').read_text() == 'time,position\n0,0\n1,0.5\n2,1\n'


def test_a_second_diagnosis_leaves_nothing_of_the_first(engb, engine, bag, model_file, tmp_path):
    folder = tmp_path / 'result'
    for first in ('first_model.yaml', 'surrogate.yaml'):
        with folder_output(folder, [first, 'old.mcap', *FILES[1:]]) as scratch:
            for name in (first, 'old.mcap', *FILES[1:]):
                (scratch / name).write_text('of another run')
    assert engb('diagnose', bag, '--model', model_file, '--out', 'result').status == 0
    assert sorted(entry.name for entry in folder.iterdir()) == FILES


def test_numbers_that_explain_without_a_name_are_told_as_that(engb, engine, bag, model_file):
    engine.result = dataclasses.replace(DIAGNOSIS, effects=())
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'result')
    first = outcome.out.splitlines()[0]
    assert 'other numbers in the model take the mismatch away' in first
    assert 'below' not in first


def test_a_set_of_more_than_one_cause_is_printed(engb, engine, bag, model_file):
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'result')
    assert ('set of causes at level 0.9: stribeck_friction, presliding_friction, another cause'
            in outcome.out)
    one = dataclasses.replace(DIAGNOSIS.effects[1],
                              causes=CauseSet(0.9, ('stribeck_friction',), False))
    engine.result = dataclasses.replace(DIAGNOSIS, effects=(one,))
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'result')
    assert 'set of causes' not in outcome.out


def test_a_level_makes_the_sets_anew(engb, engine, bag, model_file, tmp_path):
    path = tmp_path / 'result' / 'diagnosis.json'
    for level, another in (('0.000001', False), ('0.999999', True)):
        outcome = engb('diagnose', bag, '--model', model_file, '--out', 'result', '--level', level)
        assert outcome.status == 0
        found = json.loads(path.read_text())['effects'][0]['causes']
        assert found['level'] == float(level) and found['another'] is another
        assert found['effects'][0] == 'stribeck_friction'
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'new', '--level', '90')
    assert (outcome.status, outcome.err) == (
        2, 'engb: level 90: must lie within 0 and 1, as 0.9\n')
    assert not (tmp_path / 'new').exists()


def test_a_damaged_calibration_is_told_in_one_line(engb, engine, bag, model_file, tmp_path,
                                                   monkeypatch):
    damaged = tmp_path / 'cause_sets.json'
    damaged.write_text('{"format": ')
    monkeypatch.setattr(cause_sets, 'FILE', damaged)
    cause_sets.shipped_calibration.cache_clear()
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'result', '--level', '0.8')
    cause_sets.shipped_calibration.cache_clear()
    assert outcome.status == 2
    assert outcome.err.startswith(f'engb: {damaged}: is no calibration of sets of causes')
    assert outcome.err.count('\n') == 1
    assert not (tmp_path / 'result').exists()


def test_a_later_run_replaces_only_its_own_files(engb, engine, bag, model_file, tmp_path):
    engb('diagnose', bag, '--model', model_file, '--out', 'result')
    (tmp_path / 'result' / 'notes.txt').write_text('mine')
    engine.result = dataclasses.replace(DIAGNOSIS, next_experiment=None)
    assert engb('diagnose', bag, '--model', model_file, '--out', 'result').status == 0
    assert sorted(entry.name for entry in (tmp_path / 'result').iterdir()) == [
        LIST, 'diagnosis.json', 'model.yaml', 'notes.txt', 'report.html']


def test_no_diagnosis_leaves_what_was_there(engb, engine, bag, model_file, tmp_path):
    engb('diagnose', bag, '--model', model_file, '--out', 'result')
    before = (tmp_path / 'result' / 'diagnosis.json').read_bytes()
    engine.result = InputError('run1: too little motion')
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'result')
    assert (outcome.status, outcome.err) == (2, 'engb: run1: too little motion\n')
    assert (tmp_path / 'result' / 'diagnosis.json').read_bytes() == before
    assert engb('diagnose', bag, '--model', model_file, '--out', 'new').status == 2
    assert not (tmp_path / 'new').exists()
    assert not list(tmp_path.glob('.*'))


@pytest.mark.parametrize(('error', 'status'), [
    (np.linalg.LinAlgError('Singular matrix'), 2), (ZeroDivisionError('division by zero'), 2),
    (ValueError('shapes'), 70)])
def test_arithmetic_that_breaks_down(engb, engine, bag, model_file, tmp_path, error, status):
    engine.result = error
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'result')
    assert outcome.status == status
    assert outcome.err.count('\n') == 1
    assert not (tmp_path / 'result').exists()


def test_recordings_of_one_name_are_told_apart(engb, engine, bag, model_file, tmp_path):
    other = tmp_path / 'second' / 'run1'
    other.parent.mkdir()
    bag.rename(other)
    import shutil
    shutil.copytree(other, tmp_path / 'first' / 'run1')
    shutil.copytree(other, tmp_path / 'third')
    shutil.rmtree(other)
    run = motion(3000)      # no copy: what is held out must not have been seen
    write_bag(other, {'/joint_states': JointTable(1.7e9 + run['time'], run['position'], None,
                                                  run['effort'])})
    engb('diagnose', 'first/run1', 'third', '--model', model_file, '--out', 'result',
         '--holdout', other)
    recordings, _, holdout = engine.given
    assert [entry.name for entry in recordings] == ['first/run1', 'third']
    assert [entry.name for entry in holdout] == ['second/run1']


def test_progress_only_when_asked(engb, engine, bag, model_file):
    outcome = engb('diagnose', bag, '--model', model_file, '--out', 'result', '--verbose')
    assert 'thinking' in outcome.err
