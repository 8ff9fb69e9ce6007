"""The diagnosis on one page: verdict, where, what, how much better, how sure, what next."""

from __future__ import annotations

from collections import Counter
import math
import os

import numpy as np

from engb_core.diagnose.diagnosis import (
    Diagnosis,
    EffectFinding,
    QualityOfFit,
    ResidualOver,
    Trace,
    Zone,
)
from engb_core.report.details import add_details
from engb_core.report.layout import bar, Column, Page
from engb_core.report.pictures import (
    close_up,
    closed_loop,
    experiment,
    numbered,
    overlay,
    residual_over,
    Units,
)
from engb_core.report.text import breakable, escape, Html, join, shorten
from engb_core.report.wording import (
    capital,
    coordinate,
    effect_name,
    effect_names,
    enumerate_words,
    estimate,
    headline,
    number,
    parameter_name,
    percent,
    probability,
    quantities,
    quantity,
    scaled,
    zone_range,
)

__all__ = ['diagnosis_page', 'write_report']

# Points of all curves together that keep the page without plotly.js well under 1.5 MB.
POINT_BUDGET = 60000
MAIN_POINTS = 1600

# Rows that a reader takes in at once; the rest is folded.
INTERVALS, ZONES, CANDIDATES = 6, 8, 6

VERDICTS = {'consistent': ('Consistent', 'good'), 'explained': ('Explained', 'info'),
            'partly_explained': ('Partly explained', 'warn'),
            'unexplained': ('Unexplained', 'warn')}


def write_report(path: str | os.PathLike, diagnosis: Diagnosis) -> None:
    """Write the diagnosis as one self-contained HTML file, whole or not at all."""
    diagnosis_page(diagnosis).write(path)


def diagnosis_page(diagnosis: Diagnosis, *, backend: str | None = None) -> Page:
    """Return the page of a diagnosis; `backend` as in `Page`."""
    page = Page(f'{VERDICTS[diagnosis.verdict][0]} – engb diagnosis', backend=backend)
    units = Units(diagnosis)
    _header(page, diagnosis)
    _where(page, diagnosis, units)
    _what(page, diagnosis, units)
    _how_much_better(page, diagnosis, units)
    _how_sure(page, diagnosis)
    _next(page, diagnosis, units)
    add_details(page, diagnosis, units)
    seconds = diagnosis.evidence.seconds
    page.footer('engb diagnose' + (f', {number(seconds, 2)} s of computation.' if seconds > 0
                                   else '.') + ' Angles and torques are those of the motor; a '
                'positive angle applies the brake.')
    return page


def recordings(diagnosis: Diagnosis) -> list[str]:
    """Return the names of all recordings that the diagnosis speaks of, in order."""
    evidence = diagnosis.evidence
    names = [*(trace.recording for trace in evidence.traces),
             *(entry.recording for entry in diagnosis.held_out),
             *(entry.recording for entry in diagnosis.time)]
    return list(dict.fromkeys(names))


def _pooled(diagnosis: Diagnosis, quantity_name: str) -> QualityOfFit | None:
    """One figure over all held-out recordings: the root of the mean square."""
    rows = [row for row in diagnosis.held_out if row.quantity == quantity_name]
    if not rows:
        return None
    floors = [row.noise_floor for row in rows if row.noise_floor is not None]

    def mean(values: list[float]) -> float:
        return math.sqrt(sum(value**2 for value in values) / len(values))
    return QualityOfFit('', quantity_name, mean([row.rms_before for row in rows]),
                        mean([row.rms_after for row in rows]),
                        mean(floors) if len(floors) == len(rows) else None, rows[0].unit)


def _header(page: Page, diagnosis: Diagnosis) -> None:
    word, tone = VERDICTS[diagnosis.verdict]
    names = recordings(diagnosis)
    listed = ', '.join(shorten(name, 48) for name in names[:3])
    more = f' and {len(names) - 3} more' if len(names) > 3 else ''
    eyebrow = Html(f'<b>{escape(word)}</b>' + (f' · {escape(listed + more)}' if names else ''))
    page.header(eyebrow, headline(diagnosis), _lead(diagnosis), tone=tone, key=_key(diagnosis))


