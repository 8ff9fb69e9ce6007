# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Every number that the paper publishes beside ours, and whence ours comes."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.identify.confidence import Estimate
from engb_core.reproduce.results import BrakeResults, Results
from engb_core.reproduce.validation_chapter import compensated_share, worst_offset

__all__ = ['Found', 'FOUND', 'FOLLOWS', 'Number', 'published_numbers', 'SET']

# Whence a number comes. SET: the brake was made with it, so that finding it says nothing of the
# paper. FOUND: identified from the recordings, of a brake that was not made with it. FOLLOWS:
# comes out of physics that was not tuned to it.
SET, FOUND, FOLLOWS = 'set', 'found', 'follows'


@dataclass(frozen=True)
class Found:
    """One brake's number.

    Attributes:
        value: from the recordings; `low`, `high` its 95 % interval, NaN where it has none.
        word: SET, FOUND or FOLLOWS.
        truth: of the simulated brake; None where it has no such number.
    """

    value: float
    word: str
    low: float = math.nan
    high: float = math.nan
    truth: float | None = None


@dataclass(frozen=True)
class Number:
    """One number.

    Attributes:
        name: what it is.
        unit: '' or '-' where it has none.
        paper: as published; None where the paper gives none.
        form, more: of the brake of the model's form, and of that with more physics.
        remark: one sentence.
    """

    name: str
    unit: str
    paper: float | None
    form: Found
    more: Found
    remark: str = ''


def published_numbers(results: Results) -> list[Number]:
    """Return the numbers in the order of the paper."""
    both = [_of_one(brake) for brake in results.brakes]
    return [Number(name, unit, paper, form, more, remark)
            for (name, unit, paper, form, remark), (_, _, _, more, _)
            in zip(*both, strict=True)]


Row = tuple[str, str, float | None, Found, str]


def _of_one(brake: BrakeResults) -> list[Row]:
    return [*_nominal(brake), *_friction(brake), *_validation(brake), *_disc(brake)]


def _nominal(brake: BrakeResults) -> list[Row]:
    nominal, joint = brake.nominal, brake.nominal.joint.estimates
    motor, settings = brake.truth.model.motor, brake.truth.settings
    form = brake.name == 'form'
    rows: list[Row] = [_row(
        'K_T, from an added inertia', 0.0174, nominal.torque_constant, SET if form else FOUND,
        settings.torque_constant, 'Table 1; the drive reckons with 0.0174, the second brake’s '
        'magnet is weaker')]
    for symbol, paper, name, truth in (
            ('J', 6.813e-5, 'inertia', motor.inertia),
            ('B', 1.125e-3, 'viscous_friction', motor.viscous_friction)):
        steps, sweep = getattr(nominal.linear_steps, name), getattr(nominal.linear_sweep, name)
        rows += [
            _row(f'{symbol}, classical step test', paper, steps, SET if form else FOLLOWS, truth,
                 'the first brake’s true J and B are such that this reading gives Table 1'
                 if symbol == 'J' else 'too large: Coulomb friction is taken for drag'),
            _row(f'{symbol}, fitted to the sweep’s response', paper, sweep, FOLLOWS, truth),
            _row(f'{symbol}, output error, step test', paper,
                 getattr(nominal.output_error_steps, name), FOLLOWS, truth,
                 'an estimator is no remedy for a missing friction' if symbol == 'B' else
                 'SciPy’s simulation and least squares, linear motor'),
            _row(f'{symbol}, joint regression', paper, joint[name], FOUND, truth,
                 'what the motor has; Table 1 is not it')]
    return rows


def _friction(brake: BrakeResults) -> list[Row]:
    found, truth = brake.strokes.good.estimates, brake.truth.model.friction
    saturates = brake.truth.settings.saturation_velocity > 0.0
    causal = brake.strokes.causal.friction
    width = truth.saturation_velocity if saturates else None
    return [
        _row('C₀, joint regression', None, found['coulomb'], FOUND, truth.coulomb,
             'the paper prints no number'),
        _plain('C₀, the paper’s way', 'N·m', None, causal.coulomb, FOUND, truth.coulomb,
               'causal observer, J and B of the step test'),
        _row('C₁, joint regression', None, found['load_gain'], FOUND, truth.load_gain,
             'true: from the efficiency of gear and screw; the caliper’s hysteresis adds to it'),
        _plain('C₁, the paper’s way', '-', None, causal.load_gain, FOUND, truth.load_gain,
               'the observer lags behind the position'),
        _row('ω_s, joint regression', None, found['saturation_velocity'], FOUND, width,
             'drawn in Figure 15, not printed; the second brake sticks and has none'),
        _plain('ω_s, the paper’s way', 'rad/s', None, causal.saturation_velocity, FOUND, width),
    ]


