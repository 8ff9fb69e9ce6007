# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A brake that nobody here knows: identified from its recordings in four ways, then judged.

What is found goes into a plain mapping of numbers (for a JSON file), which is finished before
anybody looks at the truth; `judge` compares both, `summarise` counts over many brakes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engb_core.bench.settings import BenchSettings
from engb_core.identify.causal_observer import observe_causally
from engb_core.identify.confidence import Estimate
from engb_core.identify.paper_way import paper_way, PaperResult
from engb_core.identify.procedure import IdentifiedModel, identify
from engb_core.identify.self_energizing import compare_paper_way, fit_together, SelfEnergizing
from engb_core.identify.smoothing import moving_pieces
from engb_core.mechanism.kinematics import Mechanism
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.reproduce import chosen
from engb_core.reproduce.nominal_chapter import analyse_nominal, NominalResult
from engb_core.reproduce.plan import Experiment, plan_of
from engb_core.reproduce.self_energizing_chapter import (
    EXACT_WEDGE,
    POINTS_PER_VALUE,
    standing_and_turning,
)
from engb_core.reproduce.truth import ANGLES, truth_of

__all__ = ['BlindOutcome', 'drawing', 'estimate_brake', 'estimate_strokes', 'judge', 'NUMBERS',
           'summarise', 'WAYS']

# From the brake's drive: runs of the free motor, strokes, strokes with the disc set turning.
RUNS = ('steps', 'steps_added', 'sweep', 'cogging', 'strokes', 'disc_helping')

WAYS = ('the paper’s way, causal observer', 'the paper’s way, no phase shift',
        'joint regression', 'joint regression of the strokes alone')

# What is judged, with its unit.
NUMBERS = {'inertia': 'J', 'viscous_friction': 'B', 'torque_constant': 'K_T',
           'contact_angle': 'contact', 'coulomb': 'C₀', 'load_gain': 'C₁',
           'saturation_velocity': 'ω_s', 'cogging': 'cogging amplitude', 'gain': 'P',
           'pad_friction': 'μ'}

Way = dict[str, Any]


@dataclass(frozen=True)
class BlindOutcome:
    """How far one way is off on one brake.

    Attributes:
        way: one of WAYS.
        numbers: by name (true value, found, its standard deviation or None).
        determined: the contact is told as found.
        load: rms of the load's error over ANGLES, as a part of the largest load [-].
        band: part of ANGLES at which the load's 2σ band holds the true load; None: no band.
        orders: cogging orders found, and the true ones.
    """

    way: str
    numbers: dict[str, tuple[float, float, float | None]]
    determined: bool
    load: float
    band: float | None
    orders: tuple[tuple[float, ...], tuple[float, ...]]


def estimate_brake(record: Callable[[Experiment, Model], Recording], mechanism: Mechanism,
                   ) -> dict[str, Way]:
    """Identify a brake in each way.

    Args:
        record: returns the recording of an experiment under the loop's model; it knows the brake,
            this function does not: the experiments that it is given name another one.
        mechanism: the brake's drawing, whose wedge turns P into μ. Nothing else is known of it.

    Returns:
        For each of WAYS what was found: `numbers` (name: [value, deviation or None]), `load` and
        `band` over ANGLES [N·m, the drive's units], `orders`, `determined`.
    """
    experiments = {entry.name: entry for entry in plan_of(chosen.FORM) if entry.name in RUNS}
    recordings = {name: record(experiments[name], chosen.NOMINAL)
                  for name in RUNS if experiments[name].stage == 'nominal'}
    nominal = analyse_nominal(recordings)
    for name in RUNS:
        if name not in recordings:
            recordings[name] = record(experiments[name], nominal.classical)
    found = {}
    for way, delayed in ((WAYS[0], False), (WAYS[1], None)):
        found[way] = _by_paper(recordings, nominal, mechanism, delayed)
    joint = identify([recordings['strokes']], nominal.nominal, prior=nominal.prior)
    found[WAYS[2]] = _by_regression(joint, nominal, recordings, mechanism)
    found[WAYS[3]] = estimate_strokes(recordings['strokes'], nominal.classical)
    return found


def estimate_strokes(recording: Recording, start: Model) -> Way:
    """Identify a brake from its strokes alone, from a start that knows no cogging."""
    return _found(identify([recording], replace(start, cogging=())))


def drawing(mechanism: Mechanism) -> Mechanism:
    """Return what is on a brake's drawing: its lengths, but neither losses nor clearance nor
    stiffness, which stand as in the chosen mechanism."""
    base = chosen.MECHANISM
    return replace(mechanism, efficiency=base.efficiency, back_efficiency=base.back_efficiency,
                   clearance=base.clearance, clamp_stiffness=base.clamp_stiffness)


def judge(found: Mapping[str, Way], settings: BenchSettings) -> list[BlindOutcome]:
    """Compare what each way found with the brake as it is."""
    truth = truth_of(settings)
    model = truth.model
    wave, = model.cogging
    contact = model.load_torque.contact_angle
    true = {'inertia': model.motor.inertia, 'viscous_friction': model.motor.viscous_friction,
            'torque_constant': settings.torque_constant,
            'contact_angle': 0.0 if contact is None else contact,
            'coulomb': model.friction.coulomb, 'load_gain': model.friction.load_gain,
            'saturation_velocity': model.friction.saturation_velocity,
            'cogging': wave.amplitude, 'gain': truth.gain(chosen.DISC_SPEED),
            'pad_friction': truth.pad_friction(chosen.DISC_SPEED)}
    outcomes = []
    for way, entry in found.items():
        orders = tuple(entry['orders'])
        numbers = {name: (float(true[name]), float(value), deviation)
                   for name, (value, deviation) in entry['numbers'].items()
                   # An amplitude belongs to its order.
                   if name != 'cogging' or orders[:1] == (wave.order,)}
        load = np.array(entry['load'])
        band = None
        if entry['band']:
            low, high = np.array(entry['band'])
            band = float(np.mean((low <= truth.load) & (truth.load <= high)))
        outcomes.append(BlindOutcome(
            way, numbers, bool(entry['determined']),
            float(np.sqrt(np.mean((load - truth.load)**2)) / truth.load.max()), band,
            (orders, (wave.order,))))
    return outcomes


