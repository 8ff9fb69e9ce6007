# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model file without any load curve, held against a machine that has a load.

No effect of the library stands for a whole load that is missing: each takes a little of it, and
would be given a name for that. A first model, identified from the same recordings alone, says
whether they determine a load at all (by prediction of blocks that it has not seen), and how much
of the mismatch that load is. Friction that grows with the load is part of that: without the load
no number of the file stands for it, and no fit that has none can find it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import LARGER_PART, PARAMETER_PRICE
from engb_core.diagnose.diagnosis import Unexplained
from engb_core.diagnose.evidence import pooled, unseen_errors
from engb_core.diagnose.locate import zones
from engb_core.diagnose.nominal import CURVATURE
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import holding
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.errors import InputError
from engb_core.identify.first_model import first_model
from engb_core.model import Model
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques

__all__ = ['AbsentLoad', 'absent_load']

_NO_LOAD = ('none', 'offset')


@dataclass(frozen=True)
class AbsentLoad:
    """A load that the file does not have.

    Attributes:
        share: of the mismatch's mean square that the load is.
        form: the load's, in words.
        left: mean square [(N·m)²], weighted as in fits, that the load leaves.
        residual: (m,) mismatch that the load takes away [N·m].
        model: the file with the load, and its numbers refitted beside it.
    """

    share: float
    form: str
    left: float
    residual: NDArray[np.float64]
    model: Model

    def is_plainer(self, fitter: Fitter, explanation: Explanation) -> bool:
        """Whether the load is to be told rather than `explanation`: that leaves more of the
        mismatch, or no less than its further values take away by chance (a wave of one period per
        revolution is a load as well), or is itself no more than a description without a name."""
        fit = explanation.fit
        unnamed = [variant.effect.unnamed for variant in fit.hypothesis.variants]
        further = fit.hypothesis.size - len(fit.hypothesis.numbers) - _values(self.model)
        chance = math.exp(PARAMETER_PRICE * max(0, further))
        as_good = self.left < chance * _weighted(fitter, fit.residual)
        if unnamed and not any(unnamed):
            # Physics with a name, which no description of its rest makes less of.
            return as_good
        return explanation.table is not None or any(unnamed) or as_good

    def unexplained(self, fitter: Fitter) -> Unexplained:
        """Return what is said of it."""
        problem = fitter.problem
        return Unexplained(
            share=1.0, depends_on=('position',), parity_in_velocity='even', memory=False,
            where=tuple(zones(list(problem.runs), problem.split(self.residual), problem.model)),
            statement=f'The model file has no load torque; {self.share:.0%} of the mismatch is a '
            f'load over position ({self.form}). Identify it first, and diagnose with it: no other '
            'name is given beside a load that is missing.', load_is_absent=True)

    def corrected(self, problem_model: Model, fitter: Fitter) -> Model:
        """Return the file with the load, if that is better on what no fit has seen."""
        before = unseen_errors(fitter.problem, problem_model)
        after = unseen_errors(fitter.problem, self.model)
        return self.model if pooled(after) <= pooled(before) else problem_model


def absent_load(fitter: Fitter, nominal: Fit) -> AbsentLoad | None:
    """Return the load that the recordings show and the model file lacks altogether, or None.

    Args:
        fitter: of the file's problem.
        nominal: the file as it is.
    """
    problem = fitter.problem
    model = problem.model
    positions = np.concatenate([run.motion.position for run in problem.runs])
    if np.ptp(load_torques(nominal_vector(model), positions)) > 0.0 or model.effects:
        return None
    try:
        first = first_model([run.recording for run in problem.runs], model.joint)
    except InputError:      # too little motion to tell a load
        return None
    form = first.scores[0].form
    if form in _NO_LOAD:
        return None
    with_load = replace(
        model, load_torque=first.model.load_torque, friction=replace(
            first.model.friction, saturation_velocity=model.friction.saturation_velocity),
        motor=replace(model.motor, inertia=first.model.motor.inertia,
                      viscous_friction=first.model.motor.viscous_friction))
    beside = Fitter(holding(problem, with_load), fitter.threads)
    found = beside.base(tuple(number for number in beside.numbers if number.name != CURVATURE))
    left = _weighted(fitter, found.residual)
    # Its numbers refitted, with no effect and so without a load.
    without = _weighted(fitter, fitter.base().residual)
    mismatch = _weighted(fitter, nominal.residual)
    share = (without - left) / mismatch if mismatch > 0.0 else 0.0
    if share < LARGER_PART:
        return None
    return AbsentLoad(share, form, left, nominal.residual,
                      found.hypothesis.corrected(found.vector))


def _values(model: Model) -> int:
    """Return how many values of a model's load, and of friction that grows with it, were fitted.
    """
    load, loaded = model.load_torque, model.friction.load_gain != 0.0
    if load.form == 'sinusoid':
        return 2 + loaded
    return loaded + (sum(value != 0.0 for value in load.coefficients)
                     + (load.contact_angle is not None))


def _weighted(fitter: Fitter, residual: NDArray[np.float64]) -> float:
    weight = 1.0 / fitter.spread ** 2
    return float(np.sum(weight * residual ** 2) / np.sum(weight))
