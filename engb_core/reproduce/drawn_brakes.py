# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Brakes of the paper's kind whose numbers are drawn by chance: nobody chose what is to be found.

Every number lies within ±30 % of the chosen one, the contact anywhere between 2 and 9 rad. They
are of the model's form, so that each number has a true value; their load is the whole mechanism's,
not the cubic that the identification fits, and the drive reckons with the data sheet's K_T.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from engb_core.bench.brake import mean_load_torque
from engb_core.bench.settings import BenchSettings
from engb_core.reproduce import chosen

__all__ = ['draw_brake']

# Numbers lie within this part of the chosen ones either way; the contact between these [rad].
SPREAD = 0.3
CONTACTS = (2.0, 9.0)

# Cogging orders of common motors: slots × poles / their greatest common divisor, per turn.
ORDERS = (6.0, 8.0, 12.0, 24.0)

# The load at the strokes' end is within SPREAD of this [N·m], as in the chosen mechanism.
LARGEST_LOAD = 0.12


def draw_brake(seed: int | Sequence[int], top: float = 20.0) -> BenchSettings:
    """Return the brake of this seed.

    Args:
        seed: any whole number, or several.
        top: the strokes' largest angle [rad], at which the load is LARGEST_LOAD ± 30 %.
    """
    random = np.random.default_rng([2017, *np.atleast_1d(seed).tolist()])

    def about(value: float, spread: float = SPREAD) -> float:
        return float(value * random.uniform(1.0 - spread, 1.0 + spread))

    base = chosen.MECHANISM
    # Lengths of one design differ less than stiffness and friction do, or the lever would jam.
    mechanism = replace(base, lever_input=about(base.lever_input, 0.1),
                        lever_output=about(base.lever_output, 0.1),
                        gear_ratio=about(base.gear_ratio, 0.1),
                        efficiency=1.0 - about(1.0 - base.efficiency))
    contact = float(random.uniform(*CONTACTS))
    mechanism = replace(mechanism, clearance=float(mechanism.posture(contact).pad_onto))
    linear, square = base.clamp_stiffness
    mechanism = replace(mechanism, clamp_stiffness=(about(linear), about(square)))
    load = float(mean_load_torque(replace(chosen.FORM, mechanism=mechanism), top))
    scale = about(LARGEST_LOAD) / load
    mechanism = replace(mechanism, clamp_stiffness=tuple(
        scale * value for value in mechanism.clamp_stiffness))
    form = chosen.FORM
    coulomb = about(form.coulomb)
    return replace(
        form, mechanism=mechanism, torque_constant=about(form.torque_constant),
        inertia=about(form.inertia), viscous_friction=about(form.viscous_friction),
        coulomb=coulomb, breakaway=coulomb, saturation_velocity=about(form.saturation_velocity),
        cogging=((float(random.choice(ORDERS)), about(4e-3),
                  float(random.uniform(-np.pi, np.pi))),),
        # Less friction than holds the wedge back, whichever way the disc turns.
        pad_friction=about(form.pad_friction))
