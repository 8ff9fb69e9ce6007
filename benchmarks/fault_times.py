"""How long it takes until a fault is noticed, and until its reaction is there: measured.

    python -m benchmarks.fault_times [--rounds 5] [--only killed] [--write docs/integrate.md]

Processes are killed and frozen, commands and joint states spoilt, frames damaged on a real (UDP
multicast) bus, while a brake tracks an angle under default timeouts. Time runs from the moment of
the injection to the stamp of the diagnostics that tell of it, and to the arrival of the first
command of no torque, or the drive's first sample without. It prints the table of faults:
median and largest of the rounds. --write puts it into that page, in the place of the table that
is there. Injection through a service takes the service's time too.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import contextlib
from dataclasses import dataclass
import math
import os
from pathlib import Path
import signal
import sys
import tempfile
import time
from typing import Any

import numpy as np

from benchmarks.page import write_table
from engb_core.control.causes import Cause
from engb_ros.files import config_file, TRUE_BRAKE
from engb_ros.interface import (
    CLEAR_FAULTS,
    CONTROLLER_ACTIVATION,
    DIAGNOSTICS,
    DISTURBANCE,
    JOINT_STATES,
    POSITION_COMMAND,
    RECORDED,
    Service,
)
from engb_ros.live_loop import Drive, LiveLoop
from engb_ros.probe import Probe
from engb_ros.runner import node_command, reserved_domain, Runner

# The prober hears every message: a slower drive leaves it time to be punctual [Hz].
RATE = 250.0

# The cause of a rejected input is told with the next diagnostics; here they come quickly [s].
DIAGNOSTICS_PERIOD = 0.05

Times = dict[str, float]


class WatchedLoop(LiveLoop):
    """A live loop whose controller's diagnostics are kept."""

    def __init__(self, runner: Runner, probe: Probe, drive: Drive, **controller: Any) -> None:
        self.diagnostics = probe.listen(DIAGNOSTICS)
        super().__init__(runner, probe, drive, **controller)

    def noticed(self, begin: int, key: str, value: str = '1') -> float:
        """Wait for the controller's first diagnostics since `begin` [ns] in which `key` is
        `value`; return how long after `begin` they were written [s]."""
        found: list[int] = []

        def told() -> bool:
            for message in self.diagnostics:
                status = message.status[0]
                stamp = _nanoseconds(message.header.stamp)
                if stamp >= begin and status.name.endswith(': controller') and any(
                        entry.key == key and entry.value == value for entry in status.values):
                    found.append(stamp)
            return bool(found)

        self.until(told, f'{key} to be {value}')
        return 1e-9 * (min(found) - begin)

    def no_torque(self, begin: int) -> float:
        """Wait for the first command of no torque; return how long after `begin` [ns] it
        arrived [s]."""
        self.until(lambda: self.efforts[-1].data == 0.0, 'the torque to be gone')
        return 1e-9 * (time.time_ns() - begin)


@dataclass(frozen=True)
class Fault:
    """One kind of fault.

    Attributes:
        name: what happens.
        bound: what the parameters promise.
        reaction: what is done about it.
        test: that injects it.
        loop: 'plant', 'can' or 'force'.
        measure: injects it once and returns what took how long [s].
    """

    name: str
    bound: str
    reaction: str
    test: str
    loop: str
    measure: Callable[[WatchedLoop], Times]


def drive_hit(node: str, number: int) -> Callable[[WatchedLoop], Times]:
    """Return a measurement: `node` of the drive gets signal `number`."""
    def measure(loop: WatchedLoop) -> Times:
        begin = _hit(loop, node, number)
        return {'noticed': loop.noticed(begin, 'state', 'fault'),
                'no torque': loop.no_torque(begin)}
    return measure


def controller_hit(number: int) -> Callable[[WatchedLoop], Times]:
    """Return a measurement: the controller gets signal `number`."""
    def measure(loop: WatchedLoop) -> Times:
        loop.until(lambda: loop.effort != 0.0, 'a torque')
        # By the drive's own clock, from the last sample that came before.
        loop.pump()
        begin = _nanoseconds(loop.states[-1].header.stamp)
        _hit(loop, 'controller', number)

        def let_go() -> list[int]:
            return [stamp for stamp, effort in
                    ((_nanoseconds(message.header.stamp), message.effort[0])
                     for message in loop.states[-2000:]) if stamp > begin and effort == 0.0]

        loop.until(let_go, 'the drive to let go')
        return {'drive lets go': 1e-9 * (min(let_go()) - begin)}
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
    """Send a command that is no number."""
    begin = time.time_ns()
    loop.probe.publish(POSITION_COMMAND, math.nan)
    return {'told': loop.noticed(begin, 'command_not_finite')}


