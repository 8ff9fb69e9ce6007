"""The reproduction on one page, and its numbers as JSON."""

from __future__ import annotations

import math
from typing import Any

from engb_core.kinematics import CHOSEN as MECHANISM
from engb_core.report.layout import Column, Page
from engb_core.report.text import escape, Html
from engb_core.report.wording import MINUS, number
from engb_core.reproduce import chosen
from engb_core.reproduce.errata import ERRATA
from engb_core.reproduce.figures_identification import identification_figures
from engb_core.reproduce.figures_nominal import (
    bode,
    cogging_spectrum,
    cogging_tracking,
    mechanism_chain,
    small_angle_error,
)
from engb_core.reproduce.figures_validation import disc_figures, validation_figures
from engb_core.reproduce.identification_chapter import Bias
from engb_core.reproduce.judgement import judgement
from engb_core.reproduce.numbers import Number, published_numbers, Results
from engb_core.reproduce.plan import Experiment, PLAN
from engb_core.reproduce.validation_chapter import compensated_share

__all__ = ['reproduction_page', 'results_mapping']

TITLE = ('Load and load-dependent friction of an electronic non-circular gear brake: '
         'the paper’s experiments, made again')


def reproduction_page(results: Results, origin: str, *, backend: str | None = None) -> Page:
    """Return the page.

    Args:
        results: of `procedure.reproduce`.
        origin: how the recordings were made, one sentence.
        backend: as in `Page`.
    """
    page = Page('The paper, made again – engb reproduce', backend=backend)
    _top(page, results, origin)
    _mechanism(page)
    _nominal(page, results)
    _identification(page, results)
    _validation(page, results)
    _disc(page, results)
    _errata(page)
    _chosen(page)
    page.footer('Made by engb reproduce. The simulated brake stands in for the paper’s hardware: '
                'what depends on hardware or on numbers that the paper doesn’t print is not '
                'comparable, and is not tuned to be.')
    return page


def results_mapping(results: Results) -> dict[str, Any]:
    """Return the numbers for a JSON file."""
    return {
        'format': 'engb-reproduction/1',
        'numbers': [{'name': entry.name, 'unit': entry.unit, 'paper': entry.paper,
                     'ours': entry.ours, 'low': _finite(entry.low), 'high': _finite(entry.high),
                     'truth': entry.truth} for entry in published_numbers(results)],
        'biases': [{'recording': entry.recording, 'way': entry.way, 'load_rms': entry.load,
                    'coulomb': entry.coulomb, 'load_gain': entry.load_gain,
                    'position_mismatch': _finite(entry.mismatch)}
                   for entry in results.strokes.biases],
    }


def _top(page: Page, results: Results, origin: str) -> None:
    tracking, disc = results.validation.tracking, results.disc.directions[0]
    friction = disc.joint.pad_friction
    ratio = tracking['high_pid'].rms / tracking['high_feedforward'].rms
    page.header(
        'Electronic non-circular gear brake', TITLE,
        ['Figures 6 to 25 and every published number, from own recordings of a simulated brake '
         'of the paper’s kind; the paper’s way beside joint regression. ' + origin],
        key=[('Tracking error, high load', f'÷ {ratio:.0f}',
              'with the identified feedforward, rms; paper: ÷ 2.9'),
             ('Even disturbance left',
              f'{100 * compensated_share(results.validation.left[0])[0]:.1f} %',
              'of what the model took off'),
             ('Pad friction μ', f'{friction.value:.3f} ± {2 * friction.std:.3f}',
              f'true {chosen.PAD_FRICTION}; paper 0.249')])
    page.section('Every published number beside ours')
    page.table(
        [Column('Quantity'), Column('Paper', number=True), Column('Ours', number=True),
         Column('95 % interval', number=True), Column('Simulated brake', number=True)],
        [_row(entry) for entry in published_numbers(results)],
        caption='The simulated brake has the paper’s motor and pad friction; all else is chosen '
                '(last section). Intervals come from the residual’s own colour; where the truth '
                'lies outside of one, the method is biased by what the model form leaves out.')


