# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb predict`: arrays for a recording's samples."""

import numpy as np

from engb_core.io.bags.read import read_recording
from engb_core.model import Controller, Model, Motor


def test_effort_and_closed_loop(engb, bag, tmp_path):
    controller = Controller(0.05, 0.2, 0.002, 0.6)
    Model(controller=controller).write(tmp_path / 'loop.yaml')
    Model().write(tmp_path / 'open.yaml')
    recording = read_recording(bag)
    for name, expected in (('open', {'time', 'effort'}),
                           ('loop', {'time', 'effort', 'position', 'velocity'})):
        outcome = engb('predict', bag, '--model', f'{name}.yaml', '--out', f'deep/{name}.npz')
        assert (outcome.status, outcome.err) == (0, ''), outcome
        assert f'{recording.time.size} samples' in outcome.out
        with np.load(f'deep/{name}.npz') as arrays:
            assert set(arrays) == expected
            np.testing.assert_allclose(arrays['time'], recording.time)
            for array in arrays.values():
                assert array.shape == recording.time.shape
                assert np.isfinite(array).all()
            error = arrays['effort'] - recording.effort
        assert np.sqrt(np.mean(error ** 2)) < 0.2 * np.std(recording.effort) + 0.01
    assert sorted(entry.name for entry in (tmp_path / 'deep').iterdir()) == ['loop.npz',
                                                                              'open.npz']


def test_an_unstable_loop_takes_no_effort_away(engb, bag, tmp_path):
    """Slow motion tells nothing of the inertia: a refit of it may leave next to none."""
    Model(motor=Motor(inertia=1e-17), controller=Controller(0.05, 0.2, 0.002, 0.6)).write(
        tmp_path / 'light.yaml')
    outcome = engb('predict', bag, '--model', 'light.yaml', '--out', 'light.npz')
    assert outcome.status == 0, outcome
    assert 'the closed loop is not stable; position and velocity are left out' in outcome.out
    with np.load('light.npz') as arrays:
        assert set(arrays) == {'time', 'effort'}
        assert np.isfinite(arrays['effort']).all()
