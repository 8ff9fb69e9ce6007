# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The page of a diagnosis: self-contained, safe, finite, and it says what it must."""

from __future__ import annotations

import dataclasses
from html.parser import HTMLParser
import json
from pathlib import Path
import re
import subprocess
import sys
import textwrap

import pytest

from engb_core.report.layout import Column, Page
from engb_core.report.page import diagnosis_page, write_report
from engb_core.report.rivals import hypothesis_name

from .samples import ALL, consistent, empty, explained, HOSTILE, partly, prismatic, unexplained

BUDGET = 1_500_000


class Reader(HTMLParser):
    """Collects what a browser would load and run, and the visible text."""

    VOID = {'meta', 'br', 'img', 'link', 'wbr', 'path', 'circle', 'rect', 'use'}

    def __init__(self, html: str) -> None:
        super().__init__()
        self.loads, self.tags, self.text, self.blocks = [], [], [], []
        self.open: list[str] = []
        self.handlers: list[str] = []
        self.kind = ''
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.kind = dict(attributes).get('type', '') if tag == 'script' else ''
        for name, value in attributes:
            if name in ('src', 'href', 'data', 'action', 'xlink:href') and not (
                    value or '').startswith('#'):
                self.loads.append((tag, value))
            if name.startswith('on'):
                self.handlers.append(name)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == 'script':
            if self.kind == 'application/json':
                self.blocks.append(json.loads(data))
        elif not self.open or self.open[-1] != 'style':
            self.text.append(data)


def without_plotly(html: str) -> str:
    return re.sub(r'<script>/\*\*\n\* plotly\.js.*?</script>', '', html, flags=re.DOTALL)


def text_of(diagnosis, backend: str = 'table') -> str:
    words = ' '.join(Reader(diagnosis_page(diagnosis, backend=backend).html()).text)
    return ' '.join(words.split()).replace('\u202f', ' ')


@pytest.mark.parametrize('backend', ['plotly', 'matplotlib', 'table'])
@pytest.mark.parametrize('name', ALL)
def test_page_is_self_contained_small_and_well_formed(name, backend):
    html = without_plotly(diagnosis_page(ALL[name](), backend=backend).html())
    reader = Reader(html)
    assert len(html.encode()) < BUDGET
    assert not reader.loads and not reader.handlers and not reader.open
    assert not re.search(r'https?://|@import|url\((?!#|&quot;#)', html)
    assert reader.tags.count('h1') == 1
    assert not {'img', 'iframe', 'link', 'object', 'base'} & set(reader.tags)
    # Numbers that are none show as a dash, in text and in style.
    assert not re.search(r'\b(nan|inf|NaN|Infinity)\b', ' '.join(reader.text) + ''.join(
        re.findall(r'style="[^"]*"', html)))


def test_hostile_names_stay_text():
    html = without_plotly(diagnosis_page(ALL['hostile'](), backend='plotly').html())
    reader = Reader(html)
    assert reader.tags.count('script') == 1 + len(reader.blocks)
    assert '<script>alert' not in html and '<img' not in html
    assert '\u202e' not in html and '\ud800' not in html
    shown = json.dumps(reader.blocks)
    assert '<' not in shown   # plotly would read it as markup


def test_policy_lets_only_our_scripts_run():
    html = diagnosis_page(empty(), backend='table').html()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', html).group(1)
    assert "default-src 'none'" in policy and "script-src 'sha256-" in policy
    assert 'unsafe-inline' not in policy.split('style-src')[0]


def test_long_recordings_stay_small():
    base = partly()
    trace = base.evidence.traces[0]
    long = {field.name: value.repeat(120) if hasattr(value, 'repeat') else value
            for field in dataclasses.fields(trace)
            for value in [getattr(trace, field.name)]}
    traces = tuple(dataclasses.replace(trace, **long | {'recording': f'run{index}'})
                   for index in range(24))
    evidence = dataclasses.replace(base.evidence, traces=traces)
    page = diagnosis_page(dataclasses.replace(base, evidence=evidence), backend='plotly')
    assert len(without_plotly(page.html()).encode()) < BUDGET


def test_explained_tells_the_story_in_order():
    text = text_of(explained())
    parts = ['Stribeck friction explains the mismatch', 'falls from 21.3 to 4.9 mN·m',
             'Where it happens', '81 % of the mismatch lies at velocity', 'What it is',
             '1.420 ± 0.031', '0.81 ± 0.04 rad/s', 'How much better', 'How sure',
             'Presliding friction', 'Details', 'salvaged up to 39.9 s', 'engb-model/1',
             'engb predict RECORDING --model model.yaml']
    places = [text.index(part) for part in parts]
    assert places == sorted(places)


def test_partly_explained_names_the_rival_and_the_next_experiment():
    text = text_of(partly())
    assert 'Most likely cogging torque and load hysteresis explain 72 %' in text
    assert 'cannot rule out load-dependent friction (22 %)' in text
    assert 'load hysteresis, load-dependent friction or another cause (level 0.9)' in text
    assert 'What to measure next' in text and 'nested strokes' in text
    assert 'What remains' in text and 'same in both directions' in text