def _validation(brake: BrakeResults) -> list[Row]:
    validation = brake.validation
    tracking = validation.tracking
    rows: list[Row] = []
    published = {('high', 'pid', 'largest'): 0.83, ('high', 'pid', 'rms'): 0.38,
                 ('high', 'paper', 'largest'): 0.32, ('high', 'paper', 'rms'): 0.13}
    names = {'pid': 'PID', 'paper': 'with the paper’s model', 'joint': 'with the joint model'}
    for load in ('middle', 'high'):
        for way, told in names.items():
            run = tracking[f'{load}_{way}_poor']
            for number, value in (('largest', run.largest), ('rms', run.rms)):
                rows.append(_plain(
                    f'Tracking, {load} load, {told}: {number}', 'rad',
                    published.get((load, way, number)), value, FOLLOWS, None,
                    'at the low gains; the paper prints neither gains nor reference'
                    if (load, way, number) == ('high', 'pid', 'largest') else ''))
    rows += [_plain('PID over the paper’s model, high load: rms', '-', 0.38 / 0.13,
                    validation.ratio('high', 'paper', 'poor'), FOLLOWS, None),
             _plain('PID over the joint model, high load: rms', '-', None,
                    validation.ratio('high', 'joint', 'poor'), FOLLOWS, None)]
    for told, left in (('paper’s', validation.left), ('joint', validation.joint_left)):
        for part, share in zip(('Even', 'Odd'), compensated_share(left[0]), strict=True):
            rows.append(_plain(
                f'{part} disturbance left by the {told} model, part of it', '-', None, share,
                FOLLOWS, None, 'on strokes that nothing was identified from; paper: “close to 0”'
                if part == 'Even' and left is validation.left else ''))
    rows += [_plain('PD and the paper’s model: steady offset', 'rad', 0.1,
                    worst_offset(validation.offsets), FOLLOWS, None, 'required: 0.5 rad'),
             _plain('PD and the joint model: steady offset', 'rad', None,
                    worst_offset(validation.joint_offsets), FOLLOWS, None)]
    return rows


def _disc(brake: BrakeResults) -> list[Row]:
    helping, hindering = brake.disc.directions
    return [
        _plain('d/r, the wedge’s mean slope', '-', 0.430, brake.truth.mean_wedge, SET,
               None, 'from the paper’s P and μ; at rest it is '
               f'{brake.disc.wedge_at_rest:.4f}'),
        _row('P, the paper’s way', 0.421, helping.paper.gain, SET, helping.true_gain),
        _row('P, joint regression', 0.421, helping.joint.gain, SET, helping.true_gain,
             'the second brake’s pads lose friction with speed and force'),
        _row('P, disc hindering, joint regression', None, hindering.joint.gain, FOLLOWS,
             hindering.true_gain),
        _row('μ, the paper’s way, d/r constant', 0.249, helping.paper.pad_friction, SET,
             helping.true_friction),
        _row('μ, joint regression, mean slope', 0.249, helping.joint.pad_friction, SET,
             helping.true_friction),
        _row('μ, the same with the disc hindering', None, _negated(
            hindering.joint.pad_friction), FOLLOWS, helping.true_friction),
    ]


def _negated(estimate: Estimate) -> Estimate:
    return Estimate(-estimate.value, estimate.std, estimate.unit, True,
                    estimate.degrees_of_freedom)


def _row(name: str, paper: float | None, estimate: Estimate, word: str, truth: float | None,
         remark: str = '') -> Row:
    low, high = (float(value) for value in estimate.interval())
    return name, estimate.unit, paper, Found(estimate.value, word, low, high, truth), remark


def _plain(name: str, unit: str, paper: float | None, value: float, word: str,
           truth: float | None, remark: str = '') -> Row:
    return name, unit, paper, Found(value, word, truth=truth), remark
