# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Pictures of chapter 2 and section 3.2: the mechanism, the Bode plot, the cogging."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from engb_core.identify.nominal_plant import FrequencyResponse
from engb_core.mechanism import statics
from engb_core.mechanism.kinematics import Mechanism
from engb_core.report.figures import Axis, Band, Figure, Line, Panel, Points
from engb_core.reproduce import chosen
from engb_core.reproduce.results import BrakeResults

__all__ = ['bode', 'cogging_spectrum', 'cogging_tracking', 'mechanism_chain',
           'misfit', 'small_angle_error', 'TABLE_1']

# J and B as the paper prints them.
TABLE_1 = (6.813e-5, 1.125e-3)


def mechanism_chain(mechanism: Mechanism) -> Figure:
    """Clamp force and motor torque over the stroke, disc standing and turning either way."""
    angle = np.linspace(0.0, mechanism.stroke, 200)
    force = statics.clamp_force(mechanism, angle)
    posture = mechanism.posture(angle)
    torques = [Line(label, angle, 1e3 * statics.torque_of_clamp_force(
        mechanism, force, angle, friction, driving), colour, dash)
        for label, friction, driving, colour, dash in (
            ('applying, disc standing', 0.0, True, 'recorded', 'solid'),
            ('releasing, disc standing', 0.0, False, 'recorded', 'dash'),
            ('applying, disc helping', chosen.PAD_FRICTION, True, 'after', 'solid'),
            ('applying, disc hindering', -chosen.PAD_FRICTION, True, 'before', 'solid'))]
    return Figure(
        'Chapter 2: clamp force and motor torque over the stroke', Axis('Motor angle', 'rad'),
        (Panel(Axis('Clamp force', 'kN'), (Line('', angle, 1e-3 * force, 'recorded'),), 150),
         Panel(Axis('Motor torque', 'mN·m'), tuple(torques), 200),
         Panel(Axis('Gear angle θ_g', '°'),
               (Line('', angle, np.degrees(posture.gear_angle), 'muted'),), 140)),
        alt='Clamp force and motor torque rise with the motor angle; a helping disc lowers the '
            'torque, a hindering one raises it.',
        caption='The exact chain (2)–(22). Between applying and releasing lie the losses of gear '
                'and screw, which an identification sees as friction that grows with load.')


def small_angle_error(mechanism: Mechanism) -> Figure:
    """The error of (23), (24) and of the paper's (9)–(12) over the stroke."""
    angle = np.linspace(0.5, mechanism.stroke, 200)
    exact, small = mechanism.posture(angle), mechanism.small_angle_posture(angle)
    contact = float(statics.motor_angle(mechanism, 0.0))
    loaded = np.linspace(contact + 0.5, mechanism.stroke, 200)
    force = statics.clamp_force(mechanism, loaded)
    torque = (statics.paper_torque(mechanism, force, loaded)
              / statics.torque_of_clamp_force(mechanism, force, loaded))
    return Figure(
        'Error of the small-angle forms over the stroke', Axis('Motor angle', 'rad'),
        (Panel(Axis('Error', '%'), (
            Line('pad travel y_p, (23) and (24)', angle,
                 100.0 * (small.pad_onto / exact.pad_onto - 1.0), 'after'),
            Line('wedge slope taken as d/r', angle,
                 100.0 * (mechanism.gear_offset / mechanism.gear_radius / exact.wedge - 1.0),
                 'before'),
            Line('torque at a given force, (9) to (12)', loaded, 100.0 * (torque - 1.0),
                 'third')), 200, zero=True),),
        alt='All three errors grow with the angle.',
        caption=f'At the end of the stroke the gear stands at '
                f'{math.degrees(float(exact.gear_angle[-1])):.1f}°. Travel is off by '
                f'{100 * float(small.pad_onto[-1] / exact.pad_onto[-1] - 1):.1f} %, torque by '
                f'{100 * float(torque[-1] - 1):.1f} %; the wedge slope, from which the pad '
                'friction is worked out, by more.')


def misfit(data: FrequencyResponse, inertia: float, viscous: float) -> float:
    """Return how far 1/(J·s + B) lies from a measured response, rms [dB]."""
    seen = data.coherence > 0.5
    model = 2j * np.pi * data.frequency[seen] * inertia + viscous
    return float(np.sqrt(np.mean((20.0 * np.log10(np.abs(data.response[seen] * model)))**2)))


