"""The verdict, and what is said of what no effect explains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import EffectFinding, Unexplained
from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.locate import zones
from engb_core.diagnose.numbers import level
from engb_core.diagnose.selection import CLEAN_EXCESS, Selection

__all__ = ['verdict_of']


def verdict_of(fitter: Fitter, nominal: Fit, chosen: Fit, findings: list[EffectFinding],
               selection: Selection, mismatch: NDArray[np.float64],
               ) -> tuple[str, Unexplained | None]:
    """Return the verdict and, where structure remains, what can be said of it."""
    before = max(level(nominal, fitter) - 1.0, 0.0)
    after = max(level(chosen, fitter) - 1.0, 0.0)
    if before <= CLEAN_EXCESS:
        return 'consistent', None
    left = min(1.0, after / before)
    if after <= max(CLEAN_EXCESS, 0.02 * before):
        return ('explained' if findings or not chosen.hypothesis.variants else 'unexplained'), None
    unexplained = _unexplained(fitter, chosen, left)
    return ('partly_explained' if findings else 'unexplained'), unexplained


def _unexplained(fitter: Fitter, chosen: Fit, left: float) -> Unexplained:
    runs = list(fitter.problem.runs)
    ends = np.cumsum([run.measured.size for run in runs])[:-1]
    where = zones(runs, np.split(chosen.residual, ends), fitter.problem.model)
    velocity = np.concatenate([run.motion.velocity[run.comparison.grid] for run in runs])
    sign = np.sign(velocity)
    odd = abs(float(np.mean(chosen.residual * sign)))
    even = abs(float(np.mean(chosen.residual)))
    parity = 'odd' if odd > 2.0 * even else 'even' if even > 2.0 * odd else 'none'
    names = tuple(zone.variable for zone in where[:2])
    text = (f'{left * 100:.0f} % of the mismatch is not explained; '
            + (f'it lies mostly in {where[0].variable} from {where[0].begin:.3g} to '
               f'{where[0].end:.3g} {where[0].unit}.' if where else
               'it is not tied to any coordinate that was recorded.'))
    return Unexplained(share=left, depends_on=names, parity_in_velocity=parity, memory=False,
                       where=tuple(where), statement=text)
