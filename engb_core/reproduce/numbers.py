"""Every number that the paper publishes beside ours."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.identify.uncertainty import Estimate
from engb_core.reproduce import chosen
from engb_core.reproduce.identification_chapter import StrokesResult
from engb_core.reproduce.nominal_chapter import CoggingEffect, NominalResult
from engb_core.reproduce.self_energizing_chapter import DiscResult
from engb_core.reproduce.validation_chapter import (
    compensated_share,
    ValidationResult,
    worst_offset,
)

__all__ = ['Number', 'published_numbers', 'Results']


@dataclass(frozen=True)
class Results:
    """All chapters."""

    nominal: NominalResult
    cogging: CoggingEffect
    strokes: StrokesResult
    validation: ValidationResult
    disc: DiscResult


@dataclass(frozen=True)
class Number:
    """One number.

    Attributes:
        name: what it is.
        unit: '' or '-' where it has none.
        paper: as published; None where the paper gives none.
        ours: from the recordings; `low`, `high` its 95 % interval, NaN where it has none.
        truth: of the simulated brake; None where it has no such number.
        remark: one sentence.
    """

    name: str
    unit: str
    paper: float | None
    ours: float
    low: float = math.nan
    high: float = math.nan
    truth: float | None = None
    remark: str = ''


def published_numbers(results: Results) -> list[Number]:
    """Return the numbers in the order of the paper."""
    nominal, strokes = results.nominal, results.strokes
    motor, joint = chosen.MOTOR, nominal.joint.estimates
    friction = strokes.good.estimates
    tracking, validation = results.validation.tracking, results.validation
    even, odd = compensated_share(validation.left[0])
    helping, hindering = results.disc.directions
    return [
        _number('K_T, from an added inertia', 0.0174, nominal.torque_constant,
                motor.torque_constant, 'Table 1; the paper doesn’t say how'),
        _number('J, joint regression', 6.813e-5, joint['inertia'], motor.inertia,
                'Table 1 is also the simulated motor'),
        _number('J, classical step test', 6.813e-5, nominal.linear_steps.inertia, motor.inertia,
                'too large: Coulomb friction is taken for drag'),
        _number('J, fitted to the sweep’s response', 6.813e-5, nominal.linear_sweep.inertia,
                motor.inertia),
        _number('J, output error, step test', 6.813e-5, nominal.output_error_steps.inertia,
                motor.inertia, 'SciPy’s simulation and least squares, linear motor'),
        _number('J, output error, sweep', 6.813e-5, nominal.output_error_sweep.inertia,
                motor.inertia),
        _number('B, joint regression', 1.125e-3, joint['viscous_friction'],
                motor.viscous_friction),
        _number('B, classical step test', 1.125e-3, nominal.linear_steps.viscous_friction,
                motor.viscous_friction, 'too large for the same reason'),
        _number('B, fitted to the sweep’s response', 1.125e-3,
                nominal.linear_sweep.viscous_friction, motor.viscous_friction),
        _number('B, output error, step test', 1.125e-3,
                nominal.output_error_steps.viscous_friction, motor.viscous_friction,
                'an estimator is no remedy for a missing friction'),
        _number('B, output error, sweep', 1.125e-3,
                nominal.output_error_sweep.viscous_friction, motor.viscous_friction),
        _number('C₀', None, friction['coulomb'], chosen.COULOMB,
                'the paper prints no number'),
        _number('C₁', None, friction['load_gain'], chosen.true_brake().friction.load_gain,
                'follows from the efficiency of gear and screw'),
        _number('ω_s, joint regression', None, friction['saturation_velocity'],
                chosen.SATURATION_VELOCITY, 'drawn in Figure 15, not printed'),
        Number('ω_s, the paper’s way', 'rad/s', None,
               strokes.good.paper.friction.saturation_velocity, truth=chosen.SATURATION_VELOCITY,
               remark='too large: the observer’s filter smears the change of sign'),
        Number('Tracking, middle load, PID: largest', 'rad', None,
               tracking['middle_pid'].largest),
        Number('Tracking, middle load, with the model: largest', 'rad', None,
               tracking['middle_feedforward'].largest),
        Number('Tracking, high load, PID: largest', 'rad', 0.83, tracking['high_pid'].largest,
               remark='depends on gains and reference, which the paper doesn’t give'),
        Number('Tracking, high load, PID: rms', 'rad', 0.38, tracking['high_pid'].rms),
        Number('Tracking, high load, with the model: largest', 'rad', 0.32,
               tracking['high_feedforward'].largest,
               remark='the simulated brake obeys the form of the model, a real one doesn’t'),
        Number('Tracking, high load, with the model: rms', 'rad', 0.13,
               tracking['high_feedforward'].rms),
        Number('The same, model over PID: rms', '-', 0.13 / 0.38,
               tracking['high_feedforward'].rms / tracking['high_pid'].rms),
        Number('Even disturbance left, part of what was there', '-', None, even,
               remark='paper: “close to 0”'),
        Number('Odd disturbance left, part of what was there', '-', None, odd,
               remark='paper: “close to 0”'),
        Number('PD and model: steady offset', 'rad', 0.1, worst_offset(validation.offsets),
               remark='required: 0.5 rad'),
        Number('The same on a brake that sticks', 'rad', 0.1,
               worst_offset(validation.sticking_offsets), remark='required: 0.5 rad'),
        Number('d/r, from the paper’s P and μ', '-', 0.430, results.disc.mean_wedge,
               truth=results.disc.wedge_at_rest,
               remark='ours: the wedge’s mean slope over the stroke; true: at θ_g = 0'),
        _number('P, disc helping', 0.421, helping.joint.gain, _true_gain(results, 0)),
        _number('P, disc hindering', None, hindering.joint.gain, _true_gain(results, 1)),
        _number('μ, the paper’s way, d/r constant', 0.249, helping.paper.pad_friction,
                chosen.PAD_FRICTION, 'too large: the slope is not d/r over the stroke'),
        _number('μ, joint regression, mean slope', 0.249, helping.joint.pad_friction,
                chosen.PAD_FRICTION),
        _number('μ, the same with the disc hindering', None, _negated(
            hindering.joint.pad_friction), chosen.PAD_FRICTION),
    ]


def _true_gain(results: Results, index: int) -> float:
    angles = results.disc.angles
    friction = results.disc.directions[index].true_friction
    standing = chosen.true_brake().load_torque
    turning = chosen.true_brake(friction).load_torque
    one = _torque(standing, angles)
    two = _torque(turning, angles)
    return float(one @ two / (one @ one))


def _torque(load, angles):
    import numpy as np
    return np.polynomial.polynomial.polyval(np.maximum(angles - load.contact_angle, 0.0),
                                            load.coefficients)


def _negated(estimate: Estimate) -> Estimate:
    return Estimate(-estimate.value, estimate.std, estimate.unit, True,
                    estimate.degrees_of_freedom)


def _number(name: str, paper: float | None, estimate: Estimate, truth: float | None,
            remark: str = '') -> Number:
    low, high = (float(value) for value in estimate.interval())
    return Number(name, estimate.unit, paper, estimate.value, low, high, truth, remark)
