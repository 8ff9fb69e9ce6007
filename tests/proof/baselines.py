"""Plain methods on the same sealed cases, for comparison; they share nothing with the tool.

- `refit`: the nominal's numbers by linear least squares. It names nothing.
- `bic`: forward selection of up to two effects by the Bayesian information criterion. Effects are
  textbook regressors; effort and regressors go through the same 20 Hz filter. A wrong number is
  one column of its own; any other effect comes with all numbers fitted beside it.
- `sparse`: naive sparse regression on smoothed derivatives, unfiltered, by sequential
  thresholding (pysindy's STLSQ where pysindy is installed, else the same method in this file).

Each writes diagnosis.json, corrected.npz (what it predicts of `test`) and nominal.npz, as the
scorer reads them. The name behind a column is the effect whose textbook form it is.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
import json
from pathlib import Path
import shutil
import time as clock

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores
from scipy.signal import lfilter
import yaml

from .nominal import low_pass, moving, Nominal, torque_of

__all__ = ['BASELINES', 'run_baseline', 'sequential_thresholding', 'thresholding_by']

RATE = 500.0
_NUMBERS = ('inertia_error', 'viscous_friction_error', 'coulomb_friction_error',
            'load_stiffness_error', 'contact_shift', 'torque_offset', 'load_dependent_friction')
_THRESHOLD = 0.3   # of the residual's rms: smaller contributions are dropped
_MOST = 2


@dataclass(frozen=True)
class Signals:
    """A recording on an even grid; disc and temperature None where not recorded."""

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    effort: np.ndarray
    disc: np.ndarray | None
    temperature: np.ndarray | None


Columns = dict[str, list[np.ndarray]]


@lru_cache(maxsize=8)
def read_signals(path: Path) -> Signals:
    """Read a bag (the last few are kept); positions and effort low-passed at 150 Hz alike."""
    rows: list[tuple[float, float, float]] = []
    others: dict[str, list[tuple[float, float]]] = {'disc_speed': [], 'pad_temperature': []}
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        wanted = [c for c in reader.connections
                  if c.topic.rsplit('/', 1)[1] in ('joint_states', *others)]
        for link, logged, raw in reader.messages(connections=wanted):
            name, message = link.topic.rsplit('/', 1)[1], reader.deserialize(raw, link.msgtype)
            if name == 'joint_states':
                stamp = message.header.stamp
                rows.append((stamp.sec + 1e-9 * stamp.nanosec, message.position[0],
                             message.effort[0]))
            else:
                others[name].append((1e-9 * logged, message.data))
    table = np.array(rows)
    table = table[np.isfinite(table).all(axis=1)]
    begin = min(row[0] for row in rows)
    stamp, first = np.unique(table[:, 0] - begin, return_index=True)
    fine = np.arange(0.0, stamp[-1], 0.5 / RATE)
    position, effort = (low_pass(np.interp(fine, stamp, table[first, k]), 2.0 * RATE, 150.0)
                        for k in (1, 2))
    velocity = np.gradient(position) * 2.0 * RATE
    smooth = [one[::2] for one in (position, velocity, np.gradient(velocity) * 2.0 * RATE, effort)]
    time = fine[::2]
    extra = []
    for values in others.values():
        data = np.array(values)
        extra.append(np.interp(time, data[:, 0] - begin, data[:, 1]) if values else None)
    return Signals(time, *smooth, *extra)


def read_nominal(path: Path) -> Nominal:
    """The numbers of a nominal model file."""
    content = yaml.safe_load(path.read_text('utf8'))
    motor, load, friction = content['motor'], content['load_torque'], content['friction']
    coefficients = (*load['coefficients'], 0.0, 0.0, 0.0, 0.0)[:4]
    return Nominal(motor['inertia'], motor['viscous_friction'], tuple(coefficients),
                   load['contact_angle'], friction['coulomb'], friction['load_gain'],
                   friction['saturation_velocity'])


def _travel(run: Signals) -> np.ndarray:
    """Angle [rad] since the last reversal of the motion."""
    sign = np.sign(run.velocity) * moving(run.velocity)
    walked = np.cumsum(np.abs(run.velocity)) / RATE
    held = sign[np.maximum.accumulate(np.where(sign != 0, np.arange(sign.size), 0))]
    turns = np.flatnonzero(np.diff(held, prepend=held[0]))
    since = np.zeros(sign.size)
    since[turns] = walked[turns]
    return walked - np.maximum.accumulate(since)


def _lagged(signal: np.ndarray, constant: float) -> np.ndarray:
    keep = np.exp(-1.0 / (RATE * constant))
    return lfilter([1.0 - keep], [1.0, -keep], signal)


def _base(model: Nominal, run: Signals) -> tuple[list[np.ndarray], dict[str, np.ndarray]]:
    """The columns of all linear numbers, and what the other columns are made of."""
    s = run.position if model.contact is None else np.maximum(run.position - model.contact, 0.0)
    touch = np.ones_like(s) if model.contact is None else (s > 0.0) * 1.0
    p = model.load
    load = touch * (p[0] + s * (p[1] + s * (p[2] + s * p[3])))
    slope = touch * (p[1] + s * (2.0 * p[2] + s * 3.0 * p[3]))
    slip = np.clip(run.velocity / model.saturation, -1.0, 1.0)
    friction = (model.coulomb + model.gain * np.abs(load)) * slip
    columns = [run.acceleration, run.velocity, s, s ** 2, s ** 3, slip, np.abs(load) * slip]
    if model.contact is None:
        columns.append(np.ones_like(s))
    return columns, {'load': load, 'slope': slope, 'slip': slip, 'friction': friction}


def candidates(model: Nominal, run: Signals, orders: int) -> Columns:
    """Columns of every effect; variants (`cogging_torque:7`) differ in a nonlinear constant."""
    _, part = _base(model, run)
    load, slope, slip, friction = (part[k] for k in ('load', 'slope', 'slip', 'friction'))
    travel, effort = _travel(run), low_pass(run.effort, RATE)
    found: Columns = {
        'inertia_error': [run.acceleration], 'viscous_friction_error': [run.velocity],
        'coulomb_friction_error': [slip], 'load_stiffness_error': [load],
        'contact_shift': [slope], 'torque_offset': [np.ones_like(load)],
        'load_dependent_friction': [np.abs(load) * slip],
        'torque_saturation': [effort ** 3], 'actuation_lag': [np.gradient(effort) * RATE],
        'drivetrain_resonance': [np.gradient(np.gradient(run.acceleration)) * RATE ** 2],
        'asymmetric_friction': [np.abs(friction)],
        'nonlinear_viscous_friction': [run.velocity * np.abs(run.velocity)],
        'friction_drift': [friction * run.time / 60.0],
    }
    for order in range(1, orders + 1):
        waves = [np.cos(order * run.position), np.sin(order * run.position)]
        found[f'cogging_torque:{order}'] = waves
        found[f'torque_ripple:{order}'] = [effort * wave for wave in waves]
    for speed in (1.0, 3.0, 8.0):
        found[f'stribeck_friction:{speed}'] = [friction * np.exp(-(run.velocity / speed) ** 2)]
    for width in (0.03, 0.1, 0.3):
        found[f'presliding_friction:{width}'] = [-friction * np.exp(-travel / width)]
    for gap in (0.1, 0.3, 0.6):
        found[f'backlash:{gap}'] = [-(load + friction) * (travel < gap)]
    for width in (0.7, 2.0):
        found[f'load_hysteresis:{width}'] = [np.abs(load) * slip * (1 - np.exp(-travel / width))]
    for constant in (0.3, 1.0, 3.0):
        found[f'pad_creep:{constant}'] = [load - _lagged(load, constant)]
    if run.disc is not None:
        turning = np.sign(run.disc) * (np.abs(run.disc) > 1.0)
        angle = np.cumsum(run.disc) / RATE
        found['self_energizing'] = [load * turning]
        found['disc_runout'] = [slope * np.cos(angle), slope * np.sin(angle)]
        if run.temperature is not None:
            found['pad_friction_fade'] = [load * turning * (run.temperature - 25.0) / 100.0]
    return found


def _seen(columns: list[np.ndarray], run: Signals) -> np.ndarray:
    """Columns as a matrix, filtered as the effort is, in motion, at 50 Hz."""
    move = moving(run.velocity)
    low = low_pass(np.stack(columns, axis=1) * move[:, None], RATE)
    return low[np.flatnonzero(move)[::10]]


def _solve(matrix: np.ndarray, target: np.ndarray) -> np.ndarray:
    size = np.sqrt(np.mean(matrix ** 2, axis=0)) + 1e-15
    return np.linalg.lstsq(matrix / size, target, rcond=1e-8)[0] / size


@dataclass(frozen=True)
class Answer:
    """Effects named, the first first, with probabilities; and the torque it adds to a run."""

    claims: list[tuple[str, float]]
    added: Callable[[Signals], np.ndarray]


def _refit_only(model: Nominal, run: Signals) -> Answer:
    columns, _ = _base(model, run)
    target = _seen([run.effort - torque_of(model, run)], run)[:, 0]
    numbers = _solve(_seen(columns, run), target)
    return Answer([], lambda other: np.stack(_base(model, other)[0], axis=1) @ numbers)


def _columns_of(chosen: list[str], model: Nominal, run: Signals, found: Columns
                ) -> list[np.ndarray]:
    """All columns of the chosen: with the model's numbers, unless all of them are numbers."""
    columns = [column for name in chosen if name in found for column in found[name]]
    if all(name in _NUMBERS for name in chosen):
        return columns
    return _base(model, run)[0] + [column for name in chosen if name not in _NUMBERS
                                   and name in found for column in found[name]]


