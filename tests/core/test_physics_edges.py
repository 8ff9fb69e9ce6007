# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where machine code is kept, and efforts at the ends of what can be told."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.effect_check import MODEL
from engb_core.model import EffectSetting
from engb_core.physics import code_cache
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table

TIME = np.arange(0.0, 2.0, 1e-3)


def effort(model, moving=None, size=TIME.size):
    time = TIME[:size]
    samples = sample_table(1e-3, time, 10.0 + 8.0 * np.sin(3.0 * time),
                           24.0 * np.cos(3.0 * time), -72.0 * np.sin(3.0 * time))
    return effort_of_motion(samples, 1e-3, physics_of(model), moving)


def law(formula, acts_as, **parameters):
    return replace(MODEL, effects=(EffectSetting('law', parameters, formula, acts_as),))


@pytest.mark.parametrize('effect', [
    EffectSetting('actuation_lag', {'lag': 0.01, 'first_order': 1.0}),
    EffectSetting('sampling_delay', {'delay': 0.004})])
def test_late_torque_of_a_shaft_that_stands_is_that_of_the_motion(effect):
    model = replace(MODEL, effects=(effect,))
    moving = TIME < 1.0
    found, free = effort(model, moving), effort(model)
    begin = slice(0, 900)
    np.testing.assert_allclose(found[begin], free[begin], rtol=1e-9, atol=1e-12)
    assert np.any(found != free)


def test_a_delay_that_a_law_tells_holds_while_the_shaft_moves():
    model = law('a * abs(velocity)', 'delay', a=2e-4)
    moving = TIME < 1.0
    found, free = effort(model, moving), effort(model)
    np.testing.assert_allclose(found[:900], free[:900], rtol=1e-9, atol=1e-12)
    assert np.abs(found - effort(MODEL)).max() > 1e-4
    assert np.isfinite(found).all()


def test_a_position_that_is_read_late_needs_another_effort():
    late = effort(law('a * abs(velocity)', 'position_delay', a=2e-4))
    shifted = effort(law('a * abs(velocity)', 'position_shift', a=2e-4))
    plain = effort(MODEL)
    assert np.abs(late - plain)[10:-10].max() > 1e-4
    assert np.abs(late - shifted)[10:-10].max() > 1e-4


def test_two_samples_have_no_delay():
    model = law('a * abs(velocity)', 'delay', a=2e-4)
    np.testing.assert_array_equal(effort(model, size=2), effort(MODEL, size=2))


# ---- machine code on the disk

@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(code_cache, '_found', tmp_path)
    return tmp_path


def cache():
    def compiled(value):
        return value + 1.0

    return code_cache.CodeCache(compiled)


def test_where_nothing_may_be_written_nothing_is_kept_and_nothing_fails(monkeypatch):
    monkeypatch.setattr(code_cache, '_found', None)
    codegen = SimpleNamespace(magic_tuple=lambda: ())
    kept = cache()
    assert kept._path('sig', codegen) is None
    assert code_cache._read(None) is None
    kept.save_overload('sig', SimpleNamespace(
        lifted=(), library=SimpleNamespace(has_dynamic_globals=False), codegen=codegen))


def test_code_with_parts_of_this_process_is_not_kept(folder):
    codegen = SimpleNamespace(magic_tuple=lambda: ())
    for lifted, dynamic in (((1,), False), ((), True)):
        cache().save_overload('sig', SimpleNamespace(
            lifted=lifted, library=SimpleNamespace(has_dynamic_globals=dynamic), codegen=codegen))
    assert list(folder.iterdir()) == []


def test_the_oldest_entries_of_a_function_go(folder):
    import os
    for age in range(code_cache.KEPT + 3):
        path = folder / f'a-{age}.code'
        path.write_bytes(b'x')
        os.utime(path, (1000 - age, 1000 - age))
    (folder / 'b-1.code').write_bytes(b'x')
    code_cache._prune(folder, 'a')
    left = sorted(path.name for path in folder.glob('a-*'))
    assert left == sorted(f'a-{age}.code' for age in range(code_cache.KEPT))
    assert (folder / 'b-1.code').exists()


def test_a_table_that_a_function_reads_is_part_of_its_entry():
    keys = []
    for last in (3.0, 4.0, 3.0):
        table = np.array([1.0, 2.0, last])

        def reads(place, table=table):
            return place

        def looks(place):
            return table[place]     # noqa: B023 — it is read at once

        keys.append(list(code_cache._parts(looks, {})))
    assert keys[0] == keys[2] != keys[1]
