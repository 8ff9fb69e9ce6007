# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Figures 7 to 16: from the poorly tracked strokes to the fitted friction, of both brakes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.paper_way import observe, paper_way
from engb_core.identify.procedure import IdentifiedModel
from engb_core.identify.resampling import nearest_neighbour
from engb_core.report.figures import Axis, Band, Figure, Line, Panel, Points, Series
from engb_core.reproduce.results import BrakeResults
from engb_core.reproduce.truth import ANGLES

__all__ = ['cloud', 'identification_figures', 'sentence']

Array = NDArray[np.float64]

# The stroke that is drawn sample by sample: the largest.
STROKE = -1

# Markers of one cloud: more would hide the lines that are drawn over them.
MARKERS = 160


def cloud(name: str, x: Array, y: Array, colour: str = 'noise', marker: str = 'circle',
          ) -> Points:
    """Return a cloud of small markers, thinned evenly in order of x."""
    order = np.argsort(x, kind='stable')
    picked = order[np.unique(np.linspace(0, order.size - 1, MARKERS).round().astype(int))]
    return Points(name, np.asarray(x)[picked], np.asarray(y)[picked], colour, marker, 4.0)


def sentence(parts: Sequence[str]) -> str:
    """Return what is told of each brake as one sentence, without its full stop."""
    text = '; '.join(parts)
    return text[:1].upper() + text[1:]


def identification_figures(brakes: Sequence[BrakeResults]) -> list[Figure]:
    """Return Figures 7 to 16, of the poorly tracked strokes (7–10) and the good ones (11–16)."""
    return [_measured(brakes), _search(brakes[0].strokes.poor), _resampled(brakes),
            _resampled_disturbance(brakes), _even(brakes), _odd(brakes), _parameters(brakes),
            _load(brakes), _over_load(brakes), _over_speed(brakes), _combined(brakes)]


def _panels(brakes: Sequence[BrakeResults], label: str, unit: str, height: int,
            draw: Callable[[BrakeResults], tuple[Series, ...]], zero: bool = False,
            ) -> tuple[Panel, ...]:
    """Return one panel a brake."""
    return tuple(Panel(Axis(f'{label}, {brake.label}', unit), draw(brake), height, zero)
                 for brake in brakes)


def _measured(brakes: Sequence[BrakeResults]) -> Figure:
    def positions(brake: BrakeResults) -> tuple[Series, ...]:
        clamp, release = brake.strokes.clamp, brake.strokes.release
        sample = np.arange(clamp.size)
        grid = brake.strokes.poor.paper.resampled[STROKE].position
        return (Line('clamping θ_M', sample, clamp, 'recorded'),
                Line('releasing θ_N, reversed', sample, release, 'before', 'dash'),
                Line('reference grid θ_R', np.linspace(0, clamp.size - 1, grid.size), grid,
                     'third', 'dot'))

    def apart(brake: BrakeResults) -> tuple[Series, ...]:
        difference = brake.strokes.clamp - brake.strokes.release
        return (Line('θ_M − θ_N at the same k', np.arange(difference.size), difference,
                     'after'),)

    largest = [float(np.abs(brake.strokes.clamp - brake.strokes.release).max())
               for brake in brakes]
    return Figure(
        'Figure 7: measured position in the sample domain', Axis('Sample number k', '-'),
        (*_panels(brakes[:1], 'Position', 'rad', 190, positions),
         *_panels(brakes, 'Difference', 'rad', 130, apart, True)),
        alt='Clamping and reversed releasing positions differ at the same sample number.',
        caption='Paper: “Measured data of the motor shown in the sample domain.” To see: under '
                'low gains the two strokes pass the same moment of the mirrored reference at '
                f'positions up to {largest[0]:.2f} rad ({brakes[0].label}) and {largest[1]:.2f} '
                f'rad ({brakes[1].label}) apart, so pairing them by number would compare torques '
                'of different loads.')


