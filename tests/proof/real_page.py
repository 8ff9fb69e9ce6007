# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The conceal-one-term test on real recordings as a page."""
from __future__ import annotations

from engb_core.report.layout import Column, Page
from engb_core.report.text import escape, Html
from engb_core.report.wording import capital, effect_name, parameter_name, percent

from .real_text import sums_of

__all__ = ['real_page']

_JUST = ('just it', 'just both')
_GOOD = (*_JUST, 'first', 'both')
_MEANING = {
    'just both': 'just both', 'both': 'both, others beside them', 'one of both': 'one of both',
    'just it': 'just it', 'first': 'first, others beside it', 'not first': 'it, but not first',
    'another': 'something else', 'nothing': 'nothing new',
    'cannot tell': 'named with nothing taken out, too'}


def real_page(result: dict, *, backend: str | None = None) -> Page:
    """The page; `result` as in real.json, `backend` as in `Page`."""
    page = Page('engb prove --real', backend=backend)
    rows = [row for one in result['sets'] for row in one['rows']
            if row['taken'] and row['verdict'] != 'cannot tell']
    just = sum(row['verdict'] in _JUST for row in rows)
    good = sum(row['verdict'] in _GOOD for row in rows)
    page.header(
        f'Real recordings · {result["date"]}',
        f'In {just} of {len(rows)} models of a real machine that lacked a term, or two, just that '
        'was named',
        [f'In {good} it was named first, or both were. The recordings are what they are: only the '
         'model that the tool is handed lacks a term.'], tone='info', key=[
             ('named, nothing else', f'{just}', f'of {len(rows)} models'),
             ('named first', f'{good}', f'of {len(rows)} models'),
             ('seconds', f'{sum(r["seconds"] for r in rows) / max(len(rows), 1):.1f}',
              'a diagnosis, on average')])
    for one in result['sets']:
        _ladder(page, one)
        _spread(page, one)
        _transfer(page, one)
        _expected(page, one)
        _rows(page, one)
    page.section('How this was measured')
    page.text('The tool corrected the nominal model of each machine, as a separate process; its '
              'corrected model is the best one. One term at a time was taken out of it, and the '
              'tool ran on what was left: the other numbers as they were, or refitted to hide the '
              'gap. What it names with nothing taken out does not count for or against it. '
              'Held-out recordings were in no fit.')
    page.table([Column('what'), Column('value', kind='wrap')],
               [['command', result['command']],
                ['seconds in all', f'{result["wall_seconds"]:.0f}']], kind='compact')
    page.footer('engb prove --real. real.json holds the numbers, real/ each diagnosis and report.')
    return page


def _percent(value: float | None) -> str:
    return '–' if value is None else f'{100.0 * value:.2f} %'


def _number(value: float | None) -> str:
    return '–' if value is None else f'{value:.3g}'


# What a fit may see, and what is held out, of force and position.
_RUNG = (Column('model'), Column('force, fit', number=True), Column('held out', number=True),
         Column('moving', number=True), Column('in the loop, fit', number=True),
         Column('held out', number=True), Column('driven, fit', number=True),
         Column('held out', number=True))
_MOVED = (_RUNG[0], Column('force', number=True), _RUNG[3], Column('in the loop', number=True))


def _rung(rung: dict) -> list[str]:
    return [rung['rung'], _percent(rung['force']['train']), _percent(rung['force']['holdout']),
            _percent(rung['moving']['holdout']), *(
                _number(rung[kind][part]) for kind in ('position', 'driven')
                for part in ('train', 'holdout'))]


def _ladder(page: Page, one: dict) -> None:
    page.section(f'{one["name"]}: how well each kind of model predicts it')
    rows = [_rung(rung) for rung in one['ladder']]
    for entry in one['published']:
        numbers = [entry['train'], entry['holdout']]
        blank = ['–', '–']
        cells = {'force': [*(_percent(n) for n in numbers), '–', *blank, *blank],
                 'position': [*blank, '–', *(_number(n) for n in numbers), *blank],
                 'driven': [*blank, '–', *blank, *(_number(n) for n in numbers)]}
        rows.append([f'published, {entry["who"]}', *cells[entry['measure']]])
    page.table(list(_RUNG), rows, kind='compact',
               caption='Force: |recorded − predicted| / |recorded| at 100 Hz (the EMPS '
               'benchmark\'s measure). Moving: the same held out while the shaft moves, up to '
               f'{one["band"]:.0f} Hz. In the loop, driven: rms of position, m or rad, recorded '
               'minus simulated in the closed loop, or with no loop, driven by the recorded '
               'effort from the first position to the end of the recording (– where that effort '
               'is a command). Fitted driven: so that the driven position is right where it may '
               'be fitted. '
               f'Recordings: {one["train"]} to fit, {one["holdout"]} held out.')


