# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What decides is few constants in one file, each with its origin."""

from pathlib import Path
import re

from engb_core.diagnose import constants

ORIGINS = ('Test', 'Loss', 'Prior', 'Level')


def test_there_are_no_more_than_twenty_five_and_all_are_numbers():
    names = {name for name in vars(constants) if name.isupper()}
    assert names == set(constants.__all__) and len(names) <= 25
    assert all(isinstance(getattr(constants, name), float) for name in names)


def test_each_says_where_it_comes_from():
    text = Path(constants.__file__).read_text(encoding='utf-8')
    told = re.findall(r'((?:^#.*\n)+)([A-Z_, ]+) = ', text, re.MULTILINE)
    assert sum(len(names.split(',')) for _, names in told) == len(constants.__all__)
    for comment, names in told:
        assert any(re.search(rf'\b{origin}s?[.:]', comment) for origin in ORIGINS), names
