# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Terms of a model that can be taken out, one at a time, and how a refit would hide the gap."""
from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from . import cases  # noqa: F401  (fills the catalogue)
from .catalogue import known
from .nominal import low_pass
from .signals import RATE, Signals

__all__ = ['COMMAND_EFFECTS', 'has_load', 'hidden_by_refit', 'on_the_command',
           'Term', 'terms_of', 'without_descriptions']

# Names of the contract's additions that no generated case holds: a drive that is told positions.
COMMAND_EFFECTS = ('command_delay', 'command_rate_limit', 'effort_scale_error', 'back_emf',
                   'effort_measurement_lag')

# Of these, what acts on the set-point: the drive then acts on another effort than was recorded.
_ON_THE_COMMAND = ('command_delay', 'command_rate_limit')
_LEAST_SPEED = 0.02     # of the largest: below it the axis counts as standing


@dataclass(frozen=True)
class Term:
    """What is taken out.

    `effect` is the name that the tool should give; `parameter`, `taken` the number that it should
    find; `removed` gives the model without the term.
    """

    effect: str
    text: str
    parameter: str | None
    taken: float | None
    removed: Callable[[dict], dict]


def without_descriptions(model: dict) -> dict:
    """The model with only those effects that have a name."""
    kept = [one for one in model['effects'] if not one['effect'].startswith('unexplained')]
    return {**model, 'effects': kept}


def on_the_command(model: dict) -> bool:
    """Whether a model says that the recorded effort is a command, on which the drive acted
    otherwise than it was recorded."""
    return any(one['effect'] in _ON_THE_COMMAND for one in model['effects'])


def _changed(section: str, name: str, factor: float) -> Callable[[dict], dict]:
    def removed(model: dict) -> dict:
        model = deepcopy(model)
        model[section][name] *= factor
        return model
    return removed


def _half_load(model: dict) -> dict:
    model = deepcopy(model)
    load = model['load_torque']
    if load['form'] == 'sinusoid':
        load['amplitude'] *= 0.5
    else:
        load['coefficients'] = [0.5 * value for value in load['coefficients']]
    return model


def has_load(model: dict) -> bool:
    """Whether a model has a load torque."""
    load = model['load_torque']
    return any(load.get('coefficients', [load.get('amplitude', 0.0)]))


def terms_of(model: dict) -> list[Term]:
    """Every term of a model that holds one: friction goes whole; inertia and load, by half."""
    motor, friction = model['motor'], model['friction']
    found = [Term('inertia_error', 'half of the inertia', 'inertia', motor['inertia'],
                  _changed('motor', 'inertia', 0.5))]
    if motor['viscous_friction'] > 0.0:
        found.append(Term('viscous_friction_error', 'viscous friction', 'viscous_friction',
                          motor['viscous_friction'], _changed('motor', 'viscous_friction', 0.0)))
    if friction['coulomb'] > 0.0:
        found.append(Term('coulomb_friction_error', 'Coulomb friction', 'coulomb',
                          friction['coulomb'], _changed('friction', 'coulomb', 0.0)))
    if friction['load_gain'] > 0.0:
        found.append(Term('load_dependent_friction', 'friction that grows with load', 'load_gain',
                          friction['load_gain'], _changed('friction', 'load_gain', 0.0)))
    if has_load(model):
        found.append(Term('load_stiffness_error', 'half of the load torque', 'scale', 2.0,
                          _half_load))
    found += [_effect(one) for one in model['effects'] if _is_named(one['effect'])]
    return found


def _is_named(effect: str) -> bool:
    """Whether an effect of a model is a cause that the tool may name, those of a drive's command
    among them; and no description of a remainder."""
    return effect in known() or effect in COMMAND_EFFECTS


def _effect(setting: dict) -> Term:
    name = setting['effect']

    def removed(model: dict) -> dict:
        return {**model, 'effects': [one for one in model['effects'] if one['effect'] != name]}

    first = next(iter(setting['parameters']), None)
    value = None if first is None else float(setting['parameters'][first])
    return Term(name, name.replace('_', ' '), first, value, removed)


def hidden_by_refit(model: dict, term: Term, runs: list[tuple[Signals, np.ndarray]]) -> dict:
    """`model` (without `term`) with its other numbers changed to make up for the gap.

    Args:
        model: the mapping of a model file, the term taken out already.
        term: what was taken out.
        runs: recordings, and the torque [N·m] at each sample that the term gave.
    """
    speed = max(float(np.abs(run.velocity).max()) for run, _ in runs)
    names = [name for name, effect in (
        ('inertia', 'inertia_error'), ('viscous_friction', 'viscous_friction_error'),
        ('coulomb', 'coulomb_friction_error'), ('load', 'load_stiffness_error'))
        if effect != term.effect]
    # With a free load curve an offset or an uneven friction is the same recording (hide_numbers).
    if term.effect in ('torque_offset', 'asymmetric_friction') or not _load_of(
            model, runs[0][0].position).any():
        names = [name for name in names if name != 'load']
    rows, targets = [], []
    for run, gap in runs:
        slip = np.clip(run.velocity / max(model['friction']['saturation_velocity'], 1e-9), -1, 1)
        columns = {'inertia': run.acceleration, 'viscous_friction': run.velocity,
                   'coulomb': slip, 'load': _load_of(model, run.position)}
        move = np.abs(run.velocity) > _LEAST_SPEED * speed
        both = np.stack([*(columns[name] for name in names), gap], axis=1) * move[:, None]
        both = low_pass(both, RATE, 10.0)[move][::10]
        rows.append(both[:, :-1])
        targets.append(both[:, -1])
    size = np.sqrt(np.mean(np.vstack(rows) ** 2, axis=0)) + 1e-15
    found = np.linalg.lstsq(np.vstack(rows) / size, np.concatenate(targets), rcond=1e-8)[0] / size
    return _adjusted(model, dict(zip(names, found.tolist(), strict=True)))


def _load_of(model: dict, position: np.ndarray) -> np.ndarray:
    load = model['load_torque']
    if load['form'] == 'sinusoid':
        return load['amplitude'] * np.sin(position + load['phase'])
    contact = load.get('contact_angle')
    s = position if contact is None else np.maximum(position - contact, 0.0)
    return np.polynomial.polynomial.polyval(s, load['coefficients'])


def _adjusted(model: dict, steps: dict[str, float]) -> dict:
    model = deepcopy(model)
    motor, friction, load = model['motor'], model['friction'], model['load_torque']
    motor['inertia'] = max(motor['inertia'] + steps.get('inertia', 0.0), 0.2 * motor['inertia'])
    motor['viscous_friction'] = max(
        motor['viscous_friction'] + steps.get('viscous_friction', 0.0), 0.0)
    friction['coulomb'] = max(friction['coulomb'] + steps.get('coulomb', 0.0), 0.0)
    factor = 1.0 + steps.get('load', 0.0)
    if load['form'] == 'sinusoid':
        load['amplitude'] *= factor
    else:
        load['coefficients'] = [factor * value for value in load['coefficients']]
    return model
