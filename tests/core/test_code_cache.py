# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Machine code on disk: never old, loaded at the second start, safe among processes."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

import pytest

from engb_core.physics.code_cache import fingerprint
from engb_core.physics.compiled import COMPILED

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.skipif(not COMPILED, reason='numba is not installed')

HELPER = '''
from engb_core.physics.compiled import compiled
FACTOR = {factor}
@compiled
def inner(value):
    return {inner}
'''
CALLER = '''
from engb_core.physics.compiled import compiled
from helper import FACTOR, inner
@compiled
def outer(value):
    return FACTOR * inner(value)
'''
RUN = '''
import sys
sys.path[:0] = [{folder!r}, {root!r}]
from caller import outer
print(outer(3.0), sum(outer.stats.cache_misses.values()))
'''
SIMULATE = '''
import sys
sys.path.insert(0, {root!r})
from numba.core import event
compilations = event.install_recorder('numba:run_pass')
from engb_core.model import EffectSetting, Model
from engb_core.physics.simulation import BrakePlant
with compilations as record:
    plant = BrakePlant(Model(effects=(EffectSetting('asymmetric_friction', {{'asymmetry': 0.2}}),
                                      EffectSetting('pad_creep', {{'relaxed_fraction': 0.1,
                                                                  'time_constant': 0.5}}))))
    plant.advance(0.03, 0.2)
    plant.advance(-0.01, 0.1)
print(repr(plant.position), len(record.buffer))
'''


def started(script: str, cache: Path) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, '-c', script], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True,
                            env=os.environ | {'NUMBA_CACHE_DIR': str(cache)})


def ended(process: subprocess.Popen) -> list[float]:
    out, err = process.communicate(timeout=200)
    assert process.returncode == 0, err
    return [float(word) for word in out.split()]


@pytest.fixture
def outer(tmp_path):
    """Return a run of `outer(3.0)` with given helper: its value, and how often it compiled."""
    def run(inner: str = 'value + 1.0', factor: float = 2.0) -> list[float]:
        (tmp_path / 'helper.py').write_text(HELPER.format(inner=inner, factor=factor))
        (tmp_path / 'caller.py').write_text(CALLER)
        # Python's own cache of a module goes by its time in seconds, and its size.
        for file in (tmp_path / '__pycache__').glob('*.pyc'):
            file.unlink()
        return ended(started(RUN.format(folder=str(tmp_path), root=str(ROOT)),
                             tmp_path / 'cache'))
    return run


def test_what_is_called_or_read_elsewhere_is_part_of_the_entry(outer):
    assert outer() == [8.0, 1]
    assert outer() == [8.0, 0]
    assert outer(inner='value - 1.0') == [4.0, 1]     # same size, same module, another function
    assert outer(factor=3.0) == [12.0, 1]
    assert outer() == [8.0, 0]                        # what was there once still is


def test_a_damaged_entry_is_compiled_anew(outer, tmp_path):
    assert outer() == [8.0, 1]
    for entry in (tmp_path / 'cache').rglob('*.code'):
        data = entry.read_bytes()
        entry.write_bytes(data[:len(data) // 2])
    assert outer() == [8.0, 1]
    assert outer() == [8.0, 0]


def test_processes_that_start_together_with_nothing_cached(tmp_path):
    script = SIMULATE.format(root=str(ROOT))
    results = [ended(process) for process in [started(script, tmp_path) for _ in range(3)]]
    assert len({position for position, _ in results}) == 1
    # On a busy machine one may start when another has compiled already.
    assert any(passes > 0 for _, passes in results)
    again = ended(started(script, tmp_path))
    assert again == [results[0][0], 0], 'the second start compiled'
    assert not list(tmp_path.rglob('*.part'))


def test_fingerprints():
    def make(constant):
        def function(value):
            return value + constant
        return function

    def recursive(value):
        return recursive(value - 1) if value else 0

    assert fingerprint(make(1.0)) == fingerprint(make(1.0))
    assert fingerprint(make(1.0)) != fingerprint(make(2.0))
    assert fingerprint(make(1)) != fingerprint(make(1.0))
    assert fingerprint(recursive) == fingerprint(recursive)