def test_unexplained_admits_it():
    text = text_of(unexplained())
    assert 'I don’t know what this is; it depends on position and velocity' in text
    assert 'None of these 91 %' in text
    assert 'It has memory' in text and 'falls from 14.3 to 6.1 mN·m' in text


def test_consistent_claims_nothing():
    text = text_of(consistent())
    assert 'The model agrees with the recordings' in text
    assert 'Explains' not in text and 'corrected model' not in text.lower()


@pytest.mark.parametrize('verdict', ['explained', 'partly_explained', 'unexplained', 'consistent'])
def test_the_least_diagnosis_of_each_verdict(verdict):
    assert 'Details' in text_of(empty(verdict))


def test_linear_axis_speaks_of_force():
    text = text_of(prismatic(), 'matplotlib')
    assert 'error of the modelled force' in text and 'Motor force [N]' in text
    assert 'Motor torque [' not in text


def test_written_whole_or_not_at_all(tmp_path, monkeypatch):
    target = tmp_path / 'report.html'
    write_report(target, empty())
    before = target.read_text()
    assert before.startswith('<!DOCTYPE html>')

    def fail(*_):
        raise OSError('disk full')
    monkeypatch.setattr('os.replace', fail)
    with pytest.raises(OSError):
        write_report(target, consistent())
    assert target.read_text() == before and list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize(('blocked', 'expected'), [
    (('plotly',), 'Figures that can be zoomed need plotly'),
    (('plotly', 'matplotlib'), 'Figures need plotly (to zoom) or matplotlib')])
def test_without_the_plotting_packages(tmp_path, blocked, expected):
    script = textwrap.dedent(f'''
        import sys
        class Block:
            def find_spec(self, name, path=None, target=None):
                if name.split('.')[0] in {blocked!r}:
                    raise ModuleNotFoundError(name)
        sys.meta_path.insert(0, Block())
        from report.samples import explained
        from engb_core.report.page import write_report
        write_report({str(tmp_path / 'report.html')!r}, explained())
        assert not set(sys.modules) & set({blocked!r})
    ''')
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, '-c', script], check=True, timeout=600,
                   env={'PYTHONPATH': f'{root}:{root / "tests"}', 'PATH': '/usr/bin:/bin',
                        'MPLCONFIGDIR': str(tmp_path)})
    html = (tmp_path / 'report.html').read_text()
    assert expected in html and len(html.encode()) < BUDGET
    assert ('var(--recorded)"' in html or 'stroke: var(--recorded)' in html) == (
        'matplotlib' not in blocked)


def test_page_serves_other_reports():
    page = Page('Survey', backend='table')
    page.header('engb survey', 'Nine of ten', ['A <lead>'], tone='good', key=[('n', '10', '')])
    page.section('Table')
    page.table([Column('Name'), Column('Value', number=True)], [('a', 1), (HOSTILE, 2)])
    page.begin_details('More')
    with pytest.raises(ValueError, match='still open'):
        page.html()
    page.end_details()
    assert 'A &lt;lead&gt;' in page.html()
    with pytest.raises(ValueError, match='backend'):
        Page('x', backend='gnuplot')


def test_nothing_is_missing_only_where_nothing_is():
    assert hypothesis_name(unexplained(), ()) == 'No effect added'
    assert hypothesis_name(consistent(), ()) == 'Nothing missing'


def test_the_same_picture_is_not_shown_twice():
    """Two effects that the same coordinate reveals had it each."""
    from dataclasses import replace

    from .samples import partly
    sample = partly()
    first = sample.evidence.residual_over[0]
    twice = replace(sample, evidence=replace(sample.evidence, residual_over=(first, first)))
    once = replace(sample, evidence=replace(sample.evidence, residual_over=(first,)))
    count = [diagnosis_page(entry, backend='table').html().count(first.why)
             for entry in (once, twice)]
    assert count[0] >= 1 and count[0] == count[1]


def test_a_correction_that_was_withdrawn_is_told():
    """Names with low probability stand on the page, and the model is the file as it was."""
    base = explained()
    same = [dataclasses.replace(row, rms_after=row.rms_before) for row in base.held_out]
    text = text_of(dataclasses.replace(base, held_out=tuple(same)))
    assert 'the corrected model is the file as it was given' in text
    assert 'the corrected model is the file' not in text_of(base)


def test_a_load_that_the_file_lacks_is_the_headline():
    base = unexplained()
    rest = dataclasses.replace(
        base.unexplained, load_is_absent=True, statement='The model file has no load torque.')
    text = text_of(dataclasses.replace(base, unexplained=rest))
    assert 'The model file has no load, and the machine has one' in text
    assert 'The corrected model holds that load: go on with it.' in text
    assert 'I don’t know what this is' not in text
