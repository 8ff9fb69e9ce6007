"""Figures 7 to 16: from the poorly tracked strokes to the fitted friction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.paper_way import PaperResult
from engb_core.identify.procedure import IdentifiedModel
from engb_core.identify.resampling import nearest_neighbour
from engb_core.report.figures import Axis, Band, Figure, Line, Panel, Points
from engb_core.reproduce import chosen
from engb_core.reproduce.identification_chapter import StrokesResult, tracking_mismatch

__all__ = ['identification_figures']

Array = NDArray[np.float64]

# The stroke that is drawn sample by sample: the largest.
STROKE = -1


def identification_figures(result: StrokesResult) -> list[Figure]:
    """Return Figures 7 to 16, of the poorly tracked strokes (7–10) and the good ones (11–16)."""
    return [_measured(result.poor), _search(result.poor), _resampled(result.poor.paper),
            _resampled_disturbance(result.poor.paper), *_parts(result), _load(result),
            *_friction(result)]


def _measured(found: IdentifiedModel) -> Figure:
    clamp, release = tracking_mismatch(found.pieces, found.paper, STROKE)
    sample = np.arange(clamp.size)
    grid = found.paper.resampled[STROKE].position
    return Figure(
        'Figure 7: measured position in the sample domain', Axis('Sample number k', '-'),
        (Panel(Axis('Position', 'rad'), (
            Line('clamping θ_M', sample, clamp, 'recorded'),
            Line('releasing θ_N, reversed', sample, release, 'before', 'dash'),
            Line('reference grid θ_R', np.linspace(0, clamp.size - 1, grid.size), grid, 'muted',
                 'dot')), 200),
         Panel(Axis('Difference', 'rad'), (Line('θ_M − θ_N at the same k', sample,
                                                clamp - release, 'third'),), 110, zero=True)),
        alt='Clamping and reversed releasing positions differ at the same sample number.',
        caption='Paper: “Measured data of the motor shown in the sample domain.” To see: under '
                'low gains the two strokes pass the same sample number at positions up to '
                f'{np.abs(clamp - release).max():.1f} rad apart, so pairing them by number '
                'would compare torques of different loads.')


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
            Points('samples θ_M(k)', number, position, 'noise'),
            Points('grid θ_R(j)', at, grid, 'before', 'square'),
            Points('nearest sample θ_RM(j)', number[chosen_samples], position[chosen_samples],
                   'after', 'up')), 210),),
        alt='Each grid point and the sample nearest to it.',
        caption='Paper: “One dimensional nearest neighbor search method.” To see: of each grid '
                'position (34) takes the sample that lies nearest (35); what remains is at most '
                'half the distance of two samples.')


def _resampled(paper: PaperResult) -> Figure:
    data = paper.resampled[STROKE]
    number = np.arange(1, data.position.size + 1)
    return Figure(
        'Figure 9: position after nearest neighbour resampling', Axis('Grid number j', '-'),
        (Panel(Axis('Position', 'rad'), (
            Line('clamping θ_RM', number, data.clamp_position, 'recorded', width=2.4),
            Line('releasing θ_RN', number, data.release_position, 'before', 'dash')), 190),
         Panel(Axis('Difference', 'mrad'), (Line('θ_RM − θ_RN', number,
                                                 1e3 * data.position_mismatch, 'third'),), 110,
               zero=True)),
        alt='After resampling both strokes have the same positions.',
        caption='Paper: “Re-sampled position data using nearest neighbor search method.” To see: '
                f'the difference falls to {1e3 * np.abs(data.position_mismatch).max():.0f} mrad '
                'at most, the step from one sample to the next.')


def _resampled_disturbance(paper: PaperResult) -> Figure:
    data = paper.resampled[STROKE]
    number = np.arange(1, data.position.size + 1)
    return Figure(
        'Figure 10: resampled lumped disturbance', Axis('Grid number j', '-'),
        (Panel(Axis('Disturbance d̂', 'mN·m'), (
            Line('clamping', number, 1e3 * data.clamp, 'recorded'),
            Line('releasing', number, 1e3 * data.release, 'before')), 220, zero=True),),
        alt='The lumped disturbance of clamping and releasing over the grid number.',
        caption='Paper: “Re-sampled lumped disturbance.” To see: −(T_L + T_C) while clamping, '
                '−(T_L − |T_C|) while releasing; half their sum is the load, half their '
                'difference friction.')


def _parts(result: StrokesResult) -> tuple[Figure, Figure]:
    parts = result.good.paper.parts
    truth = chosen.true_brake().friction
    level = truth.coulomb + truth.load_gain * np.abs(result.true_load)
    even = Figure(
        'Figure 11: even disturbance over position', Axis('Position', 'rad'),
        (Panel(Axis('Even disturbance', 'mN·m'), (
            Points('resampled', parts.position, 1e3 * parts.even, 'noise'),
            Line('−T_L of the simulated brake', result.angles, -1e3 * result.true_load, 'good')),
            210),),
        alt='The even disturbance follows the negative load torque.',
        caption='Paper: “Even disturbance in position domain.” To see: three strokes of '
                'different length fall onto one curve, the load; the odd part is gone.')
    odd = Figure(
        'Figure 12: odd disturbance over position', Axis('Position', 'rad'),
        (Panel(Axis('Odd disturbance', 'mN·m'), (
            Points('resampled', parts.position, 1e3 * parts.odd, 'noise'),
            Line('−|T_C| of the simulated brake', result.angles, -1e3 * level, 'good')), 210),),
        alt='The odd disturbance grows with position.',
        caption='Paper: “Odd disturbance in position domain.” To see: friction grows with the '
                'load that position brings. At the strokes’ ends it falls, where the speed '
                'changes sign within the observer’s filter.')
    return even, odd


def _load(result: StrokesResult) -> Figure:
    paper, joint = result.good.paper, result.good.regression
    torque = joint.load(result.angles)[0]
    low, high = joint.load_band(result.angles)
    error = 1e3 * (torque - result.true_load)
    return Figure(
        'Figure 13: approximated load torque', Axis('Position', 'rad'),
        (Panel(Axis('Load torque', 'mN·m'), (
            Points('−even disturbance', paper.parts.position, -1e3 * paper.parts.even, 'noise'),
            Line('cubic, (41)', result.angles, 1e3 * paper.load.torque(result.angles), 'before',
                 'dash'),
            Line('joint regression', result.angles, 1e3 * torque, 'after', width=1.2)), 200),
         Panel(Axis('Less the true load', 'mN·m'), (
             Band('95 % band', result.angles, 1e3 * (low - result.true_load),
                  1e3 * (high - result.true_load)),
             Line('cubic, (41)', result.angles,
                  1e3 * (paper.load.torque(result.angles) - result.true_load), 'before', 'dash'),
             Line('joint regression', result.angles, error, 'after')), 130, zero=True)),
        alt='The load torque and both fits; below, their errors.',
        caption='Paper: “Approximated load torque.” The lower panel shows how far each fit is '
                'off; it needs the truth, which only a simulated brake has.')


def _friction(result: StrokesResult) -> tuple[Figure, Figure, Figure]:
    paper = result.good.paper
    parts, friction = paper.parts, result.good.model.friction
    load = paper.load.torque(parts.position)
    grid = np.linspace(0.0, max(float(load.max()), 1e-3), 50)
    signed = paper.sign_friction
    over_load = Figure(
        'Figure 14: load dependent Coulomb friction', Axis('Load torque', 'mN·m'),
        (Panel(Axis('−Odd disturbance', 'mN·m'), (
            Points('resampled', 1e3 * load, -1e3 * parts.odd, 'noise'),
            Line('C₀ + C₁·T_L, (42)', 1e3 * grid,
                 1e3 * (signed.coulomb + signed.load_gain * grid), 'before', 'dash'),
            Line('joint regression', 1e3 * grid,
                 1e3 * (friction.coulomb + friction.load_gain * grid), 'after')), 220),),
        alt='Friction grows linearly with load, with points falling to zero at the ends.',
        caption='Paper: “Approximated load dependent coulomb friction torque.” To see: friction '
                'is proportional to load; at the strokes’ ends, at low speed, it falls off, '
                'which pulls (42) with its bare sign function down: '
                f'C₀ {1e3 * signed.coulomb:.2f} mN·m, C₁ {signed.load_gain:.4f} instead of '
                f'{1e3 * chosen.COULOMB:.2f} and '
                f'{chosen.true_brake().friction.load_gain:.4f}.')
    speed = np.linspace(0.0, float(parts.velocity.max()), 400)
    mean_load = float(load.mean())
    over_speed = Figure(
        'Figure 15: friction over speed', Axis('Speed', 'rad/s'),
        (Panel(Axis('−Odd disturbance', 'mN·m'), (
            Points('resampled', parts.velocity, -1e3 * parts.odd, 'noise'),
            Line(f'paper’s way, ω_s {paper.friction.saturation_velocity:.2f} rad/s',
                 speed, 1e3 * (paper.friction.coulomb + paper.friction.load_gain * mean_load)
                 * np.clip(speed / paper.friction.saturation_velocity, 0, 1), 'before', 'dash'),
            Line(f'joint regression, {friction.saturation_velocity:.2f} rad/s',
                 speed, 1e3 * (friction.coulomb + friction.load_gain * mean_load)
                 * np.clip(speed / friction.saturation_velocity, 0, 1), 'after')), 220),),
        alt='Friction rises from zero speed and saturates.',
        caption='Paper: “Approximated velocity dependent friction torque (speed domain).” To '
                'see: friction builds up from zero speed, then hardly changes with it. The '
                f'paper’s way has it saturate at {paper.friction.saturation_velocity:.2f} rad/s, '
                f'joint regression at {friction.saturation_velocity:.2f}; the simulated brake '
                f'has {chosen.SATURATION_VELOCITY}. The observer’s low-pass widens what is drawn '
                'here; the joint regression passes its model through the same filter.')
    fitted = (paper.friction.coulomb + paper.friction.load_gain * np.abs(load)) * np.clip(
        parts.velocity / paper.friction.saturation_velocity, 0.0, 1.0)
    combined = Figure(
        'Figure 16: fitted friction over load', Axis('Load torque', 'mN·m'),
        (Panel(Axis('−Odd disturbance', 'mN·m'), (
            Points('resampled', 1e3 * load, -1e3 * parts.odd, 'noise'),
            Points('(C₀ + C₁·T_L)·sat(ω/ω_s)', 1e3 * load, 1e3 * fitted, 'after', 'up')), 220),),
        alt='The fitted friction with saturation follows the data to zero at the ends.',
        caption='Paper: “Approximated load and velocity dependent friction torque (load torque '
                'domain).” To see: with the saturation the fit follows the data where they fall '
                f'off, and C₀ {1e3 * paper.friction.coulomb:.2f} mN·m, C₁ '
                f'{paper.friction.load_gain:.4f} are no longer pulled down.')
    return over_load, over_speed, combined
