# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Cases from another hand: folders with recordings, a nominal model and their truth.

A set is a folder of `case_…`, each with `train` (or `train_1`, `train_2`, …) and `test` as
recordings, `nominal.yaml`, `truth.json` and `truth.npz`. In truth.json: `kind` (single, two,
three, oov: outside the library, consistent), `size`, `effects` with their parameters, `oov`,
`accepted`, `fair`, `tags`, `fs` [Hz], `noise_floor`, `depends_on`, `memory`, and `onset` [s] where
the effect begins within the one recording. In truth.npz, on a grid of 1 ms: of every training
recording its time (first, last, count), what the effect adds and where that counts; of `test` the
noise-free effort, the position as it was measured, and either the torque without the effect
(`test_base`) or, in truth.json, `true_base`. Torques are stored in noise floors.
"""
from __future__ import annotations

from dataclasses import replace
import json
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt
import yaml

from engb_core.errors import InputError

from .locate import Stretch
from .run import recordings_of
from .score import CaseTruth
from .signals import read_samples

__all__ = ['cases_in', 'on_other_motion', 'other_truth']

_TICK = 1e-3
_STRATA = {'two': 'pair', 'three': 'triple', 'oov': 'outside', 'consistent': 'clean'}
_AROUND_GAP = 0.06      # s: of a gap nothing is known this far into its neighbourhood
_ENERGY = ('_effect', '_effort', '_base')


def cases_in(folder: Path) -> list[Path]:
    """The folders of the cases.

    Raises:
        InputError: there are none, or one lacks its truth.
    """
    cases = sorted(path for path in folder.glob('case_*') if path.is_dir())
    if not cases:
        raise InputError(f'--cases-from {folder}: holds no folder case_…; name a folder of cases '
                         'with train, test, nominal.yaml, truth.json and truth.npz')
    for case in cases:
        for name in ('nominal.yaml', 'truth.json', 'truth.npz'):
            if not (case / name).exists():
                raise InputError(f'{case / name}: is missing; a case needs its model and truth')
    return cases


def _low(signal: np.ndarray, rate: float = 1000.0, cutoff: float = 20.0) -> np.ndarray:
    return sosfiltfilt(butter(2, cutoff / (rate / 2.0), output='sos'), signal)


def _load(model: dict, position: np.ndarray) -> np.ndarray:
    load = model['load_torque']
    if load.get('form') == 'sinusoid':
        return load['amplitude'] * np.sin(position + load['phase'])
    contact = load.get('contact_angle')
    s = position if contact is None else position - contact
    value = np.polynomial.polynomial.polyval(s, load['coefficients'])
    return value if contact is None else np.where(s < 0.0, 0.0, value)


def _torque(model: dict, position: np.ndarray, rate: float) -> np.ndarray:
    """Torque [N·m] that a model file says a measured motion needs (contract, section 2)."""
    cutoff = min(100.0, 0.4 * rate)
    smooth = _low(position, rate, cutoff)
    velocity = np.gradient(smooth) * rate
    acceleration = np.gradient(velocity) * rate
    motor, friction = model['motor'], model['friction']
    load = _load(model, smooth)
    torque = (motor['inertia'] * acceleration + motor['viscous_friction'] * velocity + load
              + (friction['coulomb'] + friction['load_gain'] * np.abs(load))
              * np.clip(velocity / friction['saturation_velocity'], -1.0, 1.0))
    for one in model.get('cogging') or []:
        torque = torque + one['amplitude'] * np.sin(one['order'] * smooth + one['phase'])
    return torque


def _on_grid(model: dict, position: np.ndarray, rate: float) -> np.ndarray:
    """The model's torque on the motion as it was logged at `rate`, back on the grid of 1 ms."""
    ticks = np.arange(position.size)
    taken = np.arange(0.0, position.size, 1000.0 / rate)
    return np.interp(ticks, taken, _torque(model, np.interp(taken, ticks, position), rate))