def _bic(model: Nominal, run: Signals) -> Answer:
    found = candidates(model, run, 40)
    names, sizes = list(found), [len(columns) for columns in found.values()]
    base = _base(model, run)[0]
    everything = _seen([run.effort - torque_of(model, run), *base,
                        *(column for columns in found.values() for column in columns)], run)
    target, numbers = everything[:, 0], everything[:, 1:1 + len(base)]
    ends = 1 + len(base) + np.cumsum(sizes)
    seen = {name: everything[:, end - size:end]
            for name, size, end in zip(names, sizes, ends, strict=True)}

    def criterion(chosen: list[str]) -> float:
        plain = all(name in _NUMBERS for name in chosen)
        parts = [seen[name] for name in chosen if plain or name not in _NUMBERS]
        matrix = np.hstack(parts if plain else [numbers, *parts])
        left = target - matrix @ _solve(matrix, target)
        # A constant that was searched for is one more parameter.
        count = matrix.shape[1] + sum(':' in name for name in chosen)
        return target.size * np.log(np.mean(left ** 2)) + count * np.log(target.size)

    chosen: list[str] = []
    claims: list[tuple[str, float]] = []
    best = target.size * np.log(np.mean(target ** 2))
    while len(chosen) < _MOST:
        taken = {name.partition(':')[0] for name in chosen}
        # The numbers are all fitted beside another effect: naming one then means nothing.
        open_names = [name for name in names if name.partition(':')[0] not in taken
                      and not (chosen and name in _NUMBERS and not taken <= set(_NUMBERS))]
        values = [criterion([*chosen, name]) for name in open_names]
        at = int(np.argmin(values))
        if values[at] >= best:
            break
        gain = best - values[at]
        chosen.append(open_names[at])
        claims.append((open_names[at].partition(':')[0], float(1 / (1 + np.exp(-gain / 2)))))
        best = values[at]
    if not chosen:
        return Answer([], lambda other: np.zeros_like(other.time))
    fitted = _solve(_seen(_columns_of(chosen, model, run, found), run), target)

    def added(other: Signals) -> np.ndarray:
        columns = _columns_of(chosen, model, other, candidates(model, other, 40))
        if len(columns) != fitted.size:     # a disc that this recording lacks
            return np.zeros_like(other.time)
        return np.stack(columns, axis=1) @ fitted

    return Answer(claims, added)


