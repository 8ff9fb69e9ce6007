# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Of laws that do as well, the one is told that leaves the file's numbers as they are."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from tests.diagnose.simulated_brake import NOMINAL, recorded, strokes_and_waves

WAY, MORE = 3.0, 0.012


@pytest.mark.slow
def test_what_acts_until_some_way_is_gone_changes_no_number():
    """A seal's lip turns over some way behind a reversal: friction that is higher until then is
    the same as lower from then on beside a Coulomb friction that is wrong in the file."""
    travel = strokes_and_waves(11)
    run = recorded(NOMINAL, lambda time, _: travel.at(time), travel.duration, noise=0.002)
    direction, gone, more = 0.0, WAY, []
    for step in np.diff(run.position, prepend=run.position[0]):
        if step * direction < 0.0:
            gone = 0.0
        direction = np.sign(step) or direction
        gone += abs(step)
        more.append(MORE * direction / (1.0 + np.exp((gone - WAY) / 0.2)))
    found = diagnose([replace(run, effort=run.effort + np.array(more))], NOMINAL)
    assert 'coulomb_friction_error' not in [entry.effect for entry in found.effects]
    assert found.unexplained.law.pattern.endswith('- since_reversal, c)')
    assert found.unexplained.law.parameters['a'].value == pytest.approx(MORE, rel=0.2)
