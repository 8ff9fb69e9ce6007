# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The machinery of `make mutants`: it changes what it says, and sees whether a test tells it."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip('cosmic_ray', reason='`make mutants` installs it')

from tests.mutants.mutations import mutants  # noqa: E402
from tests.mutants.run import LIST, listed, ROOT, TARGETS, write  # noqa: E402

SOURCE = '''"""A module."""
LARGEST = 4.0


class Judge:
    @property
    def limit(self) -> float | None:
        return LARGEST + 1.0

    def within(self, value: float) -> bool:
        return value < self.limit and not value < 0.0

    def known(self, value: object) -> bool:
        return value is not None or self is value
'''


def test_comparisons_numbers_conditions_and_decorators_are_changed() -> None:
    found = {(mutant.place, mutant.was, mutant.becomes) for mutant in mutants(SOURCE)}
    assert ('', 'LARGEST = 4.0', 'LARGEST = 5.0') in {
        (place, was, ' '.join(becomes.split())) for place, was, becomes in found}
    line = 'return value < self.limit and not value < 0.0'
    for becomes in ('return value <= self.limit and not value < 0.0',
                    'return value < self.limit or not value < 0.0',
                    'return value < self.limit and  value < 0.0'):
        assert ('Judge.within', line, becomes) in found
    assert ('Judge.limit', 'return LARGEST + 1.0', 'return LARGEST - 1.0') in found
    assert ('Judge.limit', '@property', '') in found


def test_what_any_test_would_see_or_none_could_is_left_out() -> None:
    found = [(mutant.was, mutant.becomes) for mutant in mutants(SOURCE)]
    assert not [pair for pair in found if '<<' in pair[1] or '**' in pair[1]]
    assert not [pair for pair in found if '-> float' in pair[0]]     # annotations
    assert 'return value is not None or self is not value' in [pair[1] for pair in found]
    assert not [pair for pair in found if 'value != None' in pair[1] or 'self == v' in pair[1]]
    sources = [mutant.source for mutant in mutants(SOURCE)]
    assert SOURCE not in sources
    for source in sources:
        compile(source, 'mutant', 'exec')


def test_the_list_is_written_and_read(tmp_path: Path) -> None:
    path = tmp_path / 'list.yaml'
    before = listed()
    for module in TARGETS:
        write(path, module, {entry: reason for entry, reason in before.items()
                             if entry.module == module})
    assert listed(path) == before


def test_the_same_modules_have_to_be_covered() -> None:
    lines = (ROOT / 'Makefile').read_text('utf8').splitlines()
    listed_there = next(line for line in lines if line.startswith('LAST_LINE := '))
    assert set(listed_there.removeprefix('LAST_LINE := ').split(',')) == set(TARGETS)


def test_each_survivor_has_a_reason_and_its_line_is_still_there() -> None:
    for entry, reason in listed(LIST).items():
        assert reason, entry
        lines = [line.strip() for line in (ROOT / entry.module).read_text('utf8').splitlines()]
        for line in entry.was.splitlines():
            assert line in lines, f'{entry}: changed; run `make mutants`, and mend the list'
