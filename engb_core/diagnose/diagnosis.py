# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a diagnosis says (contract, section 5) and the evidence that a report shows for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from engb_core.model import Model
from engb_core.signals.data_faults import DataFault

__all__ = ['CauseSet', 'ClosedLoop', 'Candidate', 'Diagnosis', 'EffectFinding', 'Evidence',
           'Interval', 'LawFinding', 'LawPicture', 'NextExperiment', 'NominalChange',
           'ParameterEstimate', 'QualityOfFit', 'ResidualOver', 'Timing', 'Trace', 'Unexplained',
           'Zone']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ParameterEstimate:
    """A number that was found.

    Attributes:
        value: [`unit`].
        std: its standard deviation [`unit`]; None: the data can't determine it.
        unit: of both.
    """

    value: float
    std: float | None
    unit: str


@dataclass(frozen=True)
class CauseSet:
    """The causes that a claim leaves open at a level (cause_sets.py).

    Attributes:
        level: part of the cases of any kind whose true causes lie in their sets, at least [-].
        effects: ids, the claim first.
        another: whether a cause that is not listed, known or not, or none at all is open, too.
    """

    level: float
    effects: tuple[str, ...]
    another: bool


@dataclass(frozen=True)
class EffectFinding:
    """One effect that the data call for.

    Attributes:
        effect: its id.
        probability: that it is there [-].
        parameters: what was found of its numbers, by name.
        share: of the mismatch that it explains [-].
        alternatives: ids and probabilities [-] of what it might be instead.
        statement: a sentence for a brake engineer.
        onset: the recording, and the time [s] from its first sample, at which it begins to act;
            None where it acts throughout.
        causes: the set of causes that the claim leaves open; None where it names no cause.
    """

    effect: str
    probability: float
    parameters: dict[str, ParameterEstimate]
    share: float
    alternatives: tuple[tuple[str, float], ...]
    statement: str
    onset: tuple[str, float] | None = None
    causes: CauseSet | None = None

    @property
    def any_cause(self) -> float:
        """Probability [-] that it is there, or one that it might be instead: what two causes that
        fit alike make up is as sure as one alone would be."""
        return self.probability + sum(chance for _, chance in self.alternatives)


@dataclass(frozen=True)
class Interval:
    """A stretch of a recording in which the model is off.

    Attributes:
        recording: its name.
        begin, end: [s] from its first sample.
        share: of the mismatch [-].
    """

    recording: str
    begin: float
    end: float
    share: float


@dataclass(frozen=True)
class Zone:
    """A range of a coordinate in which the model is off.

    Attributes:
        variable: the coordinate.
        begin, end: [`unit`].
        unit: of the coordinate.
        share: of the mismatch's energy [-].
    """

    variable: str
    begin: float
    end: float
    unit: str
    share: float


@dataclass(frozen=True)
class LawPicture:
    """The remainder over the coordinate that reveals a law, as means of bins.

    Attributes:
        coordinate: its name.
        unit: of the coordinate.
        centre: (k,) of the bins [`unit`].
        measured: before the law, applying (ω > 0) and releasing: (k,) each [N·m].
        law: what the law says, likewise: (k,) each [N·m].
        left: after the law, likewise: (k,) each [N·m].
    """

    coordinate: str
    unit: str
    centre: Array
    measured: tuple[Array, Array]
    law: tuple[Array, Array]
    left: tuple[Array, Array]


