# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The runner hands the tool copies that hold only recording and nominal model."""
from __future__ import annotations

import json
from pathlib import Path
import sys

import pytest

from tests.proof.run import run_tool

FAKE = """
import json, sys
from pathlib import Path
command, recording, *rest = sys.argv[1:]
at = sys.argv.index('--model')
options = dict(zip(sys.argv[at::2], sys.argv[at + 1::2]))
if command == 'diagnose':
    near = sorted(p.name for p in Path.cwd().iterdir())
    where = str(Path.cwd())
    out = Path(options['--out'])
    out.mkdir()
    (out / 'diagnosis.json').write_text(json.dumps({'near': near, 'where': where}))
    (out / 'model.yaml').write_text(Path(options['--model']).read_text())
else:
    sys.exit('engb: no ' + Path(recording).name)
"""


@pytest.mark.parametrize('trains', [['train.mcap'], ['train_1.mcap', 'train_2.mcap']])
def test_tool_sees_a_copy_without_truth(tmp_path: Path, trains: list[str]) -> None:
    case, results = tmp_path / 'case_0007', tmp_path / 'results' / 'case_0007'
    case.mkdir()
    for name in (*trains, 'test.mcap', 'nominal.yaml', 'truth.json', 'truth.npz'):
        (case / name).write_text(name, 'utf8')
    (tmp_path / 'fake.py').write_text(FAKE, 'utf8')
    failure = run_tool(case, results, [sys.executable, '-B', str(tmp_path / 'fake.py')])
    told = json.loads((results / 'diagnosis.json').read_text('utf8'))
    assert told['near'] == ['nominal.yaml', *trains]
    assert str(tmp_path) not in told['where']
    assert '0007' not in told['where']
    assert failure == 'predict: exit 1: engb: no test.mcap'
    assert json.loads((results / 'run.json').read_text('utf8'))['failure'] == failure
    assert json.loads((results / 'run.json').read_text('utf8'))['seconds'] > 0.0
