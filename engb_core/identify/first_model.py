# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The first model of any axis: inertia, friction, offset, and the load that the data determine.

The torque balance (1) is linear in its numbers once the form of the load is chosen:

    u = J·ω̇ + B·ω + C·sat(ω/ω_s) + T_L(θ),

with T_L constant (an offset), a polynomial of θ, a polynomial from a contact on, or a sinusoid.
Both sides pass the same low-pass (filtering.py), and standstill carries no weight.

Which form the data determine is decided by prediction, not by a limit on the fit: the recordings
are cut into blocks of time, each block is predicted by a fit to all others, and forms are compared
by the mean square of what they are off on blocks that they had not seen. Of the forms that are no
worse than the best by more than one standard error of the blocks' differences the one with the
fewest numbers is taken (Breiman et al. 1984, section 3.4.3: the 1-SE rule). What every form is off
alike (a gear's play in one violent stretch) cancels in these differences; a normal density by what
the fit leaves within had weighed such a block the more the better a form is elsewhere.
Uncertainties are those of the delete-a-block jackknife, which coloured residuals do not make too
small (Efron and Tibshirani 1993, chapter 11). The best of a dozen forms is ahead of none by more
than one standard error in 9 of 27 tables of a simulated bench without a load; so the level of the
rule is shared among the forms (Bonferroni) unless a form leaves clearly smaller errors on unseen
blocks.

Each load is weighed beside friction that grows with it, too: where a gear has much of it, what it
leaves in every form hid that a straight line is no pendulum. What then helps may be that friction
alone, as it differs from place to place or falls as a drive warms up: each such friction is
weighed without its load, too, so that a load stands only for what it explains itself. The model
has no such friction: it is for a diagnosis to name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear, minimize_scalar
from scipy.stats import t as student

from engb_core.errors import InputError
from engb_core.identify.found_model import FirstModel, FormScore, Number
from engb_core.identify.load_forms import contact_form, FilteredColumns, load_forms, LoadForm
from engb_core.identify.load_numbers import load_units, load_values
from engb_core.identify.reversed_effort import reversed_effort
from engb_core.model import Friction, Joint, Model, Motor
from engb_core.physics.plant import load_torques, physics_of
from engb_core.recording import Recording
from engb_core.signals.filtering import (
    comparison_of,
    low_passed_noise,
    noise_of,
    slowest_speed,
)
from engb_core.signals.held_effort import between_polls, effort_as_taken, EFFORT_TAKEN
from engb_core.signals.motion import motion_of
from engb_core.signals.plausibility import refuse_unmeasured

__all__ = ['FirstModel', 'FormScore', 'Number', 'first_model']

Array = NDArray[np.float64]

# Blocks of time that are predicted in turn. Ten are usual; shorter than a stroke they would hold
# no motion of their own.
BLOCKS, SHORTEST_BLOCK = 10, 0.5
# Corner of the comparison [Hz], and as a part of the sampling rate, as in a diagnosis.
BANDWIDTH, OF_RATE = 20.0, 0.1
LEAST_POINTS = 40
CONTACT_DEGREES = (1, 2, 3)
# Places between the ends of the stroke that are tried as a contact.
CONTACTS = 40
# Part of the motion at either end of the stroke that is too little to tell a contact by.
EDGE = 0.02
# A block left out moves a contact by no more of their distances.
ELSEWHERE = 3.0
# What chance alone puts further ahead than one standard error, of one form beside another.
ONE_ERROR = 0.159
# Mean square on unseen blocks, as a part of a plainer form's, from which on a form is clearly
# better, in however few blocks the load shows; as in a diagnosis.
HELPS = 0.9
# Fits in which the load and the friction in proportion to it settle: the latter is a part of the
# former, so that each round leaves a small part of the error of the one before.
LOAD_ROUNDS = 4
# A value is determined if it is this many standard deviations from none.
SURE = 2.0


def first_model(recordings: Sequence[Recording], joint: Joint | None = None,
                torque_constant: float | None = None,
                progress: Callable[[str], None] | None = None) -> FirstModel:
    """Identify a first model.

    Args:
        recordings: of one axis.
        joint: its name and type (None: a revolute one of the recordings' name).
        torque_constant: [N·m/A], written into the model (None: the model's usual one).
        progress: is told what is being done.

    Raises:
        InputError: too little motion, or a recording that can be one of no axis.
    """
    tell = progress or (lambda text: None)
    joint = joint or Joint(name=recordings[0].joint)
    refuse_unmeasured(recordings, joint)
    tell('reading the motion')
    recordings = [effort_as_taken(recording) for recording in recordings]
    data = _data(recordings, joint)
    _refuse_reversed(data, recordings[0].name)
    tell('weighing forms of the load')
    scored = _scored(data, joint)
    best = form = _chosen(scored)
    beside = best.beside is not None
    if beside and not best.has_load:
        # The friction, which is not in the model, explains it all: what is left has no load.
        form = next(plain for plain, _ in scored if plain.names == best.names)
    shown = [pair for pair in scored
             if pair[0].beside is None or pair[0].has_load or pair[0] is best]
    scores = tuple(_score(entry, found, scored) for entry, found in
                   sorted(shown, key=lambda pair: (pair[0] is not form, pair[0] is not best)))
    form = replace(form, beside=None)
    fit = _solve(data, form, np.ones(data.effort.size, bool))
    model = _model(fit, form, data, joint, torque_constant)
    numbers = _numbers(data, form, fit, model)
    predicted = _design(data, form) @ fit
    told = between_polls(recordings) + _not_told(data, form, numbers, scores, joint)
    if beside:
        kind = ('that grows with the load' if form.has_load else
                'that differs from place to place or changes with time')
        told.insert(0, f'friction {kind}: stretches left out of the fit are predicted better '
                       'with it; it is not in the model, so that a diagnosis can name it')
    if not fit[0] > 0.0:
        # A model needs one; the largest that the data leave room for is harmless.
        model = replace(model, motor=replace(model.motor, inertia=max(
            2.0 * numbers['inertia'].std, 1e-12)))
    return FirstModel(
        model, numbers, scores, tuple(told),
        float(np.sqrt(np.mean((data.effort - predicted) ** 2))), data.noise, data.position,
        data.velocity, data.acceleration, data.effort, predicted, data.time)


def _data(recordings: Sequence[Recording], joint: Joint) -> FilteredColumns:
    motions = [motion_of(recording) for recording in recordings]
    speed = max(motion.speed for motion in motions)
    # At which speed friction turns is for a diagnosis to find: here it is below what is judged.
    slowest = slowest_speed(motions, 0.0, speed)
    bandwidth = min(BANDWIDTH, *(OF_RATE / recording.interval for recording in recordings))
    runs = [(motion, comparison_of(motion, bandwidth, slowest)) for motion in motions]
    parts: dict[str, list[Array]] = {name: [] for name in (
        'acceleration', 'velocity', 'direction', 'position', 'effort', 'time', 'block')}
    noises = []
    blocks = 0
    length = max(sum(float(motion.time[-1]) for motion in motions) / BLOCKS, SHORTEST_BLOCK)
    for recording, (motion, comparison) in zip(recordings, runs, strict=True):
        time = motion.time[comparison.grid]
        columns = {'acceleration': motion.acceleration, 'velocity': motion.velocity,
                   'direction': np.sign(motion.velocity), 'position': motion.position,
                   'effort': motion.effort}
        for name, values in columns.items():
            parts[name].append(comparison(values))
        parts['time'].append(time)
        count = max(1, round(float(motion.time[-1]) / length))
        parts['block'].append(blocks + np.minimum(
            (time / motion.time[-1] * count).astype(int), count - 1))
        blocks += count
        stride = max(1, round(0.8 / bandwidth / motion.step))
        noises.append(
            noise_of(recording.signals[EFFORT_TAKEN].value) if motion.fresh is not None else
            low_passed_noise(motion, comparison, stride)
            or noise_of(recording.effort) * comparison.noise_gain_whole)
    joined: dict[str, Any] = {name: np.concatenate(values) for name, values in parts.items()}
    if joined['effort'].size:
        # Numbers of blocks without a gap: some hold no motion.
        joined['block'] = np.unique(joined['block'], return_inverse=True)[1]
    if joined['effort'].size < LEAST_POINTS or joined['block'].max() < 2:
        raise InputError(f'{recordings[0].name}: too little motion for a model; record several '
                         'strokes in both directions, some slow and some fast')
    return FilteredColumns(**joined, noise=float(np.sqrt(np.mean(np.square(noises)))),
                           runs=tuple(runs), slowest=slowest)


def _refuse_reversed(data: FilteredColumns, name: str) -> None:
    explained = reversed_effort(data)
    if explained is not None:
        raise InputError(
            f'{name}: effort works against the motion, as if its sign were the wrong one: an axis '
            f'explains {max(explained[0], 0.0):.0%} of it as it stands and {explained[1]:.0%} '
            'turned round. Turn it (--scale effort=-1, or record it so), if no other machine '
            'drives this axis')


def _design(data: FilteredColumns, form: LoadForm) -> Array:
    columns = [np.stack([data.acceleration, data.velocity, data.direction], axis=1), form.columns]
    return np.concatenate(columns if form.beside is None else [*columns, form.beside], axis=1)


def _solve(data: FilteredColumns, form: LoadForm, rows: NDArray[np.bool_]) -> Array:
    """Return the numbers by least squares; inertia and frictions are never negative."""
    design = _design(data, form)[rows]
    scale = np.sqrt(np.mean(design ** 2, axis=0))
    scale[scale == 0.0] = 1.0
    low = np.full(design.shape[1], -np.inf)
    low[:3] = 0.0
    if form.beside is not None:
        low[-1] = 0.0
    found = lsq_linear(design / scale, data.effort[rows], (low, np.inf), method='bvls')
    values: Array = found.x / scale
    return values


@dataclass(frozen=True)
class _Unseen:
    """Errors where no fit saw them: `squares` (blocks,), their sum in each block predicted by a
    fit to all others [(N·m)²], and `counts` (blocks,) of values."""

    squares: Array
    counts: Array

    @property
    def mean_square(self) -> float:
        """Of all of them [(N·m)²]."""
        return float(self.squares.sum() / self.counts.sum())


def _unseen(data: FilteredColumns, form: LoadForm) -> _Unseen:
    design = _design(data, form)
    blocks = int(data.block.max()) + 1
    squares, counts = np.empty(blocks), np.empty(blocks)
    for block in range(blocks):
        out = data.block == block
        error = data.effort[out] - design[out] @ _solve(data, form, ~out)
        squares[block], counts[block] = float(error @ error), error.size
    return _Unseen(squares, counts)


Scored = list[tuple[LoadForm, _Unseen]]


def _scored(data: FilteredColumns, joint: Joint) -> Scored:
    scored = [(form, _unseen(data, form)) for form in load_forms(data, joint)]
    low = np.quantile(data.position, EDGE)
    whole = np.ones(data.effort.size, bool)
    places = low + _stride(data) * np.arange(1, CONTACTS + 1)
    for degree in CONTACT_DEGREES:
        best = places[np.argmin([_left(data, contact_form(data, float(place), degree), whole)
                                 for place in places])]
        # Between the places that were tried: half a step beside it a further term would pay.
        form = _contact(data, degree, whole, best - _stride(data), best + _stride(data))
        scored.append((form, _unseen(data, form)))
    for form in [form for form, _ in scored if form.name not in ('none', 'offset')]:
        form = _beside_friction(data, form)
        scored += [(each, _unseen(data, each)) for each in (form, *_friction_alone(form))]
    return scored


def _stride(data: FilteredColumns) -> float:
    """Return how far the places lie apart that are tried as a contact [rad]."""
    low, high = np.quantile(data.position, [EDGE, 1.0 - EDGE])
    return float(high - low) / (CONTACTS + 1)


def _left(data: FilteredColumns, form: LoadForm, rows: NDArray[np.bool_]) -> float:
    return float(np.sum((data.effort[rows] - _design(data, form)[rows]
                         @ _solve(data, form, rows)) ** 2))


def _contact(data: FilteredColumns, degree: int, rows: NDArray[np.bool_], low: float,
             high: float) -> LoadForm:
    """Return the contact within two places with which a fit to some rows leaves least."""
    found = minimize_scalar(
        lambda place: _left(data, contact_form(data, float(place), degree), rows),
        bounds=(low, high), method='bounded').x
    return contact_form(data, float(found), degree)


def _beside_friction(data: FilteredColumns, form: LoadForm) -> LoadForm:
    """Return the form with a column of friction in proportion to its load. Which load that is
    follows from a fit beside the column of the load before, begun with the load alone."""
    whole = np.ones(data.effort.size, bool)
    beside = replace(form, name=form.name + ' beside friction that grows with it',
                     extra=form.extra + 1)
    for _ in range(LOAD_ROUNDS):
        load = form.load(_solve(data, beside, whole)[3:3 + form.columns.shape[1]])
        nominal = physics_of(Model(load_torque=load)).nominal
        beside = replace(beside, beside=np.concatenate([
            comparison(np.sign(motion.velocity) * np.abs(load_torques(nominal, motion.position)))
            for motion, comparison in data.runs])[:, None])
    return beside


def _friction_alone(beside: LoadForm) -> list[LoadForm]:
    """Return what a load beside friction has to be better than: that friction without the load,
    with an offset and without."""
    return [replace(beside, name=f'{name} beside friction over the position ({beside.name})',
                    columns=np.ones((beside.columns.shape[0], count)), names=(name,) * count)
            for name, count in (('none', 0), ('offset', 1))]


def _chosen(scored: Scored) -> LoadForm:
    """Return the form with the fewest numbers that is as good as the best: within one standard
    error, or within what the best of so many forms is ahead by chance, where it leaves no clearly
    smaller errors."""
    best = _best(scored)
    by_chance = float(student.ppf(1.0 - ONE_ERROR / max(len(scored) - 1, 1),
                                  best.squares.size - 1))
    near = []
    for form, unseen in scored:
        behind, error = _behind(best, unseen)
        if behind <= error or (behind <= by_chance * error
                               and best.mean_square > HELPS * unseen.mean_square):
            near.append((form.columns.shape[1] + form.extra, unseen.mean_square, form))
    return min(near, key=lambda entry: entry[:2])[2]


def _best(scored: Scored) -> _Unseen:
    return min((unseen for _, unseen in scored), key=lambda unseen: unseen.mean_square)


def _behind(best: _Unseen, other: _Unseen) -> tuple[float, float]:
    """Return by which part of the best one's a form's mean square is larger, and the standard
    error of that over the blocks; what both are off alike cancels."""
    blocks, counts = best.squares.size, best.counts
    more = other.squares - best.squares
    mean = float(more.sum() / counts.sum())
    spread = float(np.sum((more - mean * counts) ** 2)) * blocks / (blocks - 1)
    scale = max(best.mean_square, 1e-300)
    return mean / scale, math.sqrt(spread) / float(counts.sum()) / scale


def _score(form: LoadForm, found: _Unseen, scored: Scored) -> FormScore:
    behind, error = _behind(_best(scored), found)
    return FormScore(form.name, form.columns.shape[1] + form.extra, behind, error,
                     math.sqrt(found.mean_square))


def _numbers(data: FilteredColumns, form: LoadForm, fit: Array, model: Model,
             ) -> dict[str, Number]:
    """Return the numbers as the model file has them, with the standard deviations that leaving
    out one block of time after another tells."""
    joint, load = model.joint, model.load_torque
    angle, torque = ('rad', 'N·m') if joint.type == 'revolute' else ('m', 'N')
    units = {'inertia': 'kg·m²' if joint.type == 'revolute' else 'kg',
             'viscous_friction': f'{torque}·s/{angle}', 'coulomb': torque,
             **load_units(form, load, joint)}
    found = []
    for block in range(int(data.block.max()) + 1):
        rows, mine = data.block != block, form
        if load.contact_angle is not None:
            # Where the contact lies follows from the same blocks.
            apart = ELSEWHERE * _stride(data)
            mine = _contact(data, len(form.names), rows, load.contact_angle - apart,
                            load.contact_angle + apart)
        fitted = _solve(data, mine, rows)
        found.append(np.concatenate([fitted[:3], load_values(mine, fitted[3:], load)]))
    spread = np.sum((np.array(found) - np.mean(found, axis=0)) ** 2, axis=0)
    deviations = np.sqrt((len(found) - 1) / len(found) * spread)
    values = np.concatenate([fit[:3], load_values(form, fit[3:], load)])
    numbers = {name: Number(float(value), float(std), unit, abs(value) > SURE * std)
               for (name, unit), value, std in zip(units.items(), values, deviations,
                                                   strict=True)}
    # Of an angle nought is a value as any other: it is known where the load is.
    sure = any(numbers[name].determined for name in numbers
               if name == 'amplitude' or name[1:].isdigit())
    return {name: replace(number, determined=sure) if name in ('phase', 'contact_angle')
            else number for name, number in numbers.items()}


def _model(fit: Array, form: LoadForm, data: FilteredColumns, joint: Joint,
           torque_constant: float | None) -> Model:
    motor = Motor(inertia=float(fit[0]), viscous_friction=float(fit[1]))
    if torque_constant is not None:
        motor = replace(motor, torque_constant=torque_constant)
    return Model(motor=motor, load_torque=form.load(fit[3:]),
                 friction=Friction(coulomb=float(fit[2]), load_gain=0.0,
                                   saturation_velocity=0.5 * data.slowest), joint=joint)


def _not_told(data: FilteredColumns, form: LoadForm, numbers: dict[str, Number],
              scores: Sequence[FormScore], joint: Joint) -> list[str]:
    told = []
    words = {'inertia': 'the inertia: what it needs is too small beside the rest; record faster '
                        'starts',
             'viscous_friction': 'viscous friction: what changes with speed is too small beside '
                                 'the rest; record slow and fast strokes',
             'coulomb': 'Coulomb friction: it is too small beside the rest; record slow strokes '
                        'in both directions'}
    for name, text in words.items():
        if not numbers[name].determined:
            told.append(f'{text} ({numbers[name].value:.2g} ± {numbers[name].std:.2g} '
                        f'{numbers[name].unit})')
    if form.name == 'none':
        told.append('an offset or a load: stretches left out of the fit are predicted as '
                    'well without them')
    elif form.name == 'offset':
        told.append('a load that changes over the stroke: a constant predicts stretches '
                    'left out of the fit as well')
    others = [score.form for score in scores[1:]
              if score.behind <= score.error and not score.form.startswith(
                  ('none', 'offset', form.name))]
    if others and form.has_load:
        told.append(f'the form of the load for sure: as good are {", ".join(others)}')
    both = [float(np.mean(np.sign(data.velocity) > 0)), float(np.mean(np.sign(data.velocity) < 0))]
    if min(both) < 0.05:
        told.append('friction and offset apart: the axis moves in one direction only')
    if 'offset' in form.names:
        # c₊·[ω>0] − c₋·[ω<0] is a constant and a Coulomb friction, whatever the speeds.
        told.append('an offset apart from friction that differs between the directions: while '
                    'the axis moves they are one and the same, and the model has the offset')
    unit = 'rad/s' if joint.type == 'revolute' else 'm/s'
    told.append(f'friction below {data.slowest:.2g} {unit}: there the shaft may stand')
    return told
