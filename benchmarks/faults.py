# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The faults that `fault_times` injects: how, what is promised, what is done, which test."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
import signal
import tempfile
import time

from benchmarks.watched_loop import answer_of, nanoseconds, RATE, WatchedLoop
from engb_core.control.causes import Cause
from engb_ros.interface import (
    CLEAR_FAULTS,
    CONTROLLER_ACTIVATION,
    POSITION_COMMAND,
    POSITION_COMMAND_STAMPED,
    RECORDED,
)
from engb_ros.nodes.messages import message_class
from engb_ros.processes.runner import node_command

__all__ = ['BOUNDS', 'Fault', 'FAULTS', 'KEPT_ANGLE', 'LATENCY', 'LET_GO', 'Times',
           'UNTIMED']

Times = dict[str, float]

# Not a time, but how far the brake let go meanwhile [rad].
KEPT_ANGLE = 'angle lost'

# What must not be at all: by the drive's own samples, how long it gave no torque.
LET_GO = 'drive without torque'

# From the injection to the node that is hit: a service call, a signal, a message [s].
LATENCY = 0.03

# What the default parameters promise, as the page says it and in seconds. A drive at 250 Hz gives
# a cycle of 4 ms; `told` waits for the next diagnostics.
BOUNDS = {
    '`state_timeout` + 20 ms': 0.12,
    'the drive\'s `command_timeout` (100 ms)': 0.1 + 0.004,
    '`command_timeout` + a cycle': 0.25 + 0.02,
    'at once; told with `diagnostics_period`': 0.05 + 0.004,
    # Discovery takes 0.2 s as a rule, and 3 s at times, of a process that has just started.
    'discovery (up to 3 s) + 0.2 s': 3.2,
    # The drive's seventh sample is the first that is spoilt.
    'at once, of the seventh sample; told with `diagnostics_period`': 7 * 0.004 + 0.05 + 0.004,
    '`observer_timeout` + a cycle; told with `diagnostics_period`': 0.1 + 0.02 + 0.05,
    '4 frames, then `state_timeout`': 0.016 + 0.12,
    '`link_timeout`, `state_timeout`': 0.05 + 0.12,
    '`state_timeout`': 0.12,
    '`jump_time` + a cycle': 0.05 + 0.004,
    '2 × `drive_delay` + `drive_time`': 0.2,
    # 0.1 s: until the move that begins with the fault asks for that much.
    '2 × `drive_delay` + `drive_time`, once the torque asked is twice `drive_tolerance`': 0.3,
    '2 × `drive_delay` + `drive_time`, once it lacks `drive_tolerance`': 0.3,
    'three words, 10 ms apart, and a cycle': 0.03 + 0.004,
    # The move that begins with the fault takes 60 ms to the speed that tells, and 14 to the mean.
    'at once, as it moves; told with `diagnostics_period`': 0.06 + 0.014 + 0.004 + 0.05,
    '`drive_time` + a cycle; told with `diagnostics_period`': 0.1 + 0.004 + 0.05,
    '`seized_time` + the time to full torque': 1.0 + 0.2,
    '`mode_timeout` of the bridge, and 30 ms': 0.1 + 0.03 + 0.004,
    '`disc_speed_timeout` + a cycle; told with `diagnostics_period`': 0.5 + 0.02 + 0.05,
    '0.1 s after discovery; told with `diagnostics_period`': 0.1 + 0.05 + 0.2,
    '`takeover_time` + a cycle': 0.05 + 0.004,
    'the drive\'s `command_timeout` (100 ms) and `mode_timeout` of the bridge': 0.24,
    'a second': 1.0,
}


@dataclass(frozen=True)
class Fault:
    """One kind of fault.

    Attributes:
        name: what happens.
        bound: what the parameters promise.
        reaction: what is done about it.
        test: that injects it.
        loop: 'plant', 'can', 'force', 'spoilt' (a drive that goes wrong on request) or 'lossy'
            (datagrams that are lost on request).
        measure: injects it once and returns what took how long [s].
    """

    name: str
    bound: str
    reaction: str
    test: str
    loop: str
    measure: Callable[[WatchedLoop], Times]

    @property
    def limit(self) -> float:
        """Within so long it must be noticed, told, or over [s]."""
        return BOUNDS[self.bound] + LATENCY

    @property
    def latches(self) -> bool:
        """Whether the controller must stay in its fault when what caused it is gone."""
        return 'latched' in self.reaction or self.reaction.startswith('as before')


