# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is said where nothing is named."""

import pytest

from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.verdict import unless_nothing_helps

FINDING = EffectFinding('backlash', 0.9, {}, 1.0, (), '')


@pytest.mark.parametrize(('verdict', 'findings', 'helps', 'said'), [
    ('explained', [], False, 'consistent'),
    ('explained', [], True, 'explained'),
    ('explained', [FINDING], False, 'explained'),
    ('unexplained', [], False, 'unexplained'),
    ('consistent', [], False, 'consistent'),
])
def test_numbers_that_fit_nothing_new_are_no_mismatch(verdict, findings, helps, said):
    assert unless_nothing_helps(verdict, findings, helps) == said
