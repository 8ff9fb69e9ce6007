# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What an effect is: physics that a model may leave out, defined once for every use.

An effect gives one function per *stage* of the torque balance at which it acts. Simulation and
inverse dynamics walk a sample through the same stages (plant.py), so that a function written
once serves both, and the report quotes `equation` and `statement` from the same file.

Stages, in the order in which a sample passes them:

    shift      returns the angle by which the load side is displaced from the motor [rad]
    load       returns the load torque, given sample[LOAD]                           [N·m]
    level      returns the friction level, given sample[LEVEL]                       [N·m]
    direction  returns the direction of friction −1…1, given sample[DIRECTION]
    torque     returns a torque that is added to what the motor must give            [N·m]
    actuation  returns the torque that sample[EFFORT], the measured effort, gives    [N·m]

and, before all of them, where effort is a command (command_law.py):

    command    returns the set-point on which the drive acts, given sample[REFERENCE] [rad]

and, behind them, what a recording makes of it, and for the position the controller is told:

    measurement  returns the effort that is recorded, given sample[EFFORT], the true one [N·m]
    sensing      returns the position that the sensor says, given sample[POSITION]       [rad]

What a sample holds, by the names of its places. From the beginning:

    TIME_STEP        since the sample before; functions have to hold for any       [s]
    TIME             since the start                                               [s]
    POSITION         of the motor; a prismatic axis: metres, newtons for N·m       [rad]
    VELOCITY         of the motor                                                  [rad/s]
    ACCELERATION     of the motor, the mean over the step before                   [rad/s²]
    DISC_SPEED       of the brake disc, 0 where none is recorded                   [rad/s]
    DISC_ANGLE       that it has turned                                            [rad]
    PAD_TEMPERATURE  20 where none is recorded                                     [°C]

then as the stages pass; each is right from its stage on:

    INERTIA          of the model                                                  [kg·m²]
    VISCOUS          viscous friction of the model                                 [N·m·s/rad]
    COULOMB          Coulomb friction of the model, without what load adds         [N·m]
    SATURATION       speed of the model from which on dry friction is full         [rad/s]
    SHIFT            of the load side against the motor (behind the stage shift)   [rad]
    LOAD             load torque, positive against a positive effort               [N·m]
    LOAD_GAIN        how much friction grows with load                             [N·m/N·m]
    LEVEL            dry friction, Coulomb's and what load adds, without direction [N·m]
    DIRECTION        of the motion, −1 to 1, proportional to velocity close to rest [-]
    EFFORT           in the stages actuation and measurement only                  [N·m]
    REFERENCE        in the stage command only                                     [rad]
    TORQUE           in no stage; scratch of the inverse dynamics                  [N·m]

A torque that resists has the sign of the velocity: it is what the motor must give.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from engb_core.model import EffectSetting
from engb_core.physics.compiled import EffectFunction

__all__ = ['ACCELERATION', 'COULOMB', 'DIRECTION', 'DISC_ANGLE', 'DISC_SPEED', 'EFFORT',
           'INERTIA', 'LEVEL', 'LOAD', 'LOAD_GAIN', 'NUMBER_OFF', 'PAD_TEMPERATURE', 'POSITION',
           'REFERENCE', 'SAMPLE_SIZE', 'SATURATION', 'SHIFT', 'STAGES', 'STATE_SIZE', 'TIME',
           'TIME_STEP', 'TORQUE', 'TURNING', 'VELOCITY', 'VISCOUS', 'Effect', 'Parameter', 'Part',
           'Scene']

# Places in a sample, the array that every effect function receives.
(TIME_STEP, TIME, POSITION, VELOCITY, ACCELERATION, DISC_SPEED, DISC_ANGLE, PAD_TEMPERATURE,
 SHIFT, LOAD, LEVEL, DIRECTION, EFFORT, INERTIA, VISCOUS, COULOMB, LOAD_GAIN,
 TORQUE, REFERENCE, SATURATION) = range(20)
SAMPLE_SIZE = 20
# Part of the highest disc speed from which the disc turns.
TURNING = 0.04
STATE_SIZE = 72
# How the statement begins of an effect that is no missing physics.
NUMBER_OFF = 'A number is off, which is no missing physics: '
STAGES = ('shift', 'load', 'level', 'direction', 'torque', 'actuation', 'command',
          'measurement', 'sensing')


