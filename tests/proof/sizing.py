# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How large an effect must be to stand so many times over the noise, after a refit to hide it."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .catalogue import Context, Hidden
from .nominal import low_pass, moving, Nominal, refit, residual, rms
from .references import DiscProfile, Reference
from .sensors import record, Sensors
from .truth_plant import Run, simulate

__all__ = ['Bench', 'joined', 'Sizer']


@dataclass(frozen=True)
class Bench:
    """The training motions, what the disc does meanwhile, the feedforward's errors, the sensors.

    `onset` (recording's index, tick) is where the effect begins; None: it always acts.
    """

    references: tuple[Reference, ...]
    discs: tuple[DiscProfile, ...]
    forward: np.ndarray
    sensors: Sensors
    onset: tuple[int, int] | None = None

    def runs(self, plant: np.ndarray, before: np.ndarray, model: Nominal) -> list[Run]:
        """Run `plant` along all motions; up to the onset it is the plant `before`."""
        for one in (plant, before):
            # The controller knows the model, not the truth, and that only nearly.
            one['ff_inertia'] = model.inertia * self.forward[0]
            one['ff_viscous'] = model.viscous * self.forward[1]
        index, tick = self.onset or (-1, 0)
        both = np.concatenate([before, plant])
        return [simulate(both if k == index else before if k < index else plant, reference, disc,
                         switch=tick if k == index else -1)
                for k, (reference, disc) in enumerate(zip(self.references, self.discs,
                                                          strict=True))]


def joined(runs: list[Run]) -> Run:
    """Several runs as one; each begins and ends at rest, which no residual counts."""
    if len(runs) == 1:
        return runs[0]
    keys = ('position', 'velocity', 'acceleration', 'effort', 'command', 'disc_angle')
    return Run(*(np.concatenate([getattr(run, key) for run in runs]) for key in keys),
               work=sum(run.work for run in runs))


class Sizer:
    """Finds the magnitude whose residual, after a refit, stands `target` times over the noise."""

    def __init__(self, plant: np.ndarray, base: Nominal, hidden: Hidden, bench: Bench,
                 held: tuple[str, ...] = ()) -> None:
        self.plant, self.base, self.hidden, self.bench = plant, base, hidden, bench
        self.locked = tuple({*hidden.locked, *held})
        self.band = min(hidden.cutoff, 0.4 * bench.sensors.rate)
        clean = bench.runs(plant.copy(), plant.copy(), base)
        self.floor = rms(np.array([
            record(run, bench.sensors, np.random.default_rng(7)).floor(run, base, self.band)
            for run in clean]))

    def ratio(self, magnitude: float) -> float:
        """Residual after a refit over the noise floor; infinite where the run failed."""
        plant = self.plant.copy()
        self.hidden.put(plant, magnitude)
        model = self.hidden.lack(self.base, magnitude)
        runs = self.bench.runs(plant, self.plant.copy(), model)
        if any(not run.steady or np.abs(run.position - reference.position).max() > 6.0
               for run, reference in zip(runs, self.bench.references, strict=True)):
            return np.inf
        extra = None
        if self.hidden.beside is not None:
            extra = np.concatenate([
                self.hidden.beside(Context(plant, self.base, run, disc, magnitude))
                for run, disc in zip(runs, self.bench.discs, strict=True)])
        run = joined(runs)
        fitted = refit(model, run, run.effort, self.locked, extra)
        left = residual(fitted, run, run.effort, self.band)
        if extra is not None:
            left = _beside_removed(left, extra, run, self.band)
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