def bode(brake: BrakeResults) -> Figure:
    """Figure 6: measured response from current to velocity with coherence, models on top."""
    result, whole = brake.nominal, brake.nominal.response
    # Beyond the sweep's end nothing was excited: its points would only set the scale.
    seen = whole.coherence > 0.5
    per_ampere = chosen.NOMINAL.motor.torque_constant
    data = FrequencyResponse(whole.frequency[seen], per_ampere * whole.response[seen],
                             whole.coherence[seen], whole.segments)
    frequency = data.frequency
    forward = per_ampere * np.interp(frequency, result.simulated.frequency,
                                     result.simulated.response)
    grid = np.geomspace(frequency[0], frequency[-1], 120)
    laplace = 2j * np.pi * grid
    joint = result.joint.values
    classical = (result.linear_steps.inertia.value, result.linear_steps.viscous_friction.value)
    curves = [('J and B of the joint model alone', joint['inertia'], joint['viscous_friction'],
               'good', 'dash'),
              ('Table 1 of the paper', *TABLE_1, 'before', 'solid'),
              ('classical step test', *classical, 'third', 'dot')]
    magnitude = 20.0 * np.log10(np.abs(data.response))
    deviation = 8.686 * data.deviation()
    gains = [Line(label, grid,
                  20.0 * np.log10(per_ampere / np.abs(laplace * inertia + viscous)), colour, dash)
             for label, inertia, viscous, colour, dash in curves]
    gains.append(Line('joint model with its friction', frequency,
                      20.0 * np.log10(np.abs(forward)), 'after'))
    phases = [Line(label, grid, -np.degrees(np.angle(laplace * inertia + viscous)), colour, dash)
              for label, inertia, viscous, colour, dash in curves]
    phases.append(Line('joint model with its friction', frequency,
                       np.degrees(np.angle(forward)), 'after'))
    apart = 20.0 * np.log10(np.abs(data.response / forward))
    return Figure(
        f'Figure 6: Bode plot, current to velocity ({brake.label})',
        Axis('Frequency', 'Hz', log=True),
        (Panel(Axis('Magnitude', 'dB re 1 rad/(s·A)'), (
            Band('±2σ', frequency, magnitude - 2 * deviation, magnitude + 2 * deviation),
            Points('measured', frequency, magnitude, size=5), *gains), 230),
         Panel(Axis('Phase', '°'), (Points('measured', frequency, np.degrees(np.angle(
             data.response)), size=5), *phases), 170),
         Panel(Axis('Coherence', '-', limits=(0.0, 1.05)),
               (Line('coherence', frequency, data.coherence, 'muted'),), 130)),
        alt='Magnitude, phase and coherence of current to velocity, measured and modelled.',
        caption='Paper: “Bode plot of the frequency response obtained by various sine sweep '
                'input and the determined nominal model.” To see: the paper’s Table 1 misses this '
                f'brake’s response by {misfit(whole, *TABLE_1):.2f} dB rms, J and B of this '
                f'brake’s classical step test by {misfit(whole, *classical):.2f} dB, its J and B '
                f'without friction by '
                f'{misfit(whole, joint["inertia"], joint["viscous_friction"]):.2f} dB; run '
                'forward with its Coulomb friction under the same current the joint model lies '
                'within '
                f'{np.sqrt(np.mean(apart**2)):.2f} dB.')


def cogging_spectrum(brakes: Sequence[BrakeResults]) -> Figure:
    """The order spectrum of the slow strokes' residual."""
    panels, told = [], []
    for brake in brakes:
        result, waves = brake.nominal, brake.nominal.nominal.cogging
        panels.append(Panel(Axis(f'Amplitude, {brake.label}', 'mN·m'), (
            Line('residual of the slow strokes', result.orders, 1e3 * result.spectrum,
                 'recorded', width=1.2),
            Points('found', [entry.order for entry in waves],
                   [1e3 * entry.amplitude for entry in waves], 'after')), 150))
        found, true = (', '.join(f'order {entry.order:g}: {1e3 * entry.amplitude:.2f} mN·m'
                                 for entry in entries)
                       for entries in (waves, brake.truth.model.cogging))
        told.append(f'{brake.label.capitalize()}: found {found}; true {true}.')
    return Figure(
        'Cogging: what friction leaves over, by order', Axis('Order', 'cycles per revolution'),
        tuple(panels), alt='Peaks of the order spectrum at the cogging orders.',
        caption='Orders and phases are found, not given. ' + ' '.join(told)
                + ' Above order 12 the kernel lets less of a wave pass at this speed.')


def cogging_tracking(brakes: Sequence[BrakeResults]) -> Figure:
    """Tracking error of the slow strokes, before and after compensation."""
    panels, told = [], []
    for brake in brakes:
        effect = brake.cogging
        panels.append(Panel(Axis(f'Error, {brake.label}', 'mrad'), (
            Line('without compensation', effect.time, 1e3 * effect.before, 'before', width=1.1),
            Line('with compensation', effect.time, 1e3 * effect.after, 'after', width=1.1)),
            150, zero=True))
        told.append(f'{brake.label}: {1e3 * effect.rms_before:.2f} mrad rms without, '
                    f'{1e3 * effect.rms_after:.2f} mrad with the cogging fed forward')
    return Figure(
        'Cogging: tracking error of the slow strokes', Axis('Time', 's'), tuple(panels),
        alt='The periodic error falls with compensation.',
        caption=f'At steady speed, mean taken off. {"; ".join(told).capitalize()}.')
