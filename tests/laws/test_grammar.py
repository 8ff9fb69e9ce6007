# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The grammar reads arithmetic and nothing else, and prints what it reads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
import gc
import time

import pytest

from engb_core.errors import InputError
from engb_core.laws.grammar import (
    coordinates_of,
    has_memory,
    parameters_of,
    parse,
    printed,
    with_values,
)

FORMULAS = [
    'a * abs(load) * sin(k * position + c)', '-(a + b) * velocity**2', 'a - (b - c)',
    'a / (b / c)', 'a * (b + c)', '2 * peak(velocity / w) * step(position - b, 0.07)',
    'a * -b', '(-a)**2',
    'a * lag(direction, tau) + d', '(a**b)**c', 'a**b**c', 'a * 1e-05',
]


@pytest.mark.parametrize('text', FORMULAS)
def test_printing_and_reading_are_inverse(text):
    once = parse(text)
    assert parse(printed(once)) == once


@pytest.mark.parametrize('text', [
    '__import__("os").system("true")', 'a.real', 'a[0]', 'lambda: 1', 'a if b else c', '"a"',
    'open(a)', 'sin()', 'sin(a, b)', 'sin(x=a)', 'a; b', '', '   ', 'a +', '(' * 300, 'True',
    '1e999', '[a]', 'a == b', 'a and b', 'a * ' * 200 + 'a', '*a', 'f(*a)', 'a @ b', '1j',
])
def test_nothing_else_is_read(text):
    with pytest.raises(InputError, match='formula'):
        parse(text)


def test_what_stands_in_a_formula():
    law = parse('a * abs(load) * sin(k * position + c)')
    assert coordinates_of(law) == ('load', 'position')
    assert parameters_of(law) == ('a', 'k', 'c')
    assert not has_memory(law)
    assert has_memory(parse('a * lag(load, b)')) and has_memory(parse('a * since_reversal'))


def test_numbers_for_parameters():
    law = with_values(parse('a * load - k * position'), {'a': -0.25, 'k': 2.0})
    assert printed(law) == '-0.25 * load - 2 * position'


class Cycle:
    """Garbage that only the collector finds, whose finalizer lets other threads run."""

    def __init__(self):
        self.me = self

    def __del__(self):
        time.sleep(1e-5)


def test_formulas_are_read_in_threads_while_garbage_is_collected():
    """CPython counts the depth of a syntax tree for all threads together."""
    text = 'a * sin(2.0 * position + b) * abs(load) * (1 + exp(-(velocity / 3.0)**2))'
    expected = parse(text)

    def read(_):
        for _ in range(100):
            Cycle()
            assert parse(text) == expected

    threshold = gc.get_threshold()
    gc.set_threshold(20)
    try:
        with ThreadPoolExecutor(4) as threads:
            list(threads.map(read, range(8)))
    finally:
        gc.set_threshold(*threshold)
