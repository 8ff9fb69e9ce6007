# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The reproduction on one page, and its numbers as JSON."""

from __future__ import annotations

from dataclasses import asdict
import math
from typing import Any

from engb_core.mechanism.kinematics import CHOSEN as MECHANISM
from engb_core.report.layout import Column, Page
from engb_core.report.text import escape, Html
from engb_core.report.wording import MINUS, number
from engb_core.reproduce import chosen
from engb_core.reproduce.chapters import plans
from engb_core.reproduce.errata import ERRATA
from engb_core.reproduce.figures_beyond import force_figure, wear_figure
from engb_core.reproduce.figures_identification import identification_figures
from engb_core.reproduce.figures_nominal import (
    bode,
    cogging_spectrum,
    cogging_tracking,
    mechanism_chain,
    small_angle_error,
)
from engb_core.reproduce.figures_validation import disc_figures, validation_figures
from engb_core.reproduce.opened_seals import sealed_section, SealedBrakes
from engb_core.reproduce.page_tables import chosen_rows, run_rows
from engb_core.reproduce.published_numbers import Found, Number, published_numbers
from engb_core.reproduce.results import BrakeResults, LABELS, Results
from engb_core.reproduce.ways_compared import judgement, told

__all__ = ['reproduction_page', 'results_mapping']

TITLE = ('Load and load-dependent friction of an electronic non-circular gear brake: '
         'the paper’s experiments, made again')


def reproduction_page(results: Results, origin: str, sealed: SealedBrakes | None = None, *,
                      backend: str | None = None) -> Page:
    """Return the page.

    Args:
        results: of `procedure.reproduce`.
        origin: how the recordings were made, one sentence.
        sealed: brakes that were identified before anybody knew them; None: none were.
        backend: as in `Page`.
    """
    page = Page('The paper, made again – engb reproduce', backend=backend)
    _top(page, results, origin, sealed)
    _mechanism(page)
    _nominal(page, results)
    _identification(page, results)
    _validation(page, results)
    _disc(page, results)
    if sealed is not None:
        sealed_section(page, sealed)
    _beyond(page, results)
    _errata(page)
    _chosen(page)
    page.footer('Made by engb reproduce. Simulated brakes stand in for the paper’s hardware: '
                'what depends on hardware or on numbers that the paper doesn’t print is not '
                'comparable, and is not tuned to be.')
    return page


def results_mapping(results: Results, sealed: SealedBrakes | None = None) -> dict[str, Any]:
    """Return the numbers for a JSON file."""
    wear = results.beyond.wear
    gain_error, shift_error = wear.errors()
    diagnosis = results.beyond.diagnosis
    return {
        'format': 'engb-reproduction/2',
        'seeds': results.seeds,
        'numbers': [{'name': entry.name, 'unit': entry.unit, 'paper': entry.paper,
                     'form': _mapping(entry.form), 'more': _mapping(entry.more)}
                    for entry in published_numbers(results)],
        'biases': [{'brake': brake.name, 'recording': entry.recording, 'way': entry.way,
                    'seeds': len(entry.each), **{
                        name: {'mean': _finite(entry.mean(name)),
                               'deviation': _finite(entry.deviation(name))}
                        for name in ('load', 'coulomb', 'load_gain', 'mismatch')}}
                   for brake in results.brakes for entry in brake.strokes.spreads],
        'beyond': {
            'strokes': [asdict(entry) for entry in wear.updates],
            'gain_error': gain_error.tolist(), 'shift_error': shift_error.tolist(),
            'force': {name: getattr(wear.force, name)
                      for name in ('rms', 'largest', 'inside', 'narrow', 'loop')},
            'diagnosis': None if diagnosis is None else [
                {'effect': entry.effect, 'probability': entry.probability,
                 'statement': entry.statement} for entry in diagnosis.effects]},
        'sealed': None if sealed is None else sealed.mapping(),
    }


def _top(page: Page, results: Results, origin: str, sealed: SealedBrakes | None) -> None:
    form, more = (brake.validation for brake in results.brakes)
    causal = results.form.strokes.causal.friction.load_gain
    true = results.form.truth.model.friction.load_gain
    page.header(
        'Electronic non-circular gear brake', TITLE,
        ['Figures 6 to 25 and every published number, from own recordings of two simulated '
         'brakes: one of the form that the model has, which a fit can only find again, and one '
         'with what the model leaves out. ' + origin,
         'Beside each number stands one of three words. Set: the brake was made with it, and to '
         'find it says nothing of the paper. Found: identified from the recordings of a brake '
         'that was not made with it. Follows: it comes out of physics that was not tuned to it.'],
        key=[('Tracking error, high load, low gains',
              f'÷ {form.ratio("high", "paper", "poor"):.1f} and '
              f'÷ {more.ratio("high", "paper", "poor"):.1f}',
              'with the paper’s model, rms, either brake; paper: ÷ 2.9'),
             ('C₁ by the paper’s observer', f'{causal:.3f}', f'true {true:.3f}: it lags'),
             *([('Sealed brakes', str(len(sealed.digests)),
                 'identified before anybody knew them')] if sealed else [])])
    page.section('Every published number beside ours')
    page.table(
        [Column('Quantity'), Column('Paper', number=True), Column('Model’s form', number=True),
         Column(''), Column('true', number=True), Column('More physics', number=True),
         Column(''), Column('true', number=True)],
        [_row(entry) for entry in published_numbers(results)],
        caption='Below a number its 95 % interval, from the residual’s own colour: it tells what '
                'noise does; where the truth lies outside, the method is biased by what the '
                'model’s form leaves out. Torques are the drive’s, 0.0174 N·m/A × current, also '
                'where the magnet is weaker; “true” is in the same units.')


