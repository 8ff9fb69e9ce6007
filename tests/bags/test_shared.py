# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The recordings in ../shared, against rosbags' own reading of them."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from engb_core.io.bags.read import read_recording

from .samples import STORE

SHARED = Path(__file__).resolve().parents[3] / 'shared'
FOUND = [path for pattern in ('blind/*/train*', 'real/emps/train', 'real/servo_sts3215/dirty*')
         for path in sorted(SHARED.glob(pattern))]


@pytest.mark.skipif(not FOUND, reason='../shared is not there')
@pytest.mark.parametrize('path', FOUND[::4], ids=lambda path: '-'.join(path.parts[-2:]))
def test_recordings_of_others(path):
    recording = read_recording(path)
    with AnyReader([path], default_typestore=STORE) as reader:
        states = [entry for entry in reader.connections if entry.topic.endswith('joint_states')]
        table = {}
        for connection, _, raw in reader.messages(states):
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp
            table.setdefault(stamp.sec * 10**9 + stamp.nanosec,
                             (message.position[0], message.effort[0]))
        signals = {entry.topic.split('/')[-1]: entry.msgcount for entry in reader.connections
                   if entry.msgtype.endswith('Float64')}
    stamps = np.array(sorted(table))
    rows = np.array([table[stamp] for stamp in stamps.tolist()])
    good = np.isfinite(rows).all(axis=1)
    assert recording.time.size == good.sum()
    np.testing.assert_allclose(recording.time, (stamps - stamps[0])[good] * 1e-9, atol=2e-9)
    np.testing.assert_array_equal(recording.position, rows[good, 0])
    np.testing.assert_array_equal(recording.effort, rows[good, 1])
    for name, count in signals.items():
        assert recording.signals[name].value.size == pytest.approx(count, abs=3)
