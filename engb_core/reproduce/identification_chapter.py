# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Section 3.1: the strokes identified the paper's way and jointly."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.identify.causal_observer import observe_causally
from engb_core.identify.paper_way import observe, paper_way, PaperResult
from engb_core.identify.procedure import IdentifiedModel, identify
from engb_core.identify.resampling import by_mirrored_time
from engb_core.recording import Recording
from engb_core.reproduce.nominal_chapter import NominalResult
from engb_core.reproduce.plan import Experiment
from engb_core.reproduce.truth import Truth
from engb_core.reproduce.ways import mirror_centres, over_seeds, Spread

__all__ = ['analyse_strokes', 'StrokesResult', 'tracking_mismatch']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StrokesResult:
    """The identification of the good and of the poorly tracked strokes.

    Attributes:
        good, poor: joint regression of 'strokes' and 'strokes_poor'; their `paper` is the
            paper's way without phase shift, from the classical J and B.
        causal: the paper's way on 'strokes' with d̂ as the observer's node published it.
        cured: the same with the position passed through q, too.
        clamp, release: positions (n,) [rad] of the largest poorly tracked stroke, paired by the
            reference's time (Fig. 7).
        truth: the brake.
        spreads: of each way on each recording, over noise seeds.
    """

    good: IdentifiedModel
    poor: IdentifiedModel
    causal: PaperResult
    cured: PaperResult
    clamp: Array
    release: Array
    truth: Truth
    spreads: list[Spread]


def analyse_strokes(recordings: Mapping[str, Recording], experiments: Mapping[str, Experiment],
                    nominal: NominalResult, truth: Truth, seeds: int,
                    tell: Callable[[str], None]) -> StrokesResult:
    """Identify from 'strokes' and 'strokes_poor'.

    Args:
        recordings, experiments: by name.
        nominal: of the free motor.
        truth: the brake; for the biases only.
        seeds: over which each way is judged.
        tell: called with one line of text per step.
    """
    names = ('strokes', 'strokes_poor')
    good, poor = (_identified(recordings[name], nominal) for name in names)
    classical = nominal.classical
    causal, cured = (paper_way(good.pieces, classical, observed=[
        observe_causally(piece, classical, recordings['strokes'], delayed=delayed, published=True)
        for piece in good.pieces]) for delayed in (False, True))
    spreads = over_seeds([experiments[name] for name in names],
                         [recordings[name] for name in names], nominal, truth, seeds, tell)
    return StrokesResult(good, poor, causal, cured,
                         *tracking_mismatch(recordings['strokes_poor'], poor), truth, spreads)


def tracking_mismatch(recording: Recording, found: IdentifiedModel) -> tuple[Array, Array]:
    """Return the clamp positions of the largest stroke and, of the release, those at the mirrored
    time of the reference (Fig. 7), both (n,) [rad]."""
    paper, pieces = found.paper, found.pieces
    centres = mirror_centres(recording, pieces, paper.strokes)
    if not centres:
        raise InputError(f'{recording.name}: no reference recorded; record the topic reference')
    largest = int(np.argmax([np.ptp(pieces[entry.motion].position[entry.clamp])
                             for entry in paper.strokes]))
    stroke = paper.strokes[largest]
    piece = pieces[stroke.motion]
    samples = observe(piece, found.start).at(np.arange(piece.time.size))
    data = by_mirrored_time(stroke.clamp.size, piece.time, stroke.clamp, samples,
                            centres[largest])
    return data.clamp_position, data.release_position


def _identified(recording: Recording, nominal: NominalResult) -> IdentifiedModel:
    found = identify([recording], nominal.nominal, prior=nominal.prior)
    # The paper's way knows no more than the classical reading.
    paper = paper_way(found.pieces, nominal.classical)
    return IdentifiedModel(found.model, found.start, found.estimates, found.pieces, paper,
                           found.regression)
