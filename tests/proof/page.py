# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The scores of a proof as a page: what was asked, how often it was right, every miss."""
from __future__ import annotations

from collections.abc import Sequence

from engb_core.report.figures import Axis, Figure, Line, Panel, Points
from engb_core.report.layout import Column, Page
from engb_core.report.text import escape, Html
from engb_core.report.wording import effect_name, parameter_name, percent

from .score import CaseScore

__all__ = ['proof_page']

_COLOURS = ('noise', 'after', 'before', 'third', 'mark')


def proof_page(summary: dict, scores: Sequence[CaseScore], *, backend: str | None = None) -> Page:
    """The page of a proof; `summary` as in scores.json, `backend` as in `Page`."""
    page = Page('engb prove', backend=backend)
    _header(page, summary)
    _shares(page, summary)
    if 'baselines' in summary:
        _baselines(page, summary)
    _confusion(page, summary)
    _calibration(page, summary)
    _parameters(page, summary)
    _held_out(page, summary, scores)
    _misses(page, summary)
    _how(page, summary)
    page.footer('engb prove. scores.json holds the numbers, cases.jsonl a line per case, '
                'results/ each case\'s diagnosis and report.')
    return page


def _name(effect: str) -> str:
    text = effect_name(effect.removeprefix('outside_'))
    return f'{text} (outside the library)' if effect.startswith('outside_') else text


def _of(entry: dict | None) -> str:
    return '–' if entry is None else f'{entry["hits"]} of {entry["of"]}'


def _share(entry: dict | None) -> str:
    return '–' if entry is None else percent(entry['share'])


def _interval(entry: dict | None) -> str:
    if entry is None:
        return ''
    low, high = entry['interval']
    return f'{100 * low:.1f} to {100 * high:.1f} %'


def _mean(value: float | None) -> str:
    return '–' if value is None else percent(value)


def _header(page: Page, summary: dict) -> None:
    named, alarms = summary['named_first'], summary['false_alarms']
    found = [f'{_of(named[key])} {key}' for key in ('strong', 'subtle') if named.get(key)]
    if found:
        headline = f'The hidden effect was named first in {" and ".join(found)} cases'
    else:
        headline = f'{summary["cases"]} cases with concealed truth'
    lead = []
    if alarms is not None:
        lead.append(f'False alarms on clean recordings: {_of(alarms)} (95 % interval of the '
                    f'rate: {_interval(alarms)}).')
    if summary['failures']:
        lead.append(f'{len(summary["failures"])} runs failed; they count as silent.')
    seconds = summary['seconds']
    error = summary['calibration']['expected_error']
    bad = summary['failures'] or (alarms and alarms['hits'])
    page.header(f'Proof on sealed cases · {summary.get("date", "")}', headline, lead,
                tone='warn' if bad else 'info', key=[
        ('strong', _share(named.get('strong')), f'named first, {_of(named.get("strong"))}'),
        ('subtle', _share(named.get('subtle')), f'named first, {_of(named.get("subtle"))}'),
        ('false alarms', _share(alarms), f'{_of(alarms)} clean'),
        ('wrong names outside', _share(summary['confident_wrong_outside']),
         f'{_of(summary["confident_wrong_outside"])}, probability above 50 %'),
        ('calibration error', '–' if error is None else f'{error:.3f}',
         f'{summary["calibration"]["claims"]} claims'),
        ('seconds', '–' if seconds['median'] is None else f'{seconds["median"]:.1f}',
         'the median diagnosis' + ('' if seconds['median'] is None else
                                   f'; 95 % within {seconds["p95"]:.0f}'))])


