"""The verdict, and what is said of what no effect explains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import EffectFinding, Unexplained
from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.locate import zones
from engb_core.diagnose.numbers import level
from engb_core.diagnose.openset import Explanation
from engb_core.diagnose.selection import CLEAN_EXCESS

__all__ = ['verdict_of']


def verdict_of(fitter: Fitter, nominal: Fit, explanation: Explanation,
               findings: list[EffectFinding], mismatch: NDArray[np.float64],
               ) -> tuple[str, Unexplained | None]:
    """Return the verdict and, where structure remains, what can be said of it."""
    before = max(level(nominal, fitter) - 1.0, 0.0)
    if before <= CLEAN_EXCESS:
        return 'consistent', None
    named = explanation.fit
    described = explanation.table is not None or any(
        variant.effect.unnamed for variant in named.hypothesis.variants)
    after = max(level(named, fitter) - 1.0, 0.0)
    if not described and after <= max(CLEAN_EXCESS, 0.02 * before):
        # Refitted numbers alone, none of which stands out, are an explanation too.
        return 'explained', None
    unexplained = _unexplained(fitter, explanation, min(1.0, after / before))
    return ('partly_explained' if findings else 'unexplained'), unexplained


def _unexplained(fitter: Fitter, explanation: Explanation, left: float) -> Unexplained:
    fit, table = explanation.fit, explanation.table
    runs = list(fitter.problem.runs)
    ends = np.cumsum([run.measured.size for run in runs])[:-1]
    what = fit.residual if table is None else table.predicted
    vibration = [index for index, variant in enumerate(fit.hypothesis.variants)
                 if variant.effect.unnamed]
    where = zones(runs, np.split(what, ends), fitter.problem.model)
    velocity = np.concatenate([run.motion.velocity[run.comparison.grid] for run in runs])
    sign = np.sign(velocity)
    names = tuple(dict.fromkeys(table.table.names)) if table else \
        tuple(zone.variable for zone in where[:2])
    parity = _parity(what, sign)
    if vibration:
        values = fit.hypothesis.values(fit.vector, vibration[0], 0)
        names, parity = ('time',), 'none'
        text = (f'A torque of ±{values[0] * 1e3:.3g} mN·m at a fixed {values[1]:.3g} Hz is there '
                'whatever the brake does; no effect of the library does that.')
    else:
        text = f'{left * 100:.0f} % of the mismatch is not explained by any known effect'
        if table:
            text += f'; it depends on {" and ".join(names)}'
        if where:
            text += (f'; most of it lies in {where[0].variable} from {where[0].begin:.3g} to '
                     f'{where[0].end:.3g} {where[0].unit}')
        text += '.'
    if explanation.dropped:
        text += (f' {" and ".join(explanation.dropped)} would come nearest, but a flexible model '
                 'explains clearly more: no name is given.')
    return Unexplained(share=left, depends_on=names, parity_in_velocity=parity,
                       memory=table is None and not vibration and left > 0.3,
                       where=tuple(where), statement=text)


def _parity(what: NDArray[np.float64], sign: NDArray[np.float64]) -> str:
    odd, even = abs(float(np.mean(what * sign))), abs(float(np.mean(what)))
    return 'odd' if odd > 2.0 * even else 'even' if even > 2.0 * odd else 'none'
