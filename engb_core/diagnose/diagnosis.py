# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a diagnosis says (contract, section 5) and the evidence that a report shows for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from engb_core.model import Model
from engb_core.signals.data_faults import DataFault

__all__ = ['ClosedLoop', 'Candidate', 'Diagnosis', 'EffectFinding', 'Evidence', 'Interval',
           'LawFinding', 'LawPicture', 'NextExperiment', 'NominalChange', 'ParameterEstimate',
           'QualityOfFit', 'ResidualOver', 'Trace', 'Unexplained', 'Zone']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ParameterEstimate:
    """A number with its standard deviation (None: the data can't determine it) and unit."""

    value: float
    std: float | None
    unit: str


@dataclass(frozen=True)
class EffectFinding:
    """One effect that the data call for.

    `onset` is the recording, and the time in seconds from its first sample, at which it begins to
    act; None where it acts throughout.
    """

    effect: str
    probability: float
    parameters: dict[str, ParameterEstimate]
    share: float
    alternatives: tuple[tuple[str, float], ...]
    statement: str
    onset: tuple[str, float] | None = None


@dataclass(frozen=True)
class Interval:
    """A stretch of a recording, seconds from its first sample, and its share of the mismatch."""

    recording: str
    begin: float
    end: float
    share: float


@dataclass(frozen=True)
class Zone:
    """A range of a coordinate and the share of the mismatch's energy in it."""

    variable: str
    begin: float
    end: float
    unit: str
    share: float


@dataclass(frozen=True)
class LawPicture:
    """The remainder over the coordinate that reveals a law: binned means (k,), applying (ω > 0)
    and releasing; `measured` before the law, `law` what it says, `left` after it."""

    coordinate: str
    unit: str
    centre: Array
    measured: tuple[Array, Array]
    law: tuple[Array, Array]
    left: tuple[Array, Array]


@dataclass(frozen=True)
class LawFinding:
    """A law for what has no name.

    `formula` has numbers in it, `pattern` the names of `parameters`; `alternatives` are formulas
    that do about as well; `explained` is the part of the excess over the noise that it explains.
    """

    formula: str
    pattern: str
    acts_as: str
    parameters: dict[str, ParameterEstimate]
    line: str
    statement: str
    alternatives: tuple[str, ...]
    settled: bool
    explained: float
    picture: LawPicture | None = None


@dataclass(frozen=True)
class Unexplained:
    """What is left after the named effects, and the law for it where one was found."""

    share: float
    depends_on: tuple[str, ...]
    parity_in_velocity: str
    memory: bool
    where: tuple[Zone, ...]
    statement: str
    law: LawFinding | None = None


@dataclass(frozen=True)
class QualityOfFit:
    """A held-out figure: quantity is 'effort', 'position' or 'velocity'."""

    recording: str
    quantity: str
    rms_before: float
    rms_after: float
    noise_floor: float | None
    unit: str


@dataclass(frozen=True)
class NextExperiment:
    """A reference that would separate rivals: `time`, `position` hold it, `reference` says it."""

    reason: str
    discriminates: tuple[str, ...]
    reference: str
    time: Array | None = None
    position: Array | None = None


@dataclass(frozen=True)
class Trace:
    """Filtered signals of one recording on the decimated grid, all (m,): what was compared.

    `channels` has what the pictures of the effects are drawn over, by name (pictured.py).
    """

    recording: str
    held_out: bool
    time: Array
    position: Array
    velocity: Array
    effort: Array
    predicted_before: Array
    predicted_after: Array
    judged: NDArray[np.bool_]   # False where the shaft stands or samples are missing
    noise_floor: float
    channels: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class ClosedLoop:
    """Recorded against simulated closed-loop position of one recording, all (m,)."""

    recording: str
    time: Array
    recorded: Array
    simulated_before: Array
    simulated_after: Array


@dataclass(frozen=True)
class ResidualOver:
    """The residual over a coordinate that reveals it: binned means, before and after, all (k,).

    `coordinate` names it ('position', 'motor_angle', 'since_reversal', …); two curves per state
    where direction matters: applying (ω > 0) and releasing.
    """

    coordinate: str
    unit: str
    centre: Array
    applying_before: Array
    releasing_before: Array
    applying_after: Array
    releasing_after: Array
    why: str   # one sentence: why this picture convinces


@dataclass(frozen=True)
class Candidate:
    """One hypothesis that was weighed: effects, probability, held-out rms, share explained."""

    effects: tuple[str, ...]
    probability: float
    held_out_rms: float
    share: float
    remark: str = ''


@dataclass(frozen=True)
class NominalChange:
    """A nominal number before and after the joint refit."""

    name: str
    before: float
    after: float
    std: float | None
    unit: str


@dataclass(frozen=True)
class Evidence:
    """What the report draws."""

    traces: tuple[Trace, ...] = ()
    closed_loops: tuple[ClosedLoop, ...] = ()
    residual_over: tuple[ResidualOver, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    nominal: tuple[NominalChange, ...] = ()
    notes: tuple[str, ...] = ()   # repairs of the input, salvage, what could not be judged
    seconds: float = 0.0


@dataclass(frozen=True)
class Diagnosis:
    """The whole result; `model` is the corrected model."""

    verdict: str
    effects: tuple[EffectFinding, ...]
    time: tuple[Interval, ...]
    where: tuple[Zone, ...]
    unexplained: Unexplained | None
    held_out: tuple[QualityOfFit, ...]
    next_experiment: NextExperiment | None
    model: Model
    evidence: Evidence = field(default_factory=Evidence)
    data_faults: tuple[DataFault, ...] = ()
