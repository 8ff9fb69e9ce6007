"""The runner hands the tool copies that hold only recording and nominal model."""
from __future__ import annotations

import json
from pathlib import Path
import sys

from tests.proof.run import run_tool

FAKE = """
import json, sys
from pathlib import Path
command, recording, *rest = sys.argv[1:]
options = dict(zip(rest[::2], rest[1::2]))
if command == 'diagnose':
    out = Path(options['--out'])
    out.mkdir()
    near = sorted(p.name for p in Path(recording).parent.iterdir())
    (out / 'diagnosis.json').write_text(json.dumps({'near': near, 'recording': recording}))
    (out / 'model.yaml').write_text(Path(options['--model']).read_text())
else:
    sys.exit('engb: no ' + Path(recording).name)
"""


def test_tool_sees_a_copy_without_truth(tmp_path: Path) -> None:
    case, results = tmp_path / 'case_0007', tmp_path / 'results' / 'case_0007'
    case.mkdir()
    for name in ('train.mcap', 'test.mcap', 'nominal.yaml'):
        (case / name).write_text(name, 'utf8')
    (tmp_path / 'fake.py').write_text(FAKE, 'utf8')
    failure = run_tool(case, results, [sys.executable, '-B', str(tmp_path / 'fake.py')])
    told = json.loads((results / 'diagnosis.json').read_text('utf8'))
    assert told['near'] == ['nominal.yaml', 'test.mcap', 'train.mcap']
    assert str(tmp_path) not in told['recording']
    assert '0007' not in told['recording']
    assert failure == 'predict: exit 1: engb: no test.mcap'
    assert json.loads((results / 'run.json').read_text('utf8'))['failure'] == failure
    assert json.loads((results / 'run.json').read_text('utf8'))['seconds'] > 0.0
