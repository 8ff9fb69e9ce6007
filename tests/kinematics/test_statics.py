# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Forces (2)–(13), (44): free bodies solved by sympy, and virtual work, not our formulas."""

from dataclasses import replace
import math

import numpy as np
import pytest
import sympy

from engb_core.errors import InputError
from engb_core.mechanism import statics
from engb_core.mechanism.kinematics import CHOSEN
from engb_core.model import Friction, Model
from engb_core.physics.simulation import BrakePlant

ANGLES = np.linspace(2.0, 21.5, 40)


def test_sign_of_equation_9_from_the_free_bodies():
    push, brake, along, onto, normal = sympy.symbols('F_M F_B F_Px F_Py F_N')
    mu, beta, slope = sympy.symbols('mu beta slope', positive=True)
    solved = sympy.solve([
        push * sympy.cos(beta) + brake - along,            # (2)
        brake - mu * normal,                               # (3)
        push * sympy.sin(beta) + onto - normal,            # (4)
        along - slope * onto,                              # (8)
    ], [push, brake, along, onto], dict=True)[0]
    corrected = (slope - mu) / (sympy.cos(beta) + slope * sympy.sin(beta)) * normal
    assert sympy.simplify(solved[push] - corrected) == 0
    printed = (mu - slope) / (sympy.cos(beta) + slope * sympy.sin(beta)) * normal
    assert sympy.simplify(solved[push] - printed) != 0


@pytest.mark.parametrize('mu', [0.0, 0.249, -0.3])
def test_torque_by_virtual_work(mu):
    """Input work = work on the caliper − work that the disc does on the pad."""
    lossless = replace(CHOSEN, efficiency=1.0)
    step = 1e-4
    ahead, behind = lossless.posture(ANGLES + step), lossless.posture(ANGLES - step)
    force = statics.clamp_force(lossless, ANGLES)
    work = force * (ahead.pad_onto - behind.pad_onto - mu * (ahead.pad_along - behind.pad_along))
    torque = statics.torque_of_clamp_force(lossless, force, ANGLES, mu)
    assert torque == pytest.approx(work / (2 * step), rel=1e-5)


def test_exact_chain_equals_the_free_bodies_at_the_turned_lever():
    """(9)–(11) with γ and w and the cos² of (10), worked out part by part."""
    lossless, mu, angle = replace(CHOSEN, efficiency=1.0), 0.2, 17.0
    p = lossless.posture(angle)
    force = statics.clamp_force(lossless, angle)
    bend = CHOSEN.lever_bend - p.lever_angle
    push = (p.wedge - mu) / (np.cos(bend) + p.wedge * np.sin(bend)) * force
    arm = (CHOSEN.lever_output * math.cos(CHOSEN.lever_bend) + p.pad_onto) / np.cos(bend)
    nut = push * arm * np.cos(p.lever_angle)**2 / CHOSEN.lever_input
    torque = nut * CHOSEN.screw_lead / (2 * math.pi * CHOSEN.gear_ratio)
    assert statics.torque_of_clamp_force(lossless, force, angle, mu) == pytest.approx(torque)


def test_equation_10_as_printed_breaks_virtual_work_by_the_square_of_the_cosine():
    lever, l1, rate, nut = sympy.symbols('theta l_1 omega F', positive=True)
    speed = sympy.diff(l1 * sympy.tan(lever), lever) * rate       # of the nut, from (16)
    printed = nut * l1 * rate                                     # l1'·F·cos θ·ω, from (10)
    assert sympy.simplify(printed / (nut * speed) - sympy.cos(lever)**2) == 0


def test_papers_chain_is_right_at_small_angles_only():
    force = statics.clamp_force(CHOSEN, ANGLES)
    exact = statics.torque_of_clamp_force(CHOSEN, force, ANGLES)
    paper = statics.paper_torque(CHOSEN, force, ANGLES)
    assert (np.diff(np.abs(paper / exact - 1)) > 0).all()
    assert paper[-1] / exact[-1] == pytest.approx(1.03, abs=0.01)
    tiny = replace(CHOSEN, stroke=0.02, clearance=0.0)
    force = statics.clamp_force(tiny, 0.02)
    assert statics.paper_torque(tiny, force, 0.02) == pytest.approx(
        statics.torque_of_clamp_force(tiny, force, 0.02), rel=1e-4)


def test_losses_over_a_cycle_are_what_goes_in_less_what_comes_out():
    angle = np.linspace(2.0, 21.0, 2001)
    force = statics.clamp_force(CHOSEN, angle)
    clamp = statics.torque_of_clamp_force(CHOSEN, force, angle, driving=True)
    release = statics.torque_of_clamp_force(CHOSEN, force, angle, driving=False)
    onto = CHOSEN.posture(angle).pad_onto
    stored = np.trapezoid(force, onto) if hasattr(np, 'trapezoid') else np.trapz(force, onto)
    paid = np.sum(0.5 * (clamp[1:] + clamp[:-1]) * np.diff(angle))
    returned = np.sum(0.5 * (release[1:] + release[:-1]) * np.diff(angle))
    assert paid == pytest.approx(stored / CHOSEN.efficiency, rel=1e-4)
    assert returned == pytest.approx(stored * (2 - 1 / CHOSEN.efficiency), rel=1e-4)
    # As much is lost one way as the other, as the default of back_efficiency says.
    assert paid - stored == pytest.approx(stored - returned, rel=1e-3)