def _lead(diagnosis: Diagnosis) -> list[str]:
    fit = _pooled(diagnosis, 'effort')
    gain = _gain(fit) if fit else ''
    left = diagnosis.unexplained
    if diagnosis.verdict == 'consistent':
        text = 'Nothing stands above the noise that a test at 1 % would call real.'
        if fit:
            floor = (f', against a noise floor of {quantity(fit.noise_floor, fit.unit, 2)}'
                     if fit.noise_floor is not None else '')
            text += (f' On recordings that no fit has seen, the model misses the motor '
                     f'{_effort(fit)} by {quantity(fit.rms_before, fit.unit)} rms{floor}.')
        return [text]
    if diagnosis.verdict == 'unexplained' or not diagnosis.effects:
        text = ('The mismatch is real, but no effect in the catalogue describes it well enough '
                'to be named; a wrong name would be worse than none.')
        if fit and fit.rms_after < fit.rms_before:
            gain = ('It can be modelled all the same, as a function of what it depends on. '
                    f'{gain}')
        return [text, gain] if gain else [text]
    lines = [entry.statement.strip() for entry in diagnosis.effects[:2] if entry.statement]
    lines = [line if line.endswith(('.', '!', '?')) else f'{line}.' for line in lines]
    if diagnosis.verdict == 'partly_explained' and left and left.share > 0:
        gain += f' {percent(left.share)} of the mismatch remains without a name.'
    return [' '.join(lines), gain.strip()] if gain else [' '.join(lines)]


def _gain(fit: QualityOfFit) -> str:
    verb = 'falls' if fit.rms_after < fit.rms_before else 'does not fall: it goes'
    floor = (f'; the noise floor is {quantity(fit.noise_floor, fit.unit, 2)}'
             if fit.noise_floor is not None else '')
    return (f'On recordings that no fit has seen, the error of the modelled {_effort(fit)} {verb} '
            f'from {" to ".join(quantities((fit.rms_before, fit.rms_after), fit.unit))} '
            f'rms{floor}.')


def _effort(fit: QualityOfFit) -> str:
    return 'force' if fit.unit == 'N' else 'torque'


