# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Step tests, sweeps, the torque constant, self-energizing; on the test bench."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from engb_core.errors import InputError
from engb_core.identify.nominal_plant import (
    fit_free_motor,
    fit_response,
    fit_steps,
    frequency_response,
    torque_constant,
)
from engb_core.identify.output_error import fit_output_error
from engb_core.identify.procedure import identify
from engb_core.identify.self_energizing import compare_paper_way, fit_together
from engb_core.mechanism.kinematics import CHOSEN

from .bench import PAPER, simulate, stroke_reference

FREE = {'load': (0.0,) * 4, 'gain': 0.0, 'coulomb': 0.004, 'saturation': 0.5}
TORQUE = 4 * 0.0174


def open_loop(torque, **truth):
    rest = np.zeros((3, torque.size))
    return simulate(rest, FREE | truth, noise=1e-3, open_loop=torque)


def steps():
    return np.tile(np.repeat([1.0, -1.0, 0.5, -0.5], 400), 2) * TORQUE


@pytest.fixture(scope='module')
def sweep():
    time = np.arange(12000) * 1e-3
    return open_loop(TORQUE * signal.chirp(time, 0.0, 12.0, 10.0, phi=-90))


def test_step_test_finds_j_and_b_and_their_classical_bias():
    recording = open_loop(steps())
    fits, linear = fit_steps(recording)
    assert len(fits) >= 6
    assert linear.inertia.value == pytest.approx(6.813e-5, rel=0.15)
    # Coulomb friction counts as viscous in the classical reading.
    assert linear.viscous_friction.value > 1.02 * 1.125e-3
    joint = fit_free_motor([recording])
    assert joint.values['inertia'] == pytest.approx(6.813e-5, rel=0.02)
    assert joint.values['viscous_friction'] == pytest.approx(1.125e-3, rel=0.02)
    assert joint.values['coulomb'] == pytest.approx(0.004, rel=0.05)


def test_output_error_finds_a_linear_motor_and_takes_friction_for_drag():
    linear = fit_output_error([open_loop(steps(), coulomb=0.0)])
    for found, name in ((linear.inertia, 'inertia'), (linear.viscous_friction, 'viscous')):
        assert found.value == pytest.approx(PAPER[name], rel=0.005)
        assert 0.0 < found.std < 0.01 * PAPER[name]
    rubbing = fit_output_error([open_loop(steps())])
    assert rubbing.viscous_friction.value > 1.05 * PAPER['viscous']
    with pytest.raises(InputError, match='does not move'):
        fit_output_error([open_loop(np.zeros(2000))])


def test_sweep_gives_the_response_of_the_linear_motor(sweep):
    data = frequency_response([sweep])
    assert (data.coherence[(data.frequency > 1) & (data.frequency < 9)] > 0.95).all()
    linear = fit_response(data)
    assert linear.inertia.value == pytest.approx(6.813e-5, rel=0.05)
    assert linear.viscous_friction.value == pytest.approx(1.125e-3, rel=0.4)
    joint = fit_free_motor([sweep])
    assert joint.values['viscous_friction'] == pytest.approx(1.125e-3, rel=0.03)


def test_added_inertia_gives_the_torque_constant():
    """Torque recorded with 0.0174 N·m/A where the motor truly gives 0.0160."""
    share = 0.0160 / 0.0174
    bare, loaded = (fit_free_motor([replace(run, effort=run.effort / share)]).estimates['inertia']
                    for run in (open_loop(steps()), open_loop(steps(), inertia=12e-5)))
    found = torque_constant(bare, loaded, 12e-5 - 6.813e-5, 0.0174)
    assert found.value == pytest.approx(0.0160, rel=0.03)
    with pytest.raises(InputError, match='added inertia'):
        torque_constant(bare, bare, 1e-5, 0.0174)


def test_runs_that_show_nothing_are_refused():
    still = open_loop(np.zeros(1500))
    with pytest.raises(InputError, match='steps'):
        fit_steps(still)
    with pytest.raises(InputError, match='long enough'):
        frequency_response([open_loop(np.zeros(500))])


def test_self_energizing_gain_and_pad_friction():
    standing = identify([simulate(stroke_reference(count=2), seed=1, name='standing')])
    eased = {'load': tuple(0.421 * value for value in PAPER['load'])}
    turning = identify([simulate(stroke_reference(count=2), eased, seed=2, name='turning')])
    found = fit_together(standing, turning, CHOSEN)
    # The bench's load falls by one factor throughout; the wedge that is fitted falls by 3 %.
    assert found.gain.value == pytest.approx(0.421, abs=0.01)
    assert found.gain.std < 0.01
    assert found.pad_friction.value == pytest.approx(0.249, abs=0.012)
    with pytest.raises(InputError, match='name them differently'):
        fit_together(standing, standing, CHOSEN)
    paper = compare_paper_way(standing.paper.load, turning.paper.parts, 0.430, 20.0)
    assert paper.gain.value == pytest.approx(0.421, abs=0.03)
    assert turning.model.friction.coulomb == pytest.approx(0.012, rel=0.1)
