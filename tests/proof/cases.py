# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Draw a case: a machine, what it hides and how strongly, its recordings, a nominal model."""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import (  # noqa: F401
    hide_drive,
    hide_friction,
    hide_load,
    hide_numbers,
    hide_outside,
    hide_undescribed,  # noqa: F401
)
from .catalogue import Context, Hidden, known
from .held_numbers import apply_errors, bend, calibrated, numbers_of, visible_numbers
from .machines import draw_machine, Machine, motions
from .nominal import Nominal, refit, rms
from .references import disc_profile, DiscProfile, Reference
from .sensors import draw_sensors, record, Recorded
from .sizing import Bench, joined, Sizer
from .truth_plant import Run, simulate

__all__ = ['BEGINS', 'Case', 'draw_case', 'Request', 'SIZES', 'Take']

_TRAINS = ('backlash', 'drivetrain_resonance')
# Sizes over the noise floor, drawn evenly on a logarithmic scale; of several each stands alone.
SIZES = {'strong': (3.5, 7.0), 'subtle': (1.3, 3.0), 'pair': (3.0, 6.0), 'triple': (3.0, 6.0),
         'described': (3.0, 7.0), 'undescribed': (3.0, 7.0), 'clean': (1.0, 1.0)}
# Effects that may begin in mid-recording: what starts to rub, to leak, to be measured wrong.
BEGINS = ('torque_offset', 'asymmetric_friction', 'nonlinear_viscous_friction', 'cogging_torque',
          'torque_ripple', 'torque_saturation', 'load_hysteresis', 'self_energizing',
          'disc_runout')
_ATTEMPTS = 5


@dataclass(frozen=True)
class Request:
    """What a case shall be.

    `motion` is rich, routine or brief; `held` names the groups of numbers that the nominal model's
    refit left alone (held_numbers.GROUPS); `shaped`: the load curve has a form of its own;
    `recordings`: how many to train on; `begins`: the effect begins in mid-recording, if it may.
    """

    stratum: str
    effects: tuple[str, ...]
    motion: str
    refitted: bool
    held: tuple[str, ...] = ()
    machine: str = 'brake'
    shaped: bool = False
    recordings: int = 1
    begins: bool = False


@dataclass(frozen=True)
class Take:
    """One recording and what lay behind it."""

    reference: Reference
    disc: DiscProfile
    run: Run
    recorded: Recorded


@dataclass(frozen=True)
class Case:
    """Everything about one case; only the recordings and `nominal` go out."""

    request: Request
    machine: Machine
    plant: np.ndarray
    base: Nominal
    lacking: Nominal
    nominal: Nominal
    hidden: tuple[Hidden, ...]
    magnitudes: tuple[float, ...]
    ratios: tuple[float, ...]
    parameters: tuple[dict[str, float], ...]
    calibration: dict[str, float]
    accepted: tuple[str, ...]
    shape_ratio: float
    onset: tuple[int, int] | None
    bench: Bench
    trains: tuple[Take, ...]
    test: Take
    disc_recorded: bool


@dataclass(frozen=True)
class _Attempt:
    machine: Machine
    plant: np.ndarray
    before: np.ndarray
    base: Nominal
    lacking: Nominal
    hidden: tuple[Hidden, ...]
    magnitudes: tuple[float, ...]
    ratios: tuple[float, ...]
    bench: Bench
    test: tuple[Reference, DiscProfile]
    recorded: bool
    shape_ratio: float


def draw_case(request: Request, rng: np.random.Generator) -> Case:
    """Draw a case as requested; draws again where the wanted size cannot be reached."""
    low, high = np.log(SIZES[request.stratum])
    target = float(np.exp(rng.uniform(low, high)))
    best: tuple[float, _Attempt] | None = None
    for _ in range(_ATTEMPTS if request.effects else 1):
        drawn = _attempt(request, target, rng)
        worst = max((abs(np.log(max(r, 1e-3) / target)) for r in drawn.ratios), default=0.0)
        if best is None or worst < best[0]:
            best = (worst, drawn)
        if worst < 0.15:
            break
    assert best is not None
    return _finish(request, best[1], target, rng)


def _still(reference: Reference) -> DiscProfile:
    return DiscProfile(np.zeros(reference.position.size), np.full(reference.position.size, 30.0))


def _onset(request: Request, hidden: tuple[Hidden, ...], references: list[Reference],
           rng: np.random.Generator) -> tuple[int, int] | None:
    if not request.begins or len(hidden) != 1 or hidden[0].effect not in BEGINS:
        return None
    index = int(rng.integers(0, len(references)))
    return index, int(rng.uniform(0.3, 0.7) * references[index].position.size)


