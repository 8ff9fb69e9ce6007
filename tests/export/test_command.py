# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb export`: files that appear whole, what is left out told, bad input in one line."""

from __future__ import annotations

import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time
import zipfile

import pytest

from engb_core.effect_check import MODEL
from engb_core.export.fmu import compiler
from engb_ros.commands.export import FILES
from engb_ros.commands.main import BAD_INPUT, FINE, main

from .machines import machines, with_law

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'export.md'


@pytest.fixture
def model_file(tmp_path) -> Path:
    path = tmp_path / 'model.yaml'
    with_law('torque').write(path)
    return path


def test_every_format_at_once_beside_the_model(model_file, capsys):
    assert main(['export', str(model_file), '--to', *FILES]) == FINE
    made = {path.name for path in (model_file.parent / 'export').iterdir()
            if not path.name.startswith('.')}
    assert made == {name for names in FILES.values() for name in names}
    told = capsys.readouterr().out
    assert 'not in it: Law (law): a * abs(load)' in told
    # Once more, and one format alone: nothing of the program's own stands in the way.
    assert main(['export', str(model_file), '--to', 'json', 'fmu', '--source-only']) == FINE
    assert (model_file.parent / 'export' / 'engb_model.c').exists()
    with zipfile.ZipFile(model_file.parent / 'export' / 'model.fmu') as archive:
        assert not [name for name in archive.namelist() if name.startswith('binaries/')]


def test_what_somebody_changed_is_not_overwritten(model_file, capsys):
    assert main(['export', str(model_file), '--to', 'c']) == FINE
    (model_file.parent / 'export' / 'engb_model.c').write_text('/* mine */', encoding='utf-8')
    assert main(['export', str(model_file), '--to', 'c']) == BAD_INPUT
    assert 'engb_model.c was changed since' in capsys.readouterr().err


@pytest.mark.parametrize(('arguments', 'words'), [
    (['gone.yaml', '--to', 'c'], 'gone.yaml: cannot be read'),
    (['{model}', '--to', 'exe'], 'invalid choice'),
    (['{model}'], '--to')])
def test_bad_input_is_told_in_one_line(arguments, words, model_file, capsys):
    given = [entry.replace('{model}', str(model_file)) for entry in arguments]
    assert main(['export', *given]) == BAD_INPUT
    error = capsys.readouterr().err
    assert words in error and error.count('\n') == 1


def test_the_page_names_every_format_and_its_c_compiles(tmp_path):
    page = PAGE.read_text(encoding='utf-8')
    for format_, names in FILES.items():
        assert f'| `{format_}` |' in page
        assert all(f'`{name}`' in page for name in names)
    found = compiler()
    if found is None:
        pytest.skip('no C compiler (cc, gcc, clang)')
    machines()['rich'].write(tmp_path / 'model.yaml')
    assert main(['export', str(tmp_path / 'model.yaml'), '--to', 'c', '--out',
                 str(tmp_path / 'c')]) == FINE
    code = re.search(r'```c\n(.*?)```', page, re.S)[1]
    (tmp_path / 'c' / 'use.c').write_text(
        code.replace('void start', 'void start(void);\ndouble step(double effort);\nvoid start', 1)
        + 'int main(void)\n{\n    int tick;\n    double last = 0.0;\n    start();\n'
        '    for (tick = 0; tick < 1000; ++tick) {\n        last = step(0.05);\n    }\n'
        '    return last > 1.0 ? 0 : 1;\n}\n', encoding='utf-8')
    subprocess.run([found, '-std=c99', '-Wall', '-Wextra', '-Werror', '-o', 'use', 'use.c',
                    'engb_model.c', '-lm'], cwd=tmp_path / 'c', check=True)
    subprocess.run([str(tmp_path / 'c' / 'use')], check=True)


def test_the_sizes_on_the_page_are_true(tmp_path):
    found = compiler()
    if found is None:
        pytest.skip('no C compiler (cc, gcc, clang)')
    sizes = []
    for name, model in (('none', MODEL), ('one', machines()['stribeck_friction'])):
        model.write(tmp_path / f'{name}.yaml')
        assert main(['export', str(tmp_path / f'{name}.yaml'), '--to', 'c', '--out',
                     str(tmp_path / name)]) == FINE
        (tmp_path / name / 'size.c').write_text(
            '#include "engb_model.h"\n#include <stdio.h>\n'
            'int main(void) { printf("%lu", (unsigned long)sizeof(engb_plant)); return 0; }\n',
            encoding='utf-8')
        subprocess.run([found, '-o', 'size', 'size.c'], cwd=tmp_path / name, check=True)
        sizes.append(int(subprocess.run([str(tmp_path / name / 'size')], check=True,
                                        capture_output=True, text=True).stdout))
    assert [round(sizes[0] / 1e3, 1), round((sizes[1] - sizes[0]) / 1e3, 1)] == [1.9, 1.5]


# Stands for a compiler: a driver whose passes leave files where TMPDIR says, and take long.
SLOW = """#!/bin/sh
echo pass > "${TMPDIR:-/tmp}/ccX.s"
sleep 600 &
echo $! > "$PASS.new" && mv "$PASS.new" "$PASS"
wait
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_compilation_that_is_stopped_leaves_nothing(model_file, tmp_path, number):
    (tmp_path / 'cc').write_text(SLOW)
    (tmp_path / 'cc').chmod(0o755)
    rest, told = tmp_path / 'rest', tmp_path / 'pass'
    rest.mkdir()
    running = subprocess.Popen(
        [sys.executable, '-m', 'engb_ros.commands.main', 'export', str(model_file), '--to', 'fmu'],
        env={**os.environ, 'CC': str(tmp_path / 'cc'), 'TMPDIR': str(rest), 'PASS': str(told),
             'PYTHONPATH': str(Path(__file__).resolve().parents[2])},
        stderr=subprocess.PIPE, text=True)
    while not told.exists():
        assert running.poll() is None, running.communicate()[1]
        time.sleep(0.02)
    running.send_signal(number)
    _, said = running.communicate(timeout=60)
    assert running.returncode == 128 + number and said.count('\n') == 1
    assert list(rest.iterdir()) == []
    assert not (model_file.parent / 'export').exists()
    with pytest.raises(ProcessLookupError):
        while True:     # it is gone once whoever it was left to has taken notice
            os.kill(int(told.read_text()), 0)
            if Path(f'/proc/{told.read_text().strip()}/stat').read_text().split()[2] == 'Z':
                raise ProcessLookupError
            time.sleep(0.02)


@pytest.mark.parametrize('words', [['--fmi', '3'], ['--source-only']])
def test_what_is_said_of_an_fmu_has_no_effect_elsewhere(model_file, capsys, words):
    assert main(['export', str(model_file), '--to', 'json', *words]) == BAD_INPUT
    assert f'{" ".join(words)}: has no effect without --to fmu' in capsys.readouterr().err