def _mechanism(page: Page) -> None:
    page.section('Chapter 2: the mechanism')
    page.text('The plant runs the whole chain, motor to pad, solved exactly: (18) with (19)–(22) '
              'is an equation for θ_g that rises throughout, so a bracketed Newton search always '
              'finds its root. Self-locking (μ ≥ w) is refused with its reason.')
    page.figure(mechanism_chain(MECHANISM))
    page.figure(small_angle_error(MECHANISM))


def _nominal(page: Page, results: Results) -> None:
    page.section('Section 3.2: the nominal plant, and cogging')
    for brake in results.brakes:
        nominal, truth = brake.nominal, brake.truth.model.motor
        steps, output = nominal.linear_steps, nominal.output_error_steps
        page.text(
            f'The {brake.label}. Step test and sweep drive the motor with the caliper taken off. '
            f'Read as a linear motor, the step test gives J = {number(steps.inertia.value)} '
            f'kg·m² and B = {number(steps.viscous_friction.value)} N·m·s/rad (Table 1: 6.813e-5 '
            'and 1.125e-3), where the motor has '
            f'{number(truth.inertia)} and {number(truth.viscous_friction)}: too large by as much '
            'as Coulomb friction takes of the torque. A better estimator of the same linear model '
            '(output error, by SciPy’s simulation and least squares) gives '
            f'{number(output.inertia.value)} and {number(output.viscous_friction.value)}; the '
            'joint regression, which keeps the three apart, '
            f'{number(nominal.joint.values["inertia"])} and '
            f'{number(nominal.joint.values["viscous_friction"])}.')
        page.figure(bode(brake))
    page.figure(cogging_spectrum(results.brakes))
    page.figure(cogging_tracking(results.brakes))


def _identification(page: Page, results: Results) -> None:
    page.section('Section 3.1: identification, steps 0 to 6')
    page.text('The loop and the paper’s way rest on J and B of the classical step test. “The '
              'paper’s way” in Figures 13 to 16 takes d̂ as the observer’s node published it while '
              'the brake ran, causal and late; Figures 7 to 12 show it without phase shift, too.')
    for figure in identification_figures(results.brakes):
        page.figure(figure)
    page.subsection('How far is each way off?')
    for brake in results.brakes:
        for paragraph in judgement(brake):
            page.text(paragraph)
    for brake in results.brakes:
        page.begin_details(f'Each way on each recording, {brake.label}')
        page.table(
            [Column('Way'), Column('Recording'),
             Column('Paired positions apart, rms', number=True),
             Column('Load, rms error', number=True), Column('C₀ error', number=True),
             Column('C₁ error', number=True)],
            [(entry.way, entry.recording,
              '' if math.isnan(entry.mean('mismatch')) else told(entry, 'mismatch'),
              told(entry, 'load'), told(entry, 'coulomb'), told(entry, 'load_gain'))
             for entry in brake.strokes.spreads],
            caption=f'Mean and standard deviation over {results.seeds} noise seeds.')
        page.end_details()
        page.begin_details(f'The identified model, all numbers, {brake.label}')
        page.code(brake.strokes.good.summary())
        page.end_details()


def _validation(page: Page, results: Results) -> None:
    page.section('Chapter 4: validation')
    for figure in validation_figures(results.brakes):
        page.figure(figure)
    stops = results.form.validation.offsets
    page.table(
        [Column('Steady offset, PD and model'), *(Column(f'at {entry.angle:.0f} rad', number=True)
                                                  for entry in stops)],
        [(f'{brake.label}, {name} model', *(_minus(f'{1e3 * entry.error:.1f}')
                                            for entry in offsets))
         for brake in results.brakes for name, offsets in (
             ('paper’s', brake.validation.offsets), ('joint', brake.validation.joint_offsets))],
        caption='In mrad; required: 500 mrad.')


