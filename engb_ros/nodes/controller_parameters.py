# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Parameters of node `controller`, and what they make of the core's settings."""

from __future__ import annotations

import math
from typing import Any

from engb_core.control.brake_settings import ControllerSettings, ForceSettings
from engb_core.control.causes import CAUSES, Stop, STOPPING
from engb_core.control.gain_checks import check_holding
from engb_core.control.loop import LoopSettings
from engb_core.control.pid import ANTIWINDUP_STRATEGIES, PidGains
from engb_core.control.reference import REFERENCES, ReferenceSettings
from engb_core.control.supervisor_settings import STALE_ACTIONS, SupervisorSettings
from engb_core.errors import InputError
from engb_core.mechanism.kinematics import Mechanism
from engb_ros.nodes.joint import HARDWARE_ID, JOINT
from engb_ros.nodes.parameters import ParameterSpec
from engb_ros.nodes.realtime import REALTIME

__all__ = ['PARAMETERS', 'check_gains', 'controller_settings']

_LOOP = (
    ParameterSpec('model', '', 'model file; empty: the paper\'s nominal motor alone'),
    JOINT,
    HARDWARE_ID,
    ParameterSpec('p', 0.4, 'proportional gain', 'N·m/rad', 0.0, 1e3, live=True),
    ParameterSpec('i', 1.5, 'integral gain', 'N·m/(rad·s)', 0.0, 1e4, live=True),
    ParameterSpec('d', 0.006, 'derivative gain, on the measured velocity', 'N·m·s/rad', 0.0, 1e2,
                  live=True),
    ParameterSpec('u_clamp_max', 0.75, 'highest torque of the loop', 'N·m', 1e-3, 1e3),
    ParameterSpec('u_clamp_min', -0.75, 'lowest torque of the loop', 'N·m', -1e3, 0.0),
    ParameterSpec('i_clamp_max', 0.5, 'highest integral part', 'N·m', 0.0, 1e3),
    ParameterSpec('i_clamp_min', -0.5, 'lowest integral part', 'N·m', -1e3, 0.0),
    ParameterSpec('antiwindup_strategy', 'back_calculation', 'what keeps the integral part from '
                  'winding up', choices=ANTIWINDUP_STRATEGIES, live=True),
    ParameterSpec('tracking_time_constant', 0.0, 'of the back-calculation; 0: chosen from the '
                  'gains', 's', 0.0, 1e3, live=True),
    ParameterSpec('error_deadband', 0.0, 'smaller errors are not integrated', 'rad', 0.0, 1e3,
                  live=True),
    ParameterSpec('save_i_term', False, 'keep the integral part over a reset', live=True),
    ParameterSpec('derivative_filter_time', 0.0, 'low-pass on the measured velocity', 's', 0.0,
                  10.0, live=True),
    ParameterSpec('load_feedforward', True, 'add the model\'s load torque', live=True),
    ParameterSpec('friction_feedforward', True, 'add the model\'s friction torque', live=True),
    ParameterSpec('cogging_feedforward', True, 'add the model\'s cogging torque', live=True),
    ParameterSpec('disturbance_compensation', False, 'take off what the observer sees beyond the '
                  'model', live=True),
    ParameterSpec('disturbance_cutoff', 20.0, 'low-pass of the loop\'s observer', 'Hz', 0.1, 1e4,
                  live=True),
)

_REFERENCE = (
    ParameterSpec('reference', 'command', 'what to track: commands, the identification strokes, '
                  'or a CSV file of time,position', choices=REFERENCES),
    ParameterSpec('reference_file', '', 'CSV file for reference:=file; within position_min and '
                  'position_max, no faster than the brake can follow, no longer than a day'),
    ParameterSpec('start_on_request', False, 'wait for service ~/start_reference with the '
                  'trajectory, as after ~/clear_faults; false: begin with the activation'),
    ParameterSpec('repeat', False, 'begin the trajectory again when it ends'),
    ParameterSpec('stroke_amplitudes', [12.0, 24.0, 36.0], 'lengths of the identification strokes',
                  'rad', -1e4, 1e4),
    ParameterSpec('stroke_acceleration', 60.0, 'of the identification strokes', 'rad/s²', 1e-3,
                  1e6),
    ParameterSpec('stroke_repetitions', 1, 'strokes of each amplitude', '', 1, 1000),
    ParameterSpec('stop_time', 0.6, 'stop section after each half stroke', 's', 0.0, 100.0),
    ParameterSpec('slow_speeds', [1.0, 4.0], 'speeds of the slow unloaded strokes before', 'rad/s',
                  1e-3, 1e3),
    ParameterSpec('slow_range', [0.3, 3.0], 'angles between which they run; equal: none', 'rad',
                  -1e4, 1e4),
    ParameterSpec('approach_acceleration', 400.0, 'of moves to a command or to a trajectory\'s '
                  'start', 'rad/s²', 1e-3, 1e6),
    ParameterSpec('apply_speed', 60.0, 'highest speed of these moves while applying', 'rad/s',
                  1e-3, 1e4),
    ParameterSpec('release_speed', 60.0, 'highest speed of these moves while releasing', 'rad/s',
                  1e-3, 1e4),
)