@dataclass(frozen=True)
class Parameter:
    """A number of an effect.

    Attributes:
        name: as in the contract, table 4, or a name of our own for what the contract leaves open.
        unit: SI, '-' for none.
        low, high: bounds of what is physically possible [`unit`].
        none: the value at which the effect vanishes [`unit`] (only for the parameter that sizes
            it; infinity for a limit, which must be logarithmic).
        starts: where a fit starts looking [`unit`]; several for parameters with more than one
            basin.
        logarithmic: fitted on a logarithmic scale.
        per_recording: has to be found anew in each recording (a phase that is not recorded).
        form_steps: uncertainty of a number that is a time [sampling intervals]: when within
            an interval position and effort were taken is not recorded.
        default: what stands for it where a setting leaves it out [`unit`] (None: the middle
            start).
        formerly: names that it had in older versions; model files with them are read.
        of_stroke: of a number of the file that is wrong, by which part [-] of the stroke files are
            off (standard deviation; 0: nobody knows).
        kind: what a fit has to know of it ('': nothing). A 'phase' and an 'order' of what repeats
            over an angle, a 'frequency' of what repeats in time, a 'place' on the stroke with its
            'width', the 'begin' and the 'end' of a stretch of time are looked for in the
            residual; a 'natural_frequency' is driven to the edge of the band by other causes; an
            'exponent' bends the curve more than its value says; a 'disc_speed' is not the joint's.
    """

    name: str
    unit: str
    low: float
    high: float
    none: float | None = None
    starts: tuple[float, ...] = ()
    logarithmic: bool = False
    per_recording: bool = False
    form_steps: float = 0.0
    default: float | None = None
    formerly: tuple[str, ...] = ()
    of_stroke: float = 0.0
    kind: str = ''


@dataclass(frozen=True)
class Part:
    """Another effect that is part of one: what sizes it is a sum of that one's parameters.

    Attributes:
        effect: id of the other one.
        weights: parameter → factor [-] of the sum.
    """

    effect: str
    weights: Mapping[str, float]


@dataclass(frozen=True)
class Scene:
    """What a recording can tell an effect before any fit: ranges, for constants and relevance.

    Attributes:
        duration: of the recording [s].
        largest_effort, largest_load: [N·m]; no load where it is the same everywhere.
        speed: the fastest one [rad/s].
        sampling: the usual time between two samples [s].
        position_range: from and to [rad].
        disc_speed_range: from and to [rad/s], None where no disc was recorded.
        temperature_range: from and to [°C], None where none was recorded.
        joint_type: 'revolute' or 'prismatic'.
        middle_speed: m [rad/s]: what grows in proportion to (|ω| − m)/(|ω| + m) is on average,
            while the shaft moves, what it is at this speed.
        load_slope: root mean square of the load's slope in contact [N·m/rad], while the disc
            turns where there is one.
        load_power: the load goes roughly with travel^load_power [-].
        load_span: from the smallest to the largest load [N·m].
        loaded_share: the part of the dry friction that goes with load [-], on average while the
            shaft moves.
        reference_load: where friction that is curved over the load crosses the straight line of
            the same mean friction [N·m].
        effective_load: where a share of the load that changes in proportion to it has the value
            that least squares give for all loads [N·m].
        commanded: whether effort is a command that follows from the reference.
        load_is_straight: whether the load is one straight line over the whole range: moved along
            the angle it is itself and an offset.
    """

    duration: float
    largest_effort: float
    largest_load: float
    speed: float
    sampling: float
    position_range: tuple[float, float]
    disc_speed_range: tuple[float, float] | None
    temperature_range: tuple[float, float] | None
    joint_type: str = 'revolute'
    middle_speed: float = 10.0
    load_slope: float = 0.02
    load_power: float = 2.0
    load_span: float = 0.0
    loaded_share: float = 0.5
    reference_load: float = 0.2
    effective_load: float = 0.2
    commanded: bool = False
    load_is_straight: bool = False

    @property
    def disc_turned_both_ways(self) -> bool:
        """Whether a disc was recorded that turned forwards as well as backwards, by more than the
        noise of a disc that stands."""
        low, high = self.disc_speed_range or (0.0, 0.0)
        return min(-low, high) > TURNING * max(-low, high, 0.0)

    @property
    def disc_turned_only_backwards(self) -> bool:
        """Whether a disc was recorded that turned backwards and, but for noise, not forwards."""
        low, high = self.disc_speed_range or (0.0, 0.0)
        return -low > high and not self.disc_turned_both_ways


