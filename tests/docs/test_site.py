# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The documentation builds as a site without a warning, and leaves no page and no effect out."""

from __future__ import annotations

from pathlib import Path
import re
import subprocess
import sys

import pytest

from engb_core.effects.catalogue import catalogue
from tests.docs_scripts import docs_script

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope='module')
def site():
    return docs_script('make_site')


def test_every_page_and_every_effect_is_in_it(site):
    index = site.index_page().splitlines()
    for path in (ROOT / 'docs').glob('*.md'):
        assert path.stem in index
    text = site.effects_page()
    for effect in catalogue().values():
        if effect.stages:
            assert f'`{effect.id}`' in text and effect.equation in text


def test_the_chapter_of_the_readme_is_taken_whole(site):
    assert site.diagnosis_page().count('\n1. ') == 1 and '**Parsimony.**' in site.diagnosis_page()


def test_the_statistics_name_the_constants_that_are_used():
    from engb_core.diagnose import constants
    text = (ROOT / 'docs' / 'statistics.md').read_text(encoding='utf-8')
    told = dict(re.findall(r'`([A-Z_]+)` = ([0-9.]+\d)', text))
    assert len(told) >= 15
    assert f'{len(constants.__all__)} of them' in ' '.join(text.split())
    assert {name: float(value) for name, value in told.items()} == {
        name: getattr(constants, name) for name in told}
    named = set(re.findall(r'\b[A-Z]{4,}(?:_[A-Z]+)*\b', text)) - {'README'}
    assert named <= set(constants.__all__)


@pytest.mark.slow
def test_it_builds_without_a_warning(tmp_path):
    pytest.importorskip('sphinx', reason='sphinx is not installed (make docs)')
    pytest.importorskip('myst_parser', reason='myst-parser is not installed (make docs)')
    made = subprocess.run([sys.executable, str(ROOT / 'docs' / 'make_site.py'),
                           str(tmp_path / 'site')], capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr
    assert (tmp_path / 'site' / 'api.html').exists()
