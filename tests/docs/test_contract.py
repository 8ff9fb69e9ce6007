# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The contract in docs/ is the authority: what the project holds elsewhere agrees with it."""
from __future__ import annotations

import json
from pathlib import Path
import re

from engb_core.effects.catalogue import catalogue
from tests.proof.vocabulary import DRIVES, NUMBERS, TABLE_4

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'docs' / 'contract.md').read_text('utf8')


def ids(text: str) -> list[str]:
    """First cells of the tables' rows that are an id."""
    return re.findall(r'^\| `(\w+)` \|', text, re.MULTILINE)


def test_the_proof_knows_the_effects_of_table_4() -> None:
    section = PAGE.split('## 4.')[1].split('## 5.')[0]
    numbers, physics = section.split('Then physics')
    physics, drives = physics.split('Drives seen from outside')
    assert set(ids(numbers)) == NUMBERS
    assert set(ids(numbers + physics)) == TABLE_4
    assert set(ids(drives)) == DRIVES
    assert len(ids(physics)) == 17


def test_what_is_agreed_moves_up_once_it_is_built() -> None:
    agreed = ids(PAGE.split('## 6.')[1])
    built = [name for name in agreed if name in catalogue()]
    assert not built, f'{built} are built: move them to section 4 of docs/contract.md'


def test_the_example_and_the_schema_are_json() -> None:
    schema = json.loads((ROOT / 'docs' / 'diagnosis.schema.json').read_text('utf8'))
    assert schema['$schema'].startswith('https://json-schema.org/')
