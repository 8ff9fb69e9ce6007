# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a table leaves open is asked, told by other columns, or refused in a line."""

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.tables.measure import measured_of
from engb_core.io.tables.request import Request

TIME = np.arange(400) * 0.01
ANGLE = 1.2 * np.sin(2.0 * TIME)                # rad
SPEED = 2.4 * np.cos(2.0 * TIME)                # rad/s
TORQUE = 0.3 * np.cos(2.0 * TIME + 0.2)         # N·m


def csv(folder, **columns):
    """Write a table; a title's name and unit are parted by two underscores."""
    path = folder / 'bench.csv'
    titles = [name.replace('__', ' [') + ']' if '__' in name else name for name in columns]
    rows = np.column_stack(list(columns.values()))
    path.write_text(','.join(titles) + '\n' + ''.join(
        ','.join(f'{value:.9g}' for value in row) + '\n' for row in rows))
    return path


def npz(folder, **columns):
    path = folder / 'bench.npz'
    np.savez(path, **columns)
    return path


def test_questions_are_put_one_after_the_other_and_the_answers_are_taken(tmp_path):
    path = csv(tmp_path, t__s=TIME, channel1=np.degrees(ANGLE), channel2=5.0 * TORQUE)
    answers = {'--column position=': 'channel1', '--column effort=': 'channel2',
               '--unit position=': 'deg', '--unit effort=': 'A', '--torque-constant ': '0,2'}
    put = []

    def ask(question):
        put.append(' '.join(question.words))
        return answers[put[-1]]

    measured, request = measured_of(path, Request(ask=ask))
    assert put == list(answers)
    np.testing.assert_allclose(measured.columns['position'], ANGLE, atol=1e-7)
    np.testing.assert_allclose(measured.columns['effort'], TORQUE, atol=1e-7)
    again, _ = measured_of(path, Request(
        columns=request.columns, units=request.units, torque_constant=request.torque_constant))
    np.testing.assert_array_equal(again.columns['effort'], measured.columns['effort'])


def test_samples_without_time_get_it_from_the_answered_rate(tmp_path):
    path = csv(tmp_path, phi__rad=ANGLE, M__Nm=TORQUE)
    measured, request = measured_of(path, Request(ask=lambda question: '100'))
    assert request.rate == 100.0
    np.testing.assert_allclose(measured.time, TIME, atol=1e-12)


def test_an_empty_answer_is_told_with_the_option_that_would_give_it(tmp_path):
    path = csv(tmp_path, phi__rad=ANGLE, M__Nm=TORQUE)
    with pytest.raises(InputError, match=r'no column of time is needed; give --rate 1000'):
        measured_of(path, Request(ask=lambda question: '  '))


def test_an_answer_that_cannot_be_taken_is_asked_for_again(tmp_path):
    path = csv(tmp_path, t__s=TIME, channel1=np.degrees(ANGLE), channel2=5.0 * TORQUE)
    answers = iter(['channel9', 'channel1', 'channel2', 'grad celsius', 'N', 'counts', 'deg', 'A',
                    'much', '0.2'])
    put = []

    def ask(question):
        put.append((' '.join(question.words), question.refused))
        return next(answers)

    measured, request = measured_of(path, Request(ask=ask))
    np.testing.assert_allclose(measured.columns['position'], ANGLE, atol=1e-7)
    assert request.units == {'position': 'deg', 'effort': 'A'} and request.torque_constant == 0.2
    for asked, words in (('--column position=', "no column 'channel9'"),
                         ('--unit position=', 'not a known unit'),
                         ('--unit position=', 'position cannot be a force'),
                         ('--unit position=', 'such as 4096/rev'),
                         ('--torque-constant ', 'must be a number above 0')):
        assert [entry for entry in put if entry[0] == asked and words in entry[1]], (asked, words)
    assert len(put) == 10


@pytest.mark.parametrize('answer', ['-1', '0', 'fast', 'inf'])
def test_a_rate_that_is_none_is_refused(tmp_path, answer):
    path = csv(tmp_path, phi__rad=ANGLE, M__Nm=TORQUE)
    with pytest.raises(InputError, match=f'--rate {answer}: must be a number above 0'):
        measured_of(path, Request(ask=lambda question: answer))


