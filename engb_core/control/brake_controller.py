"""One brake's controller: reference, loop, clamp force and supervision, without any middleware."""

from __future__ import annotations

from dataclasses import replace
import math

from engb_core.control.acceptance import AcceptanceBounds, check_candidate
from engb_core.control.brake_settings import ControllerSettings, Report
from engb_core.control.causes import Cause
from engb_core.control.clamp_force import ClampForceEstimator
from engb_core.control.final_clamp import FinalClamp
from engb_core.control.force_control import ForceControl
from engb_core.control.loop import PositionLoop, VELOCITY_CUTOFF
from engb_core.control.reference import ReferenceSource
from engb_core.control.supervisor import Supervisor
from engb_core.control.trajectory import Setpoint
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.sensors import VelocityFromPosition

__all__ = ['BrakeController']

_COMMAND_STALE = Cause.COMMAND_STALE.value
_STATE_STALE = Cause.STATE_STALE.value
# With these latched the set-point still means something; with any other the torque goes.
_TORQUE_MUST_GO = ~(Cause.COMMAND_STALE | Cause.TRACKING_ERROR).value


class BrakeController:
    """Everything a control node does but ROS. All `now` are of a steady clock [s].

    Attributes:
        setpoint: what is tracked.
        feedforward: torque of the last cycle's feedforward [N·m].
        supervisor: state, causes.
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
        self.silent = False
        self._disc_speed = 0.0
        self._force = self._force_control(model)
        self.start(0.0)

    @property
    def model(self) -> Model:
        """The model in use."""
        return self.loop.model

    @property
    def estimator(self) -> ClampForceEstimator | None:
        """The clamp force; None without `force` settings."""
        return self._force.estimator if self._force else None

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
        if self._force is not None and settings.force is not None:
            self._force.apply(settings.force, settings.loop.disturbance_cutoff)

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
        force = self._force_control(candidate)
        if force is not None and self._force is not None:
            force.learn_from(self._force)
            force.command = self._force.command
        self._force = force
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
        if self._force is not None:
            self._force.command = None
        self.report.position_input = value
        self.source.command(value)
        return True

    def on_force_command(self, now: float, value: float) -> bool:
        """Take a set-point [N]; False where it isn't taken."""
        if self.source.commanded_by_trajectory or self._force is None:
            return False
        if not self.supervisor.accept_command(now, value, 0.0, self._highest_force):
            return False
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
        if self._force is not None:
            self._force.reset()
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self._stale_handled = self._ramping = False
        self.report = Report()

    def _ramp_down(self, now: float) -> float:
        dt, self._last = now - self._last, now
        # The ramp begins now, not with the last cycle, which may be a timeout ago.
        torque = self.clamp.ramp_down(dt if self._ramping else 0.0)
        self._ramping = True
        self.loop.reset(torque)
        self.report.effort_input, self.report.effort_command = 0.0, torque
        return torque

    def _stale(self) -> None:
        self._stale_handled = True
        settings, force = self.settings, self._force
        action = settings.supervisor.stale_action
        by_force = force is not None and force.command is not None
        if action == 'hold':
            if by_force:
                force.command = None
            self.source.hold()
            return
        value = settings.stale_value if action == 'ramp_to_value' else 0.0
        if by_force:
            self._aim_at_force(min(max(value, 0.0), self._highest_force))
        else:
            self.source.command(min(max(value, settings.position_min), settings.position_max))

    def _estimate(self, now: float, stamp: float, position: float, velocity: float,
                  effort: float) -> None:
        force = self._force
        if force is None or not force.observe(stamp, velocity, effort):
            return
        was_uncertain = force.uncertain
        force.estimate(stamp, position, velocity, self._disc_speed,
                       not self.supervisor.holds(Cause.OBSERVER_STALE))
        estimator, torques = force.estimator, self.loop.torques
        torques.shift = estimator.shift
        torques.load_ratio = estimator.map.load_ratio(self._disc_speed)
        if force.uncertain or was_uncertain:
            self.supervisor.set(Cause.FORCE_UNCERTAIN, force.uncertain, now)
        if force.command is not None:
            self._aim_at_force(force.command)

    @property
    def _highest_force(self) -> float:
        return min(self.settings.force_max, self._force.estimator.map.highest_force)

    def _aim_at_force(self, value: float) -> None:
        self._force.command = value
        angle = min(max(self._force.angle_of(value), self.settings.position_min),
                    self.settings.position_max)
        self.report.position_input = angle
        self.source.command(angle)

    def _force_control(self, model: Model) -> ForceControl | None:
        settings = self.settings
        if settings.force is None:
            return None
        return ForceControl(model, settings.force, settings.loop.disturbance_cutoff)