def _disc(page: Page, results: Results) -> None:
    page.section('Chapter 5: self-energizing')
    for figure in disc_figures(results.brakes):
        page.figure(figure)
    rows = []
    for brake in results.brakes:
        for entry in brake.disc.directions:
            for way, found in (('paper’s way, d/r at rest', entry.paper),
                               ('joint regression of both parts', entry.joint)):
                low, high = found.pad_friction.interval()
                rows.append((f'{brake.label}, {entry.name}, {way}', f'{found.gain.value:.4f}',
                             f'{entry.true_gain:.4f}', _minus(f'{found.pad_friction.value:.4f}'),
                             _minus(f'{low:.4f} … {high:.4f}'),
                             _minus(f'{entry.true_friction:.4f}')))
    page.table([Column('Disc'), Column('P', number=True), Column('true P', number=True),
                Column('μ', number=True), Column('95 % interval', number=True),
                Column('True μ', number=True)], rows,
               caption='Negative where the disc turns against the wedge. The paper’s way takes '
                       'the slope at θ_g = 0 for the whole stroke and J of the step test; true '
                       'values are means over the stroke, with cold pads.')
    page.table([Column('Friction'), Column('C₀, 95 %', number=True),
                Column('C₁, 95 %', number=True)],
               [row for brake in results.brakes for row in _disc_friction(brake)],
               kind='compact', caption='The odd part is the mechanism’s and stays what it is.')


def _disc_friction(brake: BrakeResults) -> list[list[str]]:
    rows = []
    for entry in brake.disc.directions:
        for name, found in (('standing before', entry.standing), ('turning', entry.turning)):
            cells = [f'{brake.label}, disc {entry.name}, {name}']
            for key, scale, unit in (('coulomb', 1e3, ' mN·m'), ('load_gain', 1.0, '')):
                low, high = found.estimates[key].interval()
                cells.append(_minus(f'{scale * low:.4g} … {scale * high:.4g}{unit}'))
            rows.append(cells)
    return rows


def _beyond(page: Page, results: Results) -> None:
    page.section('Beyond the paper')
    page.figure(wear_figure(results.beyond.wear))
    page.figure(force_figure(results.beyond.wear))
    diagnosis = results.beyond.diagnosis
    if diagnosis is None:
        return
    page.subsection('What was left out: the diagnosis of the residual of Figures 19 to 21')
    page.text(f'The {results.more.label} under the model that the paper’s way identified: run 1 '
              'was fitted, run 2 judged.')
    if diagnosis.effects:
        page.table([Column('Effect'), Column('Probability', number=True), Column('What it is')],
                   [(entry.effect, f'{entry.probability:.2f}', entry.statement)
                    for entry in diagnosis.effects])
    else:
        page.text('It gives no name.')
    if diagnosis.unexplained is not None and diagnosis.unexplained.statement:
        page.text(diagnosis.unexplained.statement)
    page.text('In the simulated brake: friction that sticks and falls with speed, a screw out of '
              'round, hysteresis and creep of the caliper, and a torque constant that is not the '
              'drive’s. The disc stands in these runs.', kind='muted')


def _errata(page: Page) -> None:
    page.section('Errata of the paper, with derivations')
    page.table([Column('Place'), Column('Printed'), Column('Right'), Column('Why')],
               [(entry.place, entry.prints, entry.right, entry.why) for entry in ERRATA])


def _chosen(page: Page) -> None:
    page.section('Chosen numbers, and the runs')
    page.text('The paper doesn’t print these. Of its own numbers the brakes were made with K_T, '
              'with μ (and d/r, from P and μ), and with J and B such that the classical step test '
              'gives Table 1.')
    page.table([Column('Number'), *(Column(LABELS[name], kind='wrap') for name in LABELS)],
               chosen_rows(chosen.FORM, chosen.MORE))
    page.table([Column('Run'), Column('Figures'), Column('What'), Column('Length', number=True)],
               run_rows(plans()['more']),
               caption='Each run is made with either brake, but for wear.')


# How a table shows a number of this unit: factor and name.
SHOWN = {'kg·m²': (1e6, '10⁻⁶ kg·m²'), 'N·m·s/rad': (1e3, 'mN·m·s/rad'), 'N·m': (1e3, 'mN·m')}


def _row(entry: Number) -> tuple[Html | str, ...]:
    factor, unit = SHOWN.get(entry.unit, (1.0, entry.unit))

    def text(value: float | None) -> str:
        return '' if value is None else number(factor * value, 4)

    def cells(found: Found) -> tuple[Html | str, str, str]:
        interval = '' if math.isnan(found.low) else (
            f'<br><small class="muted">{text(found.low)} … {text(found.high)}</small>')
        return Html(escape(text(found.value)) + interval), found.word, text(found.truth)

    name = entry.name + (f' [{unit}]' if unit not in ('', '-') else '')
    remark = f'<br><small class="muted">{escape(entry.remark)}</small>' if entry.remark else ''
    return (Html(f'{escape(name)}{remark}'), text(entry.paper), *cells(entry.form),
            *cells(entry.more))


def _mapping(found: Found) -> dict[str, Any]:
    return {'value': found.value, 'word': found.word, 'low': _finite(found.low),
            'high': _finite(found.high), 'truth': found.truth}


def _minus(text: str) -> str:
    return text.replace('-', MINUS)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