def _shares(page: Page, summary: dict) -> None:
    page.section('How often it was right')
    rows = [(f'named first, {key}', value) for key, value in summary['named_first'].items()]
    rows += [('both of a pair', summary['pairs_both']),
             ('one of a pair first', summary['pairs_first']),
             ('all of three', summary['triples_all']),
             ('something said on a clean recording', summary['false_alarms']),
             ('a name given on a clean recording', summary['claims_on_clean']),
             *((f'confident wrong name, {stratum}', entry)
               for stratum, entry in summary['confident_wrong'].items()),
             ('single effects with a false second name', summary['singles_with_false_extra']),
             ('held-out prediction made worse', summary['worse']),
             ('harm: materially worse, all cases', summary['harm'])]
    page.table([Column('score'), Column('share', number=True), Column('cases', number=True),
                Column('95 % interval', number=True)],
               [[name, _share(entry), _of(entry), _interval(entry)]
                for name, entry in rows if entry], kind='compact',
               caption='Exact (Clopper–Pearson) intervals. Strong and subtle: the effect stands '
               'about 7 and 2 times above the noise floor after a refit of the model to hide '
               'it, low-passed at 20 Hz (at 100 Hz for a resonance, which lies above). Rich: an '
               'identification run; routine: plain braking.')
    if summary['named_first_by_effect']:
        page.begin_details('Named first, effect by effect')
        page.table([Column('hidden'), Column('share', number=True), Column('cases', number=True),
                    Column('95 % interval', number=True)],
                   [[_name(effect), _share(entry), _of(entry), _interval(entry)]
                    for effect, entry in summary['named_first_by_effect'].items()],
                   kind='compact')
        page.end_details()


def _baselines(page: Page, summary: dict) -> None:
    page.section('Beside plain methods')

    every = [('engb diagnose', summary), *((one['label'], one) for one in summary['baselines'])]
    rows = []
    for label, one in every:
        named = one['named_first']
        if one.get('gives_names', True):
            rows.append([label, *(_share(entry) for entry in (
                named.get('strong'), named.get('subtle'), one['pairs_both'], one['false_alarms'],
                one['confident_wrong_outside']))])
    page.table([Column('method'), *(Column(text, number=True) for text in (
        'strong', 'subtle', 'both of a pair', 'false alarms', 'wrong names outside'))], rows,
        chosen=[0], kind='compact', caption='The same cases and scorer. Sparse regression by '
        f'{summary["thresholding"]}; symbolic regression by {summary["symbolic"]}.')
    kinds = [kind for kind in summary['held_out_removed'] if kind != 'named_singles']
    rows = [[label, *(_mean(one['held_out_removed'].get(kind)) for kind in kinds),
             _share(one['harm']),
             '–' if one['seconds']['mean'] is None else f'{one["seconds"]["mean"]:.1f}']
            for label, one in every]
    page.table([Column('error removed on another recording'), *(Column(text, number=True)
               for text in (*kinds, 'harm', 'seconds'))], rows, chosen=[0], kind='compact',
               caption='Of the nominal model\'s held-out error, how much of what the true '
               'equations remove. Refit, flexible regressor and oracle give no names; the oracle '
               'was told them, and fits the numbers.')


def _confusion(page: Page, summary: dict) -> None:
    page.section('What was named for what')
    rows = []
    for truth, said in sorted(summary['confusion'].items()):
        count = sum(said.values())
        order = sorted(said.items(), key=lambda entry: (-entry[1], entry[0]))
        names = ', '.join(f'{_name(name) if name != "nothing" else "nothing"} {number}'
                          for name, number in order)
        right = said.get('nothing' if truth == 'clean' or truth.startswith('outside_')
                         else truth, 0)
        rows.append([_name(truth) if truth != 'clean' else 'nothing (clean)',
                     f'{right} of {count}', names])
    page.table([Column('hidden'), Column('right', number=True), Column('first claim')], rows,
               caption='The confusion matrix without its zeros; pairs are left out. Right is the '
               'effect itself, and silence where nothing is hidden or nothing the library knows.')
    _matrix(page, summary['confusion'])


def _matrix(page: Page, confusion: dict) -> None:
    claims = sorted({name for row in confusion.values() for name in row} - {'nothing'})
    columns = ['nothing', *claims]
    page.begin_details('The whole matrix')
    page.table([Column('hidden'), *(Column(_name(name), number=True) for name in columns)],
               [[_name(truth), *(str(row.get(name, '') or '·') for name in columns)]
                for truth, row in sorted(confusion.items())], kind='numbers')
    page.end_details()


