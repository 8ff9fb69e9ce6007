# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb reproduce --offline` on the kept bags, and its bad input."""

import json
from pathlib import Path

import pytest

from engb_core.model import Model
from engb_ros.commands.main import main


def test_offline_report_from_the_kept_bags(tmp_path, capsys):
    out = tmp_path / 'out'
    assert main(['reproduce', '--offline', '--seeds', '1', '--no-diagnosis', '--out',
                 str(out)]) == 0
    assert 'report:' in capsys.readouterr().out
    page = (out / 'report.html').read_text(encoding='utf-8')
    assert all(f'Figure {figure}:' in page for figure in range(6, 26))
    results = json.loads((out / 'results.json').read_text(encoding='utf-8'))
    numbers = {entry['name']: entry for entry in results['numbers']}
    friction = numbers['μ, joint regression, mean slope']['form']
    assert friction['word'] == 'set'
    assert friction['value'] == pytest.approx(friction['truth'], rel=0.03)
    model = Model.read(out / 'model.yaml')
    assert model.friction.load_gain == pytest.approx(0.111, abs=0.01)


@pytest.mark.parametrize(('options', 'word'), [
    (['--offline', '--bags', 'nowhere'], 'nowhere'), (['--seed', '-1'], 'seed'),
    (['--every', '0'], 'every'), (['--seeds', '0'], 'seeds'), (['--sealed', '-1'], 'sealed'),
    (['--offline', '--sealed', '2'], 'sealed')])
def test_bad_input_ends_in_one_line(options, word, tmp_path, capsys):
    out = tmp_path / 'out'
    assert main(['reproduce', *options, '--out', str(out)]) == 2
    complaint = capsys.readouterr().err
    assert word in complaint
    assert complaint.count('\n') == 1
    assert not Path(out).exists()


def test_missing_bag_is_named(tmp_path, capsys):
    (tmp_path / 'bags').mkdir()
    out = tmp_path / 'out'
    assert main(['reproduce', '--offline', '--bags', str(tmp_path / 'bags'),
                 '--out', str(out)]) == 2
    assert 'steps' in capsys.readouterr().err
    assert not out.exists()
