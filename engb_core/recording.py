# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One run of a brake as aligned arrays, cleaned of what a recorder can do to samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.errors import InputError
from engb_core.repeated_stamps import one_stamp_each, usual_interval

__all__ = ['Recording', 'Reference', 'Signal', 'refuse_copies', 'refuse_new_start']

Array = NDArray[np.float64]

# Fewer samples than this hold no motion that could be judged.
MINIMUM_SAMPLES = 20
# From so many usual steps between two samples on, one is missing there: half a step of jitter.
MISSING = 1.5
# A recording is judged on an even grid as fine as its samples. Of one with pauses most of that
# grid is not known; where less than this part of it was sampled, the pauses are the recording.
SAMPLED = 0.01


@dataclass(frozen=True)
class Signal:
    """A side signal on its own clock.

    Attributes:
        time: (k,) [s], from the recording's first sample.
        value: (k,) [SI units]: disc_speed [rad/s], pad_temperature [°C].
    """

    time: Array
    value: Array

    def at(self, time: Array) -> Array:
        """Return the signal (n,) [its unit] at `time`, linearly interpolated, held at both ends.

        Args:
            time: (n,) [s], from the recording's first sample.
        """
        return np.interp(time, self.time, self.value)


@dataclass(frozen=True)
class Reference:
    """What the controller tracked.

    Attributes:
        time: (k,) [s], on the clock of the recording.
        position: (k,) [rad].
        velocity: (k,) [rad/s], None where it was not recorded.
        effort: (k,) [N·m], the feedforward torque; None where it was not recorded.
    """

    time: Array
    position: Array
    velocity: Array | None = None
    effort: Array | None = None


