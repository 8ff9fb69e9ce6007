# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Tables in other languages and of other loggers: encodings, words, units, bars and labels."""

import math

import pytest

from engb_core.io.tables.open import open_table
from engb_core.io.tables.roles import roles_of
from engb_core.io.tables.units import parse_title, unit_of

from .foreign_benches import FOREIGN_TABLES, Machine, measured

ROWS = ''.join(f'{0.001 * k:.4f},{k},{k % 7},{k % 5}\n' for k in range(40))


def _chosen(path):
    return roles_of(open_table(path), {}).chosen


@pytest.mark.parametrize(('title', 'expected'), [
    ('tiempo (s),consigna (grados),ángulo (grados),corriente (mA)', (0, 2, 3)),
    ('tempo [s],corrente [A],posizione [giri],velocità [rpm]', (0, 2, 1)),
    ('czas [s],kąt [stopnie],prąd,prędkość [rpm]', (0, 1, 2)),
    ('tijd [s],hoek,koppel [Nm],snelheid', (0, 1, 2)),
    ('tid,vinkel,ström,hastighet', (0, 1, 2)),
    ('čas,poloha,proud,rychlost', (0, 1, 2)),
    ('tempo (s),posição (graus),corrente (A),velocidade', (0, 1, 2)),
    ('時間[ms],指令角度[deg],実角度[deg],トルク[N･m]', (0, 2, 3)),
    ('时间(秒),目标位置(度),电机位置(度),电流(安)', (0, 2, 3)),
    ('시간[s],각도[deg],토크[N·m],속도', (0, 1, 2)),
    ('время,угол,ток,скорость', (0, 1, 2)),
])
def test_other_languages_tell_what_is_what(tmp_path, title, expected):
    path = tmp_path / 'a.csv'
    path.write_text(title + '\n' + ROWS, encoding='utf-8')
    chosen = _chosen(path)
    assert tuple(chosen.get(role) for role in ('time', 'position', 'effort')) == expected


@pytest.mark.parametrize(('encoding', 'title'), [
    ('cp932', '時間[ms],指令角度[deg],実角度[deg],トルク[N･m]'),
    ('gb18030', '时间(秒),目标位置(度),电机位置(度),电流(安)'),
    ('cp949', '시간[s],목표각도[deg],각도[deg],전류[A]'),
    ('cp1251', 'время [с],задание [град],угол [град],ток [А]'),
    ('cp1250', 'čas [s],zadana poloha [°],położenie [°],prąd [A]'),
    ('cp1252', 'Zeit [s],Soll-Winkel [°],Winkel [°],Motorström [A]'),
    ('utf-16', '時間[ms],指令角度[deg],実角度[deg],トルク[N･m]'),
])
def test_the_encoding_is_the_one_in_which_words_are_known(tmp_path, encoding, title):
    path = tmp_path / 'a.csv'
    path.write_bytes((title + '\n' + ROWS).encode(encoding))
    table = open_table(path)
    assert [channel.name for channel in table.channels] == title.split(',')
    assert _chosen(path) == {'time': 0, 'reference': 1, 'position': 2, 'effort': 3}


@pytest.mark.parametrize(('text', 'quantity', 'factor'), [
    ('grados', 'angle', math.radians(1)), ('stopnie', 'angle', math.radians(1)),
    ('tr', 'angle', 2 * math.pi), ('giri', 'angle', 2 * math.pi), ('度', 'angle', math.radians(1)),
    ('弧度', 'angle', 1.0), ('秒', 'time', 1.0), ('毫秒', 'time', 1e-3), ('安', 'current', 1.0),
    ('毫安', 'current', 1e-3), ('牛·米', 'torque', 1.0), ('N･m', 'torque', 1.0),
    ('転', 'angle', 2 * math.pi), ('in', 'length', 0.0254), ('转/分', 'speed', math.pi / 30),
    ('с', 'time', 1.0), ('А', 'current', 1.0), ('Н·м', 'torque', 1.0),
    ('об/мин', 'speed', math.pi / 30),
])
def test_units_of_other_languages(text, quantity, factor):
    unit = unit_of(text)
    assert unit is not None and (unit.quantity, unit.factor) == (quantity, pytest.approx(factor))


