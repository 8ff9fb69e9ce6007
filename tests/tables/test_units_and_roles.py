# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Titles tell names and units; units and words tell which column is what."""

import pytest

from engb_core.io.tables.open import open_table
from engb_core.io.tables.roles import roles_of
from engb_core.io.tables.units import parse_title, unit_of


@pytest.mark.parametrize(('title', 'name', 'quantity', 'factor'), [
    ('phi [deg]', 'phi', 'angle', 0.0174532925), ('I (A)', 'I', 'current', 1.0),
    ('n/min', 'n/min', 'speed', 0.104719755), ('M/Nm', 'M', 'torque', 1.0),
    ('n/min⁻¹', 'n', 'speed', 0.104719755), ('time_ms', 'time', 'time', 1e-3),
    ('Position in deg', 'Position', 'angle', 0.0174532925),
    ('speed (rad s^-1)', 'speed', 'speed', 1.0), ('Torque [mN·m]', 'Torque', 'torque', 1e-3),
    ('pos [4096/rev]', 'pos', 'angle', 0.00153398079), ('Winkel °', 'Winkel', 'angle', 0.01745329),
])
def test_a_title_tells_name_and_unit(title, name, quantity, factor):
    assert parse_title(title)[0] == name
    unit = unit_of(parse_title(title)[1])
    assert unit.quantity == quantity
    assert unit.factor == pytest.approx(factor)


@pytest.mark.parametrize('title', ['i_q', 'phi_m', 'motor_n', 'q', 'omega [1/s]', 'M_a'])
def test_what_is_no_unit_is_none(title):
    assert unit_of(parse_title(title)[1]) is None


@pytest.mark.parametrize(('titles', 'expected'), [
    ('t [s];phi [deg];I (A)', {'time': 0, 'position': 1, 'effort': 2}),
    ('Zeit;Drehwinkel;Drehzahl;Motorstrom', {'time': 0, 'position': 1, 'effort': 3}),
    ('t/s;phi_soll/deg;phi_ist/deg;M/Nm', {'time': 0, 'reference': 1, 'position': 2, 'effort': 3}),
    ('time;motor_angle [deg];load_angle [deg];i_d [A];i_q [A]',
     {'time': 0, 'position': 1, 'effort': 4}),
])
def test_columns_are_known(tmp_path, titles, expected):
    path = tmp_path / 'a.csv'
    width = titles.count(';') + 1
    path.write_text(titles + '\n' + ''.join(';'.join([str(row)] * width) + '\n'
                                            for row in range(5)), encoding='utf-8')
    chosen = roles_of(open_table(path), {}).chosen
    assert {role: chosen.get(role) for role in expected} == expected


def test_two_that_fit_alike_are_not_guessed(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('t [s],angle1 [deg],angle2 [deg],I [A]\n' + '1,2,3,4\n' * 5)
    found = roles_of(open_table(path), {})
    assert 'position' not in found.chosen
    assert found.unclear['position'] == (1, 2)


def test_a_capital_t_is_no_time_and_what_is_there_twice_is_not_chosen(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('T,t [s],phi [deg],T [Nm],omega1 [rpm],omega2 [rpm]\n' + '0,1,2,3,4,5\n' * 5)
    found = roles_of(open_table(path), {})
    assert found.chosen['time'] == 1 and found.chosen['effort'] == 3
    assert 'velocity' not in found.chosen and 'velocity' not in found.unclear
