# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
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
# Of each kind the first draw; of tables those that once took the process down or its memory.
SEEDS = [*((kind, 1) for kind in BOMBS), ('csv', 2), ('csv', 5), ('csv', 14), ('mat', 6),
         ('loop rate', 15), ('slow samples', 4), ('slow samples', 6), ('slow samples', 7)]
CODE = '''
import json, resource, sys
from engb_ros.commands.main import main
status = main(sys.argv[1:])
used = resource.getrusage(resource.RUSAGE_SELF)
# Tables are read by a process of their own.
reader = resource.getrusage(resource.RUSAGE_CHILDREN)
# ru_maxrss would hold the size of the process that started this one: VmHWM is its own.
with open('/proc/self/status', encoding='ascii') as lines:
    peak = next(int(line.split()[1]) for line in lines if line.startswith('VmHWM:'))
print(json.dumps([max(peak, reader.ru_maxrss) // 1024, used.ru_utime + used.ru_stime
                  + reader.ru_utime + reader.ru_stime]))
sys.exit(status)
'''


@pytest.mark.slow
@pytest.mark.parametrize(('kind', 'seed'), SEEDS)
def test_bomb(tmp_path, kind, seed):
    arguments = make_bomb(kind, tmp_path, random.Random(seed))
    outcome = subprocess.run(
        [sys.executable, '-c', CODE, *arguments, '--out', str(tmp_path / OUT[arguments[0]])],
        cwd=ROOT, capture_output=True, text=True, check=False)
    assert outcome.returncode in (0, 2), outcome
    assert outcome.stderr.count('\n') == (1 if outcome.returncode else 0)
    memory, seconds = json.loads(outcome.stdout.splitlines()[-1])
    assert memory < MEMORY
    assert seconds < SECONDS
