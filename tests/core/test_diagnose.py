# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Diagnosis end to end on recordings of a bench that shares no formula with the library."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import Diagnosis
from engb_core.diagnose.document import to_document, to_json
from engb_core.diagnose.engine import diagnose
from engb_core.errors import InputError
from engb_core.model import Controller, Friction, LoadTorque, Model
from engb_core.prediction import predict_effort
from engb_core.recording import Recording
from engb_core.signals.gaussian import filtered, gaussian_kernel

from .bench import Bench, strokes

ROOT = Path(__file__).resolve().parents[2]
SCHEMA = ROOT / 'engb_core' / 'diagnose' / 'diagnosis.schema.json'
CONTRACT = ROOT / 'docs' / 'diagnosis.schema.json'

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
              friction=Friction(0.012, 0.11, 0.06),
              controller=Controller(0.3, 1.0, 0.004, 0.6, 500.0))


def lopsided(level: float, velocity: float) -> float:
    """Friction that is 30 % higher than the mean while applying, 30 % lower while releasing."""
    return level * math.tanh(velocity / 0.03) * (1.0 + 0.3 * math.tanh(velocity / 0.1))


def dent(position: float, velocity: float) -> float:
    """A notch of 12 mN·m at 9 rad, triangular: a worn tooth, say."""
    return -0.012 * max(0.0, 1.0 - abs(position - 9.0) / 1.2)


BENCHES = {'clean': Bench(), 'asymmetric': Bench(rubbing=lopsided), 'dented': Bench(further=dent)}


@pytest.fixture(scope='module')
def recordings() -> dict[str, Recording]:
    return {name: bench.run(strokes(), name=name) for name, bench in BENCHES.items()}


@pytest.fixture(scope='module')
def results(recordings) -> dict[str, Diagnosis]:
    return {name: diagnose([recording], MODEL) for name, recording in recordings.items()}


def held_out(result: Diagnosis, quantity: str):
    entry, = (entry for entry in result.held_out if entry.quantity == quantity)
    return entry


def test_a_clean_recording_is_consistent(results):
    result = results['clean']
    assert result.verdict == 'consistent'
    assert result.effects == ()
    assert result.unexplained is None
    assert result.model == MODEL
    assert result.next_experiment is None
    effort = held_out(result, 'effort')
    assert effort.rms_after == effort.rms_before
    assert effort.rms_before == pytest.approx(effort.noise_floor, rel=0.15)


def test_a_part_of_a_clean_recording_is_consistent(recordings):
    """Whatever instant it begins at, also in motion."""
    whole = recordings['clean']
    part = whole.between(0.4 * whole.duration, whole.duration)
    assert diagnose([part], MODEL).verdict == 'consistent'


def test_asymmetric_friction_is_found(results):
    result = results['asymmetric']
    assert result.verdict == 'explained'
    finding, = result.effects
    assert finding.effect == 'asymmetric_friction'
    assert finding.probability > 0.8
    assert finding.share > 0.9
    found = finding.parameters['asymmetry']
    assert found.value == pytest.approx(0.3, abs=0.03)
    assert abs(found.value - 0.3) < 4.0 * found.std + 0.01
    assert 'applying' in finding.statement
    assert finding.causes is not None and finding.causes.level == 0.9
    assert finding.causes.effects[0] == 'asymmetric_friction'
    effort = held_out(result, 'effort')
    assert effort.rms_after < 0.2 * effort.rms_before
    assert effort.rms_after < 1.2 * effort.noise_floor
    position = held_out(result, 'position')
    assert position.rms_after < 0.8 * position.rms_before


def test_the_corrected_model_predicts(results, recordings):
    """On a run that the diagnosis has not seen, and through a file."""
    fresh = Bench(rubbing=lopsided, seed=5).run(strokes((14.0, 19.0, 6.0)), name='fresh')
    moving = np.abs(np.gradient(fresh.position, fresh.time)) > 2.0

    def missed(model: Model) -> float:
        difference = moving * (predict_effort(fresh, model) - fresh.effort)
        slow = filtered(difference, gaussian_kernel(20.0, fresh.interval))
        return float(np.sqrt(np.mean(slow[moving] ** 2)))

    assert missed(results['asymmetric'].model) < 0.25 * missed(MODEL)


def test_what_no_effect_explains_gets_no_name(results):
    result = results['dented']
    assert result.verdict == 'unexplained'
    assert result.effects == ()
    rest = result.unexplained
    assert rest is not None
    assert 'position' in rest.depends_on
    assert rest.parity_in_velocity == 'even'
    assert rest.share > 0.5
    places = [zone for zone in rest.where if zone.variable == 'position']
    assert any(zone.begin < 9.5 and zone.end > 8.5 for zone in places)
    effort = held_out(result, 'effort')
    assert effort.rms_after < 0.5 * effort.rms_before
    assert result.model != MODEL


@pytest.mark.parametrize('name', ['asymmetric', 'dented'])
def test_where_it_happens(results, name):
    result = results[name]
    assert result.time
    assert all(0.0 <= entry.begin < entry.end for entry in result.time)
    assert {entry.recording for entry in result.time} == {name}
    assert result.where
    assert all(0.0 <= entry.share <= 1.0 for entry in (*result.time, *result.where))
    assert result.evidence.traces
    assert result.evidence.closed_loops


@pytest.mark.parametrize('name', list(BENCHES))
def test_the_document_is_valid(results, name):
    jsonschema = pytest.importorskip('jsonschema')
    schema = json.loads(SCHEMA.read_text(encoding='utf-8'))
    text = to_json(results[name])
    document = json.loads(text, parse_constant=lambda value: pytest.fail(f'{value} in the JSON'))
    jsonschema.Draft202012Validator(schema).validate(document)
    assert document == json.loads(json.dumps(to_document(results[name])))
    assert document['verdict'] == results[name].verdict


def test_the_schema_is_the_contracts():
    assert json.loads(SCHEMA.read_text(encoding='utf-8')) == \
        json.loads(CONTRACT.read_text(encoding='utf-8'))


def test_a_corrected_model_survives_its_file(results, tmp_path):
    for name, result in results.items():
        result.model.write(tmp_path / f'{name}.yaml')
        assert Model.read(tmp_path / f'{name}.yaml') == result.model


def test_too_little_motion_is_refused():
    time = np.arange(3000) / 500.0
    noise = np.random.default_rng(1).normal(0.0, 1e-3, time.size)
    still = Recording.from_samples('still', time, np.zeros(time.size), noise)
    with pytest.raises(InputError, match='still: too little motion'):
        diagnose([still], MODEL)
    with pytest.raises(InputError, match='no recording'):
        diagnose([], MODEL)