def _search(found: IdentifiedModel) -> Figure:
    stroke = found.paper.strokes[STROKE]
    motion = found.pieces[stroke.motion]
    middle = stroke.clamp.size // 3
    part = stroke.clamp[middle:middle + 13]
    position = motion.position[part]
    grid = np.linspace(position[0], position[-1], 6)
    chosen_samples = nearest_neighbour(grid, position)
    number = np.arange(part.size)
    at = np.interp(grid, position, number)
    return Figure(
        'Figure 8: one-dimensional nearest neighbour search', Axis('Sample number k', '-'),
        (Panel(Axis('Position', 'rad'), (
            Points('nearest sample θ_RM(j)', number[chosen_samples], position[chosen_samples],
                   'after', 'up', 13.0),
            Points('samples θ_M(k)', number, position, 'noise', size=6.0),
            Points('grid θ_R(j)', at, grid, 'before', 'square', 5.0)), 220),),
        alt='Each grid point and the sample nearest to it.',
        caption='Paper: “One dimensional nearest neighbor search method.” To see: of each grid '
                'position (34) takes the sample that lies nearest (35); what remains is at most '
                'half the distance of two samples.')


def _resampled(brakes: Sequence[BrakeResults]) -> Figure:
    def apart(brake: BrakeResults) -> tuple[Series, ...]:
        data = brake.strokes.poor.paper.resampled[STROKE]
        return (Line('θ_RM − θ_RN', np.arange(1, data.position.size + 1),
                     1e3 * data.position_mismatch, 'third'),)

    data = brakes[0].strokes.poor.paper.resampled[STROKE]
    number = np.arange(1, data.position.size + 1)
    worst = max(float(np.abs(brake.strokes.poor.paper.resampled[STROKE].position_mismatch).max())
                for brake in brakes)
    return Figure(
        'Figure 9: position after nearest neighbour resampling', Axis('Grid number j', '-'),
        (Panel(Axis(f'Position, {brakes[0].label}', 'rad'), (
            Line('clamping θ_RM', number, data.clamp_position, 'recorded', width=4.0),
            Line('releasing θ_RN', number, data.release_position, 'mark', 'dash', width=1.8)),
            180),
         *_panels(brakes, 'Difference', 'mrad', 130, apart, True)),
        alt='After resampling both strokes have the same positions.',
        caption='Paper: “Re-sampled position data using nearest neighbor search method.” To see: '
                f'the difference falls to {1e3 * worst:.0f} mrad at most, the step from one '
                'sample to the next.')


def _resampled_disturbance(brakes: Sequence[BrakeResults]) -> Figure:
    def strokes(brake: BrakeResults) -> tuple[Series, ...]:
        data = brake.strokes.poor.paper.resampled[STROKE]
        number = np.arange(1, data.position.size + 1)
        return (Line('clamping', number, 1e3 * data.clamp, 'recorded'),
                Line('releasing', number, 1e3 * data.release, 'before'))

    return Figure(
        'Figure 10: resampled lumped disturbance', Axis('Grid number j', '-'),
        _panels(brakes, 'Disturbance d̂', 'mN·m', 180, strokes, True),
        alt='The lumped disturbance of clamping and releasing over the grid number.',
        caption='Paper: “Re-sampled lumped disturbance.” To see: −(T_L + T_C) while clamping, '
                '−(T_L − |T_C|) while releasing; half their sum is the load, half their '
                'difference friction.')


def _even(brakes: Sequence[BrakeResults]) -> Figure:
    def even(brake: BrakeResults) -> tuple[Series, ...]:
        parts, causal = brake.strokes.good.paper.parts, brake.strokes.causal.parts
        return (cloud('no phase shift', parts.position, 1e3 * parts.even),
                cloud('as the observer’s node published it', causal.position,
                      1e3 * causal.even, 'before', 'up'),
                Line('−T_L of the simulated brake', ANGLES, -1e3 * brake.truth.load, 'good',
                     width=2.2))

    return Figure(
        'Figure 11: even disturbance over position', Axis('Position', 'rad'),
        _panels(brakes, 'Even disturbance', 'mN·m', 190, even),
        alt='The even disturbance follows the negative load torque.',
        caption='Paper: “Even disturbance in position domain.” To see: three strokes of '
                'different length fall onto one curve, the load, and the observer’s lag hardly '
                'shows in it. With more physics in the brake the caliper has crept, and the load '
                'is less than its stiffness says.')