def summarise(outcomes: Sequence[BlindOutcome]) -> dict[str, dict[str, Any]]:
    """Return errors and coverage of each way over the brakes, as a mapping for JSON.

    Coverage counts |found − true| ≤ 2σ; of a normal error that is 95.4 %.
    """
    table = {}
    for way in dict.fromkeys(entry.way for entry in outcomes):
        some = [entry for entry in outcomes if entry.way == way]
        numbers = {}
        for name in NUMBERS:
            rows = [entry.numbers[name] for entry in some if name in entry.numbers]
            if not rows:
                continue
            true, value = (np.array([row[place] for row in rows]) for place in (0, 1))
            known = [(row[1] - row[0]) / row[2] for row in rows if row[2]]
            numbers[name] = {
                'brakes': len(rows), 'median': float(np.median(np.abs(value / true - 1.0))),
                'worst': float(np.max(np.abs(value / true - 1.0))),
                'bias': float(np.mean(value / true - 1.0)),
                'coverage': float(np.mean(np.abs(known) <= 2.0)) if known else None}
        bands = [entry.band for entry in some if entry.band is not None]
        told = [abs(value / true - 1.0) for entry in some if entry.determined
                for true, value, _ in [entry.numbers['contact_angle']]]
        table[way] = {
            'brakes': len(some), 'numbers': numbers,
            'load': {'median': float(np.median([entry.load for entry in some])),
                     'worst': float(np.max([entry.load for entry in some])),
                     'coverage': float(np.mean(bands)) if bands else None},
            'contact': {'determined': len(told), 'worst': max(told, default=0.0),
                        'beyond_2_percent': int(np.sum(np.array(told) > 0.02))},
            'orders_right': sum(entry.orders[0] == entry.orders[1] for entry in some)}
    return table


def _by_paper(recordings: Mapping[str, Recording], nominal: NominalResult, mechanism: Mechanism,
              delayed: bool | None) -> Way:
    """Identify the paper's way; `delayed` None: without phase shift."""
    classical = nominal.classical

    def result(recording: Recording) -> PaperResult:
        pieces = moving_pieces([recording])
        observed = None if delayed is None else [
            observe_causally(piece, classical, recording, delayed=delayed, published=True)
            for piece in pieces]
        return paper_way(pieces, classical, observed=observed)

    strokes = result(recordings['strokes'])
    standing, turning = (result(part) for part in standing_and_turning(
        recordings['disc_helping']))
    disc = compare_paper_way(standing.load, turning.parts,
                             mechanism.gear_offset / mechanism.gear_radius, POINTS_PER_VALUE)
    steps, friction = nominal.linear_steps, strokes.friction
    waves = nominal.nominal.cogging
    return {'numbers': {
        'inertia': _pair(steps.inertia), 'viscous_friction': _pair(steps.viscous_friction),
        # The paper's K_T is the data sheet's.
        'torque_constant': [classical.motor.torque_constant, None],
        'coulomb': [friction.coulomb, None], 'load_gain': [friction.load_gain, None],
        'saturation_velocity': [friction.saturation_velocity, None],
        **({'cogging': [waves[0].amplitude, None]} if waves else {}), **_disc(disc)},
        'load': strokes.load.torque(ANGLES).tolist(), 'band': None,
        'orders': [wave.order for wave in waves], 'determined': False}


def _by_regression(joint: IdentifiedModel, nominal: NominalResult,
                   recordings: Mapping[str, Recording], mechanism: Mechanism) -> Way:
    standing, turning = (identify([part], nominal.nominal, prior=nominal.prior)
                         for part in standing_and_turning(recordings['disc_helping']))
    disc = fit_together(standing, turning, mechanism, nominal.prior, EXACT_WEDGE)
    found = _found(joint)
    found['numbers'] |= {'torque_constant': _pair(nominal.torque_constant), **_disc(disc)}
    return found


def _found(identified: IdentifiedModel) -> Way:
    estimates = identified.estimates
    numbers: dict[str, list[float | None]] = {name: _pair(estimates[name]) for name in (
        'inertia', 'viscous_friction', 'contact_angle', 'coulomb', 'load_gain',
        'saturation_velocity') if name in estimates}
    waves = identified.model.cogging
    if waves:
        sine, cosine = estimates['sine0'], estimates['cosine0']
        numbers['cogging'] = [waves[0].amplitude, float(np.hypot(
            sine.value * sine.std, cosine.value * cosine.std) / waves[0].amplitude)]
    contact = estimates.get('contact_angle')
    return {'numbers': numbers, 'load': identified.load_torque(ANGLES).tolist(),
            'band': [edge.tolist() for edge in identified.regression.load_band(ANGLES, 0.9545)],
            'orders': [wave.order for wave in waves],
            'determined': contact is not None and contact.determined}


def _disc(found: SelfEnergizing) -> dict[str, list[float | None]]:
    return {'gain': _pair(found.gain), 'pad_friction': _pair(found.pad_friction)}


def _pair(estimate: Estimate) -> list[float | None]:
    return [estimate.value, estimate.std]
