# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Parts of the nodes that need no middleware: parameters, messages, and runs that go wrong."""

from dataclasses import replace
import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from engb_core.control.excitation import ExcitationSettings
from engb_core.control.reference import ReferenceSettings
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.reproduce import chosen
from engb_core.reproduce.plan import Experiment

pytest.importorskip('rclpy')

from sensor_msgs.msg import JointState  # noqa: E402

from engb_ros.experiments import live_experiments, sealed_brakes  # noqa: E402
from engb_ros.nodes.controller_parameters import controller_settings, PARAMETERS  # noqa: E402
from engb_ros.nodes.joint import joint_effort  # noqa: E402
from engb_ros.nodes.messages import joint_sample  # noqa: E402
from engb_ros.nodes.model_door import LARGEST_FILE, read_candidate  # noqa: E402
from engb_ros.nodes.parameters import ParameterSpec, path_of, values_with  # noqa: E402
from engb_ros.processes.runner import RunnerError, RunnerTimeout  # noqa: E402


def spec(default, **more):
    return ParameterSpec('a', default, 'of a test', **more)


@pytest.mark.parametrize(('made', 'value', 'words'), [
    (spec(1.0), math.nan, 'it must be a finite number'),
    (spec('x', choices=('x', 'y')), 'z', 'must be one of x, y'),
    (spec([1.0], low=0.0, high=2.0), [1.0, 3.0], 'a holds 3.0; each must lie within 0.0 and 2.0'),
    (spec([1.0]), [1.0, math.inf], 'a holds inf'),
])
def test_a_value_that_ros_lets_pass_is_refused(made, value, words):
    with pytest.raises(InputError, match=words):
        made.check(value)
    with pytest.raises(InputError, match=words):
        values_with({'a': made.default}, [made], [SimpleNamespace(name='a', value=value)])


def test_a_path_in_somebodys_home_is_expanded(monkeypatch):
    monkeypatch.setenv('HOME', '/home/one')
    assert path_of('bag', '~/x') == Path('/home/one/x')
    assert path_of('bag', 'a/~/x') == Path('a/~/x')
    with pytest.raises(InputError, match='parameter bag is ~nobody-of-this-name/x'):
        path_of('bag', '~nobody-of-this-name/x')


def test_changes_of_known_parameters_are_taken():
    made = [spec([1.0]), replace(spec(1.0), name='b')]
    changes = [SimpleNamespace(name='a', value=(2.0,)), SimpleNamespace(name='other', value=3)]
    assert values_with({'a': [1.0], 'b': 1.0}, made, changes) == {'a': [2.0], 'b': 1.0}


@pytest.mark.parametrize(('low', 'high', 'floats', 'whole'), [
    (0.0, 1.0, 1, 0), (None, 1.0, 0, 0), (None, None, 0, 0)])
def test_a_range_is_described_to_ros_where_both_ends_are_given(low, high, floats, whole):
    told = spec(0.5, low=low, high=high).descriptor()
    assert (len(told.floating_point_range), len(told.integer_range)) == (floats, whole)
    assert len(spec(1, low=0, high=2).descriptor().integer_range) == 1
    assert spec('x', low=0.0, high=1.0).descriptor().floating_point_range == []


@pytest.mark.parametrize(('names', 'position', 'expected'), [
    (['motor'], [1.0], 1.0), (['other', 'motor'], [1.0, 2.0], 2.0), (['other'], [1.0], None),
    (['motor'], [], None), (['other', 'motor'], [1.0], None), ([], [], None)])
def test_a_joint_is_found_in_a_message_by_its_name(names, position, expected):
    message = JointState(name=names, position=position, effort=position)
    sample = joint_sample(message, 'motor')
    assert (None if sample is None else sample.position) == expected
    effort = joint_effort(message, 'motor')
    assert effort == expected or (expected is None and math.isnan(effort))


def values(**changes):
    return {entry.name: entry.default for entry in PARAMETERS} | changes


def test_settings_that_do_not_fit_together_are_refused():
    assert controller_settings(values(), None).force is None
    with pytest.raises(InputError, match='position_min must be below position_max'):
        controller_settings(values(position_min=2.0, position_max=2.0), None)
    with pytest.raises(InputError, match='slow_range must hold two angles'):
        controller_settings(values(slow_range=[1.0]), None)


def test_a_candidate_has_to_be_a_small_file(tmp_path):
    path = tmp_path / 'model.yaml'
    Model().write(path)
    assert read_candidate(str(path)) == Model.read(path)
    with path.open('a') as file:
        file.truncate(LARGEST_FILE + 1)
    with pytest.raises(InputError, match='a model file has less than'):
        read_candidate(str(path))
    with pytest.raises(InputError, match='not a regular file'):
        read_candidate(str(tmp_path))
    with pytest.raises(InputError, match='cannot be read'):
        read_candidate(str(tmp_path / 'none'))


# ---- experiments on live nodes, as far as they need none