def _calibration(page: Page, summary: dict) -> None:
    sure = summary['calibration']
    if not sure['bins']:
        _conditions(page, summary)
        return
    page.section('Whether its probabilities mean what they say')
    said, right = ([b[key] for b in sure['bins']] for key in ('said', 'right'))
    page.figure(Figure(
        'Probability said, and how often it was right', Axis('said', limits=(0.0, 1.03)),
        (Panel(Axis('right', limits=(-0.03, 1.03)), (
            Line('perfect', [0.0, 1.0], [0.0, 1.0], 'noise', 'dash'),
            Line('claims', said, right, 'after', marker='circle')), 300),),
        alt='Reliability diagram: ' + '; '.join(
            f'said {b["said"]:.2f}, right {b["right"]:.2f}' for b in sure['bins'])))
    page.table([Column('said'), Column('on average', number=True), Column('right', number=True)],
               [[f'{b["from"]:.2f} to {b["to"]:.2f}', f'{b["said"]:.2f}',
                 f'{b["right"]} of {b["claims"]}'] for b in sure['bands']], kind='compact',
               caption=f'Expected calibration error {sure["expected_error"]:.3f}, where claims '
               f'that are right as often as they say have {sure["by_chance"]:.3f} on average; '
               f'Brier score {sure["brier"]:.3f}, over {sure["claims"]} claims.')
    _cause_sets(page, summary)
    _conditions(page, summary)


def _cause_sets(page: Page, summary: dict) -> None:
    rows = [(place, name, row) for place, strata in summary['cause_sets'].items()
            for name, row in strata.items()]
    if not any(row['sets'] for *_, row in rows):
        return
    page.section('Whether its sets of causes hold the truth')
    page.table([Column('claims'), Column('stratum'), *(Column(text, number=True) for text in (
        'all cases', 'with such claims', 'causes in a set', 'sets of one', 'with another cause'))],
        [[place, name, f'{row["held"]} of {row["cases"]}',
          f'{row["claiming_held"]} of {row["claiming"]}',
          '–' if row['size'] is None else f'{row["size"]:.2f}',
          f'{row["single"]} of {row["sets"]}', f'{row["another"]} of {row["sets"]}']
         for place, name, row in rows], kind='compact',
        caption='Each claim has a set of causes: the one that leads in share, and further ones. A '
        'case counts if all its sets there hold the truth. Another cause: any that is not listed, '
        'or none.')


def _conditions(page: Page, summary: dict) -> None:
    if not summary['by_tag']:
        return
    page.section('Under which conditions')
    page.table([Column('condition'), Column('right', number=True), Column('cases', number=True),
                Column('95 % interval', number=True)],
               [[tag.replace('_', ' '), _share(entry), _of(entry), _interval(entry)]
                for tag, entry in summary['by_tag'].items()], kind='compact',
               caption='Right: a single effect named first, all of several, nothing said on a '
               'clean recording, no confident wrong name outside the library.')


def _parameters(page: Page, summary: dict) -> None:
    fit = summary['parameters']
    if not fit['by_parameter']:
        return
    page.section('How well the parameters were found')
    rows = []
    for key, row in fit['by_parameter'].items():
        effect, _, name = key.rpartition('.')
        rows.append([f'{_name(effect)}: {parameter_name(name)}', str(row['cases']),
                     percent(row['median_error']), percent(row['median_deviation']),
                     _mean(row['coverage'])])
    rows.append(['all', '', percent(fit['median_error']), percent(fit['median_deviation']),
                 _mean(fit['coverage'])])
    page.table([Column('parameter'), Column('cases', number=True),
                Column('median error', number=True), Column('median deviation', number=True),
                Column('truth inside ± 2 std', number=True)], rows, chosen=[len(rows) - 1],
               caption='Of effects that were rightly claimed, pairs left out. Deviation: for '
               'ratios whose neutral value is 1, the error relative to their distance from 1.')