def _mechanism(page: Page) -> None:
    page.section('Chapter 2: the mechanism')
    page.text('The plant runs the whole chain, motor to pad, solved exactly: (18) with (19)–(22) '
              'is an equation for θ_g that rises throughout, so a bracketed Newton search always '
              'finds its root. Self-locking (μ ≥ w) is refused with its reason.')
    page.figure(mechanism_chain(MECHANISM))
    page.figure(small_angle_error(MECHANISM))


def _nominal(page: Page, results: Results) -> None:
    page.section('Section 3.2: the nominal plant, and cogging')
    steps, output = results.nominal.linear_steps, results.nominal.output_error_steps
    page.text(
        'Step test and sweep drive the motor with the caliper taken off. Read as a linear motor, '
        f'the step test gives J = {number(steps.inertia.value)} kg·m² and '
        f'B = {number(steps.viscous_friction.value)} N·m·s/rad, both too large by as much as '
        'Coulomb friction takes of the torque. A better estimator of the same linear model '
        '(output error, by SciPy’s simulation and least squares) does not mend that: it gives '
        f'J = {number(output.inertia.value)} kg·m² and '
        f'B = {number(output.viscous_friction.value)} N·m·s/rad. The joint regression keeps the '
        'three apart.')
    page.figure(bode(results.nominal))
    page.figure(cogging_spectrum(results.nominal))
    page.figure(cogging_tracking(results.cogging))


def _identification(page: Page, results: Results) -> None:
    page.section('Section 3.1: identification, steps 0 to 6')
    for figure in identification_figures(results.strokes):
        page.figure(figure)
    page.subsection('How far is each way off?')
    for paragraph in judgement(results.strokes.biases):
        page.text(paragraph)
    page.table(
        [Column('Way'), Column('Recording'), Column('Paired positions apart, rms', number=True),
         Column('Load, rms error', number=True), Column('C₀ error', number=True),
         Column('C₁ error', number=True)],
        [_bias_row(entry) for entry in results.strokes.biases],
        caption=f'True: C₀ {1e3 * chosen.COULOMB:.1f} mN·m, C₁ '
                f'{chosen.true_brake().friction.load_gain:.4f}.')
    page.begin_details('The identified model, all numbers')
    page.code(results.strokes.good.summary())
    page.end_details()


def _validation(page: Page, results: Results) -> None:
    page.section('Chapter 4: validation')
    for figure in validation_figures(results.validation):
        page.figure(figure)
    page.table(
        [Column('Stop'), Column('Steady offset', number=True),
         Column('On a brake that sticks', number=True)],
        [(f'{entry.angle:.1f} rad', _minus(f'{1e3 * entry.error:.1f} mrad'),
          _minus(f'{1e3 * other.error:.1f} mrad'))
         for entry, other in zip(results.validation.offsets,
                                 results.validation.sticking_offsets, strict=True)],
        kind='compact',
        caption='PD and identified model; required: 500 mrad.')


def _disc(page: Page, results: Results) -> None:
    page.section('Chapter 5: self-energizing')
    figures = disc_figures(results.disc)
    for figure in figures:
        page.figure(figure)
    rows = []
    for entry in results.disc.directions:
        for way, found in (('paper’s way, d/r', entry.paper),
                           ('joint regression, mean slope', entry.joint)):
            low, high = found.pad_friction.interval()
            rows.append((f'{entry.name}, {way}', f'{found.gain.value:.4f}',
                         _minus(f'{found.pad_friction.value:.4f}'),
                         _minus(f'{low:.4f} … {high:.4f}'), _minus(f'{entry.true_friction:.3f}')))
    page.table([Column('Disc'), Column('P', number=True), Column('μ', number=True),
                Column('95 % interval', number=True), Column('True μ', number=True)], rows,
               caption='Negative where the disc turns against the wedge. The paper’s way takes '
                       'the slope at θ_g = 0 for the whole stroke.')
    rows = []
    for name, found in (('standing', results.disc.standing), *(
            (entry.name, entry.identified) for entry in results.disc.directions)):
        cells = [f'disc {name}']
        for key, scale, unit in (('coulomb', 1e3, ' mN·m'), ('load_gain', 1.0, '')):
            low, high = found.estimates[key].interval()
            cells += [f'{scale * low:.4g} … {scale * high:.4g}{unit}']
        rows.append(cells)
    page.table([Column('Friction'), Column('C₀, 95 %', number=True),
                Column('C₁, 95 %', number=True)], rows, kind='compact',
               caption='The odd part is the mechanism’s and stays what it is.')