@dataclass(frozen=True)
class Recording:
    """A cleaned run. All angles are motor angles, all torques motor-side (contract, section 1).

    Attributes:
        name: the recording's name, for reports.
        time: (n,) [s], strictly increasing, 0 at the first sample.
        position: (n,) [rad].
        effort: (n,) [N·m], torque constant times measured current; NaN where none was recorded.
        velocity: (n,) [rad/s], or None where the drive gave none.
        reference: what the controller tracked, or None.
        signals: side signals by topic name, e.g. 'disc_speed' [rad/s], 'pad_temperature' [°C].
        start: [s] the first sample's stamp on the recorder's clock.
        joint: the joint's name in the messages.
        notes: what was repaired on the way here, a sentence each.
    """

    name: str
    time: Array
    position: Array
    effort: Array
    velocity: Array | None = None
    reference: Reference | None = None
    signals: dict[str, Signal] = field(default_factory=dict)
    start: float = 0.0
    joint: str = 'motor'
    notes: tuple[str, ...] = ()

    @classmethod
    def from_samples(
        cls,
        name: str,
        time: ArrayLike,
        position: ArrayLike,
        effort: ArrayLike | None,
        velocity: ArrayLike | None = None,
        reference: Reference | None = None,
        signals: dict[str, Signal] | None = None,
        joint: str = 'motor',
        notes: tuple[str, ...] = (),
        source: str = '',
    ) -> Recording:
        """Sort, drop what is doubled or not finite, and start the clock at the first sample.

        Args:
            name: for reports; each recording of a diagnosis needs its own.
            time: (n,) [s], on any clock.
            position: (n,) motor angle [rad].
            effort: (n,) motor torque [N·m]; None: none was recorded (`effort_recorded`).
            velocity: (n,) [rad/s], None where the drive gave none.
            reference: what was tracked, on the same clock as `time`.
            signals: side signals by name, on the same clock as `time`.
            joint: the joint's name in the messages.
            notes: what was repaired before, a sentence each.
            source: what messages call it, such as its path ('': its name).

        Raises:
            InputError: fewer than 20 usable samples are left.
        """
        stamp = np.asarray(time, float)
        columns = [np.asarray(position, float)]
        if effort is not None:
            columns.append(np.asarray(effort, float))
        if velocity is not None:
            columns.append(np.asarray(velocity, float))
        told = list(notes)
        good = np.isfinite(stamp)
        for column in columns:
            good &= np.isfinite(column)
        if not good.all():
            told.append(f'{int((~good).sum())} samples with a value that is not finite left out')
        order = np.flatnonzero(good)
        if np.any(np.diff(stamp[order]) < 0):
            order = order[np.argsort(stamp[order], kind='stable')]
            told.append('samples out of order were sorted by their stamp')
        kept, spread, repaired = one_stamp_each(stamp[order], [entry[order] for entry in columns])
        order = order[kept]
        told += repaired
        if order.size < MINIMUM_SAMPLES:
            raise InputError(
                f'{source or name}: holds {order.size} usable samples, at least '
                f'{MINIMUM_SAMPLES} are needed; '
                + (f'their stamps differ by {float(np.ptp(stamp[good])):.2g} s in all: check the '
                   'unit of time' if good.sum() >= MINIMUM_SAMPLES else 'record a longer run'))
        start = float(spread[0])
        _refuse_bursts(source or name, spread)
        return cls(
            name=name,
            time=spread - start,
            position=columns[0][order],
            effort=np.full(order.size, np.nan) if effort is None else columns[1][order],
            velocity=columns[-1][order] if velocity is not None else None,
            reference=_shifted_reference(reference, start),
            signals={key: Signal(value.time - start, value.value)
                     for key, value in (signals or {}).items() if value.time.size},
            start=start,
            joint=joint,
            notes=tuple(told),
        )

    @property
    def effort_recorded(self) -> bool:
        """Whether there is an effort: not where a drive logs neither torque nor current."""
        return not bool(np.isnan(self.effort).all())

    @cached_property
    def interval(self) -> float:
        """The usual time between two samples [s], and that between their stamps unless samples
        left a queue in bursts."""
        return usual_interval(self.time)

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return float(self.time[-1])

    def signal(self, name: str) -> Array | None:
        """Return a side signal at the recording's samples (n,) [its unit], None: not recorded.

        Args:
            name: of the signal, such as 'disc_speed'.
        """
        found = self.signals.get(name)
        return None if found is None else found.at(self.time)

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame (n rows), its index `time` [s].

        Columns are `position` [rad], `effort` [N·m], `velocity` [rad/s] where the drive gave one,
        and each side signal at the recording's samples. What was tracked is on a clock of its
        own: `reference`.

        Raises:
            InputError: pandas is not installed.
        """
        from engb_core.frames import data_frame
        return data_frame(self)

    def to_xarray(self, *, prismatic: bool = False) -> Any:
        """Return an xarray.Dataset over `time` (n,), the columns of `to_pandas` as variables.

        Args:
            prismatic: the joint is linear; the attributes `units` then say m, m/s and N.

        Raises:
            InputError: xarray is not installed.
        """
        from engb_core.frames import data_set
        return data_set(self, prismatic)

    def to_arrow(self, *, prismatic: bool = False) -> Any:
        """Return a pyarrow.Table (n rows) of `time` and the columns of `to_pandas`.

        Args:
            prismatic: the joint is linear; the fields' metadata `unit` then says m, m/s and N.

        Raises:
            InputError: pyarrow is not installed.
        """
        from engb_core.frames import arrow_table
        return arrow_table(self, prismatic)

    def between(self, begin: float, end: float, name: str | None = None) -> Recording:
        """Return the part with begin ≤ time < end; its clock starts at its own first sample.

        Args:
            begin, end: [s] from the first sample.
            name: of the part (None: that of the whole).
        """
        part = slice(*np.searchsorted(self.time, [begin, end]))
        first = float(self.time[part][0]) if self.time[part].size else begin
        reference = self.reference
        return replace(
            self, name=name or self.name, time=self.time[part] - first,
            position=self.position[part], effort=self.effort[part],
            velocity=None if self.velocity is None else self.velocity[part],
            reference=None if reference is None else replace(
                reference, time=reference.time - first),
            signals={key: replace(signal, time=signal.time - first)
                     for key, signal in self.signals.items()}, start=self.start + first)


def refuse_new_start(name: str, stamp: ArrayLike) -> None:
    """Raise InputError where time jumps back to run over again what was sampled before: the rows
    of two runs would be mixed up.

    Rows that come late, one by one or as a block that fills a gap, are sorted by their stamp.

    Args:
        name: of the file or the recording.
        stamp: (n,) [s], as its rows come; what is not finite counts as a row, too.
    """
    time = np.asarray(stamp, float)
    rows = np.flatnonzero(np.isfinite(time))
    time = time[rows]
    ends = np.append(np.flatnonzero(np.diff(time) < 0.0) + 1, time.size)
    begins = np.append(0, ends[:-1])
    # Each stretch in order that could be a recording of its own.
    long = [(int(begin), int(end)) for begin, end in zip(begins, ends, strict=True)
            if end - begin >= MINIMUM_SAMPLES]
    for (first, last), (begin, end) in pairwise(long):
        before, behind = time[first:last], time[begin:end]
        if min(_sampled_twice(before, behind), _sampled_twice(behind, before)) >= MINIMUM_SAMPLES:
            row = int(rows[begin]) + 1
            raise InputError(
                f'{name}: time jumps back by {float(before[-1] - behind[0]):.6g} s at row {row} '
                f'of its {np.size(stamp)} rows of numbers, and runs over the same time again: two '
                f'runs, or a counter that wrapped; give rows 1 to {row - 1} and those from {row} '
                'on as recordings of their own')


def _sampled_twice(one: Array, other: Array) -> int:
    """Return how many steps of the samples at `one` (n,) [s], in order, hold a sample of `other`
    (m,), too. Longer steps are gaps, which belong to samples that came late."""
    stamps = np.unique(one)
    steps = np.diff(stamps)
    if not steps.size:
        return 0
    places = np.searchsorted(other, stamps)
    return int(np.count_nonzero((np.diff(places) > 0)
                                & (steps < MISSING * float(np.median(steps)))))


def refuse_copies(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> None:
    """Raise InputError where what is held out has been seen: a copy of a recording that is fitted.

    Args:
        recordings: which may be fitted.
        holdout: on which the result is judged.
    """
    for copy in holdout:
        for run in recordings:
            if np.array_equal(copy.position, run.position) and np.array_equal(
                    copy.effort, run.effort, equal_nan=True):
                raise InputError(f'{copy.name}: holds the same samples as {run.name}, which is '
                                 'fitted; hold out a recording of its own, or none')


def _refuse_bursts(name: str, stamp: Array) -> None:
    """Raise InputError where a recording is bursts of samples with long pauses between them."""
    interval = float(np.median(np.diff(stamp)))
    span = float(stamp[-1] - stamp[0])
    if interval * stamp.size < SAMPLED * span:
        raise InputError(
            f'{name}: {stamp.size} samples {interval:.3g} s apart lie scattered over {span:.3g} '
            's; record without pauses, or give the stretches between them as recordings of '
            'their own')


def _shifted_reference(reference: Reference | None, start: float) -> Reference | None:
    if reference is None or reference.time.size < 2:
        return None
    good = np.isfinite(reference.time) & np.isfinite(reference.position)
    time, keep = np.unique(reference.time[good], return_index=True)

    def pick(values: Array) -> Array:
        picked: Array = values[good][keep]
        return picked if np.isfinite(picked).all() else np.nan_to_num(picked)

    if time.size < 2:
        return None
    return Reference(time - start, pick(reference.position),
                     None if reference.velocity is None else pick(reference.velocity),
                     None if reference.effort is None else pick(reference.effort))
