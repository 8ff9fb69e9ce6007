# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A recording is cleaned of what a recorder can do to samples, and says so."""

from __future__ import annotations

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.recording import Recording, Reference, Signal

START = 1.7e9


def samples(size: int = 200) -> dict[str, np.ndarray]:
    time = START + 0.001 * np.arange(size)
    position = np.linspace(0.0, 3.0, size) ** 2
    return {'time': time, 'position': position, 'effort': 0.1 * np.sin(position),
            'velocity': np.cos(position)}


def test_good_samples_stay_as_they_are():
    given = samples()
    recording = Recording.from_samples('run', **given)
    assert recording.start == START
    assert recording.time[0] == 0.0
    np.testing.assert_allclose(recording.time, given['time'] - START)
    for name in ('position', 'effort', 'velocity'):
        np.testing.assert_array_equal(getattr(recording, name), given[name])
    assert recording.notes == ()
    assert recording.interval == pytest.approx(0.001, rel=1e-3)
    assert recording.duration == pytest.approx(0.199)


def test_a_drive_without_velocity():
    given = samples() | {'velocity': None}
    assert Recording.from_samples('run', **given).velocity is None


def test_disorder_is_sorted():
    given = samples()
    order = np.random.default_rng(1).permutation(given['time'].size)
    recording = Recording.from_samples('run', **{name: value[order]
                                                 for name, value in given.items()})
    np.testing.assert_array_equal(recording.position, given['position'])
    np.testing.assert_array_equal(recording.effort, given['effort'])
    assert len(recording.notes) == 1
    assert 'out of order' in recording.notes[0]


def test_doubled_samples_are_left_out():
    given = samples()
    rows = np.sort(np.r_[np.arange(200), 7, 8, 9])
    recording = Recording.from_samples('run', **{name: value[rows]
                                                 for name, value in given.items()})
    np.testing.assert_array_equal(recording.position, given['position'])
    assert recording.notes == ('3 samples with a stamp seen before left out',)


@pytest.mark.parametrize('rounded', [np.floor, np.round])
def test_no_sample_is_lost_where_the_time_has_too_few_digits(rounded):
    # 0.01 s at 1 kHz: ten samples share a stamp, and many are alike where the shaft stands.
    given = samples(2000)
    given['position'] = np.maximum(given['position'] - 1.0, 0.0)
    given['effort'] = np.where(given['position'] > 0.0, given['effort'], 0.1)
    given['velocity'] = np.where(given['position'] > 0.0, given['velocity'], 0.0)
    place = np.arange(2000)
    recording = Recording.from_samples('run', **(given | {
        'time': START + rounded(0.1 * place + 0.01) / 100.0}))
    np.testing.assert_array_equal(recording.position, given['position'])
    off = recording.time - 0.001 * place
    assert np.std(off[10:-10]) < 1e-4
    assert np.all(np.diff(recording.time) > 0.0)
    assert 'samples share the stamp of another one' in recording.notes[0]
    assert len(recording.notes) == 1


def test_samples_that_leave_a_queue_at_once_are_all_there():
    given = samples(1000)
    late = given['time'].copy()
    for first in range(50, 950, 100):
        late[first:first + 4] = late[first + 3]
    recording = Recording.from_samples('run', **(given | {'time': late}))
    np.testing.assert_allclose(recording.time, given['time'] - START, atol=1e-6)


def test_a_pause_before_rounded_stamps_stays_one():
    given = samples(2000)
    rows = np.r_[np.arange(800), np.arange(1400, 2000)]
    recording = Recording.from_samples('run', **{
        name: (np.floor((value - START) * 100.0) / 100.0 if name == 'time' else value)[rows]
        for name, value in given.items()})
    step = np.diff(recording.time)
    assert step.max() == pytest.approx(0.6, abs=0.01)
    assert np.sort(step)[-2] < 2.5e-3


@pytest.mark.parametrize('column', ['time', 'position', 'effort', 'velocity'])
@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_are_left_out(column, value):
    given = samples()
    given[column] = given[column].copy()
    given[column][[20, 50]] = value
    recording = Recording.from_samples('run', **given)
    assert recording.time.size == 198
    for name in ('time', 'position', 'effort', 'velocity'):
        assert np.isfinite(getattr(recording, name)).all()
    assert recording.notes == ('2 samples with a value that is not finite left out',)


