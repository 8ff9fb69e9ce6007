# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is said of a linear axis has its units."""

from engb_core.diagnose.diagnosis import EffectFinding, ParameterEstimate
from engb_core.diagnose.slider import finding_of_slider


def test_lengths_are_metres_and_a_phase_is_an_angle_all_the_same() -> None:
    told = finding_of_slider(EffectFinding(
        'cogging_torque', 0.9, {'amplitude': ParameterEstimate(6.4, 0.3, 'N·m'),
                                'order': ParameterEstimate(853.0, 1.8, '1/rev'),
                                'phase': ParameterEstimate(1.3, 0.05, 'rad')},
        0.9, (), 'A torque of 6.4 N·m repeats 853 times per motor revolution (cogging).'))
    assert {name: entry.unit for name, entry in told.parameters.items()} == {
        'amplitude': 'N', 'order': '1/m', 'phase': 'rad'}
    assert told.statement == 'A force of 6.4 N repeats every 0.00737 m (cogging).'