@pytest.mark.parametrize(('columns', 'request_', 'words'), [
    ({'t__s': TIME, 'phi__rad': ANGLE, 'M__Nm': TORQUE}, {'units': {'position': 'N'}},
     'position cannot be a force (column phi [rad] [rad])'),
    ({'t__s': TIME, 'x__mm': 1e3 * ANGLE, 'M__Nm': TORQUE}, {},
     'position is a length and effort a torque'),
    ({'t__s': TIME, 'phi__rad': ANGLE, 'F__kN': TORQUE}, {},
     'position is an angle and effort a force'),
    ({'t__s': TIME, 'pos__counts': 4096 * ANGLE, 'M__Nm': TORQUE}, {},
     'how many counts of position (column pos [counts]) make one turn'),
    ({'t__s': 0.0 * TIME + 3.0, 'phi__rad': ANGLE, 'M__Nm': TORQUE}, {},
     'time never changes'),
    ({'t__s': np.nan * TIME, 'phi__rad': ANGLE, 'M__Nm': TORQUE}, {},
     'column t [s] holds no numbers at all'),
    ({'t__s': TIME, 'phi__rad': ANGLE, 'M__Nm': TORQUE},
     {'rate': 100.0, 'columns': {'time': 't'}}, '--rate and --column time=… exclude each other'),
    ({'t__s': TIME, 'x__mm': ANGLE, 'I__A': TORQUE}, {}, 'the force constant [N/A] of the motor'),
])
def test_what_does_not_fit_together_is_told(tmp_path, columns, request_, words):
    with pytest.raises(InputError) as told:
        measured_of(csv(tmp_path, **columns), Request(**request_))
    assert words in str(told.value)


def test_an_optional_column_in_counts_is_left_out(tmp_path):
    """Nobody is asked for what is not needed."""
    path = csv(tmp_path, t__s=TIME, phi__rad=ANGLE, M__Nm=TORQUE, phi_soll__counts=4096 * ANGLE)
    measured, _ = measured_of(path, Request())
    assert set(measured.columns) == {'position', 'effort'}


@pytest.mark.parametrize(('factor', 'spelt'), [
    (1.0, 'rad'), (57.29578, 'deg'), (0.1591549, 'rev')])
def test_a_position_without_unit_gets_it_from_the_velocity(tmp_path, factor, spelt):
    path = csv(tmp_path, t__s=TIME, position=factor * ANGLE, n__rpm=SPEED * 30.0 / np.pi,
               M__Nm=TORQUE)
    measured, _ = measured_of(path, Request())
    np.testing.assert_allclose(measured.columns['position'], ANGLE, atol=1e-6)
    assert f'position: column position, taken as {spelt}' in measured.told


def test_a_travel_without_unit_gets_it_from_the_velocity(tmp_path):
    path = csv(tmp_path, t__s=TIME, position=1e3 * ANGLE, v__m_s=SPEED, F__N=TORQUE)
    path.write_text(path.read_text().replace('m_s', 'm/s'))
    measured, _ = measured_of(path, Request())
    assert measured.joint_type == 'prismatic'
    np.testing.assert_allclose(measured.columns['position'], ANGLE, atol=1e-6)


@pytest.mark.parametrize('columns', [
    {'position': 3.3 * ANGLE},                      # no usual unit fits
    {'position': 0.0 * ANGLE},                      # never moves
    {'position': np.cos(7.0 * TIME)},               # another motion
    {'position': np.where(TIME < 3.9, np.nan, ANGLE)},    # hardly a sample
])
def test_a_velocity_that_tells_no_unit_leaves_it_to_be_asked(tmp_path, columns):
    path = csv(tmp_path, t__s=TIME, **columns, n__rpm=SPEED * 30.0 / np.pi, M__Nm=TORQUE)
    with pytest.raises(InputError, match='does not tell the unit of position'):
        measured_of(path, Request())


def test_a_velocity_of_another_length_tells_no_unit(tmp_path):
    path = npz(tmp_path, t_s=TIME, position=ANGLE, M_Nm=TORQUE, n_rpm=SPEED[::2])
    with pytest.raises(InputError, match='does not tell the unit of position'):
        measured_of(path, Request())


def test_too_few_samples_tell_no_unit_of_time_and_are_taken_in_seconds(tmp_path):
    path = csv(tmp_path, t=TIME[:2], phi__rad=ANGLE[:2], M__Nm=TORQUE[:2])
    measured, _ = measured_of(path, Request())
    assert measured.time.tolist() == [0.0, 0.01]


