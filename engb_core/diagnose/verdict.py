# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The verdict, and what is said of what no effect explains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import EffectFinding, Unexplained
from engb_core.diagnose.formula import part_of_formula
from engb_core.diagnose.locate import zones
from engb_core.diagnose.objective import added_by
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.noise_like import is_noise
from engb_core.diagnose.score.reduced_chi_square import excess
from engb_core.diagnose.unknown.openset import Explanation

__all__ = ['parity_in_velocity', 'unless_nothing_helps', 'verdict_of', 'with_nearest']

Array = NDArray[np.float64]

# Values at a place of the stroke that are averaged, both ways together, and how much of them
# (correlation) has to be alike or opposite to be called so: four fifths of the mean square.
VALUES_A_PLACE, MOST_OF_IT = 20, 0.6


def verdict_of(fitter: Fitter, nominal: Fit, explanation: Explanation,
               findings: list[EffectFinding],
               further: tuple[tuple[str, float], ...] = ()) -> tuple[str, Unexplained | None]:
    """Return the verdict and, where structure remains, what can be said of it.

    Args:
        fitter: of the problem.
        nominal: the file's fit.
        explanation: what is named and described.
        findings: what is claimed.
        further: (effect, part of the rest that it would take away) of known effects that were not
            chosen beside those that were.
    """
    before = excess(nominal, fitter)
    if is_noise(fitter, nominal):
        return 'consistent', None
    named = explanation.fit
    described = explanation.table is not None or named.hypothesis.has_unnamed
    after = excess(named, fitter)
    if not described and (after <= part_of_formula() * before or is_noise(fitter, named)):
        # Refitted numbers alone, none of which stands out, are an explanation too.
        return 'explained', None
    left = max(0.0, 1.0 - sum(finding.share for finding in findings))
    unexplained = replace(_unexplained(fitter, explanation, left),
                          nearest=further if findings and not explanation.dropped else ())
    return ('partly_explained' if findings else 'unexplained'), unexplained


def unless_nothing_helps(verdict: str, findings: list[EffectFinding], helps: bool) -> str:
    """Return the verdict: where nothing is named, and refitted numbers are no better than the
    file's (`helps`) on what no fit has seen, what they take away was noise."""
    if verdict == 'explained' and not findings and not helps:
        return 'consistent'
    return verdict


def _unexplained(fitter: Fitter, explanation: Explanation, left: float) -> Unexplained:
    fit, table = explanation.fit, explanation.table
    runs = list(fitter.problem.runs)
    unnamed = [index for index, variant in enumerate(fit.hypothesis.variants)
               if variant.effect.unnamed]
    what = fit.residual if table is None else table.predicted
    for index in unnamed:
        what = what + added_by(fitter, fit, index)
    where = zones(runs, fitter.problem.split(what), fitter.problem.model)
    position = np.concatenate([run.motion.position[run.comparison.grid] for run in runs])
    velocity = np.concatenate([run.motion.velocity[run.comparison.grid] for run in runs])
    names = [name for index in unnamed for name in _told_by(fit, index)]
    names += list(table.table.names) if table else []
    if not names:
        names = [zone.variable for zone in where[:2]]
    text = ' '.join(_described(fit, index) for index in unnamed)
    if not text:
        part = 'Less than 1 %' if left < 0.005 else f'{left * 100:.0f} %'
        text = f'{part} of the mismatch is not explained by any known effect'
        if table:
            text += f'; it depends on {" and ".join(table.table.names)}'
        if where:
            text += (f'; most of it lies in {where[0].variable} from {where[0].begin:.3g} to '
                     f'{where[0].end:.3g} {where[0].unit}')
        text += '.'
    if explanation.dropped:
        why = ('clearly more can be explained' if explanation.carried_over else
               'what was kept out of the fit is no better with it')
        text += (f' {" and ".join(explanation.dropped)} would come nearest, but {why}: no name is '
                 'given.')
    memory = any(_remembers(fit, index) for index in unnamed) or (
        table is None and not unnamed and left > 0.3
        and not (where and where[0].variable == 'time'))
    return Unexplained(
        share=left, depends_on=tuple(dict.fromkeys(names)),
        parity_in_velocity=parity_in_velocity(what, position, velocity), memory=memory,
        where=tuple(where), statement=text)


def with_nearest(rest: Unexplained | None) -> Unexplained | None:
    """Return what is unexplained with a sentence on the known effects that are nearest to it."""
    if rest is None or not rest.nearest:
        return rest
    parts = ', '.join(f'{effect} {100.0 * part:.0f} %' for effect, part in rest.nearest)
    return replace(rest, statement=(
        f'{rest.statement} Of the known effects these would take away a part of it: {parts}; '
        'another formula of what is named may miss as much, so none of them is named.'))


def _told_by(fit: Fit, index: int) -> tuple[str, ...]:
    effect = fit.hypothesis.variants[index].effect
    return (effect.reveals,) if effect.tells is None else effect.tells(
        fit.hypothesis.named(fit.vector, index))


def _remembers(fit: Fit, index: int) -> bool:
    effect = fit.hypothesis.variants[index].effect
    return effect.remembers is not None and effect.remembers(
        fit.hypothesis.named(fit.vector, index))


def _described(fit: Fit, index: int) -> str:
    effect = fit.hypothesis.variants[index].effect
    return effect.statement(fit.hypothesis.named(fit.vector, index))


def parity_in_velocity(torque: Array, position: Array, velocity: Array) -> str:
    """Return whether a torque turns with the sign of the velocity: 'odd', 'even', or 'none' where
    neither is most of it.

    At each place of the stroke the means of both ways are compared, as the product of both is to
    the mean of their squares: 1 where they are alike, −1 where they are opposite, and nearer to 0
    the more of either is noise.

    Args:
        torque: (m,) [N·m].
        position: (m,) where [rad].
        velocity: (m,) [rad/s].
    """
    places = max(1, torque.size // VALUES_A_PLACE)
    edges = np.quantile(position, np.linspace(0.0, 1.0, places + 1)[1:-1])
    place = np.searchsorted(edges, position)
    ways = [velocity > 0.0, velocity < 0.0]
    counts = np.array([np.bincount(place[way], minlength=places) for way in ways])
    sums = np.array([np.bincount(place[way], torque[way], places) for way in ways])
    both = counts.min(axis=0) > 0
    if not both.any():
        return 'none'
    up, down = sums[:, both] / counts[:, both]
    weight = counts[:, both].sum(axis=0)
    alike = float(weight @ (up * down)) / max(float(weight @ (up ** 2 + down ** 2)) / 2.0, 1e-300)
    return 'even' if alike > MOST_OF_IT else 'odd' if alike < -MOST_OF_IT else 'none'