def drive_hit(node: str, number: int) -> Callable[[WatchedLoop], Times]:
    """Return a measurement: `node` of the drive gets signal `number`."""
    def measure(loop: WatchedLoop) -> Times:
        begin = _hit(loop, node, number)
        return {'noticed': loop.noticed(begin, 'state', 'fault'),
                'no torque': loop.no_torque(begin)}
    return measure


def all_lost(loop: WatchedLoop) -> Times:
    """Lose every datagram of all nodes for half a second; what was reliable comes afterwards."""
    loop.until(lambda: loop.effort != 0.0, 'a torque')
    loop.pump()
    begin, last = time.time_ns(), nanoseconds(loop.states[-1].header.stamp)
    loop.wire.lose(1.0)
    loop.during(0.5)
    loop.wire.lose(0.0)
    return {'noticed': loop.noticed(begin, 'state', 'fault'), 'drive lets go': _let_go(loop, last)}


def controller_hit(number: int) -> Callable[[WatchedLoop], Times]:
    """Return a measurement: the controller gets signal `number`."""
    def measure(loop: WatchedLoop) -> Times:
        loop.until(lambda: loop.effort != 0.0, 'a torque')
        # By the drive's own clock, from the last sample that came before.
        loop.pump()
        begin = nanoseconds(loop.states[-1].header.stamp)
        _hit(loop, 'controller', number)
        return {'drive lets go': _let_go(loop, begin)}
    return measure


def bus_fault(name: str) -> Callable[[WatchedLoop], Times]:
    """Return a measurement: the drive acts out a fault of the bus."""
    def measure(loop: WatchedLoop) -> Times:
        begin = time.time_ns()
        loop.set_parameter('drive_emulator', 'fault', name)
        return {'noticed': loop.noticed(begin, 'state', 'fault'),
                'no torque': loop.no_torque(begin)}
    return measure


def stale_command(loop: WatchedLoop) -> Times:
    """Let the commands end."""
    loop.probe.publish(POSITION_COMMAND, loop.target)
    begin, loop.target = time.time_ns(), None
    return {'noticed': loop.noticed(begin, 'state', 'fault')}


def bad_command(loop: WatchedLoop) -> Times:
    """Send commands that are no number until one is read."""
    begin = time.time_ns()

    def told() -> bool:   # the controller reads the newest only
        loop.probe.publish(POSITION_COMMAND, math.nan)
        return loop.has(Cause.COMMAND_NOT_FINITE)
    loop.until(told, 'the cause')
    return {'told': loop.noticed(begin, 'command_not_finite')}


def second_controller(loop: WatchedLoop) -> Times:
    """Start another controller; time runs from its activation."""
    active = loop.probe.listen(CONTROLLER_ACTIVATION)
    loop.during(0.5)
    known = {message.data for message in active}
    second = loop.runner.start_command('second', node_command(
        'controller', name='second', parameters={**loop.controller}))
    loop.until(lambda: {message.data for message in active} - known, 'its activation')
    took = loop.noticed(max(message.data for message in active), 'state', 'fault',
                        node='second')
    second.signal(signal.SIGINT)
    loop.runner.processes.pop('second').wait()
    return {'noticed': took}


def observer_killed(loop: WatchedLoop) -> Times:
    """Kill the external observer."""
    begin = _hit(loop, 'disturbance_observer', signal.SIGKILL)
    return {'told': loop.noticed(begin, 'observer_stale')}


def recorder_killed(loop: WatchedLoop) -> Times:
    """Kill the recorder while it writes; see what is readable."""
    from engb_core.io.bags.read import read_recording
    with tempfile.TemporaryDirectory(prefix='engb_fault_') as folder:
        loop.runner.start('recorder', parameters={'bag': f'{folder}/bag'})
        loop.until(lambda: 'joint_states' in answer_of(loop, 'recorder', RECORDED)[1],
                   'the recorder', timeout=60.0)
        loop.during(3.0)
        loop.kill('recorder')
        last = loop.states[-1].header.stamp
        recording = read_recording(f'{folder}/bag')
        readable = recording.start + recording.time[-1]
        return {'lost': last.sec + 1e-9 * last.nanosec - readable}


