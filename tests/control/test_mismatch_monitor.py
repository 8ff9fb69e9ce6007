# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The monitor is quiet on a brake as modelled and says where another one parts."""

from dataclasses import replace
import math

import pytest

from engb_core.bench.virtual_brake import VirtualBrake
from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.mismatch_monitor import MismatchMonitor, MonitorSettings
from engb_core.control.pid import PidGains
from engb_core.control.trajectory import identification_strokes
from engb_core.errors import InputError
from engb_core.model import EffectSetting, Model
from engb_ros.files import TRUE_BRAKE

BRAKE = Model.read(TRUE_BRAKE)


def watched(*effects):
    """Return a monitor that has seen strokes on a brake with these effects."""
    brake = VirtualBrake(replace(BRAKE, effects=tuple(effects)))
    loop = PositionLoop(BRAKE, LoopSettings(PidGains(0.4, 1.5, 0.006, 0.75, -0.75, 0.5, -0.5)))
    monitor, path = MismatchMonitor(BRAKE), identification_strokes([30.0] * 2, 80.0, 0.5)
    measured = brake.advance()
    while measured.time < path.duration:
        brake.command(loop.step(*measured[:4], path.at(measured.time)))
        measured = brake.advance()
        monitor.step(*measured[:4])
    return monitor


def test_it_is_quiet_where_the_model_is_right():
    monitor = watched()
    assert not monitor.parted()
    assert len(monitor.rms()) >= 4


@pytest.mark.parametrize(('effect', 'where'), [
    (EffectSetting('load_stiffness_error', {'scale': 1.3}), 'under load'),
    (EffectSetting('viscous_friction_error', {'viscous_friction': 2e-3}), 'applying'),
    (EffectSetting('asymmetric_friction', {'asymmetry': 0.9}), 'ing')])
def test_it_says_where_model_and_measurement_part(effect, where):
    parted = watched(effect).parted()
    assert parted
    assert where in max(parted, key=parted.get)


def test_what_is_not_finite_is_left_out():
    monitor = MismatchMonitor(BRAKE)
    for sample in ((0.0, 1.0, 1.0, math.nan), (math.inf, 0.0, 0.0, 0.0)):
        assert math.isfinite(monitor.step(*sample))


def test_bad_settings_are_refused():
    with pytest.raises(InputError, match='threshold'):
        MonitorSettings(threshold=0.0)


def test_its_verdict_says_when_there_is_none():
    monitor = MismatchMonitor(BRAKE)
    assert 'nothing is judged yet' in monitor.verdict()
    for number in range(2000):   # standing still is no evidence, whatever the torque
        monitor.step(1e-3 * number, 20.0, 0.0, 0.5)
    assert 'nothing is judged yet' in monitor.verdict()
    assert watched().verdict() == 'model and measurement agree'
    worst = watched(EffectSetting('load_stiffness_error', {'scale': 1.3}))
    assert worst.verdict().startswith('model and measurement part: ')
    assert worst.verdict().index(max(worst.parted(), key=worst.parted().get)) < 60