def thresholding_by() -> str:
    """Which code does the sparse regression here."""
    try:
        import pysindy
    except ImportError:
        return 'own sequential thresholding (pysindy is not installed)'
    return f'pysindy {pysindy.__version__} (STLSQ)'


def sequential_thresholding(matrix: np.ndarray, target: np.ndarray, threshold: float,
                            ridge: float = 1e-3) -> np.ndarray:
    """Ridge regression; coefficients below `threshold` are dropped, the rest fitted again.

    The method of Brunton, Proctor & Kutz (2016), as pysindy's STLSQ.
    """
    try:
        from pysindy import STLSQ
    except ImportError:
        pass
    else:
        return np.ravel(STLSQ(threshold=threshold, alpha=ridge * target.size, max_iter=20).fit(
            matrix, target[:, None]).coef_)
    kept = np.ones(matrix.shape[1], bool)
    numbers = np.zeros(kept.size)
    for _ in range(20):
        part = matrix[:, kept]
        numbers[:] = 0.0
        numbers[kept] = np.linalg.solve(part.T @ part + ridge * target.size
                                        * np.eye(part.shape[1]), part.T @ target)
        still = np.abs(numbers) >= threshold
        if (still == kept).all() or not still.any():
            return numbers * still
        kept = still
    return numbers


