# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a node of the bus imports: nothing for files that it does not read."""

import os
import subprocess
import sys

import pytest

pytest.importorskip('can')
pytest.importorskip('cantools')

# asammdf, found before the one that is installed, if any.
STUB = "print('asammdf')"

CODE = '''
from engb_ros.can.bus import CanBus
from engb_ros.can.codec import DriveCodec
DriveCodec()
CanBus('virtual', 'one', 0, print, {1}).close()
print('bus')
import asammdf
'''


def test_a_bridge_that_starts_imports_no_library_of_measurement_files(tmp_path):
    """python-can imports asammdf where it is installed: two seconds until a bridge was back."""
    (tmp_path / 'asammdf.py').write_text(STUB)
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(
        [str(tmp_path), os.environ.get('PYTHONPATH', '')])}
    told = subprocess.run([sys.executable, '-c', CODE], env=environment, capture_output=True,
                          text=True, check=True).stdout
    assert told.split() == ['bus', 'asammdf']
