# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Builds the documentation as a site: the pages of docs/, the effects, and the API by docstrings.

    .venv/bin/python docs/make_site.py out/site

The effects' page is made from their files, the API from the docstrings; a warning is an error.
Needs sphinx and myst-parser (`make docs` installs them).
"""

from __future__ import annotations

from pathlib import Path
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / 'docs'
sys.path.insert(0, str(ROOT))

from engb_core.effects.base import Effect  # noqa: E402
from engb_core.effects.catalogue import catalogue  # noqa: E402

# Pages in the order of the site, under their headings.
PAGES = {
    'Begin': ('install', 'from-a-table', 'your-simulator'),
    'Understand': ('diagnosis', 'statistics', 'effects', 'theory', 'laws'),
    'Extend and integrate': ('add-an-effect', 'library', 'export', 'integrate', 'ros2-control',
                             'can-faults', 'hazards', 'security'),
    'Reference': ('api', 'contract', 'versions', 'changelog'),
}
# What is public, by module: what `import engb_core as engb` gives, and what an effect is.
MODULES = ('engb_core.library', 'engb_core.recording', 'engb_core.model', 'engb_core.effects.base',
           'engb_core.diagnose.diagnosis', 'engb_core.export.c_model', 'engb_core.export.fmu',
           'engb_core.simulated.surrogate', 'engb_core.simulated.clock_match')


def effects_page() -> str:
    """Return the page of all effects, from their files."""
    known = [effect for effect in catalogue().values() if effect.stages or effect.number_only]
    groups = {'Physics that a model leaves out': [one for one in known
                                                  if not one.number_only and not one.unnamed],
              'Numbers that are wrong': [one for one in known if one.number_only],
              'Descriptions without a name': [one for one in known if one.unnamed]}
    lines = ['# The effects', '', 'Each is one file in `engb_core/effects/`; its one function '
             'serves simulation, fit and report. [gallery.html](gallery.html) has a picture of '
             'each.', '']
    for heading, effects in groups.items():
        lines += [f'## {heading}', '']
        for effect in effects:
            lines += _effect(effect)
    return '\n'.join(lines) + '\n'


def _effect(effect: Effect) -> list[str]:
    lines = [f'### {effect.title}', '', f'`{effect.id}`, acts on: '
             + (', '.join(effect.stages) or 'what is recorded') + '.', '',
             '```text', effect.equation, '```', '']
    for text, label in ((effect.seen, ''), (effect.confused, 'Confused with: '),
                        (effect.measure, 'To tell it, measure: ')):
        if text:
            lines += [label + text[0].upper() + text[1:] if not label else label + text + '.', '']
    shown = [one for one in effect.parameters if not re.fullmatch(r'value_\d+', one.name)]
    if shown:
        lines += ['| parameter | unit | bounds |', '|---|---|---|']
        lines += [f'| `{one.name}` | {one.unit} | {one.low:g} … {one.high:g} |' for one in shown]
        lines.append('')
    derived = '' if effect.unnamed else f' [Derived](theory.md#{effect.id}).'
    return [*lines, f'Literature: {effect.reference}.{derived}', '']


def diagnosis_page() -> str:
    """Return the README's chapter on how a diagnosis is made."""
    text = (ROOT / 'README.md').read_text(encoding='utf-8')
    found = re.search(r'## How a diagnosis is made\n(.*?)\n## ', text, re.S)
    assert found, 'README.md has no chapter "How a diagnosis is made"'
    return '# How a diagnosis is made\n' + found[1] + '\n'


def api_page() -> str:
    """Return the page of the API; Sphinx fills it from the docstrings."""
    lines = ['API', '===', '', '``import engb_core as engb`` gives the names of '
             '``engb_core.library``, ``Model`` and ``InputError``.', '']
    for name in MODULES:
        lines += [name, '-' * len(name), '', f'.. automodule:: {name}', '   :members:', '']
    return '\n'.join(lines)


def pages() -> dict[str, tuple[str, ...]]:
    """Return the pages under their headings; one that stands under none comes last."""
    listed = {name for names in PAGES.values() for name in names}
    more = tuple(sorted(path.stem for path in DOCS.glob('*.md') if path.stem not in listed))
    return {**PAGES, 'More': more} if more else PAGES


def index_page() -> str:
    """Return the first page."""
    lines = ['# engb_ros', '', 'When the simulation of a brake and its bench disagree, `engb_ros` '
             'finds where, and says what physics the model leaves out.', '']
    for heading, names in pages().items():
        lines += ['```{toctree}', ':maxdepth: 1', f':caption: {heading}', '', *names, '```', '']
    return '\n'.join(lines)


def write_sources(folder: Path) -> None:
    """Write all pages, as Sphinx takes them."""
    made = {'index.md': index_page(), 'effects.md': effects_page(), 'api.rst': api_page(),
            'diagnosis.md': diagnosis_page(),
            'changelog.rst': (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')}
    for name, text in made.items():
        (folder / name).write_text(_links(text), encoding='utf-8')
    for name in (name for names in pages().values() for name in names):
        page = DOCS / f'{name}.md'
        if page.exists() and f'{name}.md' not in made:
            (folder / page.name).write_text(_links(page.read_text(encoding='utf-8')),
                                            encoding='utf-8')
    for entry in DOCS.iterdir():
        if entry.suffix in ('.html', '.png', '.json'):
            shutil.copy(entry, folder / entry.name)
    shutil.copy(DOCS / 'site' / 'conf.py', folder / 'conf.py')


def _links(text: str) -> str:
    """Return a page whose links stay within the site; others keep their words."""
    def mended(match: re.Match[str]) -> str:
        words, target = match[1], match[2]
        target = target.removeprefix('docs/')
        inside = '://' in target or target.startswith('#') or any(
            target.split('#')[0] in (f'{name}.md', f'{name}.html')
            for names in pages().values() for name in names) or target in (
                'gallery.html', 'report.png', 'diagnosis.schema.json')
        return f'[{words}]({target})' if inside else words
    return re.sub(r'(?<!!)\[([^\]\n]+)\]\(([^)\s]+)\)', mended, text)


def main() -> int:
    """Build into the folder given; return Sphinx's status."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / 'out' / 'site')
    with tempfile.TemporaryDirectory(prefix='engb-site-') as scratch:
        write_sources(Path(scratch))
        return subprocess.run([sys.executable, '-m', 'sphinx', '-W', '--keep-going', '-q', '-b',
                               'html', scratch, str(out)], check=False).returncode


if __name__ == '__main__':
    sys.exit(main())
