"""One bomb of each kind, as a process: one line or a result, bounded memory and time."""

import json
from pathlib import Path
import random
import subprocess
import sys

import pytest

from .bombs import BOMBS, make_bomb

ROOT = Path(__file__).resolve().parents[2]
OUT = {'predict': 'out.npz', 'identify': 'out.yaml', 'diagnose': 'result', 'import': 'rec'}
# What a process takes that imports everything and reads an honest recording is 0.3 GB of this.
MEMORY, SECONDS = 1000, 60.0
# Tables are read by a room that is being rebuilt.
KINDS = [kind for kind in BOMBS if kind not in ('npz', 'mat', 'csv')]
CODE = '''
import json, resource, sys
from engb_ros.commands.main import main
status = main(sys.argv[1:])
used = resource.getrusage(resource.RUSAGE_SELF)
# ru_maxrss would hold the size of the process that started this one: VmHWM is its own.
with open('/proc/self/status', encoding='ascii') as lines:
    peak = next(int(line.split()[1]) for line in lines if line.startswith('VmHWM:'))
print(json.dumps([peak // 1024, used.ru_utime + used.ru_stime]))
sys.exit(status)
'''


@pytest.mark.slow
@pytest.mark.parametrize('kind', KINDS)
def test_bomb(tmp_path, kind):
    arguments = make_bomb(kind, tmp_path, random.Random(1))
    outcome = subprocess.run(
        [sys.executable, '-c', CODE, *arguments, '--out', str(tmp_path / OUT[arguments[0]])],
        cwd=ROOT, capture_output=True, text=True, check=False)
    assert outcome.returncode in (0, 2), outcome
    assert outcome.stderr.count('\n') == (1 if outcome.returncode else 0)
    memory, seconds = json.loads(outcome.stdout.splitlines()[-1])
    assert memory < MEMORY
    assert seconds < SECONDS