def bad_state(loop: WatchedLoop) -> Times:
    """Send joint states of an hour from now until one is read (the loop reads the newest)."""
    begin = time.time_ns()
    from sensor_msgs.msg import JointState
    stamp = loop.states[-1].header.stamp
    message = JointState(name=['motor'], position=[loop.position], velocity=[0.0], effort=[0.0])
    message.header.stamp.sec, message.header.stamp.nanosec = stamp.sec + 3600, stamp.nanosec

    def told() -> bool:
        loop.probe.publish(JOINT_STATES, message)
        return loop.has(Cause.CLOCK_JUMP)
    loop.until(told, 'the cause')
    return {'told': loop.noticed(begin, 'clock_jump')}


def second_controller(loop: WatchedLoop) -> Times:
    """Start another controller; time runs from its activation."""
    active = loop.probe.listen(CONTROLLER_ACTIVATION)
    loop.during(0.5)
    known = {message.data for message in active}
    second = loop.runner.start_command('second', node_command(
        'controller', name='second', parameters={**loop.controller}))
    loop.until(lambda: {message.data for message in active} - known, 'its activation')
    took = loop.noticed(max(message.data for message in active), 'state', 'fault')
    second.signal(signal.SIGINT)
    loop.runner.processes.pop('second').wait()
    return {'noticed': took}


def observer_killed(loop: WatchedLoop) -> Times:
    """Kill the external observer."""
    begin = _hit(loop, 'disturbance_observer', signal.SIGKILL)
    return {'told': loop.noticed(begin, 'observer_stale')}


def recorder_killed(loop: WatchedLoop) -> Times:
    """Kill the recorder while it writes; see what is readable."""
    from engb_ros.bags.read import read_recording
    with tempfile.TemporaryDirectory(prefix='engb_fault_') as folder:
        loop.runner.start('recorder', parameters={'bag': f'{folder}/bag'})
        loop.until(lambda: 'joint_states' in _answer(loop, 'recorder', RECORDED)[1],
                   'the recorder', timeout=60.0)
        loop.during(3.0)
        loop.kill('recorder')
        last = loop.states[-1].header.stamp
        recording = read_recording(f'{folder}/bag')
        readable = recording.start + recording.time[-1]
        return {'lost': last.sec + 1e-9 * last.nanosec - readable}


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
    Fault('joint state NaN, jumping, of a wrong joint; clock jumps', 'at once; told with '
          '`diagnostics_period`', 'sample not used; nothing integrated over a jump',
          'test_garbage_joint_states_and_jumps_of_the_clock', 'plant', bad_state),
    Fault('second controller', 'discovery', 'the later one yields, silent',
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
    Fault('recorder killed', 'a second', 'what was recorded before is readable',
          'test_killed_while_writing_it_loses_less_than_a_second', 'plant', recorder_killed),
)

# What cannot be timed: a frame now and then, and a refusal.
UNTIMED = (
    ('frames lost or corrupted now and then', 'at once', 'those samples are left out, counted; '
     'the loop goes on', 'test_the_loop_over_can_and_every_fault_of_the_bus'),
    ('listener (recorder, identifier, monitor) killed or frozen', '-', 'the loop goes on',
     'test_who_only_listens_may_die_or_freeze'),
    ('implausible identified model', 'at the service call', 'refused',
     'test_force_mode_observer_loss_and_a_model_accepted'),
)


def measured(fault: Fault, loop: WatchedLoop, rounds: int) -> dict[str, list[float]]:
    """Inject `fault` again and again into a healthy loop."""
    found: dict[str, list[float]] = {}
    for _ in range(rounds):
        recover(loop)
        for what, took in fault.measure(loop).items():
            found.setdefault(what, []).append(took)
    recover(loop)
    return found


