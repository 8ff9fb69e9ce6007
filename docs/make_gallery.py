# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Makes docs/gallery.html: each effect of the library, with a picture of a simulated recording.

    .venv/bin/python docs/make_gallery.py

Everything in it comes from the effects' own files: run it again when one has changed. The
simulated brake has the effect, the model as given has not, the corrected model has.
"""

from __future__ import annotations

from dataclasses import replace
import hashlib
from pathlib import Path
import sys

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from engb_core.bench.sensors import SensorSettings  # noqa: E402
from engb_core.bench.virtual_brake import DriveSettings, Profile, VirtualBrake  # noqa: E402
from engb_core.control.loop import LoopSettings, PositionLoop  # noqa: E402
from engb_core.control.pid import PidGains  # noqa: E402
from engb_core.control.trajectory import TrajectoryBuilder  # noqa: E402
from engb_core.diagnose.diagnosis import Diagnosis, Trace  # noqa: E402
from engb_core.diagnose.pictured import channels_of  # noqa: E402
from engb_core.diagnose.problem import problem_of  # noqa: E402
from engb_core.effects.base import Effect  # noqa: E402
from engb_core.effects.catalogue import catalogue  # noqa: E402
from engb_core.model import Controller, EffectSetting, Friction, LoadTorque, Model  # noqa: E402
from engb_core.physics.plant import physics_of  # noqa: E402
from engb_core.physics.simulation import simulate_closed_loop  # noqa: E402
from engb_core.prediction import find_phases  # noqa: E402
from engb_core.recording import Recording, Reference, Signal  # noqa: E402
from engb_core.report.effect_pictures import effect_pictures  # noqa: E402
from engb_core.report.layout import Page  # noqa: E402
from engb_core.report.pictures import Units  # noqa: E402
from engb_core.report.text import Html  # noqa: E402

NOMINAL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
                friction=Friction(0.012, 0.11, 0.5),
                controller=Controller(0.3, 1.0, 0.004, 0.75, 1000.0))
# Sizes that a picture shows well; what is not said stands at its middle start.
SIZES: dict[str, dict[str, float]] = {
    'inertia_error': {'inertia': 1.6 * NOMINAL.motor.inertia},
    'viscous_friction_error': {'viscous_friction': 1.5 * NOMINAL.motor.viscous_friction},
    'coulomb_friction_error': {'coulomb': 0.022}, 'load_stiffness_error': {'scale': 1.25},
    'load_curve_shape': {'value_08': 0.02, 'value_09': 0.03, 'value_10': 0.02, 'to': 20.0},
    'contact_shift': {'shift': 1.5}, 'torque_offset': {'offset': 0.02},
    'load_dependent_friction': {'load_gain': 0.25}, 'asymmetric_friction': {'asymmetry': 0.3},
    'stribeck_friction': {'breakaway_ratio': 1.9, 'stribeck_velocity': 2.0},
    'presliding_friction': {'presliding_distance': 0.8},
    'nonlinear_viscous_friction': {'quadratic_viscous_friction': 4e-5},
    'friction_drift': {'friction_ratio': 0.5, 'settling': 0.3, 'shape': 1.0, 'duration': 25.0},
    'cogging_torque': {'amplitude': 0.012, 'order': 6.0},
    'torque_ripple': {'relative_amplitude': 0.06, 'order': 6.0},
    'torque_saturation': {'torque_loss': 0.15, 'largest_effort': 0.17},
    'actuation_lag': {'lag': 0.012},
    'sampling_delay': {'delay': 0.006}, 'backlash': {'gap': 1.1},
    'drivetrain_resonance': {'frequency': 9.0}, 'load_hysteresis': {'hysteresis_ratio': 0.08},
    'pad_creep': {'relaxed_fraction': 0.12, 'time_constant': 0.6},
    'self_energizing': {'load_ratio': 1.25}, 'pad_friction_fade': {'ratio_change': -0.25},
    'disc_runout': {'amplitude': 0.02},
    'command_delay': {'delay': 0.03}, 'command_rate_limit': {'speed': 12.0},
    'back_emf': {'back_emf': 0.002},
    'effort_scale_error': {'scale': 0.8}, 'effort_measurement_lag': {'lag': 0.06},
}

# Effects that are a number of the motor.
NUMBERS = {'inertia_error': 'inertia', 'viscous_friction_error': 'viscous_friction'}


def fingerprint() -> str:
    """Return a digest of what the gallery is made from."""
    digest = hashlib.sha256()
    for path in sorted([*(ROOT / 'engb_core/effects').glob('*.py'),
                        ROOT / 'engb_core/report/effect_pictures.py',
                        ROOT / 'engb_core/diagnose/pictured.py', Path(__file__)]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def shown() -> list[Effect]:
    """Return the effects that have a name to give."""
    return [effect for effect in catalogue().values() if not effect.unnamed]


def with_effect(effect: Effect) -> Model:
    """Return the brake that has the effect."""
    values = dict(SIZES[effect.id])
    known = NOMINAL
    if effect.id in NUMBERS:
        # As a diagnosis tells it: the corrected model has the number itself.
        motor = replace(NOMINAL.motor, **{NUMBERS[effect.id]: values[NUMBERS[effect.id]]})
        return replace(NOMINAL, motor=motor)
    for parameter in effect.parameters:
        if parameter.name not in values and parameter.default is None and parameter.starts:
            values[parameter.name] = parameter.starts[len(parameter.starts) // 2]
    for name, _ in effect.constants:
        if name not in effect.defaults:
            values.setdefault(name, {'highest_speed': 30.0, 'mean_speed': 8.0}.get(name, 1.0))
    return replace(known, effects=(EffectSetting(effect.id, values),))


def recorded(brake: Model) -> Recording:
    """Simulate strokes of several heights and speeds, holds, a disc that turns half the time."""
    builder = TrajectoryBuilder().stop(0.3)
    for top, acceleration, speed in ((20.0, 400.0, 30.0), (8.0, 80.0, 4.0), (20.0, 80.0, 15.0),
                                     (3.0, 60.0, 2.0), (16.0, 600.0, 30.0)):
        builder.move(top, acceleration, speed).stop(1.0).move(0.4 * top, acceleration, speed)
        builder.move(0.8 * top, acceleration, speed).move(0.0, acceleration, speed).stop(0.2)
    way = builder.build()
    half = 0.5 * way.duration
    gains = NOMINAL.controller
    lagging = any(entry.effect in ('actuation_lag', 'drivetrain_resonance')
                  for entry in brake.effects)
    if lagging:
        gains = replace(gains, proportional=0.1, integral=0.3)
    bench = VirtualBrake(
        brake, DriveSettings(physics_step=1e-4),
        SensorSettings(counts_per_revolution=4096, effort_noise=0.003, seed=3),
        Profile([0.0, half, half + 0.5, way.duration], [0.0, 0.0, 30.0, 60.0], 'disc_speed'))
    loop = PositionLoop(NOMINAL, LoopSettings(gains=PidGains(
        p=gains.proportional, i=gains.integral, d=gains.derivative,
        u_clamp_max=gains.effort_limit, u_clamp_min=-gains.effort_limit)))
    rows = []
    for _ in range(int(way.duration * gains.rate)):
        seen = bench.advance()
        wanted = way.at(seen.time)
        bench.command(loop.step(seen.time, seen.position, seen.velocity, seen.effort, wanted))
        rows.append((seen.time, seen.position, seen.velocity, seen.effort, seen.disc_speed))
    time, position, velocity, effort, disc = np.array(rows).T
    return Recording.from_samples('simulated', time, position, effort, velocity, None,
                                  {'disc_speed': Signal(time, disc)})


def servo(brake: Model) -> Recording:
    """Simulate a drive that closes its own loop on a set-point, and tells no torque: what it was
    asked for stands as effort."""
    builder = TrajectoryBuilder().stop(0.3)
    for top, speed in ((16.0, 30.0), (8.0, 6.0), (20.0, 40.0)):
        builder.move(top, 400.0, speed).stop(0.5).move(0.0, 400.0, speed).stop(0.5)
    way = builder.build()
    time = np.arange(0.0, way.duration, 0.002)
    wanted = np.array([way.at(moment).position for moment in time])
    gain = NOMINAL.controller.proportional
    drive = replace(brake, controller=Controller(gain, 0.0, 0.0, np.inf, 1000.0))
    empty = Recording('simulated', time, np.zeros(time.size), np.zeros(time.size),
                      reference=Reference(time, wanted))
    position, _ = simulate_closed_loop(empty, drive)
    position = np.round(position * 4096.0 / (2.0 * np.pi)) * 2.0 * np.pi / 4096.0
    return replace(empty, position=position, effort=gain * (wanted - position))


def traces_of(effect: Effect) -> tuple[list[Trace], Model]:
    """Return what the pictures of an effect are drawn from."""
    brake = with_effect(effect)
    problem = problem_of([(servo if 'command' in effect.stages else recorded)(brake)], NOMINAL)
    run = problem.runs[0]
    brake = find_phases(run.motion, brake)
    grid = run.comparison.grid
    return [Trace(run.recording.name, False, run.motion.time[grid], run.motion.position[grid],
                  run.motion.velocity[grid], run.measured,
                  run.predicted(physics_of(NOMINAL)), run.predicted(physics_of(brake)),
                  np.ones(grid.size, bool), float(np.sqrt(np.mean(run.noise ** 2))),
                  channels_of(run, brake, [effect.id]))], brake


def main() -> None:
    """Write the gallery."""
    page = Page('Gallery of effects – engb', backend='matplotlib')
    effects = shown()
    page.header('Gallery', f'The {len(effects)} effects of the library', [
        'Each with its equation, a simulated recording drawn as an engineer draws it, what it '
        'looks like, what it is confused with, and what to measure. The report of a diagnosis '
        'draws the same pictures of your recording.'])
    page.add(Html(f'<!-- made from {fingerprint()} by docs/make_gallery.py -->'))
    for number, effect in enumerate(effects, 1):
        print(f'{number} of {len(effects)}: {effect.id}', flush=True)
        page.section(effect.title)
        page.text(Html(f'<code>{effect.id}</code>'))
        page.code(effect.equation, copy=False)
        traces, model = traces_of(effect)
        units = Units(Diagnosis('explained', (), (), (), None, (), None, model))
        figures = effect_pictures(effect.id, traces, model, units)
        if not figures:
            raise RuntimeError(f'{effect.id} has no picture')
        for figure in figures:
            page.figure(figure, points=600)
        page.notes([f'In a recording: {effect.seen}', f'Confused with: {effect.confused}.',
                    f'To measure: {effect.measure}.', f'Described in: {effect.reference}.'])
    page.footer('Made by docs/make_gallery.py.')
    page.write(ROOT / 'docs' / 'gallery.html')


if __name__ == '__main__':
    main()
