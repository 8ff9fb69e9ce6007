# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What holds for many recordings is said once."""

from engb_core.report.alike import alike_together


def test_what_many_recordings_share_is_one_note() -> None:
    notes = [f'run_{k}: Effort is {k + 0.5} times the deviation: a command.' for k in range(8)]
    told = alike_together(['run_1: 2 samples jump.', *notes, 'A first model was identified.'])
    assert told == ['run_1: 2 samples jump.',
                    '8 recordings: Effort is 0.5 times the deviation: a command. '
                    '(The numbers are those of run_0.)',
                    'A first model was identified.']


def test_few_stand_as_they_are_and_none_is_lost() -> None:
    few = ['a: 3 samples jump.', 'b: 4 samples jump.', 'c: 5 samples jump.', 'no colon 7']
    assert alike_together(few) == few
    assert alike_together([f'{name}: no reference' for name in 'abcd']) == [
        '4 recordings: no reference']