def _sparse(model: Nominal, run: Signals) -> Answer:
    found = candidates(model, run, 8)
    labels = [name for name, columns in found.items() for _ in columns]
    move = np.flatnonzero(moving(run.velocity))[::2]
    matrix = np.stack([column[move] for columns in found.values() for column in columns], axis=1)
    target = (run.effort - torque_of(model, run))[move]
    size = np.sqrt(np.mean(matrix ** 2, axis=0)) + 1e-15
    threshold = _THRESHOLD * float(np.sqrt(np.mean(target ** 2)))
    numbers = sequential_thresholding(matrix / size, target, threshold)
    weight: dict[str, float] = {}
    for label, number in zip(labels, numbers, strict=True):
        if number != 0.0:
            effect = label.partition(':')[0]
            weight[effect] = float(np.hypot(weight.get(effect, 0.0), number))
    ranked = sorted(weight, key=lambda effect: -weight[effect])

    def added(other: Signals) -> np.ndarray:
        columns = [c for group in candidates(model, other, 8).values() for c in group]
        if len(columns) != numbers.size:
            return np.zeros_like(other.time)
        return np.stack(columns, axis=1) @ (numbers / size)

    return Answer([(effect, 1.0) for effect in ranked], added)


BASELINES: dict[str, tuple[str, Callable[[Nominal, Signals], Answer]]] = {
    'refit': ('refit only', _refit_only),
    'bic': ('filtered OMP/BIC', _bic),
    'sparse': ('naive sparse regression', _sparse),
}


def run_baseline(name: str, case: Path, results: Path) -> str | None:
    """Run a baseline on a case's folder; returns what failed, or None."""
    if results.exists():
        shutil.rmtree(results)
    results.mkdir(parents=True)
    start, failure = clock.monotonic(), None
    try:
        _answer(name, case, results)
    except (ArithmeticError, LookupError, ValueError) as error:
        failure = f'{name}: {type(error).__name__}: {error}'
    told = {'seconds': clock.monotonic() - start, 'failure': failure}
    (results / 'run.json').write_text(json.dumps(told), 'utf8')
    return failure


def _answer(name: str, case: Path, results: Path) -> None:
    model = read_nominal(case / 'nominal.yaml')
    train, test = (read_signals(next(p for p in (case / part, case / f'{part}.mcap')
                                     if p.exists())) for part in ('train', 'test'))
    answer = BASELINES[name][1](model, train)
    content = {'effects': [{'effect': effect, 'probability': p, 'parameters': {}}
                           for effect, p in answer.claims],
               'mismatch': {'time': []}, 'verdict': None}
    (results / 'diagnosis.json').write_text(json.dumps(content), 'utf8')
    nominal = torque_of(model, test)
    np.savez(results / 'nominal.npz', time=test.time, effort=nominal)
    np.savez(results / 'corrected.npz', time=test.time, effort=nominal + answer.added(test))
