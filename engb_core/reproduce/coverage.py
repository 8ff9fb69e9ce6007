"""How good is `engb identify`? Many drawn brakes, each identified blind: errors and coverage.

What one recording shows may be luck. Here each number is judged on many brakes: how far it is
off, how often its 2σ interval holds the truth, and how often the contact is told as found.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from engb_core.control.reference import ReferenceSettings
from engb_core.identify.procedure import IdentifiedModel, identify
from engb_core.model import Model, Motor
from engb_core.reproduce.bench import run_experiment
from engb_core.reproduce.drawn_brakes import draw_brake
from engb_core.reproduce.plan import PLAN
from engb_core.statics import load_values

__all__ = ['BrakeOutcome', 'identify_drawn', 'REFERENCES', 'study', 'summarise']

# What is driven: the strokes of the reproduction (6 s), and strokes for the contact's sake:
# slow ones through it, and each amplitude thrice (60 s).
REFERENCES = {
    'strokes': ReferenceSettings(kind='strokes', amplitudes=(8.0, 14.0, 20.0),
                                 slow_range=(0.0, 0.0)),
    'thorough': ReferenceSettings(kind='strokes', amplitudes=(8.0, 14.0, 20.0), repetitions=3,
                                  slow_speeds=(2.0, 4.0, 8.0), slow_range=(0.0, 12.0)),
}

ANGLES = np.linspace(0.5, 19.5, 191)


@dataclass(frozen=True)
class BrakeOutcome:
    """One brake: by name, (true value, estimate, standard deviation).

    Attributes:
        seed: of `draw_brake`.
        numbers: J, B, C₀, C₁, ω_s, contact, cogging amplitude.
        determined: the contact is told as found.
        band: part of the angles at which the load's 2σ band holds the true load.
        load_rms: of the load's error over the strokes [N·m].
        orders: of the cogging found, and the true ones.
    """

    seed: int
    numbers: dict[str, tuple[float | None, float, float]]
    determined: bool
    band: float
    load_rms: float
    orders: tuple[tuple[float, ...], tuple[float, ...]]


def identify_drawn(seed: int, reference: str = 'strokes') -> BrakeOutcome:
    """Draw a brake, record strokes on it, identify it from a start that knows nothing of it."""
    brake = draw_brake(seed).model
    settings = REFERENCES[reference]
    trajectory = settings.trajectory()
    assert trajectory is not None, 'strokes have a trajectory'
    duration = trajectory.duration + 0.3
    plan = next(entry for entry in PLAN if entry.name == 'strokes')
    recording = run_experiment(replace(plan, brake=brake, reference=settings, duration=duration),
                               Model(motor=Motor()), seed)
    return judge(seed, brake, identify([recording]))


def judge(seed: int, brake: Model, found: IdentifiedModel) -> BrakeOutcome:
    """Compare what was found with the true numbers."""
    friction = brake.friction
    true = {'inertia': brake.motor.inertia, 'viscous_friction': brake.motor.viscous_friction,
            'coulomb': friction.coulomb, 'load_gain': friction.load_gain,
            'saturation_velocity': friction.saturation_velocity,
            'contact_angle': brake.load_torque.contact_angle}
    numbers: dict[str, tuple[float | None, float, float]] = {}
    for name, value in true.items():
        estimate = found.estimates.get(name)
        if estimate is not None:
            numbers[name] = (value, estimate.value, estimate.std)
    expected = load_values(brake.load_torque, ANGLES)
    low, high = found.regression.load_band(ANGLES, 0.9545)
    contact = found.estimates.get('contact_angle')
    error = found.load_torque(ANGLES) - expected
    return BrakeOutcome(
        seed, numbers, contact is not None and contact.determined,
        float(np.mean((low <= expected) & (expected <= high))),
        float(np.sqrt(np.mean(error**2))),
        (tuple(wave.order for wave in found.model.cogging),
         tuple(wave.order for wave in brake.cogging)))


def study(seeds: Sequence[int], reference: str = 'strokes',
          progress: Callable[[str], None] | None = None) -> list[BrakeOutcome]:
    """Identify the brakes of all `seeds`."""
    outcomes = []
    for count, seed in enumerate(seeds, 1):
        outcomes.append(identify_drawn(seed, reference))
        if progress:
            progress(f'brake {count} of {len(seeds)} identified')
    return outcomes


def summarise(outcomes: Sequence[BrakeOutcome]) -> dict[str, Any]:
    """Return the errors and coverage over the brakes, as a mapping for JSON.

    Coverage counts |estimate − truth| ≤ 2σ; of a normal error that is 95.4 %.
    """
    table = {}
    for name in outcomes[0].numbers:
        rows = np.array([entry.numbers[name] for entry in outcomes if name in entry.numbers])
        true, value, deviation = rows.T
        table[name] = {
            'brakes': len(rows), 'coverage': float(np.mean(np.abs(value - true)
                                                           <= 2.0 * deviation)),
            'relative_rms': float(np.sqrt(np.mean((value / true - 1.0)**2))),
            'relative_bias': float(np.mean(value / true - 1.0)),
            'score_rms': float(np.sqrt(np.mean(((value - true) / deviation)**2)))}
    contact = [(entry.numbers['contact_angle'], entry.determined) for entry in outcomes
               if 'contact_angle' in entry.numbers]
    off = [abs(value / true - 1.0) for (true, value, _), determined in contact
           if determined and true is not None]
    return {
        'brakes': len(outcomes), 'numbers': table,
        'load_band_coverage': float(np.mean([entry.band for entry in outcomes])),
        'load_rms': float(np.sqrt(np.mean([entry.load_rms**2 for entry in outcomes]))),
        'contact': {'determined': len(off), 'worst_determined': max(off, default=0.0),
                    'beyond_2_percent': int(np.sum(np.array(off) > 0.02))},
        'orders_right': sum(entry.orders[0] == entry.orders[1] for entry in outcomes),
        'outcomes': [asdict(entry) for entry in outcomes],
    }