_FORCE = (
    ParameterSpec('mechanism', '', 'mechanism file, for force commands and the force estimate; '
                  'empty: angles only. The model must be an identified one'),
    ParameterSpec('pad_friction', 0.0, 'μ, for the self-energizing gain where the model states '
                  'none', '-', 0.0, 1.0),
    ParameterSpec('running_clearance', 2.0, 'how far the released motor stands before contact',
                  'rad', 0.0, 1e3, live=True),
    ParameterSpec('force_max', 9000.0, 'highest force command', 'N', 0.0, 1e6),
    ParameterSpec('position_min', -5.0, 'lowest position command', 'rad', -1e4, 1e4),
    ParameterSpec('position_max', 40.0, 'highest position command', 'rad', -1e4, 1e4),
)

# Nothing here is live: who can switch off a watchdog while a brake is applied can do it silently.
_SUPERVISION = (
    ParameterSpec('command_timeout', 0.25, 'a command older than this is stale; 0: never', 's',
                  0.0, 100.0),
    ParameterSpec('state_timeout', 0.1, 'a joint state older than this is stale; 0: never, as '
                  'with use_sim_time', 's', 0.0, 10.0),
    ParameterSpec('observer_timeout', 0.0, 'a disturbance older than this is stale; 0: not '
                  'watched', 's', 0.0, 10.0),
    ParameterSpec('disc_speed_timeout', 0.5, 'a disc speed older than this is stale, once one '
                  'came; 0: never', 's', 0.0, 100.0),
    ParameterSpec('stale_action', 'hold', 'what the set-point does when commands are stale',
                  choices=STALE_ACTIONS),
    ParameterSpec('stale_value', 0.0, 'for stale_action:=ramp_to_value: N if forces were '
                  'commanded, else rad', '', -1e4, 1e6),
    ParameterSpec('command_source', '', 'the only source whose commands are obeyed, by the '
                  'frame_id of its stamped commands; empty: whoever comes first'),
    ParameterSpec('largest_command_step', 0.0, 'larger steps between two position commands are '
                  'told; 0: none', 'rad', 0.0, 1e6),
    ParameterSpec('largest_force_step', 0.0, 'larger steps between two force commands are told; '
                  '0: none', 'N', 0.0, 1e6),
    ParameterSpec('largest_speed', 400.0, 'angles that moved faster are not believed', 'rad/s',
                  1.0, 1e5),
    ParameterSpec('jump_time', 0.05, 'an angle that jumped and stays for so long is lost', 's',
                  0.0, 10.0),
    ParameterSpec('velocity_tolerance', 25.0, 'the velocity may be off from that of the angles by '
                  'so much, in the mean of 20 ms; 0: not watched', 'rad/s', 0.0, 1e5),
    ParameterSpec('largest_error', 2.0, 'a larger tracking error is told; the angle may leave its '
                  'range by so much', 'rad', 0.001, 1e4),
    ParameterSpec('error_time', 0.3, 'if the tracking error lasts so long', 's', 0.0, 100.0),
    ParameterSpec('drive_tolerance', 0.15, 'the measured torque may be off by so much from what '
                  'is asked; 0: not watched', 'N·m', 0.0, 1e3),
    ParameterSpec('drive_time', 0.1, 'of the mean that is held against it', 's', 1e-3, 10.0),
    ParameterSpec('drive_delay', 0.05, 'the measured torque may lag so far behind', 's', 1e-3,
                  10.0),
    ParameterSpec('seized_time', 1.0, 'the shaft may stand at full torque for so long; 0: not '
                  'watched', 's', 0.0, 100.0),
    ParameterSpec('effort_limit', 0.75, 'final clamp of the torque', 'N·m', 1e-3, 1e3),
    ParameterSpec('effort_rate', 1000.0, 'final clamp of its slew rate', 'N·m/s', 0.1, 1e6),
    ParameterSpec('ramp_time', 0.2, 'from full torque to none in a fault', 's', 1e-3, 10.0),
    *(ParameterSpec(f'stop_{cause.word}', CAUSES[cause].stops[0].value,
                    f'what becomes of the torque in this fault: {CAUSES[cause].reason}',
                    choices=tuple(stop.value for stop in CAUSES[cause].stops))
      for cause in STOPPING),
    ParameterSpec('standby', False, 'stay silent beside another controller, and take over when '
                  'it falls silent'),
    ParameterSpec('takeover_time', 0.05, 'the other one may be silent for so long; keep it below '
                  'the drive\'s command_timeout', 's', 0.005, 10.0),
    ParameterSpec('candidate_model', '', 'model file that service ~/accept_model takes',
                  live=True),
)