@pytest.mark.parametrize('title', ['voltage_in', 'count_in', 'cur_tr', 'power in'])
def test_what_only_looks_like_a_unit_is_none(title):
    assert unit_of(parse_title(title)[1]) is None


def test_a_line_that_names_the_separator_is_no_title(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('sep=;\nt [s];phi [deg];I [A]\n' + ROWS.replace(',', ';'))
    assert _chosen(path) == {'time': 0, 'position': 1, 'effort': 2}


def test_bars_may_stand_around_the_rows_too(tmp_path):
    path = tmp_path / 'a.txt'
    path.write_text('| t [s] | phi [deg] | I [A] |\n|:---|---:|---|\n' + ''.join(
        f'| {0.01 * k:.2f} | {k} | {k % 7} |\n' for k in range(30)))
    table = open_table(path)
    assert [channel.name for channel in table.channels] == ['t [s]', 'phi [deg]', 'I [A]']
    assert table.read([1])[1].value[:4].tolist() == [0.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize('sign', [':', '='])
@pytest.mark.parametrize('delimiter', [',', '\t', ' ', ', '])
def test_each_number_may_have_its_label(tmp_path, sign, delimiter):
    path = tmp_path / 'a.log'
    path.write_text(''.join(delimiter.join(
        (f't_ms{sign}{k}', f'pos_deg{sign}{k % 11:.2f}', f'cur_mA{sign}{-k % 7}')) + '\n'
        for k in range(30)))
    table = open_table(path)
    assert [channel.name for channel in table.channels] == ['t_ms', 'pos_deg', 'cur_mA']
    assert _chosen(path) == {'time': 0, 'position': 1, 'effort': 2}
    found = table.read([0, 2])
    assert found[0].value.tolist() == list(range(30))
    assert found[2].value[:3].tolist() == [0.0, 6.0, 5.0]


def test_times_of_day_are_no_labels(tmp_path):
    path = tmp_path / 'a.csv'
    path.write_text('time,phi [deg],I [A]\n' + ''.join(
        f'10:15:{k:06.3f},{k},{k % 7}\n' for k in range(30)))
    table = open_table(path)
    assert [channel.name for channel in table.channels] == ['time', 'phi [deg]', 'I [A]']
    assert table.read([0])[0].value[3] - table.read([0])[0].value[0] == pytest.approx(3.0)


@pytest.mark.parametrize('title', ['Elapsed time (h:mm:ss)', 'Time [hh:mm:ss.000]', 'Time (ms)'])
def test_a_clock_is_in_seconds_whatever_its_title_says(tmp_path, title):
    path = tmp_path / 'a.csv'
    path.write_text(f'{title},Position (in),Force (lbf)\n' + ''.join(
        f'0:00:{0.002 * k:09.6f},{k},{k % 7}\n' for k in range(30)))
    table = open_table(path)
    assert table.channels[0].unit == 's'
    assert _chosen(path) == {'time': 0, 'position': 1, 'effort': 2}


@pytest.mark.parametrize('table', FOREIGN_TABLES, ids=lambda table: table.name)
def test_the_ten_tables_are_understood_with_two_questions_at_most(tmp_path, table):
    assert table.questions <= 2
    path = tmp_path / table.name
    run = measured(Machine(duration=0.6), 0, table.every)
    table.write(path, run)
    chosen = _chosen(path)
    assert {'time', 'position', 'effort'} <= set(chosen)
    values = open_table(path).read(chosen.values())
    assert all(samples.value.size == run['t'].size for samples in values.values())


def test_a_row_of_units_may_be_labelled_as_such(tmp_path):
    """As National Instruments' loggers write a time before each channel."""
    path = tmp_path / 'a.csv'
    path.write_text('Interval,0.001,Interval,0.001\nChannel name,Torque,Channel name,Angle\n'
                    'Unit,N·m,Unit,deg\n'
                    + ''.join(f'{0.001 * k:.4f},{k % 7},{0.001 * k:.4f},{k % 11}\n'
                              for k in range(40)))
    assert [(channel.name, channel.unit) for channel in open_table(path).channels] == [
        ('time', 's'), ('Torque', 'N·m'), ('time', 's'), ('Angle', 'deg')]
    assert _chosen(path) == {'time': 0, 'effort': 1, 'position': 3}
