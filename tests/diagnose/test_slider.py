# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is said of a linear axis has its units."""

import pytest

from engb_core.diagnose.diagnosis import EffectFinding, ParameterEstimate
from engb_core.diagnose.hypothesis import scaled, variants_of
from engb_core.diagnose.slider import finding_of_slider
from engb_core.effects.base import Scene
from engb_core.effects.catalogue import get_effect


def test_lengths_are_metres_and_a_phase_is_an_angle_all_the_same() -> None:
    told = finding_of_slider(EffectFinding(
        'cogging_torque', 0.9, {'amplitude': ParameterEstimate(6.4, 0.3, 'N·m'),
                                'order': ParameterEstimate(853.0, 1.8, '1/rev'),
                                'phase': ParameterEstimate(1.3, 0.05, 'rad')},
        0.9, (), 'A torque of 6.4 N·m repeats 853 times per motor revolution (cogging).'))
    assert {name: entry.unit for name, entry in told.parameters.items()} == {
        'amplitude': 'N', 'order': '1/m', 'phase': 'rad'}
    assert told.statement == 'A force of 6.4 N repeats every 0.00737 m (cogging).'


@pytest.mark.parametrize('name', ['self_energizing', 'pad_friction_fade'])
def test_a_short_stroke_says_nothing_of_the_disc(name):
    """Starts and bounds of distances and speeds go with the joint's, but not those of the disc."""
    effect = get_effect(name)
    scene = Scene(duration=10.0, largest_effort=1.0, largest_load=1.0, speed=0.5, sampling=1e-3,
                  position_range=(0.0, 1.0), disc_speed_range=(0.0, 50.0), temperature_range=None)
    of_disc = effect.of_kind('disc_speed')
    assert of_disc is not None
    assert scaled(effect, scene).of_kind('disc_speed') == of_disc


@pytest.mark.parametrize('name', ['self_energizing', 'pad_friction_fade'])
@pytest.mark.parametrize(('speeds', 'ways'), [
    ((0.0, 55.0), [0.0]), ((-0.2, 55.0), [0.0]), ((-18.0, 55.0), [0.0, 1.0]),
    ((-55.0, 0.0), [1.0]), ((-55.0, 0.2), [1.0])])   # the noise of a disc that stands
def test_a_disc_that_turned_both_ways_may_act_alike(name, speeds, ways):
    scene = Scene(duration=10.0, largest_effort=1.0, largest_load=1.0, speed=50.0, sampling=1e-3,
                  position_range=(0.0, 30.0), disc_speed_range=speeds, temperature_range=None)
    found = variants_of(get_effect(name), scene)
    assert [variant.constants[-1] for variant in found] == ways