@dataclass(frozen=True)
class Effect:
    """Physics that a model may leave out.

    Attributes:
        id: name in diagnosis and model file (contract, table 4).
        title: as a person says it.
        parameters: what is fitted, the sizing parameter first.
        stages: stage name → compiled function f(parameters, state, sample) → float. The
            functions of one effect share one state; `parameters` holds `parameters` then
            `constants`, in order.
        equation: the physics in one line.
        reference: where it is described.
        reveals: coordinate over which the residual shows it best.
        tells: (values) → all coordinates that it depends on, of one without a name (None: the one
            that reveals it).
        remembers: (values) → whether it depends on what went before, of one without a name.
        picture: how an engineer draws it: names of report/effect_pictures.py, by spaces.
        seen, confused, measure: for the gallery: what it looks like in a recording, what it is
            confused with, and what to measure to tell it.
        constants: names and units of numbers that are set from the recording, not fitted.
        set_constants: Scene → their values.
        defaults: what stands for a constant that a model file leaves out; one without must be
            given.
        applies: whether a recording could show it at all (None: always).
        variants: fixed settings tried in turn, e.g. what a fade depends on.
        time_shift: (parameters) → (delay, time constant) [s] by which torque comes after measured
            effort; inverse dynamics undoes both.
        number_only: no physics is missing, a nominal number is wrong.
        not_in_file: of such a number, that no file holds it: it is none that was measured wrong,
            and as likely beforehand as physics that acts like it.
        proportional: (values) → whether the torque that it makes of an effort is proportional to
            that (None: no): inverse dynamics then divides, and need not search.
        of_motion: it looks at motion, time and disc alone, not at what passed the stages before;
            in the stages load, level and actuation it returns something proportional to what it is
            given there, in the stage direction it may look at that.
        memoryless: its functions remember nothing from one sample to the next: over a whole motion
            the torque that it adds may be computed by itself.
        unnamed: no cause, only a description of what is left; never claimed.
        only_here: bound to the times of one recording; not carried over to others.
        contains: ids of effects that this one includes as a special case.
        part: another effect that it holds, and that is named beside it where it is there.
        apart: ids of effects that are not tried together with this one: beside it they would
            stand for its details.
        credence: (values) → how far a good fit is believed, 0 to 1 (None: fully); for forms of
            an effect that other causes imitate.
        at_once: values of its last parameters, which say how it grows over the recording, at which
            it is there at once: for one that begins within the recording.
        multimodal: the cost has many narrow minima in its parameters; fits move at random first.
        statement: (values) → a sentence for a brake engineer.
        warp: (parameters, state, sample) → by how much torque comes late [s] at each sample;
            inverse dynamics reads effort so much earlier, exactly.
        correction: (parameters, state, sample) → what is to be added to the measured position at
            each recorded sample; inverse dynamics corrects the motion instead of the stages.
        late_position: whether `correction` says how late the position is [s] instead.
        made_of: (setting) → the effect and its values, where the setting itself says what it is
            (a law's formula).
        written: (values) → the setting of the model file, where it is more than numbers.
        formerly: ids that it had in older versions; model files with them are read.
        forms: the same effect with some of its parameters fixed, or other constants, which is
            tried beside it from the beginning where it applies.
        richer: the same effect with further parameters behind those that it has, tried where it
            leaves more than noise.
        begins: (values of the plainer effect) → where the fit of a richer one may begin.
    """

    id: str
    title: str
    parameters: tuple[Parameter, ...]
    stages: Mapping[str, EffectFunction]
    equation: str
    reference: str
    statement: Callable[[Mapping[str, float]], str]
    reveals: str = 'velocity'
    tells: Callable[[Mapping[str, float]], tuple[str, ...]] | None = None
    remembers: Callable[[Mapping[str, float]], bool] | None = None
    picture: str = ''
    seen: str = ''
    confused: str = ''
    measure: str = ''
    constants: tuple[tuple[str, str], ...] = ()
    set_constants: Callable[[Scene], Mapping[str, float]] | None = None
    defaults: Mapping[str, float] = field(default_factory=dict)
    applies: Callable[[Scene], bool] | None = None
    variants: tuple[Mapping[str, float], ...] = field(default=({},))
    time_shift: Callable[[Mapping[str, float]], tuple[float, float]] | None = None
    number_only: bool = False
    not_in_file: bool = False
    proportional: Callable[[Mapping[str, float]], bool] | None = None
    of_motion: bool = False
    memoryless: bool = False
    unnamed: bool = False
    only_here: bool = False
    contains: tuple[str, ...] = ()
    part: Part | None = None
    apart: tuple[str, ...] = ()
    multimodal: bool = False
    at_once: Mapping[str, float] = field(default_factory=dict)
    credence: Callable[[Mapping[str, float]], float] | None = None
    warp: EffectFunction | None = None
    correction: EffectFunction | None = None
    late_position: bool = False
    made_of: Callable[[EffectSetting], tuple[Effect, list[float]]] | None = None
    written: Callable[[Mapping[str, float]], EffectSetting] | None = None
    formerly: tuple[str, ...] = ()
    forms: tuple[Effect, ...] = ()
    richer: tuple[Effect, ...] = ()
    begins: Callable[[Mapping[str, float]], list[dict[str, float]]] | None = None

    def of_kind(self, kind: str) -> Parameter | None:
        """Return the first parameter of a kind, if there is one.

        Args:
            kind: as in `Parameter`.
        """
        return next((entry for entry in self.parameters if entry.kind == kind), None)

    @property
    def knows_reversals(self) -> bool:
        """Whether it makes loops, which nothing does that follows the position alone."""
        return self.reveals == 'since_reversal'

    @property
    def names(self) -> tuple[str, ...]:
        """Names of parameters and constants, in the order in which the functions read them."""
        return (*(entry.name for entry in self.parameters),
                *(name for name, _ in self.constants))