def _key(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    items = []
    if diagnosis.verdict in ('explained', 'partly_explained') and diagnosis.effects:
        first = diagnosis.effects[0]
        items.append(('Probability', probability(min(entry.probability
                                                     for entry in diagnosis.effects)),
                      f'that it is {effect_name(first.effect)}' if len(diagnosis.effects) == 1
                      else 'of the least certain effect'))
        total = min(sum(entry.share for entry in diagnosis.effects), 1.0)
        items.append(('Mismatch explained', percent(total), 'of its energy above the noise'))
    left = diagnosis.unexplained
    if diagnosis.verdict == 'unexplained' and left is not None and left.depends_on:
        parity = {'odd': 'odd', 'even': 'even'}.get(left.parity_in_velocity,
                                                    'neither odd nor even')
        items.append(('Depends on', ', '.join(coordinate(name) for name in left.depends_on),
                      f'{parity} in velocity, {"with" if left.memory else "without"} memory'))
    for name, title in (('effort', 'Held-out torque error'), ('position', 'Closed-loop position')):
        fit = _pooled(diagnosis, name)
        if fit is None:
            continue
        if diagnosis.verdict == 'consistent':
            value = quantity(fit.rms_before, fit.unit)
        else:
            value = '\u00a0→ '.join(quantities((fit.rms_before, fit.rms_after), fit.unit))
        floor = (f'noise floor {quantity(fit.noise_floor, fit.unit, 2)}'
                 if fit.noise_floor is not None else 'rms error on held-out recordings')
        items.append((title, value, floor))
    return items


def _where(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    traces = _ordered(diagnosis)
    if not traces and not diagnosis.time and not diagnosis.where:
        return
    consistent = diagnosis.verdict == 'consistent'
    page.section('What was compared' if consistent else 'Where it happens')
    if diagnosis.where and not consistent:
        first = max(diagnosis.where, key=lambda zone: zone.share)
        place = zone_range(first)
        verb = 'lies at' if any(character.isdigit() for character in place) else 'comes while'
        page.text(f'{percent(first.share)} of the mismatch {verb} {place}.')
        _zones(page, diagnosis.where)
    if traces:
        page.figure(overlay(traces[0], diagnosis.time, units), points=MAIN_POINTS)
        strongest = [entry for _, entry in numbered(diagnosis.time, traces[0].recording)[:1]]
        picture = close_up(traces[0], strongest[0], units) if strongest else None
        if picture is not None:
            page.figure(picture, points=MAIN_POINTS)
    if diagnosis.time and not consistent:
        _intervals(page, diagnosis)
    if len(traces) > 1:
        points = int(min(max(POINT_BUDGET / (7 * (len(traces) - 1)), 60), 700))
        page.begin_details(f'The other recordings ({len(traces) - 1})')
        for trace in traces[1:]:
            page.figure(overlay(trace, diagnosis.time, units), points=points)
        page.end_details()


def _ordered(diagnosis: Diagnosis) -> list[Trace]:
    """The recording with most of the mismatch first, held-out ones before others."""
    weight: Counter[str] = Counter()
    for entry in diagnosis.time:
        weight[entry.recording] += entry.share
    return sorted((trace for trace in diagnosis.evidence.traces if trace.time.size),
                  key=lambda trace: (-weight[trace.recording], not trace.held_out))


def _zones(page: Page, zones: tuple[Zone, ...]) -> None:
    ranked = sorted(zones, key=lambda zone: -zone.share)[:ZONES]
    page.shares([(capital(zone_range(zone)), zone.share, percent(zone.share)) for zone in ranked],
                colour='before')
    page.text('Each bar is the share of the mismatch (energy of the torque residual above the '
              'noise) within that range; ranges of different coordinates overlap.', kind='caption')


def _intervals(page: Page, diagnosis: Diagnosis) -> None:
    ranked = sorted(diagnosis.time, key=lambda entry: -entry.share)
    several = len({entry.recording for entry in ranked}) > 1

    def label(rank: int) -> str:
        entry = ranked[rank]
        place = f', {shorten(entry.recording, 32)}' if several else ''
        return f'{rank + 1}:  {entry.begin:.2f}–{entry.end:.2f} s{place}'
    total = sum(entry.share for entry in ranked)
    spread = sum(entry.share for entry in ranked[:INTERVALS]) < 0.35 and len(ranked) > INTERVALS
    if spread:
        page.text(f'It is spread over {len(ranked)} short intervals, which together hold '
                  f'{percent(min(total, 1.0))} of the mismatch; no single one holds more than '
                  f'{percent(ranked[0].share)}.')
    else:
        page.shares([(label(rank), entry.share, percent(entry.share))
                     for rank, entry in enumerate(ranked[:INTERVALS])], colour='mark')
    if len(ranked) > INTERVALS:
        page.begin_details(f'All {len(ranked)} intervals')
        page.table([Column('Rank'), Column('From [s]', number=True),
                    Column('To [s]', number=True), Column('Share', number=True),
                    Column('Recording')],
                   [(str(rank), f'{entry.begin:.2f}', f'{entry.end:.2f}', percent(entry.share),
                     breakable(shorten(entry.recording, 60)))
                    for rank, entry in enumerate(ranked[:200], 1)], kind='compact')
        page.end_details()


def _what(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    pictures = list(diagnosis.evidence.residual_over)
    if diagnosis.verdict == 'consistent':
        if pictures:
            page.section('No structure is left')
        _pictures(page, pictures, units)
        return
    if not diagnosis.effects:
        page.section('What is known about it')
        _unexplained(page, diagnosis)
        _pictures(page, pictures, units)
        return
    page.section('What it is')
    # As many pictures as effects: the i-th belongs to the i-th. Otherwise they stand together.
    paired = len(pictures) == len(diagnosis.effects)
    for index, finding in enumerate(diagnosis.effects):
        _effect(page, finding)
        if paired:
            _pictures(page, pictures[index:index + 1], units)
    if not paired:
        _pictures(page, pictures, units)
    if diagnosis.unexplained and diagnosis.verdict == 'partly_explained':
        page.subsection('What remains')
        _unexplained(page, diagnosis)


def _pictures(page: Page, pictures: list[ResidualOver], units: Units) -> None:
    for picture in pictures:
        page.figure(residual_over(picture, units))


def _effect(page: Page, finding: EffectFinding) -> None:
    page.subsection(effect_name(finding.effect, start=True))
    page.text(finding.statement)
    facts = [('Share of the mismatch', percent(finding.share)),
             ('Probability', probability(finding.probability))]
    facts += [(parameter_name(name), estimate(value))
              for name, value in finding.parameters.items()]
    page.table([Column('Quantity'), Column('Value')], facts, kind='compact')
    rivals = [(name, value) for name, value in finding.alternatives if value >= 0.01]
    if rivals:
        named = enumerate_words([f'{effect_name(name)} ({probability(value)})'
                                 for name, value in rivals[:4]], 'or')
        page.text(f'These recordings cannot rule out {named}.' if rivals[0][1] > 0.1 else
                  f'Hardly, but possibly: {named}.')
    if any(value.std is None for value in finding.parameters.values()):
        page.text('"Not determined" means that the recordings do not contain the motion that '
                  'would fix this number; take the value as a guess.', kind='caption')


def _unexplained(page: Page, diagnosis: Diagnosis) -> None:
    left = diagnosis.unexplained
    if left is None:
        page.text('Nothing more can be said about it from these recordings.')
        return
    if left.statement:
        page.text(left.statement)
    parity = {'odd': 'it changes sign with the direction of motion, as friction does',
              'even': 'it is the same in both directions, as a load is',
              'none': 'it is neither the same nor opposite in the two directions'}
    facts = [f'It holds {percent(left.share)} of the mismatch.']
    if left.depends_on:
        facts.append('It depends on '
                     f'{enumerate_words(coordinate(name) for name in left.depends_on)}.')
    if left.parity_in_velocity in parity:
        facts.append(capital(parity[left.parity_in_velocity]) + '.')
    facts.append('It has memory: the same position, speed and load give different torques, '
                 'depending on what went before.' if left.memory else
                 'No memory was found: the present state decides.')
    page.notes(facts)
    if left.where:
        _zones(page, left.where)


def _how_much_better(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    rows = diagnosis.held_out
    if not rows and not diagnosis.evidence.closed_loops:
        return
    consistent = diagnosis.verdict == 'consistent'
    page.section('How well the model predicts' if consistent else 'How much better')
    if rows:
        page.text('Root mean square errors on recordings, or parts of them, that no fit has '
                  'seen.', kind='muted')
        _fit_table(page, rows)
    loops = diagnosis.evidence.closed_loops
    for loop in loops[:1]:
        page.figure(closed_loop(loop, units), points=MAIN_POINTS)
    if len(loops) > 1:
        page.begin_details(f'Closed loop of the other recordings ({len(loops) - 1})')
        points = int(min(max(POINT_BUDGET / (8 * (len(loops) - 1)), 60), 700))
        for loop in loops[1:]:
            page.figure(closed_loop(loop, units), points=points)
        page.end_details()


def _fit_table(page: Page, rows: tuple[QualityOfFit, ...]) -> None:
    table = []
    for row in rows:
        largest = max(row.rms_before, row.rms_after, row.noise_floor or 0.0) or 1.0
        mark = None if row.noise_floor is None else row.noise_floor / largest
        bars = join([bar(row.rms_before / largest, 'before', mark=mark),
                     bar(row.rms_after / largest, 'after', mark=mark)])
        change = (row.rms_after / row.rms_before - 1) if row.rms_before > 0 else math.nan
        name = {'effort': 'motor torque' if row.unit != 'N' else 'motor force'}.get(
            row.quantity, f'closed-loop {coordinate(row.quantity)}')
        unit = scaled(largest, row.unit)[1]
        figures = [row.rms_before, row.rms_after, *([] if mark is None else [row.noise_floor])]
        texts = quantities([*figures, largest], row.unit)[:len(figures)] + ['–'] * (mark is None)
        table.append((breakable(shorten(row.recording, 44)),
                      f'{name} [{shorten(unit, 24)}]', *texts, _change(change), bars))
    page.table([Column('Recording'), Column('Quantity'), Column('As given', number=True),
                Column('Corrected', number=True), Column('Noise floor', number=True),
                Column('Change', number=True), Column('', kind='bars')], table[:40],
               caption='Upper bar: model as given; lower bar: corrected model; the line marks '
                       'the noise floor.')


def _change(change: float) -> str:
    if not math.isfinite(change):
        return '–'
    return f'{"+" if change > 0 else "−"}{abs(round(100 * change))}\u202f%'


def _how_sure(page: Page, diagnosis: Diagnosis) -> None:
    candidates = sorted(diagnosis.evidence.candidates, key=lambda entry: -entry.probability)
    if not candidates:
        return
    page.section({'consistent': 'What was tried',
                  'unexplained': 'Why none of the known effects'}.get(
                      diagnosis.verdict, 'How sure, and why not something else'))
    held = [entry.held_out_rms for entry in candidates]
    page.text(f'{len(candidates)} hypotheses were fitted together with the nominal numbers and '
              'judged on data that the fit had not seen. The probabilities are calibrated: of '
              'claims made with 90 %, nine in ten hold.')
    unit = next((row.unit for row in diagnosis.held_out if row.quantity == 'effort'), 'N·m')
    best = min((value for value in held if np.isfinite(value)), default=math.nan)
    named = tuple(sorted(entry.effect for entry in diagnosis.effects))
    shown = candidates[:CANDIDATES]
    rows = [(effect_names(entry.effects, start=True), probability(entry.probability),
             bar(entry.probability), quantity(entry.held_out_rms, unit), percent(entry.share),
             entry.remark or _why_not(entry.held_out_rms, best)) for entry in shown]
    unknown = diagnosis.verdict == 'unexplained'
    chosen = [index for index, entry in enumerate(shown)
              if tuple(sorted(entry.effects)) == named and not unknown]
    rest = 1 - sum(entry.probability for entry in candidates)
    if rest >= 0.01:
        rows.append(('None of these', probability(rest), bar(rest), '–', '–', ''))
        chosen += [len(rows) - 1] if unknown else []
    page.table([Column('Hypothesis'), Column('Probability', number=True), Column('', kind='bars'),
                Column('Held-out rms', number=True), Column('Explains', number=True),
                Column('Remark', kind='wrap')],
               rows, chosen=chosen)


def _why_not(rms: float, best: float) -> str:
    if not (math.isfinite(rms) and math.isfinite(best) and best > 0):
        return ''
    ratio = rms / best
    if ratio < 1.005:
        return ''
    return (f'held-out error {percent(ratio - 1)} above the best' if ratio < 2 else
            f'held-out error {number(ratio, 2)} times the best')


def _next(page: Page, diagnosis: Diagnosis, units: Units) -> None:
    proposal = diagnosis.next_experiment
    if proposal is None:
        return
    page.section('What to measure next')
    names = enumerate_words([effect_name(name) for name in proposal.discriminates])
    page.text(proposal.reason)
    page.call(Html(f'Tells apart: <b>{escape(names)}</b>'),
              Html(f'Reference: {escape(proposal.reference)}'))
    picture = experiment(proposal, units)
    if picture is not None:
        page.figure(picture)