def _odd(brakes: Sequence[BrakeResults]) -> Figure:
    def odd(brake: BrakeResults) -> tuple[Series, ...]:
        parts, causal = brake.strokes.good.paper.parts, brake.strokes.causal.parts
        friction = brake.truth.model.friction
        level = friction.coulomb + friction.load_gain * np.abs(brake.truth.load)
        return (cloud('no phase shift', parts.position, 1e3 * parts.odd),
                cloud('as the observer’s node published it', causal.position, 1e3 * causal.odd,
                      'before', 'up'),
                Line('−(C₀ + C₁·T_L) of the simulated brake', ANGLES, -1e3 * level, 'good',
                     width=2.2))

    return Figure(
        'Figure 12: odd disturbance over position', Axis('Position', 'rad'),
        _panels(brakes, 'Odd disturbance', 'mN·m', 190, odd),
        alt='The odd disturbance grows with position.',
        caption='Paper: “Odd disturbance in position domain.” To see: friction grows with the '
                'load that position brings. The causal observer, late, takes part of the load’s '
                'slope off it; B from the step test takes off a constant. With more physics the '
                'caliper’s hysteresis and creep are added, odd as friction is. At the strokes’ '
                'ends it falls, where the speed changes sign within the observer’s filter.')


def _parameters(brakes: Sequence[BrakeResults]) -> Figure:
    """What the nominal model's J and B leave in the parts: the terms of (39) and (40)."""
    def even(brake: BrakeResults) -> tuple[Series, ...]:
        position, difference, shown = _parameter_terms(brake)
        return (cloud('even part', position, 1e3 * difference[0], 'noise'),
                Line('−ΔJ·ω̇, −ΔB·ω of the reference', *shown[0], 'after', width=2.2))

    def odd(brake: BrakeResults) -> tuple[Series, ...]:
        position, difference, shown = _parameter_terms(brake)
        return (cloud('odd part', position, 1e3 * difference[1], 'before', 'up'),
                Line('−ΔJ·ω̇, −ΔB·ω of the reference', *shown[1], 'after', width=2.2))

    return Figure(
        'After Figure 12: what J and B of the step test add to the parts, (39) and (40)',
        Axis('Position', 'rad'),
        (*_panels(brakes[:1], 'Even part: −ΔJ·ω̇', 'mN·m', 150, even, True),
         *_panels(brakes[:1], 'Odd part: −ΔB·ω', 'mN·m', 150, odd, True)),
        alt='The classical J adds a step to the even part, the classical B an arch to the odd.',
        caption='The largest stroke, with J and B of the classical step test less the same with '
                'those of the joint regression (ΔJ, ΔB: true less nominal). The paper calls both '
                'terms negligible. ΔJ·ω̇ is even, since the reference’s acceleration mirrors: the '
                'lower half of a stroke is read with too little load, the upper with too much. '
                'ΔB·ω is odd and as large as what is missing from C₀.')


def _parameter_terms(brake: BrakeResults) -> tuple[
        Array, tuple[Array, Array], tuple[tuple[Array, Array], tuple[Array, Array]]]:
    """Return positions (m,), the even and odd difference (m,) [N·m] of the largest stroke, and
    (θ [rad], −ΔJ·ω̇ and −ΔB·ω [mN·m]) of a stroke of constant acceleration."""
    strokes, nominal = brake.strokes, brake.nominal
    pieces = strokes.good.pieces
    parts = []
    for start in (nominal.classical, nominal.nominal):
        result = paper_way(pieces, start, observed=[observe(piece, start) for piece in pieces])
        size = result.resampled[STROKE].position.size
        parts.append((result.parts.position[-size:], result.parts.even[-size:],
                      result.parts.odd[-size:]))
    motor, other = nominal.nominal.motor, nominal.classical.motor
    top = float(parts[0][0].max())
    angle = np.linspace(0.0, top, 200)
    # Half up at constant acceleration, half down, as the reference is; its speed from its angle.
    acceleration = _acceleration(strokes.good)
    lower = angle < 0.5 * top
    speed = np.sqrt(2.0 * acceleration * np.where(lower, angle, top - angle))
    inertial = -(motor.inertia - other.inertia) * np.where(lower, acceleration, -acceleration)
    viscous = -(motor.viscous_friction - other.viscous_friction) * speed
    return (parts[0][0], (parts[0][1] - parts[1][1], parts[0][2] - parts[1][2]),
            ((angle, 1e3 * inertial), (angle, 1e3 * viscous)))


