# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Ten tables more, of drives as machine builders have them: a cascade of position, speed and
current loops, moves from place to place, a gear, an arm, a screw. No formula of the library is
used, and none of simulated_bench.py beside it.

Each hides one effect, or none, and is written as the tool that logged it would.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
import math
from pathlib import Path

import numpy as np

from .simulated_bench import BenchTable, rows_of

__all__ = ['OTHER_TABLES', 'Drive', 'recorded']

STEP = 5e-5


@dataclass(frozen=True)
class Drive:
    """A motor with what it turns; SI units, at the motor's shaft.

    Attributes:
        load: amplitude of an arm's weight, over the angle behind the gear [N·m].
        ratio: turns of the motor for one of what is behind the gear.
        stribeck: how much more friction there is at rest, over that at full speed, and how far
            it reaches [rad/s].
        uneven: by what part friction and drag are larger forward and smaller backward; of dry
            friction alone, without a load, it would be an offset.
        windage: drag over the square of speed [N·m·s²/rad²].
        teeth: cogging: cycles a turn and its size [N·m].
        by_load: friction for each N·m of load.
        warm: by what part of it friction is larger when cold, and the time of warming [s].
        late: how much later than logged the torque acts [s].
        bends: torque at which the motor's iron saturates [N·m].
        gap: the gear's play at the motor's shaft [rad]; the arm's inertia is beyond it.
    """

    inertia: float = 1.2e-4
    viscous: float = 6e-4
    coulomb: float = 0.012
    load: float = 0.0
    ratio: float = 1.0
    stribeck: tuple[float, float] = (0.0, 1.0)
    uneven: float = 0.0
    windage: float = 0.0
    teeth: tuple[float, float] = (1.0, 0.0)
    by_load: float = 0.0
    warm: tuple[float, float] = (0.0, 1.0)
    late: float = 0.0
    bends: float = 0.0
    gap: float = 0.0
    torque_constant: float = 0.06
    limit: float = 1.2
    speed: float = 60.0
    reach: float = 25.0
    duration: float = 24.0


def _moves(drive: Drive, rng: np.random.Generator) -> Iterator[tuple[float, float]]:
    """Yield place and speed at each step: moves at random speeds with ramps, and short stops."""
    place = 0.0
    while True:
        goal = rng.uniform(-drive.reach, drive.reach)
        top = drive.speed * 10.0 ** rng.uniform(-1.3, 0.0)
        ramp = drive.speed * rng.uniform(4.0, 12.0)
        way = abs(goal - place)
        top = min(top, math.sqrt(way * ramp), way / 0.2, 1e9)
        goes = way / top
        begin, sign = place, math.copysign(1.0, goal - place)
        rise = top / ramp
        for step in range(int((goes + rise) / STEP)):
            t = step * STEP
            if t < rise:
                gone, rate = 0.5 * ramp * t * t, ramp * t
            elif t < goes:
                gone, rate = top * (t - 0.5 * rise), top
            else:
                left = goes + rise - t
                gone, rate = way - 0.5 * ramp * left * left, ramp * left
            yield begin + sign * gone, sign * rate
        place = goal
        for _ in range(int(rng.uniform(0.05, 0.2) / STEP)):
            yield place, 0.0


