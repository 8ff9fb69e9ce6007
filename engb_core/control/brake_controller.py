"""One brake's controller: reference, loop, clamp force and supervision, without any middleware."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

from engb_core.control.acceptance import AcceptanceBounds, check_candidate
from engb_core.control.clamp_force import ClampForceEstimator, ClampForceMap, EstimatorSettings
from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.reference import ReferenceSettings, ReferenceSource
from engb_core.control.supervisor import Cause, FinalClamp, Supervisor, SupervisorSettings
from engb_core.control.trajectory import Setpoint
from engb_core.errors import InputError
from engb_core.kinematics import Mechanism
from engb_core.model import Model
from engb_core.sensors import VelocityFromPosition

__all__ = ['BrakeController', 'ControllerSettings', 'ForceSettings', 'Report']

VELOCITY_CUTOFF = 100.0

# The contact wanders slowly: more than this often needn't be looked [s].
ESTIMATE_EVERY = 0.0035

_COMMAND_STALE = Cause.COMMAND_STALE.value
_STATE_STALE = Cause.STATE_STALE.value
# With these latched the set-point still means something; with any other the torque goes.
_TORQUE_MUST_GO = ~(Cause.COMMAND_STALE | Cause.TRACKING_ERROR).value


@dataclass(frozen=True)
class ForceSettings:
    """What force commands need.

    Attributes:
        mechanism: the geometry.
        pad_friction: μ [-].
        running_clearance: how far the released motor stands before contact [rad].
        estimator: what is believed of the sources.
    """

    mechanism: Mechanism
    pad_friction: float = 0.0
    running_clearance: float = 2.0
    estimator: EstimatorSettings = EstimatorSettings()


@dataclass(frozen=True)
class ControllerSettings:
    """All settings of a controller.

    Attributes:
        loop, reference, supervisor: of its parts.
        force: None: no force commands.
        position_min, position_max: range of position commands [rad].
        force_max: highest force command [N].
        stale_value: set-point of stale_action ramp_to_value [rad, or N in force mode].
    """

    loop: LoopSettings = LoopSettings()
    reference: ReferenceSettings = ReferenceSettings()
    supervisor: SupervisorSettings = SupervisorSettings()
    force: ForceSettings | None = None
    position_min: float = -5.0
    position_max: float = 50.0
    force_max: float = math.inf
    stale_value: float = 0.0


@dataclass
class Report:
    """Input, command and output of the last cycle, in angle [rad] and torque [N·m].

    `input` is what was asked (a force as its angle), `command` what was tracked or sent after
    all limits, `output` what was measured.
    """

    position_input: float = math.nan
    position_command: float = math.nan
    position_output: float = math.nan
    effort_input: float = 0.0
    effort_command: float = 0.0
    effort_output: float = math.nan


class BrakeController:
    """Everything a control node does but ROS. All `now` are of a steady clock [s].

    Attributes:
        setpoint: what is tracked.
        feedforward: torque of the last cycle's feedforward [N·m].
        supervisor: state, causes.
        estimator: the clamp force, None without `force` settings.
        silent: nothing may be sent (another controller was here first).
    """

    def __init__(self, model: Model, settings: ControllerSettings) -> None:
        self.settings = settings
        self.supervisor = Supervisor(settings.supervisor)
        self.clamp = FinalClamp(settings.supervisor)
        self.loop = PositionLoop(model, settings.loop)
        self.source = ReferenceSource(settings.reference)
        self.supervisor.watch_commands = settings.reference.kind == 'command'
        self.report = Report()
        self.setpoint = Setpoint(0.0)
        self.estimator: ClampForceEstimator | None = None
        self.silent = False
        self._disc_speed = 0.0
        self._build_force(model)
        self.start(0.0)

    @property
    def model(self) -> Model:
        """The model in use."""
        return self.loop.model

    def start(self, now: float) -> None:
        """Begin: hold the position of the first sample."""
        self.supervisor.start(now)
        self.silent = False
        self._restart()
        self._last = now

    def apply(self, settings: ControllerSettings) -> None:
        """Change settings while running; the torque doesn't jump. `reference` is not changed."""
        self.settings = replace(settings, reference=self.settings.reference)
        self.supervisor.settings = self.clamp.settings = settings.supervisor
        self.loop.set_settings(settings.loop)

    def accept_model(self, candidate: Model) -> None:
        """Take an identified model into use; the torque doesn't jump.

        Raises:
            InputError: it is out of bounds (`acceptance`).
        """
        settings = self.settings
        check_candidate(candidate, self.model, AcceptanceBounds(
            highest_torque=settings.supervisor.effort_limit, low=settings.position_min,
            high=settings.position_max))
        before = self.loop.output
        self._build_force(candidate)
        self.loop.set_model(candidate)
        self.loop.carry_over(before, self.setpoint)

    # Inputs.

    def on_position_command(self, now: float, value: float) -> bool:
        """Take a set-point [rad]; False where it isn't taken."""
        settings = self.settings
        if self.source.commanded_by_trajectory:
            return False
        if not self.supervisor.accept_command(now, value, settings.position_min,
                                              settings.position_max):
            return False
        self._force_command = None
        self.report.position_input = value
        self.source.command(value)
        return True

    def on_force_command(self, now: float, value: float) -> bool:
        """Take a set-point [N]; False where it isn't taken."""
        if self.source.commanded_by_trajectory or self.estimator is None:
            return False
        highest = min(self.settings.force_max, self.estimator.map.highest_force)
        if not self.supervisor.accept_command(now, value, 0.0, highest):
            return False
        self._force_command = value
        self._aim_at_force(value)
        return True

    def on_disc_speed(self, value: float) -> None:
        """Take the disc's speed [rad/s]."""
        if math.isfinite(value):
            self._disc_speed = value

    def on_disturbance(self, now: float, value: float) -> None:
        """Take an external observer's word: only its age is used."""
        if math.isfinite(value):
            self.supervisor.observer_spoke(now)

    def on_wrong_joint(self, now: float) -> None:
        """Take note of a joint state that lacks the joint."""
        self.supervisor.note(Cause.STATE_WRONG_JOINT, now)

    def start_reference(self) -> float:
        """Begin the trajectory; return its length [s]. InputError where there is none."""
        if self.supervisor.faults:
            raise InputError('a fault is latched; clear it first')
        self.source.start()
        return self.source.duration

    def clear(self, now: float) -> Cause:
        """Clear latched faults; return those whose condition remains."""
        left = self.supervisor.clear(now)
        if not left:
            self.silent = False
            self._restart()
        return left

    # Cycles.

    def on_state(self, now: float, stamp: float, position: float, velocity: float,
                 effort: float) -> float | None:
        """Take a joint state; return the torque to send [N·m], None: send nothing."""
        supervisor = self.supervisor
        supervisor.watch(now)
        if not supervisor.accept_state(now, stamp, position, velocity):
            return None
        if velocity != velocity:
            velocity = self._derived.step(stamp, position)
        report = self.report
        report.position_output, report.effort_output = position, effort
        if self.silent:
            return None
        self._estimate(now, stamp, position, velocity, effort)
        if supervisor.faults & _TORQUE_MUST_GO:
            return self._ramp_down(now)
        if supervisor.faults & _COMMAND_STALE and not self._stale_handled:
            self._stale()
        self.setpoint = setpoint = self.source.at(stamp, position)
        if self.source.commanded_by_trajectory and self.source.running:
            supervisor.commanded = True
        wish = self.loop.step(stamp, position, velocity, effort, setpoint)
        dt, self._last = now - self._last, now
        if not math.isfinite(wish):
            supervisor.set(Cause.OUTPUT_NOT_FINITE, True, now)
            return self.clamp.ramp_down(dt)
        torque = self.clamp.step(wish, dt)
        if self.clamp.limited:
            supervisor.note(Cause.OUTPUT_LIMITED, now)
        supervisor.tracking(now, setpoint.position - position)
        report.position_command = setpoint.position
        report.effort_input, report.effort_command = wish, torque
        return torque

    def on_tick(self, now: float) -> float | None:
        """Look at the clock; return a torque to send where no joint state will ask for one."""
        supervisor = self.supervisor
        supervisor.watch(now)
        if self.silent or not supervisor.faults & _STATE_STALE:
            return None
        return self._ramp_down(now)

    def on_other_controller(self, now: float, present: bool, was_first: bool) -> None:
        """Say whether someone else publishes torque; `was_first`: this one was here before."""
        self.supervisor.set(Cause.OTHER_CONTROLLER, present, now, latch=not was_first)
        if present and not was_first:
            self.silent = True

    @property
    def feedforward(self) -> float:
        """Feedforward torque of the last cycle [N·m]."""
        return self.loop.feedforward

    # Parts.

    def _restart(self) -> None:
        self.loop.reset()
        self.source.reset()
        self.observer.reset()
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self._force_command: float | None = None
        self._estimated = -math.inf
        self._stale_handled = False
        self.report = Report()

    def _ramp_down(self, now: float) -> float:
        dt, self._last = now - self._last, now
        torque = self.clamp.ramp_down(dt)
        self.loop.reset(torque)
        self.report.effort_input, self.report.effort_command = 0.0, torque
        return torque

    def _stale(self) -> None:
        self._stale_handled = True
        action = self.settings.supervisor.stale_action
        if action == 'hold':
            self._force_command = None
            self.source.hold()
            return
        value = self.settings.stale_value if action == 'ramp_to_value' else 0.0
        if self._force_command is not None:
            highest = min(self.settings.force_max, self.estimator.map.highest_force)
            self._force_command = min(max(value, 0.0), highest)
            self._aim_at_force(self._force_command)
        else:
            self.source.command(min(max(value, self.settings.position_min),
                                    self.settings.position_max))

    def _estimate(self, now: float, stamp: float, position: float, velocity: float,
                  effort: float) -> None:
        estimator = self.estimator
        if estimator is None:
            return
        disturbance = math.nan
        if math.isfinite(effort):
            disturbance = self.observer.step(stamp, velocity, effort)
        if 0.0 <= stamp - self._estimated < ESTIMATE_EVERY:
            return
        self._estimated = stamp
        if self.supervisor.holds(Cause.OBSERVER_STALE):
            disturbance = math.nan
        estimator.step(stamp, position, velocity, disturbance, self._disc_speed)
        torques = self.loop.torques
        torques.shift = estimator.shift
        torques.load_ratio = estimator.map.load_ratio(self._disc_speed)
        uncertain = abs(estimator.shift) >= estimator.settings.largest_shift
        if uncertain or self._uncertain:
            self.supervisor.set(Cause.FORCE_UNCERTAIN, uncertain, now)
            self._uncertain = uncertain
        if self._force_command is not None:
            self._aim_at_force(self._force_command)

    def _aim_at_force(self, force: float) -> None:
        estimator = self.estimator
        if force > 0.0:
            angle = estimator.map.angle_of_force(force) + estimator.shift
        else:
            angle = estimator.contact_angle - self.settings.force.running_clearance
        angle = min(max(angle, self.settings.position_min), self.settings.position_max)
        self.report.position_input = angle
        self.source.command(angle)

    def _build_force(self, model: Model) -> None:
        self.observer = DisturbanceObserver(model.motor, self.settings.loop.disturbance_cutoff)
        self._uncertain = False
        force = self.settings.force
        if force is None:
            self.estimator = None
            return
        table = ClampForceMap(model, force.mechanism, force.pad_friction)
        before, self.estimator = self.estimator, ClampForceEstimator(table, force.estimator)
        if before is not None:
            self.estimator.shift, self.estimator.shift_std = before.shift, before.shift_std

