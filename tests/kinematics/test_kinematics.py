# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Geometry (14)–(24), held against the equations as sympy reads them and against itself."""

from dataclasses import replace
import math

import numpy as np
import pytest
import sympy

from engb_core.errors import InputError
from engb_core.mechanism.kinematics import CHOSEN, Mechanism

ANGLES = np.linspace(-1.0, CHOSEN.stroke, 47)


def test_posture_satisfies_the_implicit_equation():
    p = CHOSEN.posture(ANGLES)
    l2, beta = CHOSEN.lever_output, CHOSEN.lever_bend
    r, d = CHOSEN.gear_radius, CHOSEN.gear_offset
    along = l2 * math.sin(beta) - (l2 * math.cos(beta) + p.pad_onto) * np.tan(
        beta - p.lever_angle)
    assert p.pad_along == pytest.approx(along, abs=1e-15)
    assert p.pad_along == pytest.approx(
        2 * (d * (1 - np.cos(p.gear_angle)) + r * p.gear_angle), abs=1e-15)
    assert p.pad_onto == pytest.approx(2 * d * np.sin(p.gear_angle), abs=1e-15)


def test_ratio_is_the_derivative_of_the_pad_travel():
    step = 1e-4
    inner = ANGLES[1:-1]
    for posture in (CHOSEN.posture, CHOSEN.small_angle_posture):
        numeric = (posture(inner + step).pad_onto - posture(inner - step).pad_onto) / (2 * step)
        assert posture(inner).ratio == pytest.approx(numeric, rel=1e-6)


def test_wedge_is_the_slope_of_the_pads_path():
    p = CHOSEN.posture(np.linspace(0.0, 22.0, 4001))
    numeric = np.gradient(p.pad_onto, p.pad_along)
    assert p.wedge[1:-1] == pytest.approx(numeric[1:-1], rel=1e-6)
    assert p.wedge[0] == pytest.approx(CHOSEN.gear_offset / CHOSEN.gear_radius)


def test_chain_backwards_returns_the_motor_angle():
    onto = CHOSEN.posture(ANGLES).pad_onto
    assert CHOSEN.motor_angle_of_pad(onto) == pytest.approx(ANGLES, abs=1e-9)


def test_gear_turns_the_screw_slower_as_power_demands():
    # (11) divides the screw's torque by N_g on the way to the motor; the speeds must then
    # stand the other way, or power would come from nowhere: (14) as printed fails here.
    torque_ratio = 1.0 / CHOSEN.gear_ratio
    speed_ratio = CHOSEN.screw_angle(8.0) / 8.0
    assert torque_ratio == pytest.approx(speed_ratio)
    assert 2 * CHOSEN.nut_travel(math.pi * CHOSEN.gear_ratio) == pytest.approx(CHOSEN.screw_lead)


def test_small_angle_form_solves_the_linearised_equations():
    r, d, l2, beta, lever, gear = sympy.symbols('r d l2 beta lever gear', positive=True)
    equation = sympy.Eq(2 * r * gear, l2 * sympy.sin(beta) - (
        l2 * sympy.cos(beta) + 2 * d * gear) * sympy.tan(beta - lever))
    solved = sympy.solve(equation, gear)[0]
    numbers = {r: CHOSEN.gear_radius, d: CHOSEN.gear_offset, l2: CHOSEN.lever_output,
               beta: CHOSEN.lever_bend}
    for angle in (3.0, 12.0, 21.0):
        expected = solved.subs(numbers).subs(lever, float(CHOSEN.lever_angle(angle)))
        assert CHOSEN.small_angle_posture(angle).gear_angle == pytest.approx(float(expected))


def test_small_angle_error_grows_over_the_stroke_and_stays_small():
    exact, small = CHOSEN.posture(ANGLES), CHOSEN.small_angle_posture(ANGLES)
    error = np.abs(small.pad_onto - exact.pad_onto)[ANGLES > 0]
    assert (np.diff(error) > 0).all()
    assert error[-1] / exact.pad_onto[-1] < 0.02
    assert math.degrees(exact.gear_angle[-1]) < 5.0


def test_solution_is_safe_over_many_geometries():
    rng = np.random.default_rng(2)
    solved = 0
    for _ in range(200):
        radius = rng.uniform(5e-3, 30e-3)
        try:
            mechanism = Mechanism(
                rng.uniform(1, 10), rng.uniform(1e-3, 8e-3), rng.uniform(20e-3, 100e-3),
                rng.uniform(15e-3, 80e-3), rng.uniform(0, 1.2), radius,
                radius * rng.uniform(0.05, 0.95), 0.9, 0.0, (1e6,), rng.uniform(5, 60))
        except InputError:
            continue
        angle = np.linspace(0, mechanism.stroke, 31)
        onto = mechanism.posture(angle).pad_onto
        assert (np.diff(onto) > 0).all()
        assert mechanism.motor_angle_of_pad(onto) == pytest.approx(angle, abs=1e-6)
        solved += 1
    assert solved > 50


@pytest.mark.parametrize(('change', 'word'), [
    ({'gear_ratio': 0.0}, 'gear_ratio'), ({'screw_lead': -1e-3}, 'screw_lead'),
    ({'lever_bend': 1.5}, 'lever_bend'), ({'efficiency': 1.2}, 'efficiency'),
    ({'gear_offset': 11e-3}, 'overlap'), ({'clearance': -1e-4}, 'clearance'),
    ({'clamp_stiffness': (-1e6,)}, 'clamp_stiffness'), ({'clamp_stiffness': ()}, 'clamp_stiff'),
    ({'stroke': 500.0}, 'jam|non-circular'), ({'gear_radius': math.nan}, 'gear_radius'),
    ({'back_efficiency': 1.5}, 'back_efficiency')])
def test_bad_geometry_is_refused_by_name(change, word):
    with pytest.raises(InputError, match=word):
        replace(CHOSEN, **change)


@pytest.mark.parametrize('angle', [23.0, -5.0, math.nan])
def test_angle_outside_the_stroke_is_refused(angle):
    with pytest.raises(InputError, match='stroke'):
        CHOSEN.posture([1.0, angle])


def test_pad_travel_beyond_the_gear_is_refused():
    with pytest.raises(InputError, match='pad travel'):
        CHOSEN.motor_angle_of_pad(0.02)