def _spread(page: Page, one: dict) -> None:
    found = one['spread']
    page.subsection('Its numbers on each recording')
    if not found['rows']:
        page.text('The tool named and changed no number.')
        return
    if found['folds'] < 2:
        page.text('One recording that cannot be cut has no spread.')
        return
    rows = []
    for row in found['rows']:
        label = parameter_name(row['number'])
        rows.append([f'{label} ({effect_name(row["effect"])})' if row['effect'] else label,
                     _number(row['value']), _number(row['told']),
                     f'{row["telling"]} of {found["folds"]}', _number(row['spread']),
                     _number(row['own']), _ratio(row['ratio']), _number(row['mean']),
                     _number(row['scatter'])])
    page.table([Column('number'), Column('model', number=True), Column('told ±', number=True),
                Column('tell it', number=True), Column('apart', number=True),
                Column('own ±', number=True), Column('ratio', number=True),
                Column('mean', number=True), Column('scatter ±', number=True)], rows,
               kind='compact',
               caption='The best model\'s numbers, the same causes all the time, fitted anew to '
               f'each of {found["folds"]} {found["kind"]}. Tell it: those whose own deviation '
               '(residual and its colour) tells the number from nothing; only they count. Apart: '
               'their standard deviation, beside the root mean square of their own ones; a ratio '
               'of 1 says that they lie apart as they say themselves. Scatter: the deviation that '
               'this gives to their weighted mean; the one that the tool told of all recordings '
               'together should be no smaller.')
    if found['idle']:
        page.text('Told, but without influence on these recordings: ' + ', '.join(
            parameter_name(name) for name in found['idle']) + '.')


def _ratio(value: float | None) -> str:
    return '–' if value is None else f'{value:.2f}'


def _transfer(page: Page, one: dict) -> None:
    found = one['transfer']
    if found is None:
        return
    page.subsection(f'The model of another unit, {found["of"]}, on this one')
    page.table(list(_MOVED),
               [[cell for place, cell in enumerate(_rung(rung)) if place in (0, 2, 3, 5)]
                for rung in found['rungs']], kind='compact',
               caption='Held-out recordings of this unit; force, moving and position as above.')
    page.table([Column('number'), Column(found['of'], number=True),
                Column('refitted here', number=True)],
               [[parameter_name(entry['number']), _number(entry['first']), _number(entry['here'])]
                for entry in found['numbers']], kind='compact')


def _rows(page: Page, one: dict) -> None:
    page.subsection('Terms taken out')
    rows = []
    for row in one['rows']:
        link = Html(f'<a href="real/{escape(one["name"])}/{escape(row["folder"])}/report.html">'
                    f'{escape(row["text"])}</a>')
        said = ', '.join(f'{effect_name(effect)} {p:.2f}' for effect, p in row['claims']) \
            or 'nothing'
        rows.append([link, 'refitted' if row['refitted'] else 'as they were', said,
                     _MEANING.get(row['verdict'], '–'), _value(row),
                     f'{row["times_best"]:.2f}', f'{row["after_times_best"]:.2f}'])
    page.table([Column('taken out'), Column('other numbers'), Column('named'), Column('which is'),
                Column('its number'), Column('held out before', number=True),
                Column('after', number=True)], rows,
               caption='Held-out effort error as the tool reports it, over that of the best '
               'model. Below about 1.1 before, what was taken out can hardly be seen.')
    counted = [row['verdict'] for row in one['rows']
               if row['taken'] and row['verdict'] != 'cannot tell']
    just = sum(verdict in _JUST for verdict in counted)
    page.text(f'Just what was taken out: {percent(just / max(len(counted), 1))} of '
              f'{len(counted)} models. ' + ' '.join(
                  f'{capital(line)}.' for line in sums_of(one['rows'])))


def _expected(page: Page, one: dict) -> None:
    if not one['expected']:
        return
    page.subsection('What an expert expects, and what was said of the nominal model')
    rows = []
    for entry in one['expected']:
        if 'beside' in entry:
            continue
        number = '–' if entry['value'] is None else (
            f'{parameter_name(entry["parameter"])} {entry["value"]:.3g}, expected '
            f'{entry["low"]:.3g} to {entry["high"]:.3g}')
        rows.append([' or '.join(effect_name(name) for name in entry['names']),
                     'sure' if entry['sure'] else 'likely',
                     _told(entry), f'{entry["probability"]:.2f}', number])
    page.table([Column('expected'), Column('how sure'), Column('named'),
                Column('probability', number=True), Column('its number')], rows)
    beside = one['expected'][-1]['beside']
    page.text('Beside it, at 0.5 and more: ' + (', '.join(
        f'{effect_name(name)} {p:.2f}' for name, p in beside) or 'nothing') + '.')


def _told(entry: dict) -> str:
    if entry['said'] is not None:
        return effect_name(entry['said'])
    causes = ' or '.join(effect_name(name) for name in entry['in_set'])
    return f'as a set: {causes}' if causes else 'not named'


def _value(row: dict) -> str:
    if row['said'] is None or row['value'] is None:
        return '–'
    std = '' if row['std'] is None else f' ± {row["std"]:.2g}'
    return f'{parameter_name(row["parameter"])} {row["said"]:.4g}{std}, taken {row["value"]:.4g}'
