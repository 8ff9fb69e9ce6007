# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The watch over the machine: others are told from one's own, and excuse what comes late."""

import os
from pathlib import Path
import subprocess
import sys
import time

import pytest

from tests.machine import family_time, Watch

pytestmark = pytest.mark.skipif(not Path('/proc/stat').exists(), reason='there is no /proc')
BUSY = 'import time\nwhile time.process_time() < 0.5: pass'


def test_the_family_is_a_process_with_all_that_it_started():
    before = family_time(os.getpid())
    subprocess.run([sys.executable, '-c', BUSY], check=True)     # it has ended
    grandchild = f'import subprocess, sys\nsubprocess.run([sys.executable, "-c", {BUSY!r}])'
    subprocess.run([sys.executable, '-c', grandchild], check=True)
    assert family_time(os.getpid()) - before >= 0.9


def test_what_we_use_ourselves_is_no_excuse(monkeypatch):
    monkeypatch.delenv('PYTEST_XDIST_WORKER', raising=False)
    watch = Watch()
    begin, used = time.monotonic(), time.process_time()
    while time.process_time() - used < 0.5:
        pass
    passed = time.monotonic() - begin
    others, everybody = watch.used()
    # Ticks of 10 ms are counted for each process.
    assert everybody - others == pytest.approx(0.5 / passed / os.cpu_count(), abs=0.1)


def test_a_process_that_is_no_child_is_another(monkeypatch, tmp_path):
    monkeypatch.delenv('PYTEST_XDIST_WORKER', raising=False)
    # As a daemon is started: its parent ends at once.
    busy = f'{BUSY}\nopen("done", "w").close()'
    watch, begin = Watch(), time.monotonic()
    subprocess.run([sys.executable, '-c', 'import subprocess, sys\nsubprocess.Popen('
                    f'[sys.executable, "-c", {busy!r}])'], check=True, cwd=tmp_path)
    while not (tmp_path / 'done').exists():
        time.sleep(0.05)
    others, _ = watch.used()
    assert others * (time.monotonic() - begin) * os.cpu_count() > 0.4
