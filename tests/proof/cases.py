"""Draw a case: a base plant, what it hides and how strongly, two runs, a nominal model."""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import hide_drive, hide_friction, hide_load, hide_numbers, hide_outside  # noqa: F401
from .catalogue import Context, Hidden, known
from .nominal import low_pass, moving, Nominal, refit, residual, rms
from .plant_record import blank_plant
from .references import disc_profile, DiscProfile, Reference, rich, routine, short_test
from .sensors import draw_sensors, record, Recorded, Sensors
from .truth_plant import Run, simulate

__all__ = ['Case', 'Request', 'Sizer', 'Take', 'TARGETS', 'draw_base', 'draw_case']

_TRAINS = ('backlash', 'drivetrain_resonance')
TARGETS = {'strong': 7.0, 'subtle': 2.0, 'pair': 5.0, 'outside': 5.0, 'clean': 0.0}


@dataclass(frozen=True)
class Request:
    """What a case shall be: stratum, effect ids, motion ('rich' or 'routine'), nominal."""

    stratum: str
    effects: tuple[str, ...]
    motion: str
    refitted: bool


@dataclass(frozen=True)
class Take:
    """One recording and what lay behind it."""

    reference: Reference
    disc: DiscProfile
    run: Run
    recorded: Recorded


@dataclass(frozen=True)
class Case:
    """Everything about one case; only `train`'s and `test`'s records and `nominal` go out."""

    request: Request
    plant: np.ndarray
    base: Nominal
    lacking: Nominal
    nominal: Nominal
    hidden: tuple[Hidden, ...]
    magnitudes: tuple[float, ...]
    ratios: tuple[float, ...]
    parameters: tuple[dict[str, float], ...]
    sensors: Sensors
    train: Take
    test: Take
    disc_recorded: bool


def draw_base(rng: np.random.Generator, contact: bool) -> tuple[np.ndarray, Nominal]:
    """A brake with random numbers and gains, as the plant's record and as a model."""
    plant = blank_plant()
    around = rng.uniform(0.7, 1.3, 8)
    if contact:
        at = rng.uniform(4.5, 9.5)
        load = (0.0, 2.9e-3 * around[0], 1.5e-4 * around[1], 2.5e-6 * around[2])
    else:
        at = None
        load = (rng.uniform(0.0, 0.004), 2.3e-3 * around[0], 1.2e-4 * around[1],
                1.8e-6 * around[2])
    lazy = rng.uniform(0.3, 2.0) if rng.random() < 0.15 else 0.0
    wide = rng.random() < 0.15
    inertia = rng.uniform(3e-5, 1.5e-4) if wide else 6.8e-5 * around[3]
    # Some brakes truly have no friction that grows with load: a 0 in the model is no sign.
    gain = 0.0 if rng.random() < 0.15 else rng.uniform(0.06, 0.15)
    base = Nominal(inertia, 1.15e-3 * around[4], load, at, 0.015 * around[5], gain,
                   lazy or rng.uniform(0.05, 0.06))
    plant['inertia'], plant['viscous'], plant['load'] = inertia, base.viscous, load
    plant['contact'] = -1e9 if at is None else at
    plant['coulomb'], plant['gain'], plant['saturation'] = base.coulomb, base.gain, lazy
    scale = np.sqrt(inertia / 6.8e-5)
    plant['kp'], plant['ki'] = rng.uniform(0.25, 0.5) * scale, rng.uniform(1.0, 2.4) * scale
    plant['kd'], plant['limit'] = rng.uniform(0.0045, 0.0065) * scale, 0.75
    return plant, base