def _acceleration(found: IdentifiedModel) -> float:
    """Return the strokes' acceleration [rad/s²]: the middle one while clamping."""
    stroke = found.paper.strokes[STROKE]
    return float(np.median(np.abs(found.pieces[stroke.motion].smooth_acceleration[stroke.clamp])))


def _load(brakes: Sequence[BrakeResults]) -> Figure:
    def error(brake: BrakeResults) -> tuple[Series, ...]:
        joint, truth = brake.strokes.good.regression, brake.truth.load
        low, high = joint.load_band(ANGLES)
        return (Band('95 % band of the joint regression', ANGLES, 1e3 * (low - truth),
                     1e3 * (high - truth)),
                Line('cubic, (41)', ANGLES, 1e3 * (brake.strokes.causal.load.torque(ANGLES)
                                                   - truth), 'before', 'dash'),
                Line('joint regression', ANGLES, 1e3 * (joint.load(ANGLES)[0] - truth), 'after'))

    brake = brakes[0]
    paper = brake.strokes.causal
    return Figure(
        'Figure 13: approximated load torque', Axis('Position', 'rad'),
        (Panel(Axis(f'Load torque, {brake.label}', 'mN·m'), (
            cloud('−even disturbance', paper.parts.position, -1e3 * paper.parts.even),
            Line('joint regression', ANGLES, 1e3 * brake.strokes.good.regression.load(ANGLES)[0],
                 'after', width=3.6),
            Line('cubic, (41)', ANGLES, 1e3 * paper.load.torque(ANGLES), 'before', 'dash',
                 width=1.8)), 190),
         *_panels(brakes, 'Less the true load', 'mN·m', 150, error, True)),
        alt='The load torque and both fits; below, their errors.',
        caption='Paper: “Approximated load torque.” The lower panels show how far each fit is '
                'off; they need the truth, which only a simulated brake has. A band tells what '
                'noise does, not what the model’s form leaves out.')


def _over_load(brakes: Sequence[BrakeResults]) -> Figure:
    def friction(brake: BrakeResults) -> tuple[Series, ...]:
        paper, joint = brake.strokes.causal, brake.strokes.good.model.friction
        load = paper.load.torque(paper.parts.position)
        grid = np.linspace(0.0, max(float(load.max()), 1e-3), 50)
        signed, true = paper.sign_friction, brake.truth.model.friction
        return (cloud('resampled', 1e3 * load, -1e3 * paper.parts.odd),
                Line('C₀ + C₁·T_L of the simulated brake', 1e3 * grid,
                     1e3 * (true.coulomb + true.load_gain * grid), 'good', width=6.0),
                Line('joint regression', 1e3 * grid,
                     1e3 * (joint.coulomb + joint.load_gain * grid), 'after'),
                Line('C₀ + C₁·T_L, (42)', 1e3 * grid,
                     1e3 * (signed.coulomb + signed.load_gain * grid), 'before', 'dash'))

    told = sentence([
        f'{brake.label}: C₀ {1e3 * brake.strokes.causal.sign_friction.coulomb:.2f} mN·m, C₁ '
        f'{brake.strokes.causal.sign_friction.load_gain:.4f} instead of '
        f'{1e3 * brake.truth.model.friction.coulomb:.2f} and '
        f'{brake.truth.model.friction.load_gain:.4f}' for brake in brakes])
    return Figure(
        'Figure 14: load dependent Coulomb friction', Axis('Load torque', 'mN·m'),
        _panels(brakes, '−Odd disturbance', 'mN·m', 190, friction),
        alt='Friction grows linearly with load, with points falling to zero at the ends.',
        caption='Paper: “Approximated load dependent coulomb friction torque.” To see: friction '
                'grows in proportion to load; at the strokes’ ends, at low speed, it falls off, '
                f'which pulls (42) with its bare sign function down. {told}.')


