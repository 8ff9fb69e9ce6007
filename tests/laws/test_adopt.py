# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""From a recording to a name: a law is found, adopted, and named the next time."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.catalogue import catalogue
from engb_core.laws.adoption import effect_text
from engb_ros.commands.diagnose import write_results
from engb_ros.commands.main import main
from tests.laws.test_find_law import law, MODEL, recorded

NAME = 'dragging_cover'


@pytest.fixture
def own(tmp_path, monkeypatch):
    """An empty folder of effects of one's own."""
    monkeypatch.setenv('ENGB_EFFECTS', str(tmp_path / 'own'))
    catalogue.cache_clear()
    yield tmp_path / 'own'
    monkeypatch.undo()
    catalogue.cache_clear()


def test_found_adopted_and_named_the_next_time(own, tmp_path):
    hidden = law('a * peak(velocity / 6) * step(position - 13, 0.2)', 'torque', a=0.02)
    first = diagnose([recorded(hidden)], MODEL, threads=1)
    assert first.unexplained is not None and first.unexplained.law is not None
    result = tmp_path / 'result'
    result.mkdir()
    write_results(result, first)
    assert main(['adopt', str(result), '--name', NAME]) == 0
    catalogue.cache_clear()
    effect = catalogue()[NAME]
    # Its bounds are those of the estimate, and of the region for the place.
    for entry in effect.parameters:
        assert entry.low < entry.starts[0] < entry.high
    text = (own / f'{NAME}.py').read_text(encoding='utf-8')
    assert 'The region in which it was seen: position' in text
    assert 'anywhere in the region of position' in text
    # As whoever adopts it runs it.
    tested = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider',
         str(own / f'test_{NAME}.py')], capture_output=True, text=True, timeout=120, check=False)
    assert tested.returncode == 0, tested.stdout
    # Another brake of the kind, where it is smaller and begins elsewhere.
    other = law('a * peak(velocity / 6) * step(position - 12, 0.2)', 'torque', a=0.014)
    second = diagnose([recorded(other, seed=4)], MODEL, threads=1)
    assert [entry.effect for entry in second.effects if entry.probability >= 0.5] == [NAME]
    assert second.unexplained is None or second.unexplained.law is None
    assert NAME in [entry.effect for entry in second.model.effects]


@pytest.fixture(scope='module')
def fitter():
    return Fitter(problem_of([recorded()], MODEL), 1)


@pytest.mark.parametrize(('acts_as', 'pattern'), [
    ('torque', 'a * lag(load, b)'), ('friction_gain', 'a * bell(position - b, 2)'),
    ('load_gain', 'a * exp(-abs(velocity) / b)'), ('effort_gain', 'a * tanh(effort / b)'),
    ('inertia', 'a * sin(b * position + 1)'), ('position_shift', 'a * sin(b * position + 1)'),
    ('delay', 'a * (abs(load) + b)'), ('position_delay', 'a * (abs(load) + b)'),
    ('load_shift', 'a * heat(abs(velocity), b)')])
def test_an_adopted_law_of_every_place_is_tried(fitter, acts_as, pattern):
    space: dict[str, object] = {}
    text = effect_text(NAME, {'pattern': pattern, 'acts_as': acts_as, 'parameters': {
        name: {'value': value, 'std': None, 'unit': '-'}
        for name, value in (('a', 1e-3), ('b', 1.2))}}, {'position': (2.0, 22.0)}, 'a test')
    exec(compile(text, 'effect.py', 'exec'), space)     # noqa: S102 — what a user would import
    (variant,) = variants_of(space['EFFECT'], fitter.problem.scene)
    fit = fitter.fit(variant, rounds=1, keep=1)
    assert np.isfinite(fit.cost)


def bounds(pattern: str, within: dict, **parameters: tuple[float, float | None]):
    """Return the bounds of each parameter in the written file."""
    space: dict[str, object] = {}
    text = effect_text(NAME, {'pattern': pattern, 'acts_as': 'torque', 'parameters': {
        name: {'value': value, 'std': std, 'unit': '-'}
        for name, (value, std) in parameters.items()}}, within, 'a test')
    exec(compile(text, 'effect.py', 'exec'), space)     # noqa: S102 — what a user would import
    return {entry.name: (entry.low, entry.high) for entry in space['EFFECT'].parameters}


@pytest.mark.parametrize(('pattern', 'name', 'estimate', 'low', 'high'), [
    ('a * step(position - b, 0.2)', 'b', (13.0, 0.1), 0.0, 24.0),
    ('a * positive(b - position)', 'b', (2.5, None), 0.0, 24.0),
    ('a * positive(velocity - b)', 'b', (12.0, 1.0), -40.0, 40.0),
    ('a * positive(load - b)', 'b', (0.1, 0.01), -0.2, 0.4),
    ('a * positive(load - b)', 'b', (0.1, 1.0), -4.9, 5.1),
    ('a * sin(b * position + 1)', 'b', (1.25, 0.001), 1.25 - 0.0785, 1.25 + 0.0785),
    ('a * sin(b * position + 1)', 'b', (1.25, 0.05), 1.0, 1.5),
    ('a * stop(position, b)', 'b', (0.5, 0.05), 0.1, 2.5),
    ('a * lag(load, b)', 'b', (0.5, 0.9), 0.05, 5.0),
    ('a * load * b', 'a', (0.02, 0.001), -0.2, 0.2),
])
def test_bounds_come_from_the_estimate_and_the_region(pattern, name, estimate, low, high):
    values = {'a': (0.02, 0.001), 'b': (1.0, 0.1), name: estimate}
    found = bounds(pattern, {'position': (2.0, 22.0), 'velocity': (-33.333, 33.333)},
                   **{key: value for key, value in values.items() if key in pattern})
    assert found[name] == pytest.approx((low, high), rel=5e-3, abs=1e-3)
