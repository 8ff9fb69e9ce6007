# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Each kind of fault of the link ends as promised, and the page says what is measured."""

from pathlib import Path

import pytest

pytest.importorskip('cantools')

from benchmarks.can_faults import KINDS, measured, page  # noqa: E402

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'can-faults.md'


@pytest.mark.parametrize('kind', KINDS, ids=lambda kind: kind.name)
def test_a_kind_of_fault(kind):
    took = measured(kind)
    if kind.bound is None:
        assert took is None
    else:
        assert took is not None
        assert took <= kind.bound + 1e-9


def test_the_page_is_the_measurement():
    assert PAGE.read_text(encoding='utf-8') == page()