@dataclass(frozen=True)
class LawFinding:
    """A law for what has no name.

    Attributes:
        formula: with numbers in it.
        pattern: with the names of `parameters`.
        acts_as: what the formula gives (engb_core/laws).
        parameters: its numbers, by name.
        line: the formula in one line, with units.
        below: what has to be said below that line: factors that stand as letters in it, symbols.
        statement: a sentence for a brake engineer.
        alternatives: formulas that do about as well.
        settled: whether the data leave no other one.
        explained: part of the excess over the noise that it explains [-].
        picture: the remainder over the coordinate that reveals it.
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
    below: tuple[str, ...] = ()


@dataclass(frozen=True)
class Unexplained:
    """What is left after the named effects, and the law for it where one was found.

    Attributes:
        share: of the mismatch [-].
        depends_on: coordinates over which it is not by chance.
        parity_in_velocity: 'even', 'odd' or 'none' (neither of both).
        memory: whether it depends on what went before.
        where: ranges in which it is.
        statement: a sentence for a brake engineer.
        law: for what is left; None where none was found.
        nearest: (effect, part of what is left that it would take away) of known effects that are
            not named, most first.
        load_is_absent: whether the model file has no load, and the machine has one.
    """

    share: float
    depends_on: tuple[str, ...]
    parity_in_velocity: str
    memory: bool
    where: tuple[Zone, ...]
    statement: str
    law: LawFinding | None = None
    nearest: tuple[tuple[str, float], ...] = ()
    load_is_absent: bool = False


@dataclass(frozen=True)
class QualityOfFit:
    """How far both models are off what no fit has seen.

    Attributes:
        recording: its name.
        quantity: 'effort', 'position' or 'velocity'.
        rms_before: root mean square error of the given model [`unit`].
        rms_after: that of the corrected model [`unit`].
        noise_floor: what a perfect model would leave [`unit`]; None: not known.
        unit: of the quantity.
    """

    recording: str
    quantity: str
    rms_before: float
    rms_after: float
    noise_floor: float | None
    unit: str


@dataclass(frozen=True)
class NextExperiment:
    """A reference that would separate rivals.

    Attributes:
        reason: a sentence.
        discriminates: ids of the effects that it tells apart.
        reference: the motion in words.
        time: (k,) of the motion [s].
        position: (k,) of the motion [rad].
    """

    reason: str
    discriminates: tuple[str, ...]
    reference: str
    time: Array | None = None
    position: Array | None = None


@dataclass(frozen=True)
class Trace:
    """Filtered signals of one recording on the decimated grid: what was compared.

    Attributes:
        recording: its name.
        held_out: whether no fit has seen it.
        time: (m,) [s].
        position: (m,) [rad].
        velocity: (m,) [rad/s].
        effort: (m,) as measured [N·m].
        predicted_before: (m,) by the given model [N·m].
        predicted_after: (m,) by the corrected model [N·m].
        judged: (m,) False where the shaft stands or samples are missing.
        noise_floor: root mean square of the noise [N·m].
        channels: what the pictures of the effects are drawn over, by name (pictured.py).
    """

    recording: str
    held_out: bool
    time: Array
    position: Array
    velocity: Array
    effort: Array
    predicted_before: Array
    predicted_after: Array
    judged: NDArray[np.bool_]
    noise_floor: float
    channels: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class ClosedLoop:
    """Recorded against simulated closed-loop position of one recording.

    Attributes:
        recording: its name.
        time: (m,) [s].
        recorded: (m,) [rad].
        simulated_before: (m,) by the given model [rad].
        simulated_after: (m,) by the corrected model [rad].
    """

    recording: str
    time: Array
    recorded: Array
    simulated_before: Array
    simulated_after: Array


@dataclass(frozen=True)
class ResidualOver:
    """The residual over a coordinate that reveals it, as means of bins.

    Two curves per model where direction matters: applying (ω > 0) and releasing.

    Attributes:
        coordinate: its name ('position', 'motor_angle', 'since_reversal', …).
        unit: of the coordinate.
        centre: (k,) of the bins [`unit`].
        applying_before, releasing_before: (k,) of the given model [N·m].
        applying_after, releasing_after: (k,) of the corrected model [N·m].
        why: one sentence: why this picture convinces.
    """

    coordinate: str
    unit: str
    centre: Array
    applying_before: Array
    releasing_before: Array
    applying_after: Array
    releasing_after: Array
    why: str


@dataclass(frozen=True)
class Timing:
    """By how much torque and recorded effort are apart, within one sample.

    Attributes:
        delay: of the torque after the recorded effort [s]; negative: it comes before.
        causes: ids of effects that it may be, none told apart from the others.
        at_bound: whether it may be more, which would be more than sampling makes up.
        statement: a sentence.
    """

    delay: ParameterEstimate
    causes: tuple[str, ...]
    at_bound: bool
    statement: str


@dataclass(frozen=True)
class Candidate:
    """One hypothesis that was weighed.

    Attributes:
        effects: ids.
        probability: among the hypotheses [-].
        held_out_rms: error where no fit saw it [N·m].
        share: of the mismatch that it explains [-].
        remark: a sentence, where there is something to say.
    """

    effects: tuple[str, ...]
    probability: float
    held_out_rms: float
    share: float
    remark: str = ''


@dataclass(frozen=True)
class NominalChange:
    """A nominal number before and after the joint refit.

    Attributes:
        name: in the model file.
        before: of the given model [`unit`].
        after: of the corrected model [`unit`].
        std: its standard deviation [`unit`]; None: the data can't determine it.
        unit: of all three.
    """

    name: str
    before: float
    after: float
    std: float | None
    unit: str


@dataclass(frozen=True)
class Evidence:
    """What the report draws.

    Attributes:
        traces: what was compared, a recording each.
        closed_loops: simulated against recorded motion.
        residual_over: the residual over coordinates.
        candidates: the hypotheses that were weighed.
        nominal: changes of the nominal numbers.
        notes: repairs of the input, salvage, what could not be judged.
        seconds: that the diagnosis took [s].
    """

    traces: tuple[Trace, ...] = ()
    closed_loops: tuple[ClosedLoop, ...] = ()
    residual_over: tuple[ResidualOver, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    nominal: tuple[NominalChange, ...] = ()
    notes: tuple[str, ...] = ()
    seconds: float = 0.0


@dataclass(frozen=True)
class Diagnosis:
    """The whole result.

    Attributes:
        verdict: 'consistent', 'explained', 'partly_explained' or 'unexplained'.
        effects: what was named, the largest share first.
        time: stretches in which the given model is off.
        where: ranges of coordinates in which it is off.
        unexplained: what is left after the effects; None: nothing.
        held_out: errors of both models where no fit saw them.
        next_experiment: what would settle what this recording can't; None: nothing is open.
        model: the corrected model.
        evidence: what the report draws.
        data_faults: gaps, jumps, clipping, … of the recordings.
        timing: by how much torque and effort are apart; None: by nothing that can be told.
    """

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
    timing: Timing | None = None

    @property
    def corrects(self) -> bool:
        """Whether the corrected model is another than the file."""
        return self.verdict != 'consistent' or self.timing is not None