_OUTPUT = (
    ParameterSpec('reference_every', 10, 'publish `reference` every n-th cycle; 0: never', '', 0,
                  1000),
    ParameterSpec('force_every', 10, 'publish `clamp_force` every n-th cycle', '', 2, 1000),
    ParameterSpec('report_every', 50, 'publish `control_report` every n-th cycle; 0: never', '', 0,
                  1000),
    ParameterSpec('diagnostics_period', 0.5, 'between messages on /diagnostics', 's', 0.05, 60.0),
)

PARAMETERS = _LOOP + _REFERENCE + _FORCE + _SUPERVISION + _OUTPUT + REALTIME


def controller_settings(values: dict[str, Any],
                        mechanism: Mechanism | None) -> ControllerSettings:
    """Return the core's settings from parameter values; InputError where they don't fit.

    Args:
        values: of the parameters.
        mechanism: of the file that they name, read once; None: no forces.
    """
    force = None
    if mechanism is not None:
        force = ForceSettings(mechanism, values['pad_friction'], values['running_clearance'])
    if not values['position_min'] < values['position_max']:
        raise InputError('parameter position_min must be below position_max')
    return ControllerSettings(
        _loop(values), _reference(values), _supervision(values), force,
        values['position_min'], values['position_max'], values['force_max'],
        values['stale_value'])


def check_gains(values: dict[str, Any], present: dict[str, Any]) -> None:
    """Raise InputError where gains would hold no brake, changed while one may be applied.

    Args:
        values: of all parameters, as the whole request would leave them.
        present: as they are.
    """
    check_holding(_gains(values), _gains(present), values['largest_error'],
                  values['effort_limit'])


def _gains(values: dict[str, Any]) -> PidGains:
    return PidGains(**{name: values[name] for name in PidGains.__dataclass_fields__})


def _loop(values: dict[str, Any]) -> LoopSettings:
    return LoopSettings(_gains(values), values['load_feedforward'], values['friction_feedforward'],
                        values['cogging_feedforward'], values['disturbance_compensation'],
                        values['disturbance_cutoff'])


def _reference(values: dict[str, Any]) -> ReferenceSettings:
    if len(values['slow_range']) != 2:
        raise InputError('parameter slow_range must hold two angles [rad]')
    return ReferenceSettings(
        kind=values['reference'], file=values['reference_file'],
        start_on_request=values['start_on_request'], repeat=values['repeat'],
        amplitudes=tuple(values['stroke_amplitudes']),
        acceleration=values['stroke_acceleration'], repetitions=values['stroke_repetitions'],
        stop_time=values['stop_time'], slow_speeds=tuple(values['slow_speeds']),
        slow_range=tuple(values['slow_range']),
        approach_acceleration=values['approach_acceleration'],
        apply_speed=values['apply_speed'], release_speed=values['release_speed'])


def _supervision(values: dict[str, Any]) -> SupervisorSettings:
    names = {name: values[name] for name in SupervisorSettings.__dataclass_fields__
             if name in values}
    for name in ('largest_command_step', 'largest_force_step'):
        names[name] = values[name] or math.inf
    names['stops'] = {cause: Stop(values[f'stop_{cause.word}']) for cause in STOPPING}
    return SupervisorSettings(**names)