def experiment(**more):
    return Experiment('run', 'nominal', '', 'a test', chosen.FORM, 0.2, **more)


def test_what_a_plant_is_given_depends_on_its_brake(tmp_path):
    bench = live_experiments._plant(experiment(unloaded=True), tmp_path, 3, None)
    assert bench['unloaded'] is True and bench['bench'] == str(tmp_path / 'brake.yaml')
    model = live_experiments._plant(replace(experiment(), brake=Model()), tmp_path, 3, None)
    assert Model.read(model['model']) == Model() and 'bench' not in model
    (tmp_path / 'brake.yaml').unlink()
    sealed = live_experiments._plant(experiment(), tmp_path, 3, tmp_path / 'truth.sealed')
    assert sealed['bench'] == str(tmp_path / 'truth.sealed')
    assert not (tmp_path / 'brake.yaml').exists()


def test_what_drives_a_run_is_told_to_its_node(tmp_path):
    name, given = live_experiments._driver(experiment(excitation=ExcitationSettings()), Model(),
                                           tmp_path)
    assert name == 'excitation' and given['kind'] == 'steps'
    strokes = ReferenceSettings(kind='strokes', amplitudes=(7.0,))
    name, given = live_experiments._driver(experiment(reference=strokes, observer=12.0), Model(),
                                           tmp_path)
    assert name == 'controller' and given['stroke_amplitudes'] == [7.0]
    assert given['disturbance_cutoff'] == 12.0 and 'reference_file' not in given
    with pytest.raises(RunnerError, match='run: nothing to track'):
        live_experiments._driver(experiment(), Model(), tmp_path)


class Silent:
    """A probe whose services refuse, and which hears nothing."""

    def call(self, *_):
        return SimpleNamespace(success=False, message='too few strokes')

    def spin(self, duration):
        pass

    def check(self):
        pass


def test_a_node_that_refuses_or_falls_silent_ends_the_run(monkeypatch):
    monkeypatch.setattr(live_experiments, 'PATIENCE', 0.01)
    silent = Silent()
    with pytest.raises(RunnerError, match='the plant refused transition 3'):
        live_experiments._change(silent, 3)
    with pytest.raises(RunnerError, match='the identifier says: too few strokes'):
        live_experiments._wait_for_model(silent, silent)
    with pytest.raises(RunnerTimeout, match='the plant has sent nothing'):
        live_experiments._follow(silent, silent, [], 1.0, print)
    told = []
    messages = [None] * 120
    live_experiments._follow(silent, silent, messages, 1.0, told.append)
    assert told == []       # all were there at once


# ---- sealed brakes

def test_a_brake_that_cannot_be_drawn_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(sealed_brakes.subprocess, 'run', lambda *_, **__: SimpleNamespace(
        returncode=1, stderr='no space left\n', stdout=''))
    with pytest.raises(InputError, match='a brake cannot be drawn: no space left'):
        sealed_brakes.identify_sealed(tmp_path, 1, 0, print)


def test_what_was_found_is_kept_beside_each_seal(tmp_path, monkeypatch):
    def draw(command, **_):
        place = tmp_path / 'brakes' / command[-1].rpartition('/')[2]
        place.mkdir(parents=True)
        return SimpleNamespace(returncode=0, stdout='digest\n', stderr='')

    runs = []
    monkeypatch.setattr(sealed_brakes.subprocess, 'run', draw)
    monkeypatch.setattr(sealed_brakes, 'read_mechanism', lambda path: None)
    monkeypatch.setattr(sealed_brakes, 'record_experiment',
                        lambda given, *_, **more: runs.append((given.name, more['identified'])))
    monkeypatch.setattr(sealed_brakes, 'estimate_brake', lambda record, mechanism: [
        record(replace(experiment(), name=name), Model()) for name in ('strokes', 'sweep')])
    told = []
    sealed_brakes.identify_sealed(tmp_path / 'brakes', 2, 0, told.append)
    assert told == ['sealed brake 1 of 2: digest', 'sealed brake 2 of 2: digest']
    assert [name for name, live in runs if live is not None] == ['strokes', 'strokes']
    found = json.loads((tmp_path / 'brakes' / 'brake_2' / sealed_brakes.FOUND).read_text())
    assert found['digest'] == 'digest'


def test_a_seal_that_is_another_one_is_refused(tmp_path):
    place = tmp_path / 'brake_1'
    place.mkdir()
    with pytest.raises(InputError, match='no sealed brake that was identified'):
        sealed_brakes.open_all(tmp_path, '')
    (place / sealed_brakes.FOUND).write_text('{"digest": "x", "ways": {}}')
    seal = Path(__file__).resolve().parents[2] / 'bags' / 'brake_1' / 'truth.sealed'
    (place / sealed_brakes.SEAL).write_text(seal.read_text())
    with pytest.raises(InputError, match='not the one that was told before'):
        sealed_brakes.open_all(tmp_path, '')
    assert sealed_brakes.open_all(tmp_path / 'nothing', '') is None