def _known(case: Path, facts: dict, arrays: dict[str, np.ndarray]) -> np.ndarray:
    """Where the motion of `test` determines its torque."""
    known = arrays['test_mask'].copy()
    if facts['faults']:
        longest, time = facts.get('gap_s') or 0.006, _grid(arrays['test_time'])
        stamps = read_samples(recordings_of(case, 'test')[0]).time
        for k in np.flatnonzero(np.diff(stamps) > longest):
            known &= (time < stamps[k] - _AROUND_GAP) | (time > stamps[k + 1] + _AROUND_GAP)
    return known


def _grid(ends: np.ndarray) -> np.ndarray:
    return np.linspace(ends[0], ends[1], int(ends[2]))


def on_other_motion(truth: CaseTruth) -> CaseTruth:
    """Return what is known of a case whose `test` run is diagnosed: what it holds, throughout, but
    neither where it acts nor a motion to predict."""
    return replace(truth, stretches=(), onset=None, held_out_scored=False)


def other_truth(case: Path) -> CaseTruth:
    """Read the truth of one case.

    Raises:
        InputError: it is damaged.
    """
    try:
        facts = json.loads((case / 'truth.json').read_text('utf8'))
        with np.load(case / 'truth.npz', allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        for name in arrays:
            if name.endswith(_ENERGY):
                arrays[name] = arrays[name].astype(float) * facts['noise_floor']
        return _truth(case, facts, arrays)
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f'{case}: truth.json or truth.npz is damaged ({error})') from error


def _truth(case: Path, facts: dict, arrays: dict[str, np.ndarray]) -> CaseTruth:
    nominal = yaml.safe_load((case / 'nominal.yaml').read_text('utf8'))
    true = _low(arrays['test_effort'])
    known, grid = _known(case, facts, arrays), _grid(arrays['test_time'])

    def size(effort: np.ndarray) -> float:
        return float(np.sqrt(np.mean((_low(effort) - true)[known] ** 2)))

    def error(time: np.ndarray, effort: np.ndarray) -> float:
        return size(np.interp(grid, time, effort))

    position = arrays['test_position_measured']
    if 'test_base' in arrays:
        before = size(_on_grid(nominal, position, facts['fs']))
        base = arrays['test_base']
    else:
        before = size(_torque(nominal, position, 1000.0))
        base = _torque(facts['true_base'], position, 1000.0)
    hidden = tuple(one['effect'] for one in facts['effects']) + tuple(facts['oov'])
    parameters = tuple(
        (one['effect'], name, float(value),
         tuple(float(one['parameters'][key]) for key in (f'_alt_{name}',)
               if key in one['parameters']))
        for one in facts['effects'] for name, value in one['parameters'].items()
        if not name.startswith('_'))
    count = facts.get('recordings', 1)
    names = ['train'] if 'train_time' in arrays else [f'train_{k + 1}' for k in range(count)]
    stretches = tuple(
        Stretch(name, _grid(arrays[f'{name}_time']), _low(arrays[f'{name}_effect']) ** 2,
                arrays[f'{name}_mask']) for name in names)
    forms = tuple(str(facts.get('reasonable') or '') for _ in hidden)
    stratum = facts['size'] if facts['kind'] == 'single' else _STRATA[facts['kind']]
    return CaseTruth(
        case.name, stratum, hidden, forms, tuple(facts['accepted']), before,
        size(base + arrays['test_effect']), facts['noise_floor'], error,
        stretches if hidden else (), fair=tuple(facts.get('fair', ())), parameters=parameters,
        tags=tuple(facts.get('tags', ())), motion=str(facts.get('protocol', '')),
        refitted=bool(facts['concealed']),
        depends_on=tuple(tuple(group) for group in facts.get('depends_on', ())),
        memory=bool(facts.get('memory')),
        other_load_shape=facts.get('shape_ratio', 0.0) > 0.5,
        held_out_scored=bool(facts['heldout_scored']),
        onset=None if facts.get('onset') is None or len(names) > 1
        else (names[0], float(facts['onset'])))
