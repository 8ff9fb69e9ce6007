# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Chapter 5: the disc standing, then turning, in one run; P and the pads' friction coefficient."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.identify.procedure import IdentifiedModel, identify
from engb_core.identify.self_energizing import compare_paper_way, fit_together, SelfEnergizing
from engb_core.recording import Recording
from engb_core.reproduce import chosen
from engb_core.reproduce.nominal_chapter import NominalResult
from engb_core.reproduce.truth import Truth

__all__ = ['analyse_disc', 'Direction', 'DiscResult', 'EXACT_WEDGE', 'part_of',
           'POINTS_PER_VALUE', 'standing_and_turning']

# The simulated wedge is exactly that of the drawing.
EXACT_WEDGE = 0.0

# The observer's kernel ties so many of a stroke's resampled points together.
POINTS_PER_VALUE = 8.0


@dataclass(frozen=True)
class Direction:
    """One direction of the disc.

    Attributes:
        name: 'helping' or 'hindering'.
        standing, turning: identified from the run's parts.
        paper: P by the paper's way, with d/r as it stands at θ_g = 0.
        joint: P from one joint regression of both parts, at the wedge's mean slope.
        true_gain, true_friction: P and μ of the simulated brake, signed; in the mean over the
            strokes, each angle counted by the square of its load, with cold pads.
    """

    name: str
    standing: IdentifiedModel
    turning: IdentifiedModel
    paper: SelfEnergizing
    joint: SelfEnergizing
    true_gain: float
    true_friction: float


@dataclass(frozen=True)
class DiscResult:
    """Chapter 5: both directions, and the wedge's slope at rest [-]."""

    directions: list[Direction]
    wedge_at_rest: float


def analyse_disc(recordings: Mapping[str, Recording], nominal: NominalResult,
                 truth: Truth) -> DiscResult:
    """Compare the turning with the standing part of 'disc_helping' and 'disc_hindering'."""
    # The geometry is known; the force that presses is not asked for.
    mechanism = truth.settings.mechanism
    at_rest = mechanism.gear_offset / mechanism.gear_radius
    directions = []
    for name, speed in (('helping', chosen.DISC_SPEED), ('hindering', -chosen.DISC_SPEED)):
        standing, turning = (
            identify([part], nominal.nominal, prior=nominal.prior)
            for part in standing_and_turning(recordings[f'disc_{name}']))
        directions.append(Direction(
            name, standing, turning,
            compare_paper_way(standing.paper.load, turning.paper.parts, at_rest,
                              POINTS_PER_VALUE),
            fit_together(standing, turning, mechanism, nominal.prior, EXACT_WEDGE),
            truth.gain(speed), truth.pad_friction(speed)))
    return DiscResult(directions, at_rest)


def standing_and_turning(recording: Recording) -> tuple[Recording, Recording]:
    """Return the parts before the disc begins to turn and after it has come to speed.

    Raises:
        InputError: no disc speed recorded, or it never turns, or never stands.
    """
    signal = recording.signals.get('disc_speed')
    if signal is None:
        raise InputError(f'{recording.name}: no disc_speed recorded; record that topic too')
    speed = np.abs(signal.at(recording.time))
    top = float(speed.max())
    moving, full = speed > 0.01 * top, speed > 0.99 * top
    if not top > 0.0 or moving[0] or not full.any():
        raise InputError(f'{recording.name}: the disc must stand first and then turn')
    return (part_of(recording, 'standing', ~moving & (np.cumsum(moving) == 0)),
            part_of(recording, 'turning', full))


def part_of(recording: Recording, name: str, where: NDArray[np.bool_]) -> Recording:
    """Return the samples of `recording` at `where` (n,); its reference and signals stay whole."""
    velocity = recording.velocity
    return replace(recording, name=f'{recording.name}, {name}', time=recording.time[where],
                   position=recording.position[where], effort=recording.effort[where],
                   velocity=None if velocity is None else velocity[where])