def test_identification_sees_the_efficiency_as_load_dependent_friction():
    scale, gain = statics.efficiency_load_gain(CHOSEN)
    force = statics.clamp_force(CHOSEN, 15.0)
    clamp = statics.torque_of_clamp_force(CHOSEN, force, 15.0)
    release = statics.torque_of_clamp_force(CHOSEN, force, 15.0, driving=False)
    even, odd = (clamp + release) / 2, (clamp - release) / 2
    assert odd == pytest.approx(gain * even)
    assert even == pytest.approx(scale * clamp * CHOSEN.efficiency)


def test_force_torque_and_angle_return_to_where_they_began():
    force = statics.clamp_force(CHOSEN, ANGLES)
    assert statics.motor_angle(CHOSEN, force) == pytest.approx(ANGLES, abs=1e-9)
    for driving in (True, False):
        torque = statics.torque_of_clamp_force(CHOSEN, force, ANGLES, 0.2, driving)
        assert statics.clamp_force_of_torque(CHOSEN, torque, ANGLES, 0.2, driving) \
            == pytest.approx(force)


def test_self_energizing_numbers_of_the_paper():
    """P = 0.421 and μ = 0.249 ask for d/r = 0.430; (44) as printed for a negative one."""
    ratio, mu = sympy.symbols('ratio mu')
    corrected = sympy.solve(sympy.Eq((ratio - mu) / ratio, 0.421), ratio)[0]
    printed = sympy.solve(sympy.Eq(ratio / (ratio - mu), 0.421), ratio)[0]
    assert float(corrected.subs(mu, 0.249)) == pytest.approx(0.430, abs=1e-3)
    assert float(printed.subs(mu, 0.249)) < 0
    assert statics.self_energizing_gain(0.430, 0.249) == pytest.approx(0.421, abs=1e-3)
    value, std = statics.pad_friction(0.421, 0.430, 0.01)
    assert (value, std) == (pytest.approx(0.249, abs=1e-3), pytest.approx(0.0043))


def test_turning_the_other_way_costs_more_torque():
    force = statics.clamp_force(CHOSEN, 15.0)
    torques = [statics.torque_of_clamp_force(CHOSEN, force, 15.0, mu) for mu in (0.25, 0, -0.25)]
    assert torques == sorted(torques)


def test_self_locking_is_refused_with_its_reason():
    with pytest.raises(InputError, match='self-locking'):
        statics.torque_of_clamp_force(CHOSEN, 1000.0, 15.0, 0.4414)
    with pytest.raises(InputError, match='self-locking'):
        statics.self_energizing_gain(0.3, 0.3)
    holding = replace(CHOSEN, efficiency=0.45)
    with pytest.raises(InputError, match='says nothing'):
        statics.clamp_force_of_torque(holding, 0.1, 15.0, driving=False)


def test_clamp_force_beyond_the_stroke_is_refused():
    for force in (-1.0, 1e6):
        with pytest.raises(InputError, match='clamp force'):
            statics.motor_angle(CHOSEN, force)


def test_polynomial_of_the_model_file_is_the_chain():
    found = statics.load_polynomial(CHOSEN, 0.2)
    force = statics.clamp_force(CHOSEN, ANGLES)
    scale, gain = statics.efficiency_load_gain(CHOSEN)
    torque = scale * CHOSEN.efficiency * statics.torque_of_clamp_force(CHOSEN, force, ANGLES, 0.2)
    load = found.load_torque
    assert np.polynomial.polynomial.polyval(ANGLES - load.contact_angle, load.coefficients) \
        == pytest.approx(torque, abs=1e-9)
    assert found.error < 1e-9
    assert found.load_gain == gain


def test_friction_sticks_slides_and_breaks_away():
    level, static = 0.02, 0.03
    args = (level, static, 0.01)
    assert statics.coulomb_friction(1.0, 0.5, *args) == pytest.approx(0.02)
    assert statics.coulomb_friction(-1.0, 0.5, *args) == pytest.approx(-0.02)
    assert statics.coulomb_friction(0.0, 0.013, *args) == pytest.approx(0.013)   # holds exactly
    assert statics.coulomb_friction(0.0, -0.05, *args) == pytest.approx(-0.03)   # breaks away
    net = np.linspace(-0.1, 0.1, 21)
    assert np.abs(statics.coulomb_friction(np.zeros(21), net, *args)).max() == static


@pytest.mark.parametrize('speed', [0.0, 30.0, -30.0])
def test_plant_runs_the_mechanism(speed):
    """What holds the simulated brake at an angle is what the chain asks for, both disc ways."""
    mu, angle = 0.2, 15.0
    model = statics.mechanism_load(Model(friction=Friction(0.0, 0.0, 0.01)), CHOSEN, mu)
    plant = BrakePlant(model, position=angle)
    sign = np.sign(speed)
    scale, _ = statics.efficiency_load_gain(CHOSEN)
    force = statics.clamp_force(CHOSEN, angle)
    load = float(scale * CHOSEN.efficiency * statics.torque_of_clamp_force(
        CHOSEN, force, angle, sign * mu))
    plant.advance(load, 0.05, disc_speed=speed)
    assert abs(plant.velocity) < 0.02
    assert plant.load_torque == pytest.approx(load, rel=0.02)
