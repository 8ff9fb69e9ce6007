# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Keeps the two lists of mechanisms outside the library: described and undescribed.

A description is a file of engb_core/effects, a named effect or an `unexplained_*` one. A grammar
of laws (effects/law.py) that can spell a mechanism with its atoms is no description of it.
"""
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.proof import cases  # noqa: F401  registers all drawers
from tests.proof.catalogue import known
from tests.proof.hide_outside import DESCRIBED
from tests.proof.hide_undescribed import DESCRIBED_SINCE, UNDESCRIBED
from tests.proof.machines import draw_machine
from tests.proof.vocabulary import TABLE_4

EFFECTS = Path(__file__).resolve().parents[2] / 'engb_core' / 'effects'
# Looked at on 2026-11-24: no undescribed kind is among them (a load curve's form does not change
# with time or heat, as the contact's of two undescribed kinds does). The last six are to come.
NO_DESCRIPTION_OF_THESE = TABLE_4 | {
    '__init__', 'base', 'catalogue', 'sampling_delay', 'load_curve_shape',
    'law', 'effort_scale_error', 'command_delay', 'command_rate_limit', 'back_emf',
    'effort_measurement_lag'}


def test_every_described_kind_has_its_description() -> None:
    missing = {kind: name for kind, name in (DESCRIBED | DESCRIBED_SINCE).items()
               if not (EFFECTS / f'{name}.py').exists()}
    assert not missing, f'their description is gone; they are undescribed: {missing}'


def test_a_new_description_moves_its_kind() -> None:
    files = {path.stem for path in EFFECTS.glob('*.py')}
    new = files - NO_DESCRIPTION_OF_THESE - {*DESCRIBED.values(), *DESCRIBED_SINCE.values()}
    assert not new, (
        f'engb_core/effects has {", ".join(sorted(new))}: does one of them describe a kind of '
        'UNDESCRIBED? Then enter that kind in DESCRIBED_SINCE (and keep at least 14 undescribed '
        'ones); if not, enter the file in NO_DESCRIPTION_OF_THESE')


def test_a_description_named_like_a_kind_is_noticed() -> None:
    files = {path.stem.removeprefix('unexplained_') for path in EFFECTS.glob('*.py')}
    assert not files & {kind.removeprefix('outside_') for kind in UNDESCRIBED}


def test_lists_are_apart_and_long_enough() -> None:
    assert not set(DESCRIBED) & set(UNDESCRIBED)
    assert set(DESCRIBED_SINCE) < set(UNDESCRIBED)
    assert len(UNDESCRIBED) - len(DESCRIBED_SINCE) >= 14
    assert len(DESCRIBED) + len(UNDESCRIBED) >= 24
    assert {name for name in known() if name.startswith('outside_')} == {*DESCRIBED, *UNDESCRIBED}


@pytest.mark.parametrize('name', sorted({*DESCRIBED, *UNDESCRIBED}))
def test_every_kind_tells_its_variables(name: str) -> None:
    rng = np.random.default_rng(1)
    hidden = known()[name](rng, draw_machine(rng, 'brake')[2], 'rich')
    assert hidden.depends_on
    names = {'position', 'motor_angle', 'screw_angle', 'velocity', 'direction', 'acceleration',
             'load', 'effort', 'time', 'since_reversal', 'time_at_rest', 'distance', 'heat',
             'disc_speed', 'disc_angle', 'pad_temperature'}
    assert {one for group in hidden.depends_on for one in group} <= names
    assert set(hidden.fair) <= TABLE_4