def _over_speed(brakes: Sequence[BrakeResults]) -> Figure:
    def friction(brake: BrakeResults) -> tuple[Series, ...]:
        paper, joint = brake.strokes.causal, brake.strokes.good.model.friction
        parts, fit = paper.parts, paper.friction
        load = paper.load.torque(parts.position)
        speed = np.linspace(0.0, float(parts.velocity.max()), 400)
        series: list[Series] = []
        # One line of a load each: friction depends on both.
        edges = np.quantile(load, [0.0, 1 / 3, 2 / 3, 1.0])
        for place, (colour, marker, name) in enumerate((
                ('noise', 'circle', 'low'), ('before', 'up', 'middle'),
                ('third', 'square', 'high'))):
            inside = (load >= edges[place]) & (load <= edges[place + 1])
            series.append(cloud(f'{name} load', parts.velocity[inside],
                                -1e3 * parts.odd[inside], colour, marker))
        for place in range(3):
            middle = float(np.mean(edges[place:place + 2]))
            series.append(Line('joint regression, at each load’s middle', speed, 1e3 * (
                joint.coulomb + joint.load_gain * middle) * np.clip(
                    speed / joint.saturation_velocity, 0, 1), 'after', width=2.0))
            series.append(Line('paper’s way, likewise', speed, 1e3 * (
                fit.coulomb + fit.load_gain * middle) * np.clip(
                    speed / fit.saturation_velocity, 0, 1), 'recorded', 'dash', width=1.4))
        return tuple(series)

    form, more = brakes
    widths = [[brake.strokes.causal.friction.saturation_velocity,
               brake.strokes.good.model.friction.saturation_velocity] for brake in brakes]
    return Figure(
        'Figure 15: friction over speed', Axis('Speed', 'rad/s'),
        _panels(brakes, '−Odd disturbance', 'mN·m', 200, friction),
        alt='Friction rises from zero speed and saturates, higher at higher load.',
        caption='Paper: “Approximated velocity dependent friction torque (speed domain).” To '
                'see: friction builds up from zero speed; that it then falls is what B of the '
                'step test takes off it. The paper’s way has it saturate at '
                f'{widths[0][0]:.2f} rad/s, joint regression at {widths[0][1]:.2f}; the '
                f'{form.label} has {form.truth.settings.saturation_velocity}. The {more.label} '
                'sticks by (13) and has none: there the paper’s way draws '
                f'{widths[1][0]:.2f} rad/s, which is the width of the observer’s low-pass; joint '
                'regression passes its model through the '
                f'same filter and gives {widths[1][1]:.2f}.')


def _combined(brakes: Sequence[BrakeResults]) -> Figure:
    def friction(brake: BrakeResults) -> tuple[Series, ...]:
        paper = brake.strokes.causal
        parts, fit = paper.parts, paper.friction
        load = paper.load.torque(parts.position)
        fitted = (fit.coulomb + fit.load_gain * np.abs(load)) * np.clip(
            parts.velocity / fit.saturation_velocity, 0.0, 1.0)
        return (cloud('resampled', 1e3 * load, -1e3 * parts.odd),
                cloud('(C₀ + C₁·T_L)·sat(ω/ω_s)', 1e3 * load, 1e3 * fitted, 'after', 'up'))

    fits = [brake.strokes.causal.friction for brake in brakes]
    return Figure(
        'Figure 16: fitted friction over load', Axis('Load torque', 'mN·m'),
        _panels(brakes, '−Odd disturbance', 'mN·m', 190, friction),
        alt='The fitted friction with saturation follows the data to zero at the ends.',
        caption='Paper: “Approximated load and velocity dependent friction torque (load torque '
                'domain).” To see: with the saturation the fit follows the data where they fall '
                'off, and C₀ ' + ', '.join(f'{1e3 * fit.coulomb:.2f} mN·m' for fit in fits)
                + ' and C₁ ' + ', '.join(f'{fit.load_gain:.4f}' for fit in fits)
                + ' (one a brake) are no longer pulled down.')