def two_publishers(loop: WatchedLoop) -> Times:
    """Publish the same command from a second publisher, which asks for less."""
    node = loop.probe.node
    other = node.create_publisher(message_class(POSITION_COMMAND.type), POSITION_COMMAND.name, 1)
    begin, angle = time.time_ns(), loop.position
    took = {'told': loop.noticed(begin, 'command_conflict')}
    lowest = angle
    for _ in range(20):
        other.publish(message_class(POSITION_COMMAND.type)(data=3.0))
        loop.during(0.03)
        lowest = min(lowest, loop.position)
    node.destroy_publisher(other)
    return took | {KEPT_ANGLE: angle - lowest}


def primary_killed(loop: WatchedLoop) -> Times:
    """Kill the controller beside a standby; torque commands stop for so long."""
    standby = loop.runner.start_command('standby', node_command(
        'controller', name='standby', parameters={**loop.controller, 'standby': True}))

    asked = [time.monotonic()]

    def ready() -> bool:
        # A busy machine makes watchdogs find what nobody injected.
        if loop.is_in('fault') and time.monotonic() - asked[0] > 1.0:
            asked[0] = time.monotonic()
            answer_of(loop, 'controller', CLEAR_FAULTS)
        for message in reversed(loop.diagnostics):
            status = message.status[0]
            if status.name.endswith(': standby'):
                values = {entry.key: entry.value for entry in status.values}
                return (values['state'] in ('enabled', 'degraded')
                        and values['standby_not_ready'] == '0')
        return False

    loop.diagnostics.clear()
    loop.until(ready, 'the standby')
    loop.torques.clear()
    loop.until(lambda: len(loop.torques) > 20, 'torque')
    angle = loop.position
    begin = len(loop.states)
    killed = time.time_ns()
    # A process takes a while to end, in which nobody would hear who speaks: not waited for.
    primary = loop.runner.processes.pop('controller')
    primary.signal(signal.SIGKILL)
    loop.during(1.5)
    primary.wait()
    arrivals = [arrived for arrived, _ in loop.torques]
    gap = 1e-9 * max(after - before for before, after
                     in zip(arrivals[:-1], arrivals[1:], strict=True) if after > killed - 5e7)
    lowest = min(message.position[0] for message in loop.states[begin:])
    let_go, since = 0.0, None
    for message in loop.states[begin:]:
        stamp = 1e-9 * nanoseconds(message.header.stamp)
        if message.effort[0] != 0.0:
            since = None
        else:
            since = stamp if since is None else since
            let_go = max(let_go, stamp - since + 1.0 / RATE)
    standby.signal(signal.SIGINT)
    loop.runner.processes.pop('standby').wait()
    return {'without torque commands': gap, LET_GO: let_go, KEPT_ANGLE: max(angle - lowest, 0.0)}


def spoilt(name: str, told: str = '', angle: float = 15.0) -> Callable[[WatchedLoop], Times]:
    """Return a measurement: the drive goes wrong; `told` names the cause where no fault is
    latched, `angle` is commanded meanwhile [rad]."""
    def measure(loop: WatchedLoop) -> Times:
        begin = time.time_ns()
        loop.target = angle
        loop.set_parameter('plant', 'fault', name)
        if told:
            return {'told': loop.noticed(begin, told)}
        found = {'noticed': loop.noticed(begin, 'state', 'fault')}
        if name in ('seized', 'angle_stuck'):   # held, not let go
            return found
        return found | {'no torque': loop.no_torque(begin)}
    return measure


def command(value: float, told: str) -> Callable[[WatchedLoop], Times]:
    """Return a measurement: a position is commanded [rad], and told of."""
    def measure(loop: WatchedLoop) -> Times:
        begin = time.time_ns()
        loop.target = value
        return {'told': loop.noticed(begin, told)}
    return measure


def stamped(told: str, age: float = 0.0, counters: tuple[float, ...] = (1.0,),
            ) -> Callable[[WatchedLoop], Times]:
    """Return a measurement: stamped commands that are late, repeated, or somebody else's."""
    def measure(loop: WatchedLoop) -> Times:
        from sensor_msgs.msg import JointState
        loop.until(lambda: loop.probe.subscribers(POSITION_COMMAND_STAMPED), 'the subscription')
        begin = time.time_ns()

        def seen() -> bool:
            for counter in counters:
                message = JointState(name=['motor', 'counter'], position=[15.0, counter])
                message.header.frame_id = f'somebody {begin}'
                message.header.stamp = loop.probe.node.get_clock().now().to_msg()
                message.header.stamp.sec -= int(age)
                loop.probe.publish(POSITION_COMMAND_STAMPED, message)
            return loop.has(Cause[told.upper()])
        loop.until(seen, told)
        return {'told': loop.noticed(begin, told)}
    return measure


