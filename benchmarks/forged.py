# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How far forged joint states let an applied brake go, in simulation.

    python -m benchmarks.forged [--write docs/hazards.md]

A brake is applied, at 20 and at 35 rad. Its drive tells joint states at 250 Hz; somebody sends
others on the same topic, of every combination of the angles, velocities and stamps below. Shown is
the worst of each row [rad], and how many ended in a fault, which takes the braking away. The
measured torque that is forged is the true one.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import copy
import itertools
import math
from pathlib import Path
import sys
from typing import NamedTuple

from benchmarks.page import markdown, write_table
from engb_core.bench.virtual_brake import DriveSettings, VirtualBrake
from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings, ForceSettings
from engb_core.control.causes import State
from engb_core.control.clamp_force import read_mechanism
from engb_core.control.command_arbiter import Command
from engb_core.control.loop import LoopSettings
from engb_core.control.pid import PidGains
from engb_core.model import Model
from engb_ros.files import config_file, TRUE_BRAKE

DT, EVERY = 0.001, 4
GAINS = PidGains(0.4, 1.5, 0.006, 0.75, -0.75, 0.5, -0.5)

APPLIED = (20.0, 35.0)
ANGLES = (-1.5, -1.0, -0.7, -0.3, -0.1, 0.0, 0.1, 0.3, 0.7, 1.0, 1.5)
VELOCITIES = (399.0, -399.0, 150.0, -150.0, 80.0, -80.0, 40.0, -40.0, 20.0, 0.0, math.nan)
AHEAD = (0.0, 0.003, -0.003, 0.09, -0.09, 0.5)
HEAD = ('forged', 'cases', 'let go at most [rad]', 'faults')


class Forgery(NamedTuple):
    """`count` joint states, one each `every` steps of 1 ms, the first `first` steps after one of
    the drive's; the angle is off by the same [rad], or by more each time; stamps `ahead` [s]."""

    count: int
    every: int
    first: int
    angle: float
    velocity: float
    ahead: float
    walks: bool = False

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return DT * (self.first + self.count * self.every)

    def at(self, step: int) -> float | None:
        """Return by how much the angle is off that is sent after a step; None: nothing is."""
        number, rest = divmod(step - self.first, self.every)
        if rest or not 0 <= number < self.count:
            return None
        return self.angle * (number + 1 if self.walks else 1)


class Loop:
    """A controller and its brake."""

    def __init__(self, angle: float) -> None:
        model = Model.read(TRUE_BRAKE)
        self.brake = VirtualBrake(model, DriveSettings(rate=1.0 / DT))
        self.controller = BrakeController(model, ControllerSettings(
            LoopSettings(GAINS), position_max=40.0,
            force=ForceSettings(read_mechanism(config_file('mechanism.yaml')))))
        self.now, self.command, self.count = 100.0, Command(angle), 0
        self.controller.start(self.now)

    def run(self, seconds: float, forgery: Forgery | None = None) -> float:
        """Let time pass; return the lowest angle [rad]."""
        lowest = math.inf
        for step in range(round(seconds / DT)):
            measured = self.brake.advance()
            self.now += DT
            self.count += 1
            if self.count % 20 == 0:
                self.controller.on_command(self.now, self.command)
            if self.count % EVERY == 0:
                self._send(self.controller.on_state(self.now, self.now, measured.position,
                                                    measured.velocity, measured.effort))
            self._send(self.controller.on_tick(self.now))
            off = forgery.at(step) if forgery else None
            if forgery and off is not None:
                now = self.now + 0.5 * DT
                self._send(self.controller.on_state(
                    now, now + forgery.ahead, measured.position + off, forgery.velocity,
                    measured.effort))
            lowest = min(lowest, self.brake.plant.position)
        return lowest

    def _send(self, torque: float | None) -> None:
        if torque is not None:
            self.brake.command(torque)


def forgeries() -> Iterator[tuple[str, list[Forgery]]]:
    """Yield what stands in a row, and its cases."""
    pairs = list(itertools.product(ANGLES, VELOCITIES))
    yield 'one', [Forgery(1, 1, first, *pair, ahead) for first, pair, ahead in itertools.product(
        range(EVERY), pairs, AHEAD)]
    for count in (2, 3):
        yield f'{count} between two of the drive', [
            Forgery(count, 1, 0, *pair, 0.0) for pair in pairs]
        yield f'{count} between two of the drive, each farther off', [
            Forgery(count, 1, 0, *pair, 0.0, walks=True) for pair in pairs]
    for count in (2, 3, 5, 25, 125):
        yield f'{count}, one between each two of the drive', [
            Forgery(count, EVERY, 0, *pair, 0.0) for pair in pairs]


def main() -> int:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--write', metavar='PAGE', help='page whose table is replaced')
    options = parser.parse_args()
    applied = []
    for angle in APPLIED:
        loop = Loop(angle)
        loop.run(1.3)
        applied.append(loop)
    lines = [HEAD, ('---',) * len(HEAD)]
    for name, cases in forgeries():
        worst, faults = 0.0, 0
        for loop, forgery in itertools.product(applied, cases):
            tried = copy.deepcopy(loop)
            before = tried.brake.plant.position
            worst = max(worst, before - tried.run(forgery.duration + 0.5, forgery))
            faults += tried.controller.supervisor.state is State.FAULT
        count = len(applied) * len(cases)
        lines.append((name, str(count), f'{worst:.2f}', str(faults)))
        print(' | '.join(lines[-1]), file=sys.stderr, flush=True)
    text = markdown(lines)
    print(text)
    if options.write:
        write_table(Path(options.write), 'forged', text)
    return 0


if __name__ == '__main__':
    sys.exit(main())