def test_everything_at_once():
    given = samples()
    rng = np.random.default_rng(2)
    rows = rng.permutation(np.r_[np.arange(200), rng.integers(0, 200, 40)])
    mixed = {name: value[rows].copy() for name, value in given.items()}
    mixed['effort'][::50] = np.nan
    recording = Recording.from_samples('run', **mixed, notes=('cut off at the end',))
    assert np.all(np.diff(recording.time) > 0)
    assert recording.notes[0] == 'cut off at the end'
    assert len(recording.notes) == 4
    expected = np.interp(recording.time, given['time'] - START, given['position'])
    np.testing.assert_allclose(recording.position, expected, atol=1e-3)


@pytest.mark.parametrize('usable', [0, 1, 19])
def test_too_few_samples(usable):
    given = samples(40)
    given['position'][usable:] = np.nan
    with pytest.raises(InputError, match=f'run: holds {usable} usable samples'):
        Recording.from_samples('run', **given)
    with pytest.raises(InputError):
        Recording.from_samples('run', **samples(usable))


def test_twenty_samples_are_enough():
    assert Recording.from_samples('run', **samples(20)).time.size == 20


def test_reference_and_signals_share_the_clock():
    given = samples()
    clock = START + 0.01 * np.arange(30) - 0.05
    reference = Reference(clock, np.sin(clock), np.cos(clock), np.full(30, np.nan))
    signals = {'disc_speed': Signal(clock, np.arange(30.0)),
               'pad_temperature': Signal(np.empty(0), np.empty(0))}
    recording = Recording.from_samples('run', **given, reference=reference, signals=signals)
    np.testing.assert_allclose(recording.reference.time[0], -0.05, atol=1e-6)
    np.testing.assert_array_equal(recording.reference.velocity, np.cos(clock))
    assert np.isfinite(recording.reference.effort).all()
    assert set(recording.signals) == {'disc_speed'}
    np.testing.assert_allclose(recording.signal('disc_speed')[[0, -1]], [5.0, 24.9], atol=1e-4)
    assert recording.signal('pad_temperature') is None


def test_reference_in_disorder():
    given = samples()
    clock = START + np.array([0.02, 0.0, 0.01, 0.01, np.nan, 0.03])
    reference = Reference(clock, np.array([2.0, 0.0, 1.0, 1.0, 9.0, np.nan]))
    recording = Recording.from_samples('run', **given, reference=reference)
    np.testing.assert_allclose(recording.reference.time, [0.0, 0.01, 0.02], atol=1e-6)
    np.testing.assert_array_equal(recording.reference.position, [0.0, 1.0, 2.0])
    lone = Reference(clock[:1], np.zeros(1))
    assert Recording.from_samples('run', **given, reference=lone).reference is None


def test_a_signal_is_held_at_its_ends():
    signal = Signal(np.array([1.0, 2.0]), np.array([5.0, 7.0]))
    np.testing.assert_array_equal(signal.at(np.array([0.0, 1.5, 9.0])), [5.0, 6.0, 7.0])


def test_a_part_begins_its_own_clock():
    given = samples()
    reference = Reference(given['time'], given['position'])
    whole = Recording.from_samples('run', **given, reference=reference, signals={
        'disc_speed': Signal(given['time'], np.arange(given['time'].size, dtype=float))})
    part = whole.between(0.0495, 0.0995, 'part')
    assert (part.name, part.time.size) == ('part', 50)
    np.testing.assert_array_equal(part.position, whole.position[50:100])
    assert part.time[0] == 0.0
    assert part.start == pytest.approx(START + 0.05, abs=1e-6)
    assert part.reference is not None
    np.testing.assert_allclose(np.interp(part.time, part.reference.time, part.reference.position),
                               whole.position[50:100], atol=1e-6)
    np.testing.assert_allclose(part.signal('disc_speed'), np.arange(50, 100), atol=1e-3)
    assert whole.time[50] == pytest.approx(0.05)


def test_stamps_in_a_wrong_unit_are_told():
    """Nanoseconds taken for seconds: all samples fall on a few stamps."""
    time = np.repeat(np.arange(10) * 1e-9, 30)
    with pytest.raises(InputError, match='9e-09 s in all: check the unit of time'):
        Recording.from_samples('run', time, time, time)