def recover(loop: WatchedLoop) -> None:
    """Wake or restart whatever is frozen or gone, clear faults, and track 15 rad again."""
    loop.target = None
    for name in (*loop.drive, 'controller'):
        if name in loop.runner.processes:
            loop.runner.processes[name].signal(signal.SIGCONT)
        else:
            loop.start(name)
    if 'drive_emulator' in loop.drive:
        loop.set_parameter('drive_emulator', 'fault', 'none')
    count = len(loop.states)
    loop.until(lambda: len(loop.states) > count + 30, 'joint states')
    asked = [0.0]

    def tracks() -> bool:
        # Under default timeouts a busy machine finds faults that nobody injected.
        if loop.is_in('fault') and time.monotonic() - asked[0] > 0.3:
            asked[0] = time.monotonic()
            _cleared(loop)
        return abs(loop.position - loop.target) < 0.3 and (
            loop.is_in('enabled') or loop.is_in('degraded'))

    loop.diagnostics.clear()
    loop.until(lambda: _cleared(loop), 'the faults to be cleared', timeout=60.0)
    loop.target = 15.0
    loop.until(tracks, 'the brake to track')
    loop.until(lambda: not loop.has(Cause.OBSERVER_STALE | Cause.CLOCK_JUMP
                                    | Cause.COMMAND_NOT_FINITE), 'old causes to fade')
    loop.until(tracks, 'the brake to track')


@contextlib.contextmanager
def closed_loop(kind: str) -> Iterator[WatchedLoop]:
    """Run a loop with the plant, over CAN, or commanding by force with an observer."""
    brake = {'rate': RATE, 'effort_noise': 0.0}
    controller = {'diagnostics_period': DIAGNOSTICS_PERIOD}
    drive = [('plant', brake)]
    if kind == 'can':
        bus = {'interface': 'udp_multicast', 'channel': f'239.75.{os.getpid() % 250}.1'}
        drive = [('drive_emulator', {**brake, **bus}), ('can_bridge', bus)]
    elif kind == 'force':
        drive.append(('disturbance_observer', {}))
        controller |= {'model': os.fspath(TRUE_BRAKE), 'observer_timeout': 0.1,
                       'mechanism': os.fspath(config_file('mechanism.yaml'))}
    with reserved_domain() as domain, Runner(domain) as runner, Probe(domain) as probe:
        loop = WatchedLoop(runner, probe, drive, **controller)
        if kind == 'force':
            loop.until(lambda: probe.publishers(DISTURBANCE), 'the observer')
        yield loop
        runner.kill()


def table(rows: list[tuple[str, str, str, str, str]], rounds: int) -> str:
    """Return the table of faults as Markdown."""
    head = ('fault', 'promised within', f'measured, median (largest) of {rounds}', 'reaction',
            'test')
    return '\n'.join('| ' + ' | '.join(row) + ' |' for row in (head, ('---',) * 5, *rows))


def main() -> int:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rounds', type=int, default=5, help='how often each is injected')
    parser.add_argument('--only', default='', metavar='TEXT', help='faults whose name holds TEXT')
    parser.add_argument('--write', metavar='PAGE', help='page whose table is replaced')
    options = parser.parse_args()
    chosen = [fault for fault in FAULTS if options.only in fault.name]
    texts: dict[Fault, str] = {}
    for kind in ('plant', 'can', 'force'):
        of_kind = [fault for fault in chosen if fault.loop == kind]
        if not of_kind:
            continue
        with closed_loop(kind) as loop:
            for fault in of_kind:
                texts[fault] = '; '.join(
                    f'{what} {1e3 * np.median(times):.0f} ms ({1e3 * max(times):.0f})'
                    for what, times in measured(fault, loop, options.rounds).items())
                print(f'{fault.name}: {texts[fault]}', file=sys.stderr, flush=True)
    rows = [(fault.name, fault.bound, texts[fault], fault.reaction, f'`{fault.test}`')
            for fault in chosen]
    rows += [(name, bound, '-', reaction, f'`{test}`')
             for name, bound, reaction, test in UNTIMED if not options.only]
    text = table(rows, options.rounds)
    print(text)
    if options.write:
        write_table(Path(options.write), 'faults', text)
    return 0


def _nanoseconds(stamp: Any) -> int:
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def _hit(loop: WatchedLoop, node: str, number: int) -> int:
    """Send a signal; return when [ns]."""
    begin = time.time_ns()
    loop.runner.processes[node].signal(number)
    if number == signal.SIGKILL:
        loop.runner.processes.pop(node).wait()
    return begin


def _cleared(loop: WatchedLoop) -> bool:
    return _answer(loop, 'controller', CLEAR_FAULTS)[0]


def _answer(loop: WatchedLoop, node: str, service: Service) -> tuple[bool, str]:
    try:
        answer = loop.probe.call(node, service, timeout=2.0)
    except TimeoutError:   # a request to the one that was killed: the graph forgets it slowly
        return False, ''
    return answer.success, answer.message


if __name__ == '__main__':
    sys.exit(main())
