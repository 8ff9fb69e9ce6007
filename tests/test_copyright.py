# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Each source file says whose it is and under which license, in one line that tools read."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NOTICE = 'Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0'
FOLDERS = ('.ci', 'bags', 'benchmarks', 'docs', 'engb_core', 'engb_ros', 'tests')
SUFFIXES = ('.py', '.c', '.h', '.launch.xml', '.xacro')
BEFORE = ('#!', '<?xml')        # what has to be a file's first line
COMMENTS = {'.c': '/* {} */', '.h': '/* {} */', '.xml': '<!-- {} -->', '.xacro': '<!-- {} -->'}


def sources() -> list[Path]:
    """Return the source files that hold anything."""
    found = [path for folder in FOLDERS for path in (ROOT / folder).rglob('*')
             if path.name.endswith(SUFFIXES) or path.parent.name == '.ci']
    found += [ROOT / name for name in ('setup.py', 'Makefile', 'Dockerfile')]
    return sorted(path for path in found if path.is_file() and path.stat().st_size)


def expected(path: Path) -> str:
    """Return the line as it stands in a file of this kind."""
    return COMMENTS.get(path.suffix, '# {}').format(NOTICE)


def test_the_copyright_line_comes_first() -> None:
    without = []
    for path in sources():
        lines = path.read_text('utf8').splitlines()
        if lines[lines[0].startswith(BEFORE):][:1] != [expected(path)]:
            without.append(f'{path.relative_to(ROOT)}: {expected(path)}')
    assert not without, 'let this be their first line:\n' + '\n'.join(without)


def test_the_license_is_the_packages() -> None:
    assert 'Apache-2.0</license>' in (ROOT / 'package.xml').read_text('utf8')
    assert 'Apache License' in (ROOT / 'LICENSE').read_text('utf8')
    assert len(sources()) > 400
