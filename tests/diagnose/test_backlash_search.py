# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A gap is found wherever the friction lies."""

from dataclasses import replace
import math

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.resonance.wide_band import linear_shaft, with_play
from engb_core.effects.catalogue import get_effect
from engb_core.identify.first_model import first_model
from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.recording import Recording
from tests.tables.other_benches import Drive, recorded

from .simulated_brake import brake_with, lively, NOMINAL, strokes_and_waves
from .simulated_brake import recorded as recorded_brake
from .swings import swung


@pytest.mark.slow
def test_a_gap_beyond_all_of_the_friction():
    """A load without friction of its own bounces between the flanks: rounding decides at which
    minimum a fit ends, so that one of three may miss it."""
    found = 0
    for seed in (1, 3, 6):
        run = recorded(Drive(gap=0.25, load=0.1, ratio=20.0, reach=30.0), seed, 20)
        recording = Recording.from_samples('gear', run['t'], run['phi'], 0.06 * run['i'])
        fitter = Fitter(problem_of([recording], first_model([recording]).model))
        variant, *_ = variants_of(get_effect('backlash'), fitter.problem.scene)
        fit = fitter.fit(variant)
        gap = fit.hypothesis.named(fit.vector, 0)['gap']
        found += fit.cost < 0.5 * fitter.base().cost and 0.22 < gap < 0.28
    assert found >= 2


GAP, INERTIA, BEYOND, FLANK = 0.02, 1.2e-3, 0.5, 22.0


def _behind_an_elastic_gap(duration: float, rate: float, seed: int, gap: float = GAP,
                           flank: float = FLANK, damped: float = 0.15, gravity: float = 0.15,
                           drag: float = 0.0) -> Recording:
    """A pendulum behind a gap whose flanks are springs: each side rings at `flank` [Hz] against
    them; `drag` [N·m·s/rad] acts on the pendulum itself."""
    rng = np.random.default_rng(seed)
    fine = 20
    time = np.arange(0.0, duration, 1.0 / (rate * fine))
    angle, speed, rise = swung(time, (0.13, 0.37, 0.83, 1.7),
                               lambda frequency: 0.5 / (1.0 + frequency), rng)
    load = BEYOND * INERTIA
    stiffness = load * (2.0 * math.pi * flank) ** 2
    damping = 2.0 * damped * load * 2.0 * math.pi * flank
    passed, place, pace = np.zeros(time.size), angle[0], speed[0]
    step = time[1]
    for row in range(time.size):
        twist = angle[row] - place
        contact = 0.0
        if abs(twist) > 0.5 * gap:
            contact = stiffness * (twist - math.copysign(0.5 * gap, twist)) \
                + damping * (speed[row] - pace)
            contact = max(contact, 0.0) if twist > 0.0 else min(contact, 0.0)
        passed[row] = contact
        pace += step * (contact - gravity * math.sin(place) - drag * pace
                        - 1e-3 * math.tanh(pace / 0.02)) / load
        place += step * pace
    effort = INERTIA * (1.0 - BEYOND) * rise + 1.5e-3 * speed \
        + 0.02 * np.clip(speed / 0.04, -1.0, 1.0) + passed
    every = slice(None, None, fine)
    return Recording.from_samples(
        'gear', time[every], np.round(angle[every] / 1e-5) * 1e-5,
        effort[every] + 5e-4 * rng.standard_normal(time[every].size))


def test_flanks_that_give():
    """Part of the lost motion under load is how far the flanks give; what rings against them is
    no reason to doubt the gap."""
    model = Model(Motor(1.0, INERTIA, 1.5e-3), LoadTorque('sinusoid', amplitude=0.15),
                  Friction(0.021, 0.0, 0.04))
    found = diagnose([_behind_an_elastic_gap(20.0, 250.0, 4)], model)
    first = found.effects[0]
    assert first.effect == 'backlash' and first.probability > 0.8
    assert first.parameters['gap'].value == pytest.approx(GAP, rel=0.05)
    assert first.parameters['flank_frequency'].value == pytest.approx(FLANK, rel=0.1)
    assert not any(entry.effect == 'contact_shift' for entry in found.effects)


def test_drag_beyond_a_gap():
    """What drags the load in the gap is a part of the drag that the file has in all."""
    drag, gap = 6e-3, 0.06
    model = Model(Motor(1.0, INERTIA, 1.5e-3 + drag), LoadTorque('sinusoid', amplitude=0.02),
                  Friction(0.021, 0.0, 0.04))
    recording = _behind_an_elastic_gap(25.0, 250.0, 4, gap, 70.0, 0.8, 0.02, drag)
    fitter = Fitter(problem_of([recording], model))
    variant, *_ = variants_of(get_effect('backlash'), fitter.problem.scene)

    hypothesis = fitter.hypothesis((variant,))
    start = [np.log(gap), BEYOND, 0.05, 0.0, drag / (1.5e-3 + drag)]
    fit = fitter.refine(fitter.evaluate(
        hypothesis, np.concatenate([hypothesis.start_of_numbers(), start])))
    found = fit.hypothesis.named(fit.vector, 0)
    assert fit.cost < 0.7 * fitter.base().cost
    assert found['gap'] == pytest.approx(gap, rel=0.15)
    assert found['viscous_fraction'] == pytest.approx(drag / (1.5e-3 + drag), abs=0.15)


def test_lost_motion_in_front_of_a_load_that_stays():
    """The spring on a screw that holds itself lags by half the gap, either way: no force is lost,
    and the loop is as wide in angle everywhere, not as a part of the load."""
    gap, travel = 0.8, strokes_and_waves(5)
    run = recorded_brake(NOMINAL, lambda time, _: travel.at(time), travel.duration)
    follows, carried = run.position[0], []
    for place in run.position:
        follows = min(max(follows, place - 0.5 * gap), place + 0.5 * gap)
        carried.append(follows)
    there, here = (np.polyval(NOMINAL.load_torque.coefficients[::-1], np.maximum(angle, 0.0))
                   for angle in (np.array(carried), run.position))
    more = there - here
    found = diagnose([replace(run, effort=run.effort + more)], NOMINAL)
    assert [entry.effect for entry in found.effects if entry.probability >= 0.5] == ['backlash']
    assert found.effects[0].parameters['gap'].value == pytest.approx(gap, rel=0.05)
    assert found.verdict == 'explained'
    setting = next(entry for entry in found.model.effects if entry.effect == 'backlash')
    assert setting.parameters['load_stays'] == 1.0


def _wide(recording: Recording, model: Model) -> Fitter:
    return Fitter(problem_of([recording], model, bandwidth=60.0, motion_bandwidth=120.0))


def test_flanks_that_ring_are_told_from_a_shaft_in_the_wide_band():
    """Each looks like the other one where they ring; behind a reversal only the load is gone."""
    model = Model(Motor(1.0, INERTIA, 1.5e-3), LoadTorque('sinusoid', amplitude=0.15),
                  Friction(0.021, 0.0, 0.04))
    loose = _wide(_behind_an_elastic_gap(20.0, 500.0, 4, gap=0.002), model)
    play = with_play(loose, loose.finish(linear_shaft(loose)))
    assert play.hypothesis.named(play.vector, 0)['gap'] == pytest.approx(0.002, rel=0.1)
    tight = _wide(lively(brake_with('drivetrain_resonance', inertia_fraction=0.4, frequency=18.0,
                                    damping_ratio=0.1)), NOMINAL)
    assert with_play(tight, tight.finish(linear_shaft(tight))) is None