def _held_out(page: Page, summary: dict, scores: Sequence[CaseScore]) -> None:
    page.section('What the corrected model gains on another recording')
    rows = [[name.replace('_', ' '), _mean(value)]
            for name, value in summary['held_out_removed'].items()]
    where = summary['localisation']
    page.table([Column('stratum'), Column('removed', number=True)], rows, kind='compact',
               caption='Removed energy of the error as a share of what the oracle removes, which '
               'knows the true torque (1: all of it; below 0: worse than the nominal).')
    series = []
    groups = {'clean': ('clean',), 'single': ('strong', 'subtle'), 'several': ('pair', 'triple'),
              'described': ('described', 'outside'), 'undescribed': ('undescribed',)}
    for (name, strata), colour in zip(groups.items(), _COLOURS, strict=True):
        kept = [s for s in scores if s.stratum in strata and s.after is not None and s.floor > 0]
        if kept:
            name = 'outside' if {s.stratum for s in kept} == {'outside'} else name
            series.append(Points(name, [s.before / s.floor for s in kept],
                                 [s.after / s.floor for s in kept], colour))
    if series:
        top = max(s.before / s.floor for s in scores if s.floor > 0)
        page.figure(Figure(
            'Held-out error before and after, in noise floors',
            Axis('nominal model', 'floors'),
            (Panel(Axis('corrected model', 'floors'), (
                Line('no gain', [0.0, top], [0.0, top], 'recorded', 'dash'), *series), 320),),
            alt='Error of the corrected model over that of the nominal model, a point per case.'))
    if where['recall'] is not None:
        page.text(f'Where in time the mismatch lies: precision {where["precision"]:.2f} (chance '
                  f'{where["chance"]:.2f}), recall {where["recall"]:.2f}.')
    told = {stratum: one for stratum, one in summary['variables'].items() if one}
    if told:
        page.table([Column('outside the library'), Column('cases', number=True),
                    Column('right variables', number=True),
                    Column('others beside', number=True), Column('memory', number=True)],
                   [[stratum, str(one['cases']), _mean(one['told']), f'{one["beside"]:.2f}',
                     _mean(one['memory'])] for stratum, one in told.items()], kind='compact',
                   caption='Of the variables that the mismatch truly depends on, the share that '
                   'is named; how many are named beside them; whether memory is told right.')
    begun = summary['onset']
    if begun['begins']:
        off = '' if begun['median_error'] is None else (
            f', off by {begun["median_error"]:.2f} s (median)')
        page.text(f'Onsets in mid-recording: told in {begun["told"]} of {begun["begins"]} cases'
                  f'{off}; told where the effect acts throughout in {begun["invented"]} of '
                  f'{begun["throughout"]}.')
    zones = where['zones']
    if zones['count']:
        page.text(f'Where in position and velocity: the {zones["count"]} named zones hold '
                  f'{percent(zones["energy"])} of the mismatch in {percent(zones["time"])} of the '
                  'time in motion, on average; the share that is said differs from the true one '
                  f'by {percent(zones["said_error"])}.')


def _misses(page: Page, summary: dict) -> None:
    page.section('Every miss')
    if not summary['misses'] and not summary['failures']:
        page.text('None.')
        return
    rows, silent = [], {one['case'] for one in summary['failures']}
    for miss in summary['misses']:
        case = str(miss['case'])
        held = ', '.join(f'{_name(effect)} ({form})' if form else _name(effect)
                         for effect, form in zip(miss['hidden'], miss['as'], strict=True)
                         ) or 'nothing'
        said = ', '.join(f'{_name(effect)} {p:.2f}' for effect, p in miss['claims']) or (
            f'nothing ({miss["verdict"]})')
        link = Html(f'<a href="results/{escape(case)}/report.html">{escape(case)}</a>')
        rows.append([case if case in silent else link,
                     f'{miss["stratum"]}, {miss["motion"]}'
                     + (', refitted' if miss['refitted'] else ''), held, said])
    if rows:
        page.table([Column('case'), Column('kind'), Column('hidden'), Column('said')], rows)
    page.notes([f'{one["case"]} failed: {one["failure"]}' for one in summary['failures']])


def _how(page: Page, summary: dict) -> None:
    page.section('How this was measured')
    if summary['source'] == 'other':
        page.text('The cases come from another hand: another plant, other formulas, other '
                  'conditions. The tool ran as a separate process on copies that held the '
                  'recordings and a nominal model, nothing else.')
        page.table([Column('what'), Column('value', kind='wrap')],
                   [['command', summary['command']], ['cases', str(summary['cases'])]],
                   kind='compact')
        return
    page.text('Each case is a brake drawn at random, simulated by a plant that shares no code '
              'with the tool, with an effect in a formulation that is not the library\'s (a wrong '
              'number, a dead time and a linear shaft have but one form). The tool ran as a '
              'separate process on copies that held two recordings and a nominal model, nothing '
              'else. The digest of the truth was printed before it ran and checked after.')
    page.table([Column('what'), Column('value', kind='wrap')],
               [['truth, SHA-256', summary['digest']], ['seed', str(summary.get('seed'))],
                ['strata', summary.get('strata') or 'the usual mix'],
                ['command', summary.get('command', '')],
                ['cases', str(summary['cases'])]], kind='compact')
