# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The truth plant obeys mechanics."""
from __future__ import annotations

import numpy as np
import pytest

from tests.proof.effects_drive import delivered, RING
from tests.proof.plant_record import blank_plant
from tests.proof.references import Reference, short_test
from tests.proof.truth_plant import Run, simulate


def plant_of(**numbers: float) -> np.ndarray:
    """A middling brake with some numbers changed."""
    plant = blank_plant()
    base = {'inertia': 6.8e-5, 'viscous': 1.1e-3, 'coulomb': 0.012, 'gain': 0.1, 'kp': 0.4,
            'ki': 1.5, 'kd': 0.0055, 'limit': 0.75, 'ff_inertia': 6.8e-5, 'ff_viscous': 1.1e-3}
    plant['load'] = (0.002, 2.3e-3, 1.2e-4, 1.8e-6)
    for name, value in {**base, **numbers}.items():
        plant[name] = value
    return plant


@pytest.fixture(scope='module')
def reference() -> Reference:
    return short_test(np.random.default_rng(4), plain=False)


def surplus(run: Run) -> float:
    """Energy supplied that went nowhere, relative to all that was turned over."""
    supplied, *spent = run.work
    return (supplied - sum(spent)) / np.abs(run.work).sum()


TRAIN = {'far_inertia': 2e-5, 'far_coulomb': 0.008, 'stiffness': 20.0, 'damping': 8e-3}


@pytest.mark.parametrize(('name', 'numbers', 'tolerance'), [
    ('plain', {}, 1e-9),
    ('soft sign', {'saturation': 1.0}, 1e-9),
    ('gap', {'train_kind': 1, 'gap': 0.4, **TRAIN}, 1e-6),
    ('shaft', {'train_kind': 3, **TRAIN}, 1e-6),
    ('bristle', {'bristle_kind': 1, 'bristle_length': 0.2}, 1e-6),
])
def test_energy_balances(reference: Reference, name: str, numbers: dict, tolerance: float) -> None:
    run = simulate(plant_of(**numbers), reference)
    assert run.steady
    assert abs(surplus(run)) < tolerance


def test_equation_of_motion_holds_where_it_moves(reference: Reference) -> None:
    plant = plant_of()
    run = simulate(plant, reference)
    s, moves = run.position, np.abs(run.velocity) > 2.0
    load = 0.002 + s * (2.3e-3 + s * (1.2e-4 + s * 1.8e-6))
    needed = (6.8e-5 * run.acceleration + 1.1e-3 * run.velocity + load
              + (0.012 + 0.1 * np.abs(load)) * np.sign(run.velocity))
    assert np.abs(run.effort - needed)[moves].max() < 1e-3
    assert np.sqrt(np.mean((run.effort - needed)[moves] ** 2)) < 1e-4


def test_shaft_truly_sticks(reference: Reference) -> None:
    run = simulate(plant_of(), reference)
    assert np.mean(run.velocity[:500] == 0.0) == 1.0
    assert np.mean(run.velocity == 0.0) > 0.05


def test_finer_steps_change_little(reference: Reference) -> None:
    coarse = simulate(plant_of(), reference, substeps=20)
    fine = simulate(plant_of(), reference, substeps=80)
    assert np.abs(coarse.position - fine.position).max() < 5e-3


def test_gap_lets_the_motor_run_free(reference: Reference) -> None:
    tight = simulate(plant_of(train_kind=1, gap=0.0, **TRAIN), reference)
    loose = simulate(plant_of(train_kind=1, gap=2.0, **TRAIN), reference)
    base = simulate(plant_of(), reference)
    low = reference.position < 4.0
    moves = low & (np.abs(reference.velocity) > 1.0)
    assert np.abs(tight.effort - base.effort)[moves].mean() \
        < 0.5 * np.abs(loose.effort - base.effort)[moves].mean()


@pytest.mark.parametrize('kind', [1, 2, 3, 4])
def test_lag_delays_the_torque_by_its_time(kind: int) -> None:
    plant, dt = plant_of(lag_kind=kind, lag=4e-3), 5e-5
    states, ring = np.zeros(2), np.zeros(RING)
    torque = [delivered(plant[0], states, ring, i, 1.0, 0.0, 0.0, dt) for i in range(2000)]
    assert torque[-1] == pytest.approx(1.0, rel=1e-4)
    assert np.sum(1.0 - np.array(torque)) * dt == pytest.approx(4e-3, rel=0.03)
