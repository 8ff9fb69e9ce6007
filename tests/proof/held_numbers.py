# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which numbers a refit held, how well they had been calibrated, and load curves of other forms.

Both are drawn without regard to what a case hides: neither the held numbers nor the form of the
load curve tells it. A number that was held is 1 to 3 % off, but by no more than a part of what is
hidden (on a clean recording: of the noise), else it would itself be the mismatch.
"""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects_load import curves
from .hide_numbers import LOAD_NUMBERS
from .nominal import load_of, low_pass, moving, Nominal, refit, residual, rms, torque_of
from .references import Reference
from .truth_plant import Run

__all__ = ['apply_errors', 'bend', 'calibrated', 'draw_held', 'GROUPS', 'numbers_of',
           'visible_numbers']

# Numbers that one holds together, and the name of the effect that a wrong one of them is.
GROUPS = {'inertia': (('inertia',), 'inertia_error'),
          'viscous': (('viscous',), 'viscous_friction_error'),
          'load': (LOAD_NUMBERS, 'load_stiffness_error'),
          'coulomb': (('coulomb',), 'coulomb_friction_error'),
          'gain': (('gain',), 'load_dependent_friction'),
          'saturation': (('saturation',), None)}
_HELD = 0.3         # the chance that a refit held a group
_SAYABLE = 0.5      # noise floors from which a calibration error may rightly be named


def draw_held(rng: np.random.Generator, refitted: bool) -> tuple[str, ...]:
    """Groups of numbers that were held: all of them where nothing was refitted."""
    return tuple(name for name in GROUPS if not refitted or rng.random() < _HELD)


def numbers_of(held: tuple[str, ...]) -> tuple[str, ...]:
    """The model's numbers in these groups."""
    return tuple(number for name in held for number in GROUPS[name][0])


def _off(model: Nominal, group: str, share: float) -> Nominal:
    if group == 'load':
        a, b, c, d = (1.0 + share) * np.asarray(model.load)
        return replace(model, load=(float(a), float(b), float(c), float(d)))
    return replace(model, **{group: getattr(model, group) * (1.0 + share)})


def _left(model: Nominal, true: Nominal, run: Run, held: tuple[str, ...]) -> float:
    effort = torque_of(true, run)
    return rms(residual(refit(model, run, effort, numbers_of(held)), run, effort))


def calibrated(true: Nominal, run: Run, held: tuple[str, ...], spared: tuple[str, ...],
               most: float, rng: np.random.Generator) -> dict[str, float]:
    """Relative errors of the held groups (`spared` numbers stay); `most` [N·m] is left of all."""
    errors = {name: float(rng.choice((-1.0, 1.0)) * rng.uniform(0.01, 0.03)) for name in held}
    errors = {name: share for name, share in errors.items()
              if not set(GROUPS[name][0]) & set(spared)}
    for _ in range(4):
        model = true
        for name, share in errors.items():
            model = _off(model, name, share)
        left = _left(model, true, run, held)
        if left <= most:
            break
        errors = {name: share * 0.9 * most / left for name, share in errors.items()}
    return errors


def apply_errors(model: Nominal, errors: dict[str, float]) -> Nominal:
    """The model with its held numbers off by their calibration errors."""
    for name, share in errors.items():
        model = _off(model, name, share)
    return model


def visible_numbers(true: Nominal, run: Run, held: tuple[str, ...], errors: dict[str, float],
                    floor: float) -> tuple[str, ...]:
    """Names of wrong numbers that stand above the noise: to say them is right."""
    return tuple(str(GROUPS[name][1]) for name, share in errors.items() if GROUPS[name][1]
                 and _left(_off(true, name, share), true, run, held) > _SAYABLE * floor)


def bend(plant: np.ndarray, base: Nominal, references: tuple[Reference, ...], size: float,
         rng: np.random.Generator) -> Nominal:
    """Bend the plant's load curve so that its model's form misses it by `size` [N·m] rms.

    Returns the model with the curve of its form that fits best.
    """
    place = np.concatenate([one.position for one in references])
    move = moving(np.concatenate([one.velocity for one in references]))
    start = base.contact or 0.0
    span = place[move].max() - max(start, place[move].min())
    plant['bend_kind'] = int(rng.integers(1, 4))
    plant['bend_at'] = rng.uniform(0.35, 0.7) * span + max(start, place[move].min()) - start
    plant['bend_width'] = rng.uniform(0.06, 0.18) * span
    plant['bend'] = 0.0
    straight = curves(plant, place)
    plant['bend'] = 1.0
    shape = curves(plant, place) - straight
    columns = np.stack([load_of(replace(base, load=tuple(np.eye(4)[k])), place)
                        for k in range(4)], axis=1)
    keep = np.flatnonzero(move)[::7]
    best = np.linalg.lstsq(columns[keep], shape[keep], rcond=None)[0]
    left = rms(low_pass(move * (shape - columns @ best))[move])
    most = float(size / max(left, 1e-12))
    plant['bend'] = most
    a, b, c, d = np.asarray(base.load) + most * best
    return replace(base, load=(float(a), float(b), float(c), float(d)))
