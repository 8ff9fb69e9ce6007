# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The monitor on live nodes: quiet while the model holds, a warning with the place where not."""

import pytest

from engb_ros.files import TRUE_BRAKE
from engb_ros.interface import DIAGNOSTICS

STROKES = {'model': str(TRUE_BRAKE), 'reference': 'strokes', 'repeat': True,
           'stroke_amplitudes': [30.0], 'slow_range': [0.0, 0.0], 'state_timeout': 0.0,
           'effort_rate': 1e6, 'largest_speed': 1e5}


@pytest.mark.parametrize(('effects', 'level'), [
    ('', 0), ('load_stiffness_error: {scale: 1.4}', 1)])
def test_it_warns_when_model_and_brake_part(runner, probe, effects, level):
    diagnostics = probe.listen(DIAGNOSTICS)
    runner.start('monitor', parameters={'model': str(TRUE_BRAKE), 'period': 0.2})
    runner.start('controller', parameters=STROKES)
    runner.start('plant', parameters={'lockstep': True, 'speed': 2.0, 'effects': effects})

    def words():
        return [message.status[0] for message in diagnostics
                if message.status[0].name.endswith('monitor')]

    def looked():
        """Whether it has seen whole strokes, or warned."""
        last = words()[-1:]
        return last and (last[0].level == bytes([1]) or len(
            [value for value in last[0].values if value.key.startswith('rms')]) >= 4
            and len(words()) > 40)

    runner.wait_until(looked, 'the monitor', timeout=90.0, pause=probe.spin)
    last = words()[-1]
    assert last.level == bytes([level]), last.values
    if level:
        assert 'part' in last.message
        assert 'under load' in last.message
    runner.stop()