def recorded(drive: Drive, seed: int, every: int) -> dict[str, np.ndarray]:
    """Simulate; returns t [s], phi [rad], i [A], goal [rad], each `every` steps."""
    rng = np.random.default_rng(seed)
    drive = replace(drive, inertia=drive.inertia * rng.uniform(0.8, 1.25),
                    coulomb=drive.coulomb * rng.uniform(0.8, 1.25))
    count = int(drive.duration / STEP)
    out = np.zeros((4, count))
    shaft, speed, behind, behind_speed = 0.0, 0.0, 0.0, 0.0
    torque = integral = seen = seen_speed = 0.0
    waiting = [0.0] * round(drive.late / STEP)
    # Of the whole inertia two fifths are beyond the gear's play.
    near, far = (0.6 * drive.inertia, 0.4 * drive.inertia) if drive.gap else (drive.inertia, 0.0)
    stiff, damping = 20.0, 0.012
    moves = _moves(drive, rng)
    tick = 2.0 * math.pi / 16384.0
    position_gain = 25.0
    speed_gain, speed_integral = 150.0 * drive.inertia, 4000.0 * drive.inertia
    for k in range(count):
        t = k * STEP
        goal, rate = next(moves)
        if k % 4 == 0:      # the drive's own cycle, 5 kHz
            angle = math.floor(shaft / tick) * tick
            seen_speed += 0.15 * ((angle - seen) / (4.0 * STEP) - seen_speed)
            seen = angle
            error = rate + position_gain * (goal - angle) - seen_speed
            integral = max(-0.5, min(0.5, integral + speed_integral * error * 4.0 * STEP))
            asked = max(-drive.limit, min(drive.limit, speed_gain * error + integral))
        torque += (asked - torque) * STEP / 2e-4       # the current loop
        given = torque
        if waiting or drive.late:
            waiting.append(given)
            given = waiting.pop(0)
        if drive.bends:
            given = drive.bends * math.tanh(given / drive.bends)
        weight = drive.load * math.sin((behind if drive.gap else shaft) / drive.ratio)
        other = drive.teeth[1] * math.sin(drive.teeth[0] * shaft + 0.7)
        side = 1.0 + math.copysign(drive.uneven, speed)
        other += drive.viscous * side * speed + drive.windage * speed * abs(speed)
        level = drive.coulomb * (1.0 + drive.stribeck[0] * math.exp(
            -abs(speed) / drive.stribeck[1]))
        level *= 1.0 + drive.warm[0] * math.exp(-t / drive.warm[1])
        level *= side
        level += drive.by_load * abs(weight)
        through = 0.0
        if drive.gap:
            twist = shaft - behind
            open_ = twist - max(-0.5 * drive.gap, min(0.5 * drive.gap, twist))
            through = stiff * open_ + (damping * (speed - behind_speed) if open_ else 0.0)
            behind_speed += STEP * (through - weight) / far
            behind += STEP * behind_speed
        else:
            other += weight
        free = speed + STEP * (given - other - through) / near
        most = STEP * level / near
        speed = 0.0 if abs(free) <= most else free - math.copysign(most, free)
        shaft += speed * STEP
        out[:, k] = t, math.floor(shaft / tick) * tick, torque / drive.torque_constant, goal
    found = out[:, ::every]
    current = found[2] + rng.normal(0.0, 0.03, found.shape[1])
    return {'t': found[0], 'phi': found[1], 'i': np.round(current / 1e-3) * 1e-3,
            'goal': found[3]}


@dataclass(frozen=True)
class DriveTable(BenchTable):
    """A table of a drive."""

    drive: Drive = Drive()

    def sampled(self, seed: int) -> dict[str, np.ndarray]:
        """Return what the drive logs."""
        return recorded(self.drive, seed, self.every)


def _scope(path: Path, run: dict[str, np.ndarray]) -> None:
    """A control's scope, German: head above the titles, comma for the point, time in ms."""
    head = ('Name;Achse X Scope\nDatei;C:\\Scope\\achse_x.tcscopex\nStart;25.11.2026 09:12:44\n'
            'Abtastzeit;1\n\n')
    text = rows_of([1e3 * run['t'], np.rad2deg(run['goal']), np.rad2deg(run['phi']), run['i']],
                 '%.4f', ';').replace('.', ',')
    path.write_text(head + 'Zeit [ms];Sollposition [°];Istposition [°];Motorstrom [A]\n' + text,
                    encoding='cp1252')


def _turns(path: Path, run: dict[str, np.ndarray]) -> None:
    """A hobbyist's drive with turns, read by a script."""
    path.write_text('time,pos_estimate (turns),input_pos (turns),Iq_measured (A)\n' + rows_of(
        [3.217 + run['t'], run['phi'] / (2 * np.pi), run['goal'] / (2 * np.pi), run['i']],
        '%.6f', ','))


def _serial(path: Path, run: dict[str, np.ndarray]) -> None:
    """A microcontroller's serial port: ms since it started, each line now and then twice."""
    lines = ['millis,encoder_deg,current_mA']
    for number, (t, phi, i) in enumerate(zip(run['t'], run['phi'], run['i'], strict=True)):
        line = f'{1e3 * (41.0 + t):.0f},{math.degrees(phi):.2f},{1e3 * i:.0f}'
        lines += [line] * (2 if number % 211 == 7 else 1)
    path.write_text('\r\n'.join(lines) + '\r\n')


def _joint(path: Path, run: dict[str, np.ndarray]) -> None:
    """A robot's joint behind a gear of 50, from a bag, in ns."""
    path.write_text('header.stamp [ns],/joint_states/elbow/position [rad],'
                    '/joint_states/elbow/current [A]\n' + ''.join(
                        f'{1764061964000000000 + round(1e9 * t)},{phi / 50.0:.7f},{i:.3f}\n'
                        for t, phi, i in zip(run['t'], run['phi'], run['i'], strict=True)))


