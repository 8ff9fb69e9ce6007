# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The page for newcomers names what there is: fields of the model file, options, formats."""

from pathlib import Path
import re

import pytest

from engb_core.io.tables.formats import SUFFIXES
from engb_core.model import Cogging, Controller, EffectSetting, Model
from engb_ros.commands import diagnose, import_table
from engb_ros.commands import model as model_command
from engb_ros.commands.main import _parser

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'docs' / 'from-a-table.md').read_text(encoding='utf-8')
FULL = Model(cogging=(Cogging(1.0, 1e-3, 0.0),), effects=(EffectSetting('pad_creep', {}),),
             controller=Controller(0.05, 0.2, 0.002, 0.6, 1000.0))


def fields(mapping):
    """Return the own name of each field that holds something other than fields, deep."""
    for key, value in mapping.items():
        if not isinstance(value, dict) or key in ('parameters', 'controller'):
            yield key
        for entry in value if isinstance(value, list) else [value]:
            if isinstance(entry, dict):
                yield from fields(entry)


@pytest.mark.parametrize('field', sorted(set(fields(FULL.to_mapping()))))
def test_every_field_of_the_model_file_is_explained(field):
    table = PAGE.split('## The model file')[1]
    assert re.search(rf'`(\w+\.)?{field}`', table), field


def test_every_command_on_the_pages_can_be_given():
    readme = (ROOT / 'README.md').read_text(encoding='utf-8')
    modules = {'diagnose': diagnose, 'model': model_command, 'import': import_table}
    seen = 0
    for line in re.findall(r'^ +\.venv/bin/engb (.*)$', readme + PAGE, re.MULTILINE):
        name, *words = line.split('#')[0].split()
        if name not in modules or '…' in line:
            continue
        parser = _parser(f'engb {name}', 'x')
        modules[name].add_arguments(parser)
        parser.parse_args(words)        # a wrong option ends the test
        seen += 1
    assert seen >= 4


def test_formats_are_those_that_are_read():
    readme = (ROOT / 'README.md').read_text(encoding='utf-8')
    listed = set(re.findall(r'\.[a-z0-9]+', readme.split('A table (')[1].split(')')[0]))
    assert listed <= set(SUFFIXES)
    assert {kind for suffix, kind in SUFFIXES.items() if suffix in listed} == set(
        SUFFIXES.values())