FAULTS = (
    Fault('drive killed', '`state_timeout` + 20 ms', 'torque ramps to zero in `ramp_time`; '
          'latched', 'test_a_killed_drive_and_a_frozen_drive', 'plant',
          drive_hit('plant', signal.SIGKILL)),
    Fault('drive frozen', '`state_timeout` + 20 ms', 'as before',
          'test_a_killed_drive_and_a_frozen_drive', 'plant', drive_hit('plant', signal.SIGSTOP)),
    Fault('bridge killed', '`state_timeout` + 20 ms', 'as before; the drive lets go by itself',
          'test_a_killed_drive_and_a_frozen_drive', 'can',
          drive_hit('can_bridge', signal.SIGKILL)),
    Fault('bridge frozen', '`state_timeout` + 20 ms', 'as before',
          'test_a_killed_drive_and_a_frozen_drive', 'can',
          drive_hit('can_bridge', signal.SIGSTOP)),
    Fault('controller killed', 'the drive\'s `command_timeout` (100 ms)', 'the drive lets go; '
          'restarted in mid-stroke, the controller holds the angle it finds',
          'test_a_killed_controller_and_its_restart_in_mid_stroke', 'plant',
          controller_hit(signal.SIGKILL)),
    Fault('controller frozen', 'the drive\'s `command_timeout` (100 ms)', 'the drive lets go; '
          'awake again, the controller finds its inputs stale', 'test_a_frozen_controller',
          'plant', controller_hit(signal.SIGSTOP)),
    Fault('commands stale', '`command_timeout` + a cycle', '`stale_action`; latched',
          'test_garbage_and_stale_commands', 'plant', stale_command),
    Fault('command NaN, infinite, out of range, jumping', 'at once; told with '
          '`diagnostics_period`', 'not taken', 'test_garbage_and_stale_commands', 'plant',
          bad_command),
    Fault('joint state NaN, jumping, of a wrong joint; clock jumps', 'at once, of the seventh '
          'sample; told with `diagnostics_period`', 'sample not used; nothing integrated over a '
          'jump',
          'test_garbage_joint_states_and_jumps_of_the_clock', 'spoilt',
          spoilt('angle_nan_now', 'state_not_finite')),
    Fault('second controller', 'discovery (up to 3 s) + 0.2 s', 'the later one yields, silent',
          'test_two_controllers_at_once', 'plant', second_controller),
    Fault('observer killed', '`observer_timeout` + a cycle; told with `diagnostics_period`',
          'degraded; force from the angle alone',
          'test_force_mode_observer_loss_and_a_model_accepted', 'force', observer_killed),
    Fault('frames repeated', '4 frames, then `state_timeout`', 'no sample is published; torque '
          'ramps to zero', 'test_the_loop_over_can_and_every_fault_of_the_bus', 'can',
          bus_fault('repeated')),
    Fault('bus off, or silent', '`link_timeout`, `state_timeout`', 'as before; the bus is opened '
          'again each `reconnect_time`', 'test_the_loop_over_can_and_every_fault_of_the_bus',
          'can', bus_fault('bus_off')),
    Fault('frames late (120 ms, in bursts)', '`link_timeout`, `state_timeout`', 'as before',
          'test_the_loop_over_can_and_every_fault_of_the_bus', 'can', bus_fault('late')),
    Fault('drive\'s sensor fault flag', '`state_timeout`', 'as before',
          'test_the_loop_over_can_and_every_fault_of_the_bus', 'can', bus_fault('sensor_fault')),
    Fault('stamps stand still', '`state_timeout` + 20 ms',
          'samples not used, then `stop_state_stale`; latched',
          'test_a_drive_whose_stamps_or_angles_go_wrong', 'spoilt',
          spoilt('stamps_stand')),
    Fault('stamps are nought', '`state_timeout` + 20 ms',
          'as before',
          'test_a_drive_whose_stamps_or_angles_go_wrong', 'spoilt',
          spoilt('stamps_nought')),
    Fault('clock set back by 60 ms', 'at once; told with `diagnostics_period`',
          'the loop goes on by the steady clock',
          'test_a_drive_whose_stamps_or_angles_go_wrong', 'spoilt',
          spoilt('clock_back', 'clock_jump')),
    Fault('clock set forward by an hour', 'at once; told with `diagnostics_period`',
          'as before',
          'test_a_drive_whose_stamps_or_angles_go_wrong', 'spoilt',
          spoilt('clock_forward', 'clock_jump')),
    Fault('angle jumps by 8 rad and stays', '`jump_time` + a cycle',
          '`stop_angle_lost`; latched',
          'test_a_drive_whose_stamps_or_angles_go_wrong', 'spoilt',
          spoilt('angle_jumps')),
    Fault('angle jumps by 500 rad and stays', '`jump_time` + a cycle',
          'as before',
          'test_a_drive_whose_stamps_or_angles_go_wrong', 'spoilt',
          spoilt('angle_far')),
    Fault('angle glitches now and then',
          'at once, of the seventh sample; told with `diagnostics_period`',
          'sample not used',
          'test_a_drive_whose_stamps_or_angles_go_wrong', 'spoilt',
          spoilt('angle_glitches', 'state_jump')),
    Fault('angle is no number', '`state_timeout` + 20 ms',
          'samples not used, then `stop_state_stale`; latched',
          'test_a_drive_whose_stamps_or_angles_go_wrong', 'spoilt',
          spoilt('angle_nan')),
    Fault('drive gives no torque', '2 × `drive_delay` + `drive_time`, once the '
          'torque asked is twice `drive_tolerance`',
          '`stop_drive_off`; latched, nothing winds up',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('off', angle=25.0)),
    Fault('command link lost for a second', '2 × `drive_delay` + `drive_time`, once the '
          'torque asked is twice `drive_tolerance`',
          'as before',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('deaf_for_a_second', angle=25.0)),
    Fault('bridge says the drive refuses', 'three words, 10 ms apart, and a cycle',
          'as before',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('refuses')),
    Fault('bridge says the drive does not let go', 'three words, 10 ms apart, and a cycle',
          '`stop_drive_wrong`; latched',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('holds_on')),
    Fault('torque reversed', '2 × `drive_delay` + `drive_time`',
          'as before',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('reversed', angle=25.0)),
    Fault('torque stuck', '2 × `drive_delay` + `drive_time`',
          'as before',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('stuck', angle=25.0)),
    Fault('drive weak (40 %)', '2 × `drive_delay` + `drive_time`, once it lacks `drive_tolerance`',
          'degraded; nothing winds up',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('weak', 'drive_weak', 36.0)),
    Fault('drive tells no torque any more', '`drive_time` + a cycle; told with '
          '`diagnostics_period`', 'degraded; tracking goes on',
          'test_a_drive_that_tells_no_torque_any_more_is_told', 'spoilt',
          spoilt('no_effort', 'effort_missing')),
    Fault('velocity reversed', 'at once, as it moves; told with `diagnostics_period`',
          'degraded; the angles\' own velocity is used',
          'test_a_velocity_that_is_not_that_of_the_angles_is_told_and_not_used', 'spoilt',
          spoilt('velocity_reversed', 'velocity_wrong', 36.0)),
    Fault('shaft seized', '`seized_time` + the time to full torque',
          '`stop_shaft_seized`; latched',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('seized', angle=30.0)),
    Fault('command beyond the range', 'at once; told with `diagnostics_period`',
          "taken at the range's end",
          'test_a_request_too_high_and_then_none', 'spoilt',
          command(45.0, 'command_out_of_range')),
    Fault('stamped command late', 'at once; told with `diagnostics_period`',
          'not taken',
          'test_several_sources_of_commands', 'spoilt',
          stamped('command_late', 60.0)),
    Fault('stamped command repeated', 'at once; told with `diagnostics_period`',
          'not taken',
          'test_several_sources_of_commands', 'spoilt',
          stamped('command_repeated', 0.0, (5.0, 5.0))),
    Fault('second source of commands, by name', 'at once; told with `diagnostics_period`',
          'the first is obeyed; degraded',
          'test_several_sources_of_commands', 'spoilt',
          stamped('command_conflict')),
    Fault('drive gives 0.4 N·m more than asked', '2 × `drive_delay` + `drive_time`',
          'as before',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('biased', angle=25.0)),
    Fault('angle stands still while the shaft moves',
          '`seized_time` + the time to full torque',
          '`stop_shaft_seized`; latched: it cannot be told from a seized shaft',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('angle_stuck', angle=30.0)),
    Fault('disc speed falls silent',
          '`disc_speed_timeout` + a cycle; told with `diagnostics_period`',
          'degraded; the disc counts as standing',
          'test_a_drive_that_does_not_obey', 'spoilt',
          spoilt('no_disc', 'disc_speed_stale')),
    Fault('drive refuses its mode (CAN)', '`mode_timeout` of the bridge, and 30 ms',
          '`stop_drive_off`; latched',
          'test_a_drive_that_does_not_obey_is_told', 'can', bus_fault('refuses')),
    Fault('drive does not hear its commands (CAN)', 'the drive\'s `command_timeout` (100 ms) and '
          '`mode_timeout` of the bridge', 'as before',
          'test_a_drive_that_does_not_obey_is_told', 'can', bus_fault('deaf')),
    Fault('two publishers of one Float64 command',
          '0.1 s after discovery; told with `diagnostics_period`',
          'the highest request of the last `command_timeout`; degraded',
          'test_two_publishers_of_one_float64_do_not_swing_the_brake', 'plant', two_publishers),
    Fault('primary controller killed beside a standby', '`takeover_time` + a cycle',
          'the standby goes on from the last torque',
          'test_a_standby_keeps_the_brake_applied_when_the_primary_is_killed', 'plant',
          primary_killed),
    Fault('all datagrams lost for half a second', '`state_timeout` + 20 ms', 'torque ramps to '
          'zero in `ramp_time`, and the drive lets go by itself; latched',
          'test_all_datagrams_lost_for_a_while', 'lossy', all_lost),
    Fault('recorder killed', 'a second', 'what was recorded before is readable',
          'test_killed_while_writing_it_loses_less_than_a_second', 'plant', recorder_killed),
)