def _later(plant: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same plant at another time: a passing fault is over, clocks stand elsewhere."""
    plant = plant.copy()
    plant['fault_kind'] = 0
    plant['runout_phase'], plant['vibe_phase'] = rng.uniform(0.0, 2.0 * np.pi, 2)
    return plant


def _set_feedforward(plant: np.ndarray, model: Nominal, forward: np.ndarray) -> None:
    """The controller knows the model, not the truth, and that only nearly."""
    plant['ff_inertia'] = model.inertia * forward[0]
    plant['ff_viscous'] = model.viscous * forward[1]


def _floor(sensors: Sensors, run: Run, cutoff: float, seed: int) -> float:
    return record(run, sensors, np.random.default_rng(seed)).floor(cutoff)


class Sizer:
    """Finds the magnitude whose residual, after a refit, stands `target` times over the noise."""

    def __init__(self, plant: np.ndarray, base: Nominal, hidden: Hidden, sensors: Sensors,
                 reference: Reference, disc: DiscProfile, forward: np.ndarray) -> None:
        self.forward = forward
        self.plant, self.base, self.hidden = plant, base, hidden
        self.sensors, self.reference, self.disc = sensors, reference, disc
        clean = simulate(plant, reference, disc)
        self.floor = _floor(sensors, clean, hidden.cutoff, 7)

    def ratio(self, magnitude: float) -> float:
        """Residual after a refit over the noise floor; infinite where the run failed."""
        plant = self.plant.copy()
        self.hidden.put(plant, magnitude)
        model = self.hidden.lack(self.base, magnitude)
        _set_feedforward(plant, model, self.forward)
        run = simulate(plant, self.reference, self.disc)
        if not run.steady or np.abs(run.position - self.reference.position).max() > 6.0:
            return np.inf
        extra = None
        if self.hidden.beside is not None:
            extra = self.hidden.beside(Context(plant, self.base, run, self.disc, magnitude))
        fitted = refit(model, run, run.effort, self.hidden.locked, extra)
        left = residual(fitted, run, run.effort, self.hidden.cutoff)
        if extra is not None:
            left = _beside_removed(left, extra, run, self.hidden.cutoff)
        return rms(left) / self.floor

    def find(self, target: float) -> tuple[float, float]:
        """(magnitude, ratio), the ratio as near the target as the bounds allow."""
        low, high = self.hidden.bounds
        at = float(np.sqrt(low * high))
        best = (at, np.nan)
        for _ in range(12):
            got = self.ratio(at)
            if np.isfinite(got) and (np.isnan(best[1])
                                     or abs(np.log(got / target)) < abs(np.log(best[1] / target))):
                best = (at, got)
            if np.isfinite(got) and abs(np.log(got / target)) < 0.08:
                break
            if got > target:
                high = at
            else:
                low = at
            guess = at * (target / got) if np.isfinite(got) and got > 0.05 else 0.0
            inside = low * 1.001 < guess < high * 0.999
            at = guess if inside else float(np.sqrt(low * high))
            if high / low < 1.01:
                break
        return best


def _beside_removed(left: np.ndarray, extra: np.ndarray, run: Run, cutoff: float) -> np.ndarray:
    move = moving(run.velocity)
    side = low_pass(move[:, None] * extra, cutoff=cutoff)[move]
    return left - side @ np.linalg.lstsq(side, left, rcond=None)[0]


def _take(plant: np.ndarray, reference: Reference, disc: DiscProfile, sensors: Sensors,
          rng: np.random.Generator) -> Take:
    run = simulate(plant, reference, disc)
    return Take(reference, disc, run, record(run, sensors, rng))


def draw_case(request: Request, rng: np.random.Generator) -> Case:
    """Draw a case as requested; draws again where the wanted size cannot be reached."""
    target = TARGETS[request.stratum] * float(np.exp(rng.normal(0.0, 0.08)))
    best: tuple[float, tuple] | None = None
    for _ in range(6 if request.effects else 1):
        drawn = _attempt(request, target, rng)
        worst = max((abs(np.log(max(r, 1e-3) / target)) for r in drawn[6]), default=0.0)
        if best is None or worst < best[0]:
            best = (worst, drawn)
        if worst < 0.15:
            break
    assert best is not None
    return _finish(request, best[1], rng)


def _attempt(request: Request, target: float, rng: np.random.Generator) -> tuple:
    plant, base = draw_base(rng, rng.random() < 0.5)
    sensors = draw_sensors(rng)
    plant['counts'] = sensors.counts
    catalogue = known()
    hidden = tuple(catalogue[name](rng, base, request.motion) for name in request.effects)
    hidden = tuple(sorted(hidden, key=lambda one: one.effect in _TRAINS))
    if any(h.effect in ('stribeck_friction', 'presliding_friction') for h in hidden):
        plant['saturation'], base = 0.0, replace(base, saturation=rng.uniform(0.05, 0.06))
    forward = rng.uniform(0.92, 1.08, 2)
    reference = rich(rng) if request.motion == 'rich' else routine(rng)
    needs_disc = any(h.needs_disc for h in hidden)
    recorded = needs_disc or rng.random() < 0.35
    reversing = recorded and rng.random() < 0.25
    disc = (disc_profile(rng, reference, reversing) if recorded else
            DiscProfile(np.zeros(reference.position.size), np.full(reference.position.size, 30.)))
    magnitudes, ratios = [], []
    lacking = base
    for one in hidden:
        size, ratio = Sizer(plant, base, one, sensors, reference, disc, forward).find(target)
        magnitudes.append(size)
        ratios.append(0.0 if np.isnan(ratio) else ratio)
    for one, size in zip(hidden, magnitudes, strict=True):
        one.put(plant, size)
        lacking = one.lack(lacking, size)
    _set_feedforward(plant, lacking, forward)
    return plant, base, lacking, hidden, sensors, magnitudes, ratios, reference, disc, recorded, \
        reversing


def _finish(request: Request, drawn: tuple, rng: np.random.Generator) -> Case:
    (plant, base, lacking, hidden, sensors, magnitudes, ratios, reference, disc, recorded,
     reversing) = drawn
    train = _take(plant, reference, disc, sensors, rng)
    other = short_test(rng, request.motion == 'routine')
    size = other.position.size
    other_disc = (disc_profile(rng, other, reversing) if recorded else
                  DiscProfile(np.zeros(size), np.full(size, 30.0)))
    test = _take(_later(plant, rng), other, other_disc, sensors, rng)
    nominal = lacking
    locked = tuple(name for one in hidden for name in one.locked)
    if request.refitted:
        nominal = refit(lacking, train.run, train.run.effort + train.recorded.noise, locked)
    parameters = tuple(one.describe(Context(plant, base, train.run, disc, size))
                       for one, size in zip(hidden, magnitudes, strict=True))
    return Case(request, plant, base, lacking, nominal, hidden, tuple(magnitudes), tuple(ratios),
                parameters, sensors, train, test, recorded)