def _linear(path: Path, run: dict[str, np.ndarray]) -> None:
    """A screw of 10 mm a turn, with force at the slide reckoned by the drive."""
    force = 0.06 * run['i'] * 2 * np.pi / 0.01
    path.write_text('# slide, screw 10 mm\n# measured force = Kt*iq*2*pi/lead\n'
                    'Time (s)\tSlide position (mm)\tForce (N)\n' + rows_of(
                        [run['t'], run['phi'] / (2 * np.pi) * 10.0, force], '%.5f', '\t'))


def _dyno(path: Path, run: dict[str, np.ndarray]) -> None:
    """A test stand: ISO times with a zone, rpm, torque in N·cm, quotes round everything."""
    start = datetime(2026, 11, 25, 8, 0, 0)
    rpm = np.gradient(run['phi'], run['t']) * 60.0 / (2 * np.pi)
    lines = ['"Timestamp","Angle [deg]","Speed [rpm]","Torque [Ncm]"']
    for t, phi, n, i in zip(run['t'], run['phi'], rpm, run['i'], strict=True):
        stamp = (start + timedelta(seconds=float(t))).isoformat(timespec='microseconds')
        lines.append(f'"{stamp}+01:00","{math.degrees(phi):.4f}","{n:.1f}","{6.0 * i:.3f}"')
    path.write_text('\n'.join(lines) + '\n')


def _inches(path: Path, run: dict[str, np.ndarray]) -> None:
    """An American bench: time in µs, torque in lbf·in, units in a row of their own."""
    torque = 0.06 * run['i'] / 0.1129848
    path.write_text('Time,Shaft Angle,Motor Torque\nus,deg,lbf-in\n' + rows_of(
        [1e6 * run['t'], np.rad2deg(run['phi']), torque], '%.4f', ','))


def _din(path: Path, run: dict[str, np.ndarray]) -> None:
    """As DIN writes titles, blanks for columns, an empty cell where a value was lost."""
    text = rows_of([run['t'], run['phi'], 60.0 * run['i']], '%.6f', ';').splitlines()
    for number in range(50, len(text), 997):
        text[number] = text[number].rpartition(';')[0] + ';'
    path.write_text('t/s;φ/rad;M/mNm\n' + '\n'.join(text).replace('.', ',') + '\n',
                    encoding='utf-8-sig')


def _french(path: Path, run: dict[str, np.ndarray]) -> None:
    path.write_text('Temps (s);Angle moteur (deg);Courant (A)\n' + rows_of(
        [run['t'], np.rad2deg(run['phi']), run['i']], '%.5f', ';').replace('.', ','),
        encoding='latin-1')


def _bare(path: Path, run: dict[str, np.ndarray]) -> None:
    """Units in remarks alone, which nothing can be expected to read: they are asked."""
    path.write_text('% position in degrees, current in amperes\n% motor KT 0.06\n'
                    't pos cur\n' + rows_of([run['t'], np.rad2deg(run['phi']), run['i']],
                                          '%.5f', ' '))


_KT = ('--torque-constant', '0.06')
OTHER_TABLES = (
    DriveTable(None, _scope, 'achse_x.csv', 20, _KT, Drive()),
    DriveTable('cogging_torque', _turns, 'odrive.csv', 20, _KT,
               Drive(teeth=(14.0, 0.01), speed=20.0, reach=10.0)),
    DriveTable('stribeck_friction', _serial, 'serial.log', 40, _KT,
               # Short ways: of long ones, at seeds 0 and 2, only one or two speeds fit in.
               Drive(stribeck=(1.2, 3.0), speed=30.0, reach=8.0)),
    DriveTable('load_dependent_friction', _joint, 'elbow.csv', 40, ('--torque-constant', '3.0'),
               Drive(load=0.12, ratio=50.0, by_load=0.35, reach=80.0, speed=120.0)),
    DriveTable('asymmetric_friction', _linear, 'slide.tsv', 20, (),
               Drive(uneven=0.35, load=0.0)),
    DriveTable('friction_drift', _dyno, 'stand4.csv', 40, (), Drive(warm=(1.2, 8.0))),
    DriveTable('torque_saturation', _inches, 'press.csv', 20, (),
               Drive(bends=0.35, inertia=2.5e-4, speed=90.0)),
    DriveTable('actuation_lag', _din, 'late.csv', 20, (), Drive(late=6e-3)),
    DriveTable('nonlinear_viscous_friction', _french, 'ventilateur.csv', 20, _KT,
               Drive(windage=2.5e-5, speed=90.0)),
    DriveTable('backlash', _bare, 'gear.dat', 20, (*_KT, '--unit', 'position=deg'),
               Drive(gap=0.25, load=0.1, ratio=20.0, reach=30.0)),
)
