# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The top of the diagnosis page: the verdict as a sentence, its numbers, the key figures."""

from __future__ import annotations

import math

from engb_core.diagnose.diagnosis import Diagnosis, QualityOfFit
from engb_core.report.layout import Page
from engb_core.report.text import escape, Html, shorten
from engb_core.report.wording import (
    coordinate,
    effect_name,
    headline,
    largest_change,
    percent,
    probability,
    quantities,
    quantity,
)

__all__ = ['VERDICTS', 'add_verdict', 'recordings']

VERDICTS = {'consistent': ('Consistent', 'good'), 'explained': ('Explained', 'info'),
            'partly_explained': ('Partly explained', 'warn'),
            'unexplained': ('Unexplained', 'warn')}


def add_verdict(page: Page, diagnosis: Diagnosis) -> None:
    """Add the header: verdict, lead and key figures."""
    word, tone = VERDICTS[diagnosis.verdict]
    names = recordings(diagnosis)
    listed = ', '.join(shorten(name, 48) for name in names[:3])
    more = f' and {len(names) - 3} more' if len(names) > 3 else ''
    eyebrow = Html(f'<b>{escape(word)}</b>' + (f' · {escape(listed + more)}' if names else ''))
    page.header(eyebrow, headline(diagnosis), _lead(diagnosis), tone=tone, key=_key(diagnosis))


def recordings(diagnosis: Diagnosis) -> list[str]:
    """Return the names of all recordings that the diagnosis speaks of, in order."""
    evidence = diagnosis.evidence
    names = [*(trace.recording for trace in evidence.traces),
             *(entry.recording for entry in diagnosis.held_out),
             *(entry.recording for entry in diagnosis.time)]
    return list(dict.fromkeys(names))


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
        if diagnosis.timing is None:
            return [text]
        said = diagnosis.timing.statement
        if fit:
            said += f' With that in it, it misses by {quantity(fit.rms_after, fit.unit)} rms.'
        return [text, said]
    if diagnosis.verdict == 'explained' and not diagnosis.effects:
        text = (f'Other numbers in the model take the mismatch away{largest_change(diagnosis)}. '
                'The corrected model holds them.')
        return [text, gain] if gain else [text]
    if left is not None and left.load_is_absent:
        with_it = f'The corrected model holds that load: go on with it. {gain}' \
            if fit and fit.rms_after < fit.rms_before else ''
        return [left.statement, with_it] if with_it else [left.statement]
    if diagnosis.verdict == 'unexplained' or not diagnosis.effects:
        text = ('The mismatch is real, but no effect in the catalogue describes it well enough '
                'to be named; a wrong name would be worse than none.')
        if fit and fit.rms_after < fit.rms_before:
            gain = ('It can be modelled all the same, as a function of what it depends on. '
                    f'{gain}')
        return [text, gain] if gain else [text]
    lines = [entry.statement.strip() for entry in diagnosis.effects[:2] if entry.statement]
    lines = [line if line.endswith(('.', '!', '?')) else f'{line}.' for line in lines]
    if fit and fit.rms_after == fit.rms_before:
        gain = ('No fit of this makes the model better on what it was not fitted to, so the '
                'corrected model is the file as it was given.')
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
    for name in ('effort', 'position'):
        fit = _pooled(diagnosis, name)
        if fit is None:
            continue
        title = f'Held-out {_effort(fit)} error' if name == 'effort' else 'Closed-loop position'
        if not diagnosis.corrects:
            value = quantity(fit.rms_before, fit.unit)
        else:
            value = '\u00a0→ '.join(quantities((fit.rms_before, fit.rms_after), fit.unit))
        floor = (f'noise floor {quantity(fit.noise_floor, fit.unit, 2)}'
                 if fit.noise_floor is not None else 'rms error on held-out recordings')
        items.append((title, value, floor))
    return items


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