def _errata(page: Page) -> None:
    page.section('Errata of the paper, with derivations')
    page.table([Column('Place'), Column('Printed'), Column('Right'), Column('Why')],
               [(entry.place, entry.prints, entry.right, entry.why) for entry in ERRATA])


def _chosen(page: Page) -> None:
    page.section('Chosen numbers, and the runs')
    mechanism = MECHANISM
    page.text('The paper doesn’t print these. The saturation velocity stands for what its Figures '
              '14 to 16 show, the rest for a brake of its size.')
    page.table(
        [Column('Number'), Column('Value', number=True)],
        [('N_g', f'{mechanism.gear_ratio:g}'), ('L', f'{1e3 * mechanism.screw_lead:g} mm'),
         ('l₁, l₂', f'{1e3 * mechanism.lever_input:g} mm, '
                    f'{1e3 * mechanism.lever_output:g} mm'),
         ('β', f'{math.degrees(mechanism.lever_bend):.0f}°'),
         ('r, d', f'{1e3 * mechanism.gear_radius:g} mm, {1e3 * mechanism.gear_offset:.3g} mm'),
         ('η driving', f'{mechanism.efficiency:g}'),
         ('clearance', f'{1e3 * mechanism.clearance:g} mm'),
         ('F_N(s)', ' + '.join(
            f'{number(value)}·s{power}' for value, power in zip(
                mechanism.clamp_stiffness, ('', '²', '³'), strict=False)) + ' N, s in m'),
        ('C₀', f'{1e3 * chosen.COULOMB:g} mN·m'),
         ('ω_s, and of the brake that sticks', f'{chosen.SATURATION_VELOCITY:g} rad/s, '
                                               f'{chosen.STICKING_VELOCITY:g} rad/s'),
         ('PID', f'p {chosen.GAINS.p:g}, i {chosen.GAINS.i:g}, d {chosen.GAINS.d:g}'),
         ('PID, low gains', f'p {chosen.POOR_GAINS.p:g}, i {chosen.POOR_GAINS.i:g}, '
                            f'd {chosen.POOR_GAINS.d:g}'),
         ('encoder, current noise', f'{chosen.SENSORS["counts_per_revolution"]} counts, '
                                    f'{1e3 * chosen.SENSORS["effort_noise"]:g} mN·m'),
         ('disc', f'±{chosen.DISC_SPEED:g} rad/s')], kind='compact')
    page.table([Column('Run'), Column('Figures'), Column('What'), Column('Length', number=True)],
               [_experiment_row(entry) for entry in PLAN])


# How a table shows a number of this unit: factor and name.
SHOWN = {'kg·m²': (1e6, '10⁻⁶ kg·m²'), 'N·m·s/rad': (1e3, 'mN·m·s/rad'), 'N·m': (1e3, 'mN·m')}


def _row(entry: Number) -> tuple[Html | str, ...]:
    factor, unit = SHOWN.get(entry.unit, (1.0, entry.unit))

    def text(value: float | None) -> str:
        return '' if value is None else number(factor * value, 4)

    interval = ('' if math.isnan(entry.low) else f'{text(entry.low)} … {text(entry.high)}')
    name = entry.name + (f' [{unit}]' if unit not in ('', '-') else '')
    remark = Html(f'<br><small class="muted">{escape(entry.remark)}</small>')
    return (Html(f'{escape(name)}{remark if entry.remark else ""}'), text(entry.paper),
            text(entry.ours), interval, text(entry.truth))


def _bias_row(entry: Bias) -> tuple[str, ...]:
    apart = '' if math.isnan(entry.mismatch) else f'{1e3 * entry.mismatch:.0f} mrad'
    return (entry.way, entry.recording, apart, f'{1e3 * entry.load:.2f} mN·m',
            _minus(f'{1e3 * entry.coulomb:+.2f} mN·m'), _minus(f'{entry.load_gain:+.4f}'))


def _minus(text: str) -> str:
    return text.replace('-', MINUS)


def _experiment_row(entry: Experiment) -> tuple[str, ...]:
    return entry.name, entry.figures, entry.purpose, f'{entry.duration:.1f} s'


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
