# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One brake's controller: reference, loop, clamp force and supervision, without any middleware."""

from __future__ import annotations

from dataclasses import replace
import math

from engb_core.control.acceptance import AcceptanceBounds, check_candidate, check_computable
from engb_core.control.brake_settings import ControllerSettings, Report
from engb_core.control.causes import Cause, Stop
from engb_core.control.clamp_force import ClampForceEstimator
from engb_core.control.command_arbiter import ANONYMOUS, Command
from engb_core.control.final_clamp import FinalClamp
from engb_core.control.force_control import force_control_of, ForceControl, PreparedModel
from engb_core.control.gain_checks import delay_margin
from engb_core.control.loop import PositionLoop
from engb_core.control.reference import ReferenceSource
from engb_core.control.supervisor import Supervisor
from engb_core.control.trajectory import Setpoint
from engb_core.control.velocity_watch import VelocityWatch
from engb_core.errors import InputError
from engb_core.model import Model

__all__ = ['BrakeController']

_COMMAND_STALE = Cause.COMMAND_STALE.value
_STATE_STALE = Cause.STATE_STALE.value

# Full torque, but for rounding.
_FULL = 0.99


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
        check_computable(model, self._bounds)
        self.supervisor = Supervisor(settings.supervisor)
        self.clamp = FinalClamp(settings.supervisor)
        self.loop = PositionLoop(model, settings.loop)
        self.source = ReferenceSource(settings.reference, settings.reference_bounds(model))
        self._velocity = VelocityWatch(settings.supervisor.velocity_tolerance)
        self._look_at(model)
        self.supervisor.watch_commands = settings.reference.kind == 'command'
        self.report = Report()
        self.setpoint = Setpoint(0.0)
        self._disc_speed = 0.0
        self._force = force_control_of(model, settings)
        self._moves = False
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
        self.silent, self._last = False, now
        self._restart()
        self.source.restart()

    def apply(self, settings: ControllerSettings) -> None:
        """Change settings while running; the torque doesn't jump. `reference` is not changed."""
        self.settings = replace(settings, reference=self.settings.reference)
        self.supervisor.settings = self.clamp.settings = settings.supervisor
        self._look_at(self.model)
        self.loop.set_settings(settings.loop)
        if self._force is not None and settings.force is not None:
            self._force.apply(settings.force, settings.loop.disturbance_cutoff)

    def accept_model(self, candidate: Model) -> None:
        """Take an identified model into use; the torque doesn't jump.

        Raises:
            InputError: it is out of bounds (`acceptance`).
        """
        self.take_model(self.prepare_model(candidate))

    def prepare_model(self, candidate: Model) -> PreparedModel:
        """Judge an identified model and build what it takes to use it; changes nothing, so it
        may be called in another thread.

        Raises:
            InputError: it is out of bounds (`acceptance`).
        """
        check_candidate(candidate, self.model, self._bounds)
        return PreparedModel(candidate, force_control_of(candidate, self.settings))

    def take_model(self, prepared: PreparedModel) -> None:
        """Take a prepared model into use; the torque doesn't jump."""
        force = prepared.force
        if force is not None and self._force is not None:
            force.learn_from(self._force)
            force.command = self._force.command
        self._force = force
        self._look_at(prepared.model)
        self.loop.set_model(prepared.model)

    @property
    def _bounds(self) -> AcceptanceBounds:
        settings = self.settings
        return AcceptanceBounds(highest_torque=settings.supervisor.effort_limit,
                                low=settings.position_min, high=settings.position_max)

    def _look_at(self, model: Model) -> None:
        """Say how slow stands, and how fast a motor speeds up: with the whole torque, and as much
        again of load and friction (a brake that were heavier is not accepted); and how far apart
        samples may come."""
        self._slow = 2.0 * model.friction.saturation_velocity
        limit = 2.0 * self.settings.supervisor.effort_limit / model.motor.inertia
        self._velocity.acceleration = self.supervisor.states.acceleration = limit
        self.supervisor.longest_interval = delay_margin(self.settings.loop.gains, model.motor)

    # Inputs.
    def on_position_command(self, now: float, value: float) -> bool:
        """Take a set-point [rad] without a name; False where it isn't taken."""
        return self.on_command(now, Command(value))

    def on_force_command(self, now: float, value: float) -> bool:
        """Take a set-point [N] without a name; False where it isn't taken."""
        return self.on_command(now, Command(value, by_force=True))

    def on_command(self, now: float, command: Command) -> bool:
        """Take a set-point; False where it isn't taken.

        With a fault latched only a lower request is.
        """
        settings, supervisor = self.settings, self.supervisor
        if self.source.commanded_by_trajectory:
            return False
        if command.by_force and self._force is None:
            supervisor.note(Cause.FORCE_NOT_CONFIGURED, now)
            return False
        low, high = ((0.0, self._highest_force) if command.by_force
                     else (settings.position_min, settings.position_max))
        value = supervisor.accept_command(now, command, low, high)
        if value is None:
            return False
        rivals = supervisor.commands.rivals and command.source == ANONYMOUS
        if supervisor.faults or rivals:
            angle = self._angle_of_force(value) if command.by_force else value
            if rivals and supervisor.commands.asks_for_less(now, command.by_force, angle):
                return False
            if supervisor.faults and (supervisor.stop is not Stop.HOLD
                                      or angle > self.source.target):
                return False
        if command.by_force:
            self._aim_at_force(value)
        else:
            if self._force is not None:
                self._force.command = None
            self.report.position_input = value
            self.source.command(value)
        return True

    def on_disc_speed(self, now: float, value: float) -> None:
        """Take the disc's speed [rad/s]."""
        if math.isfinite(value):
            self._disc_speed = value
            self.supervisor.disc_spoke(now)

    def on_disturbance(self, now: float, value: float) -> None:
        """Take an external observer's word: only its age is used."""
        if math.isfinite(value):
            self.supervisor.observer_spoke(now)

    def on_wrong_joint(self, now: float) -> None:
        """Take note of a joint state that lacks the joint."""
        self.supervisor.note(Cause.STATE_WRONG_JOINT, now)

    def on_drive_state(self, now: float, word: str) -> None:
        """Take a bridge's word on whether its drive obeys (`Supervisor.drive_state`)."""
        self.supervisor.drive_state(now, word)

    def start_reference(self) -> float:
        """Begin the trajectory; return its length [s]. InputError where there is none."""
        if self.supervisor.stopping:
            raise InputError(self.supervisor.waits_for or 'a fault is latched; clear it first')
        self.source.start()
        return self.source.duration

    def clear(self, now: float, speak: bool = True) -> Cause:
        """Clear latched faults; return those whose condition remains. A brake without faults
        goes on as if nothing had been asked; one that is silent speaks, if it may, and holds the
        position: a trajectory goes on by `start_reference` alone."""
        supervisor = self.supervisor
        stop = supervisor.stop
        if not supervisor.faults:
            return Cause(0)
        left = supervisor.clear(now)
        if not left and (speak or not self.silent):
            if self.silent or stop is not Stop.HOLD:
                self._restart(self.clamp.output)
            self._hold()   # where torque is there and the loop is closed, it stays so
            self.silent = False
        return left

    # Cycles.

    def on_state(self, now: float, stamp: float, position: float, velocity: float,
                 effort: float) -> float | None:
        """Take a joint state; return the torque to send [N·m], None: send nothing."""
        supervisor = self.supervisor
        supervisor.watch(now)
        states = supervisor.states
        if not supervisor.accept_state(now, stamp, position, velocity):
            return self._hold_load(now) if states.in_doubt else None
        if self._ramping and not (supervisor.enabled_once or supervisor.stopping):
            self._restart(self.clamp.output)   # the drive that was waited for is back
        velocity = self._velocity.step(states.taken.time, states.span, position, velocity)
        states.velocity = velocity
        report, settings = self.report, self.settings
        report.position_output, report.effort_output = position, effort
        # Slower than this its friction may hold it either way: it stands.
        self._moves = abs(velocity) > self._slow
        if self.silent:
            return None
        dt, self._last = now - self._last, now
        supervisor.angle(now, position, settings.position_min, settings.position_max)
        supervisor.torque(now, effort, dt)
        supervisor.velocity(now, self._velocity.wrong)
        try:
            wish = self._wish(now, states.time, position, velocity, supervisor.torques.measured)
        except (ArithmeticError, ValueError):   # a model whose torque cannot be computed
            wish = math.nan
        if not math.isfinite(wish):
            supervisor.set(Cause.OUTPUT_NOT_FINITE, True, now)
        if supervisor.stop not in (None, Stop.HOLD):
            return self._let_go(dt)
        self._ramping: bool = False
        torque = self.clamp.step(wish, dt)
        supervisor.torques.asked(torque, dt)
        if self.clamp.limited:
            supervisor.note(Cause.OUTPUT_LIMITED, now)
        error = self.setpoint.position - position
        supervisor.tracking(now, error, self.setpoint.position)
        if supervisor.shaft(now, position, error, self._is_full(torque), dt):
            self._seized(position)
        report.position_command = self.setpoint.position
        report.effort_input, report.effort_command = wish, torque
        return torque

    def on_tick(self, now: float) -> float | None:
        """Look at the clock; return a torque to send where no joint state will ask for one."""
        supervisor = self.supervisor
        supervisor.watch(now)
        if self.silent or not supervisor.stopping & _STATE_STALE:
            return None
        dt, self._last = now - self._last, now
        return self._let_go(dt)

    def on_other_controller(self, now: float, present: bool, was_first: bool,
                            latch: bool = True) -> None:
        """Say whether someone else publishes torque; `was_first`: this one was here before.

        Who was not falls silent, and with `latch` stays so until it is cleared.
        """
        yields = present and not was_first
        self.supervisor.set(Cause.OTHER_CONTROLLER, present, now, latch=latch and yields)
        if yields:
            self.silent = True

    def take_over(self, now: float, torque: float) -> None:
        """Speak from now on, in the place of one who sent `torque` [N·m] last."""
        force = self._force.command if self._force is not None else None
        target = self.source.target
        limit = self.settings.supervisor.effort_limit
        self._restart(min(max(torque, -limit), limit))
        self._hold()
        self.supervisor.enabled_once = True
        self.silent, self._last = False, now
        if force is not None:
            self._aim_at_force(force)
        elif self.supervisor.commanded:
            self.source.command(target)

    @property
    def feedforward(self) -> float:
        """Feedforward torque of the last cycle [N·m]."""
        return self.loop.feedforward

    # Parts.

    def _wish(self, now: float, time: float, position: float, velocity: float,
              effort: float) -> float:
        """Return the loop's torque [N·m] for a sample; NaN where there is none."""
        supervisor = self.supervisor
        self._estimate(now, time, position, velocity, effort)
        new = supervisor.faults & ~self._handled
        if new:
            self._handled |= new
            if new & _COMMAND_STALE:
                self._stale()
            elif supervisor.stop is Stop.HOLD:
                self._hold_at(position)
        if supervisor.stop not in (None, Stop.HOLD):
            return 0.0
        self.setpoint = self.source.at(time, position)
        if self.source.commanded_by_trajectory and self.source.running and supervisor.paced:
            supervisor.enable()
        loop = self.loop
        loop.pid.frozen = supervisor.torques.short
        return loop.step(time, position, velocity, effort, self.setpoint)

    def _restart(self, output: float = 0.0) -> None:
        """Begin anew, from torque `output` [N·m]."""
        position = self.report.position_output
        known = math.isfinite(position) and self.supervisor.states.seen
        self.loop.reset(output, Setpoint(position) if known else None)
        self.clamp.output = output
        self.source.reset()
        if self._force is not None:
            self._force.reset()
        self._velocity.reset()
        self._handled = 0
        self._ramping = False
        self.report = Report()

    def _hold_load(self, now: float) -> float | None:
        """Return what holds the load [N·m], as long as nobody knows where the motor is: what was
        to speed it up or damp it for a moment would throw a free motor out of its range."""
        if self.silent or self.supervisor.stop not in (None, Stop.HOLD):
            return None
        dt, self._last = now - self._last, now
        torque = self.clamp.step(self.loop.held_torque(self.report.position_output), dt)
        self.supervisor.torques.asked(torque, dt)
        self.report.effort_command = torque
        return torque

    def _let_go(self, dt: float) -> float:
        """Return the next torque of a stop that ends without any [N·m]."""
        if self.supervisor.stop is Stop.RELEASE:
            torque = self.clamp.release()
        else:
            if not self._ramping and self._moves:
                # What speeds a motor up holds no load: ramped down with nobody watching it
                # would drive a free motor out of its range.
                self.clamp.output = min(self.clamp.output,
                                        self.loop.held_torque(self.report.position_output))
            # The ramp begins now, not with the last cycle, which may be a timeout ago.
            torque = self.clamp.ramp_down(dt if self._ramping else 0.0)
        self._ramping = True
        self.supervisor.torques.asked(torque, dt)
        self.loop.reset(torque)
        self.report.effort_input, self.report.effort_command = 0.0, torque
        return torque

    def _hold(self) -> None:
        """Stay at the set-point, forget the command."""
        self._handled = 0
        if self._force is not None:
            self._force.command = None
        self.source.hold()

    def _hold_at(self, position: float) -> None:
        if self._force is not None:
            self._force.command = None
        settings = self.settings
        self.source.hold_at(min(max(position, settings.position_min), settings.position_max))

    def _seized(self, position: float) -> None:
        """Full torque moves nothing: hold what is reached with what the model says it takes."""
        if self.supervisor.stop is Stop.HOLD:
            self._hold_at(position)
            held = Setpoint(position)
            self.loop.reset(self.loop.torques.torque(held), held)
            self.supervisor.torques.moved()

    def _is_full(self, torque: float) -> bool:
        gains, limit = self.loop.settings.gains, self.settings.supervisor.effort_limit
        if torque >= 0.0:
            return torque >= _FULL * min(limit, gains.u_clamp_max)
        return torque <= _FULL * max(-limit, gains.u_clamp_min)

    def _stale(self) -> None:
        settings, force = self.settings, self._force
        action = settings.supervisor.stale_action
        if force is not None and force.command is None:
            force = None        # the position is what was commanded
        if action == 'hold':
            if force is not None:
                force.command = None
            self.source.hold()
            return
        value = settings.stale_value if action == 'ramp_to_value' else 0.0
        if force is not None:
            self._aim_at_force(min(max(value, 0.0), self._highest_force))
        else:
            self.source.command(min(max(value, settings.position_min), settings.position_max))

    def _estimate(self, now: float, stamp: float, position: float, velocity: float,
                  effort: float) -> None:
        force = self._force
        if force is None or not force.observe(stamp, velocity, effort):
            return
        supervisor = self.supervisor
        was_uncertain = force.uncertain
        # A speed that nobody tells any more counts as none.
        unknown = supervisor.holds(Cause.DISC_SPEED_STALE)
        disc_speed = 0.0 if unknown else self._disc_speed
        force.estimate(stamp, position, velocity, disc_speed,
                       not unknown and not supervisor.holds(Cause.OBSERVER_STALE))
        estimator, torques = force.estimator, self.loop.torques
        torques.shift = estimator.shift
        torques.load_ratio = estimator.map.load_ratio(disc_speed)
        if force.uncertain or was_uncertain:
            supervisor.set(Cause.FORCE_UNCERTAIN, force.uncertain, now)
        if force.command is not None:
            self._aim_at_force(force.command)

    @property
    def _by_force(self) -> ForceControl:
        """What turns forces into angles; asked for where forces are taken only."""
        assert self._force is not None, 'the settings have no force control'
        return self._force

    @property
    def _highest_force(self) -> float:
        return min(self.settings.force_max, float(self._by_force.estimator.map.highest_force))

    def _aim_at_force(self, value: float) -> None:
        self._by_force.command = value
        self.report.position_input = angle = self._angle_of_force(value)
        self.source.command(angle)

    def _angle_of_force(self, value: float) -> float:
        return min(max(self._by_force.angle_of(value), self.settings.position_min),
                   self.settings.position_max)