def _attempt(request: Request, target: float, rng: np.random.Generator) -> _Attempt:
    machine, plant, base = draw_machine(rng, request.machine)
    sensors = draw_sensors(rng, 0.6 if request.stratum == 'clean' else 0.17,
                           request.motion == 'brief')
    plant['counts'] = sensors.counts
    catalogue = known()
    hidden = tuple(catalogue[name](rng, base, request.motion) for name in request.effects)
    hidden = tuple(sorted(hidden, key=lambda one: one.effect in _TRAINS))
    if any(h.effect in ('stribeck_friction', 'presliding_friction') for h in hidden):
        plant['saturation'], base = 0.0, replace(base, saturation=rng.uniform(0.05, 0.06))
    references, other = motions(rng, request.machine, request.motion, request.recordings)
    needs_disc = any(h.needs_disc for h in hidden)
    recorded = needs_disc or (machine.kind == 'brake' and rng.random() < 0.35)
    reversing = recorded and rng.random() < 0.25
    discs = [disc_profile(rng, one, reversing) if recorded else _still(one)
             for one in (*references, other)]
    bench = Bench(tuple(references), tuple(discs[:-1]), rng.uniform(0.92, 1.08, 2), sensors,
                  _onset(request, hidden, references, rng))
    straight, magnitudes, ratios = plant.copy(), [], []
    held = numbers_of(request.held) if request.refitted and 'load' in request.held else ()
    held = tuple(name for name in held if name in ('p0', 'p1', 'p2', 'p3', 'contact'))
    for one in hidden:
        size, ratio = Sizer(straight, base, one, bench, held).find(target)
        magnitudes.append(size)
        ratios.append(0.0 if np.isnan(ratio) else ratio)
    shape_ratio = 0.0
    if request.shaped:
        shape_ratio = float(rng.uniform(0.15, 0.4) if request.stratum == 'clean'
                            else rng.uniform(0.6, 3.0))
        floor = _floor(bench, plant, base)
        base = bend(plant, base, bench.references, shape_ratio * floor, rng)
    before, lacking = plant.copy(), base
    for one, size in zip(hidden, magnitudes, strict=True):
        one.put(plant, size)
        lacking = one.lack(lacking, size)
    return _Attempt(machine, plant, before, base, lacking, hidden, tuple(magnitudes),
                    tuple(ratios), bench, (other, discs[-1]), recorded, shape_ratio)


def _floor(bench: Bench, plant: np.ndarray, base: Nominal) -> float:
    runs = bench.runs(plant.copy(), plant.copy(), base)
    return rms(np.array([record(run, bench.sensors, np.random.default_rng(7)).floor(run, base)
                         for run in runs]))


def _later(plant: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same plant at another time: a passing fault is over, clocks stand elsewhere."""
    plant = plant.copy()
    plant['fault_kind'] = 0
    plant['runout_phase'], plant['vibe_phase'] = rng.uniform(0.0, 2.0 * np.pi, 2)
    return plant


def _twins(hidden: tuple[Hidden, ...], held: tuple[str, ...]) -> set[str]:
    """What no recording tells apart: with a free load curve F(±1 + a) is an offset."""
    names = {one.effect for one in hidden}
    found = {'self_energizing'} if 'pad_friction_fade' in names else set()
    if 'load' in held:
        return found
    for one in hidden:
        if one.formulation in ('unequal parts', 'current sensor'):
            found |= {'torque_offset', 'asymmetric_friction'}
    return found


def _finish(request: Request, drawn: _Attempt, target: float, rng: np.random.Generator) -> Case:
    bench, lacking, hidden = drawn.bench, drawn.lacking, drawn.hidden
    runs = bench.runs(drawn.plant, drawn.before, lacking)
    trains = tuple(Take(reference, disc, run, record(run, bench.sensors, rng))
                   for reference, disc, run in zip(bench.references, bench.discs, runs,
                                                   strict=True))
    other, disc = drawn.test
    run = simulate(_later(drawn.plant, rng), other, disc)
    test = Take(other, disc, run, record(run, bench.sensors, rng))
    whole = joined(runs)
    noise = np.concatenate([one.recorded.on_grid(one.run.position.size) for one in trains])
    floor = rms(np.array([one.recorded.floor(one.run, drawn.base) for one in trains]))
    spared = tuple(name for one in hidden for name in one.locked)
    most = 0.3 if request.stratum == 'clean' else max(0.5, 0.25 * target)
    errors = calibrated(lacking, whole, request.held, spared, most * floor, rng)
    nominal = apply_errors(lacking, errors)
    if request.refitted:
        locked = (*numbers_of(request.held), *spared)
        nominal = refit(nominal, whole, whole.effort + noise, locked)
    sayable = visible_numbers(lacking, whole, request.held, errors, floor)
    joint_disc = DiscProfile(np.concatenate([one.speed for one in bench.discs]),
                             np.concatenate([one.temperature for one in bench.discs]))
    parameters = tuple(one.describe(Context(drawn.plant, drawn.base, whole, joint_disc, size))
                       for one, size in zip(hidden, drawn.magnitudes, strict=True))
    names = [one.effect for one in hidden]
    accepted = tuple(sorted({*names, *sayable, *_twins(hidden, request.held)}))
    return Case(request, drawn.machine, drawn.plant, drawn.base, lacking, nominal, hidden,
                drawn.magnitudes, drawn.ratios, parameters, errors, accepted, drawn.shape_ratio,
                bench.onset, bench, trains, test, drawn.recorded)