# What cannot be timed: a frame now and then, and a refusal.
UNTIMED = (
    ('a fifth of all datagrams lost', '-', 'the loop goes on with the samples that come',
     'test_a_fifth_of_all_datagrams_lost'),
    ('frames lost or corrupted now and then', 'at once', 'those samples are left out, counted; '
     'the loop goes on', 'test_the_loop_over_can_and_every_fault_of_the_bus'),
    ('listener (recorder, identifier, monitor) killed or frozen', '-', 'the loop goes on',
     'test_who_only_listens_may_die_or_freeze'),
    ('implausible identified model', 'at the service call', 'refused',
     'test_force_mode_observer_loss_and_a_model_accepted'),
    ('model file with a cogging order of 1e308', 'at the service call', 'refused; no cycle waits',
     'test_no_model_file_stops_the_loop'),
    ('model file with 3000 harmonics', 'at the service call', 'refused; no cycle waits',
     'test_no_model_file_stops_the_loop'),
    ('model whose load is a tenth', 'at the service call', 'refused',
     'test_no_model_file_stops_the_loop'),
    ('model file that is a pipe', 'at the service call', 'refused; no cycle waits',
     'test_no_model_file_stops_the_loop'),
    ('watchdog, clock or limit changed while it runs', 'at the service call', 'refused',
     'test_watchdogs_cannot_be_switched_off_while_it_runs'),
    ('force command without a mechanism', 'at once', 'told, not taken',
     'test_a_request_too_high_and_then_none'),
    ('single lower request after stale commands', '-', 'not taken; one that lasts '
     '`command_timeout` is', 'test_a_request_too_high_and_then_none'),
    ('forged claim of another controller', '-', 'told; nobody falls silent by one message',
     'test_an_intruder_neither_silences_nor_hides'),
    ('torque of 1e6 N·m, or none that is finite, from a stranger', '0.1 s after discovery',
     'not taken by the drive; told, degraded',
     'test_torque_of_an_intruder_that_no_controller_asks_for_does_nothing'),
    ('joint states of a stranger, three thousand a second', '0.1 s after discovery',
     'not used; told, degraded', 'test_joint_states_of_a_stranger_are_told_and_not_used'),
    ('a stranger\'s torque beside a primary that is killed', '`takeover_time`',
     'the standby takes over; the stranger is not obeyed',
     'test_a_stranger_who_speaks_beside_the_primary_keeps_no_standby_from_taking_over'),
    ('primary frozen that goes on, two standbys', '`takeover_time`', 'one goes on',
     'test_a_primary_that_was_frozen_and_goes_on_lets_nothing_go'),
    ('a time below nought on /clock', 'the message', 'not taken; the nodes go on',
     'test_a_time_below_nought_ends_no_node'),
    ('torque within the limit from a stranger', '0.1 s after discovery', 'not taken by the drive; '
     'told, degraded', 'test_torque_of_an_intruder_within_the_limit_is_told_and_moves_nothing'),
    ('torque of a second node, of a drive on CAN', '0.5 s', 'not passed on; told',
     'test_torque_of_a_second_node_is_not_passed_on'),
    ('constant delay with which the loop swings', 'three times beyond `largest_error`',
     'degraded', 'test_a_constant_delay_with_which_the_loop_swings_is_told'),
    ('drive silent before the first command', '`state_timeout` + 20 ms', 'torque ramps to zero; '
     'told, waited for, not latched',
     'test_a_drive_that_is_silent_before_the_first_command_is_waited_for'),
    ('two publishers of one clamp force', '0.1 s after discovery', 'the highest request of the '
     'last `command_timeout`; degraded', 'test_two_publishers_do_not_swing_the_force'),
    ('transition that the state has not', 'at the service call', 'refused; the loop goes on',
     'test_a_transition_that_is_not_possible_is_refused'),
    ('parameter of a type that is none', 'at the service call', 'refused; the loop goes on',
     'test_no_request_of_parameters_ends_the_controller'),
    ('gain that is NaN', 'at the service call', 'refused',
     'test_parameters_are_described_and_checked_while_running'),
    ('message with lists of other lengths, stamps or numbers that are none', 'the cycle',
     'not used; the loop goes on', 'test_no_message_ends_the_controller'),
    ('bytes that are no message', 'the cycle', 'not used; the loop goes on',
     'test_no_damaged_bytes_end_the_controller'),
    ('two controllers on remapped topics', '0.1 s after discovery', 'the later one yields',
     'test_the_guard_against_two_controllers_sees_remapped_names'),
    ('driver that offers best effort only', 'discovery', 'heard; told where samples may be lost',
     'test_a_driver_that_offers_best_effort_only_is_heard'),
    ('one forged or flawed message of joint states, commands, claims, or about the drive', '-',
     'not used; the brake stays applied', 'test_one_message_takes_no_braking_away'),
    ('primary deactivated beside a standby', '`takeover_time`',
     'the standby goes on from the last torque', 'test_a_planned_hand_over_lets_nothing_go'),
    ('one command in the stack\'s name, its stamp or counter far ahead', 'a period of the stack',
     'the stack\'s next one counts again',
     'test_one_command_in_the_stacks_name_takes_no_braking_away'),
    ('angles from one node, forces from another one', '0.1 s after discovery',
     'the highest request of the last `command_timeout`; degraded',
     'test_an_angle_and_a_force_of_two_nodes_do_not_swing_the_brake'),
    ('clock of the stamps of commands set back', 'the next command', 'stamps begin anew',
     'test_a_release_goes_through_after_the_clock_was_set_back'),
    ('configuration fails', 'at the transition', 'told in one line; nothing stays behind',
     'test_a_failing_configuration_leaves_nothing_behind'),
)


def _let_go(loop: WatchedLoop, begin: int) -> float:
    """Wait for the drive's first sample without torque; return how long after its own `begin` [ns]
    it was taken [s]."""
    def gone() -> list[int]:
        return [stamp for stamp, effort in
                ((nanoseconds(message.header.stamp), message.effort[0])
                 for message in loop.states[-2000:]) if stamp > begin and effort == 0.0]

    loop.until(gone, 'the drive to let go')
    return 1e-9 * (min(gone()) - begin)


def _hit(loop: WatchedLoop, node: str, number: int) -> int:
    """Send a signal; return when [ns]."""
    begin = time.time_ns()
    loop.runner.processes[node].signal(number)
    if number == signal.SIGKILL:
        loop.runner.processes.pop(node).wait()
    return begin
