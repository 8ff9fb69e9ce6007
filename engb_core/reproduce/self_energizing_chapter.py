"""Chapter 5: the disc standing and turning either way; P and the pads' friction coefficient."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.procedure import IdentifiedModel, identify
from engb_core.identify.self_energizing import compare_fits, compare_paper_way, SelfEnergizing
from engb_core.recording import Recording
from engb_core.reproduce import chosen
from engb_core.reproduce.nominal_chapter import NominalResult

__all__ = ['analyse_disc', 'Direction', 'DiscResult']

Array = NDArray[np.float64]

# The observer's kernel ties so many of a stroke's resampled points together.
POINTS_PER_VALUE = 8.0


@dataclass(frozen=True)
class Direction:
    """One direction of the disc.

    Attributes:
        name: 'helping' or 'hindering'.
        identified: from the run with the disc turning.
        paper: P by the paper's way, with d/r as it stands at θ_g = 0.
        joint: P from the two joint regressions, with the wedge's mean slope over the strokes.
        true_friction: μ of the simulated brake, signed.
    """

    name: str
    identified: IdentifiedModel
    paper: SelfEnergizing
    joint: SelfEnergizing
    true_friction: float


@dataclass(frozen=True)
class DiscResult:
    """Chapter 5: `standing`, both directions, and the wedge's slope at rest and in the mean."""

    standing: IdentifiedModel
    directions: list[Direction]
    wedge_at_rest: float
    mean_wedge: float
    angles: Array


def analyse_disc(recordings: Mapping[str, Recording], nominal: NominalResult,
                 standing: IdentifiedModel) -> DiscResult:
    """Compare 'disc_helping' and 'disc_hindering' with the disc standing."""
    angles = np.linspace(4.0, 19.5, 100)
    wedge = chosen.MECHANISM.posture(angles).wedge
    load = standing.load_torque(angles)
    # P is fitted by least squares, so each angle counts by the square of its load.
    mean_wedge = float(wedge @ load**2 / (load @ load))
    at_rest = chosen.MECHANISM.gear_offset / chosen.MECHANISM.gear_radius
    directions = []
    for name, friction in (('helping', chosen.PAD_FRICTION), ('hindering', -chosen.PAD_FRICTION)):
        turning = identify([recordings[f'disc_{name}']], nominal.nominal,
                           prior=nominal.prior)
        directions.append(Direction(
            name, turning,
            compare_paper_way(standing.paper.load, turning.paper.parts, at_rest,
                              POINTS_PER_VALUE),
            compare_fits(standing.regression, turning.regression, angles, mean_wedge), friction))
    return DiscResult(standing, directions, at_rest, mean_wedge, angles)