@pytest.mark.parametrize(('factor', 'spelt'), [(1.0, 's'), (1e3, 'ms'), (1e6, 'us')])
def test_steps_tell_the_unit_of_time(tmp_path, factor, spelt):
    path = csv(tmp_path, t=factor * TIME, phi__rad=ANGLE, M__Nm=TORQUE)
    measured, _ = measured_of(path, Request())
    np.testing.assert_allclose(measured.time, TIME, atol=1e-9)
    assert measured.told[0] == f'time: column t, taken as {spelt}'


def test_columns_of_different_length_are_told(tmp_path):
    path = npz(tmp_path, t_s=TIME, phi_rad=ANGLE, M_Nm=TORQUE[:-1])
    with pytest.raises(InputError, match=r'different length \(effort 399, time 400\)'):
        measured_of(path, Request())


def test_groups_have_clocks_of_their_own_and_meet_on_the_slower_one(tmp_path):
    path = npz(tmp_path, **{'fast/t_s': TIME, 'fast/phi_rad': ANGLE,
                            'slow/t_s': TIME[::4], 'slow/M_Nm': TORQUE[::4]})
    measured, _ = measured_of(path, Request())
    np.testing.assert_allclose(measured.time, TIME[::4])
    np.testing.assert_allclose(measured.columns['position'], ANGLE[::4])
    assert measured.notes == ('signals of several rates (position 100 Hz, effort 25 Hz) brought '
                              'onto the clock of effort',)


def test_groups_that_never_meet_are_told(tmp_path):
    path = npz(tmp_path, **{'fast/t_s': TIME, 'fast/phi_rad': ANGLE,
                            'slow/t_s': TIME + 100.0, 'slow/M_Nm': TORQUE[:]})
    with pytest.raises(InputError, match='never recorded at the same time'):
        measured_of(path, Request())


def test_a_signal_of_one_sample_is_told(tmp_path):
    effort = np.full(TIME.size, np.nan)
    effort[7] = 1.0
    path = csv(tmp_path, t__s=TIME, phi__rad=np.where(np.arange(400) == 7, np.nan, ANGLE),
               M__Nm=effort)
    with pytest.raises(InputError, match='fewer than two samples'):
        measured_of(path, Request())


def test_an_angle_that_wraps_at_a_turn_is_unwrapped(tmp_path):
    turning = 5.0 * TIME
    path = csv(tmp_path, t__s=TIME, phi__rad=turning % (2.0 * np.pi), M__Nm=TORQUE)
    measured, _ = measured_of(path, Request())
    np.testing.assert_allclose(measured.columns['position'], turning, atol=1e-6)
    assert measured.notes == ('position jumps by a turn 3 times: unwrapped',)


def test_an_angle_of_a_turn_without_jumps_stays(tmp_path):
    path = csv(tmp_path, t__s=TIME, phi__rad=np.pi * np.sin(TIME * 2.0), M__Nm=TORQUE)
    measured, _ = measured_of(path, Request())
    assert measured.notes == ()
    assert np.ptp(measured.columns['position']) == pytest.approx(2.0 * np.pi, rel=1e-3)


def test_a_question_of_another_kind_is_a_fault_of_the_program():
    with pytest.raises(ValueError, match='no question is answered by --rites'):
        Request().told('--rites', '', '1')


def test_times_with_too_few_digits_lose_no_row(tmp_path):
    fine = np.arange(4000) * 0.001
    angle = 1.2 * np.sin(2.0 * fine)
    path = csv(tmp_path, t__s=np.floor(fine * 100.0) / 100.0, phi__rad=angle,
               M__Nm=0.3 * np.cos(2.0 * fine), reference__rad=angle + 0.01)
    measured, _ = measured_of(path, Request(ask=None))
    np.testing.assert_allclose(measured.columns['position'], angle, atol=1e-7)
    assert np.std((measured.time - fine)[20:-20]) < 1e-4
    recording = measured.recording()
    assert recording.time.size == fine.size
    assert any('share the stamp of another' in note for note in recording.notes)
    # What was tracked has the times of its rows.
    np.testing.assert_allclose(recording.reference.time, recording.time, atol=1e-12)
