# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Ten tables of a third kind: written in other languages and by other loggers, of machines that
are moved by a speed loop, a sweep or a torque that changes at random. No formula of the library is
used, and none of the benches beside it.

One table hides two effects; the first has to be the larger one.
"""

from __future__ import annotations

from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np

from .simulated_bench import BenchTable, rows_of

__all__ = ['FOREIGN_TABLES', 'Machine', 'measured']

STEP = 5e-5
TICK = 2.0 * math.pi / 20000.0


@dataclass(frozen=True)
class Machine:
    """A motor with what it turns; SI units at the motor's shaft.

    Attributes:
        moved: by a speed loop in steps (`speeds`), a position loop after a sweep (`sweep`), or
            a torque that changes at random beside a soft spring (`torques`).
        swing, top: how far [rad] and how fast [rad/s] it is moved.
        spring: load torque over the angle [N·m/rad], and from which angle on [rad].
        rest: what friction is larger by at standstill, and over which speed that goes
            [rad/s]; of the form 1/(1 + |ω|/ω_s).
        side: by what part friction and drag are larger forward and smaller backward.
        square: drag over the square of speed [N·m·s²/rad²].
        poles: cycles a turn and size [N·m] of a torque over the angle.
        ripple: cycles a turn and part by which torque per ampere varies.
        bristle: the way after a reversal over which friction builds up [rad].
        grip: friction for each N·m of load.
        wear: by what part friction is larger at the end than at the begin.
        slow: time constant of the filter that the logged current passes [s].
        soft: from which torque on more current gives less of it [N·m].
    """

    moved: str = 'speeds'
    swing: float = 12.0
    top: float = 40.0
    duration: float = 20.0
    inertia: float = 1.5e-4
    drag: float = 8e-4
    dry: float = 0.015
    spring: tuple[float, float] = (0.0, -1e9)
    rest: tuple[float, float] = (0.0, 1.0)
    side: float = 0.0
    square: float = 0.0
    poles: tuple[float, float] = (1.0, 0.0)
    ripple: tuple[float, float] = (1.0, 0.0)
    bristle: float = 0.0
    grip: float = 0.0
    wear: float = 0.0
    slow: float = 0.0
    soft: float = 0.0
    constant: float = 0.08
    noise: float = 0.02


def measured(machine: Machine, seed: int, every: int) -> dict[str, np.ndarray]:
    """Simulate; returns t [s], phi [rad], i [A], goal [rad], each `every` steps."""
    rng = np.random.default_rng(seed + 77)
    inertia = machine.inertia * rng.uniform(0.85, 1.2)
    dry = machine.dry * rng.uniform(0.85, 1.2)
    count = int(machine.duration / STEP)
    out = np.zeros((4, count))
    shaft = speed = bristle = logged = torque = summed = 0.0
    asked_speed, until, pushed, seen, rate = 0.0, 0.0, 0.0, 0.0, 0.0
    phases = rng.uniform(0.0, 2.0 * math.pi, 2)
    for k in range(count):
        t = k * STEP
        if k % 10 == 0:                 # 2 kHz
            angle = round(shaft / TICK) * TICK
            rate += 0.3 * ((angle - seen) / (10 * STEP) - rate)
            seen = angle
            if machine.moved == 'speeds':
                if t >= until or (seen > machine.swing and asked_speed > 0.0) or (
                        seen < -machine.swing and asked_speed < 0.0):
                    sense = -1.0 if seen > machine.swing else 1.0 if seen < -machine.swing else (
                        rng.choice((-1.0, 1.0)))
                    asked_speed = sense * machine.top * 10.0 ** rng.uniform(-1.5, 0.0)
                    until = t + rng.uniform(0.15, 1.2)
                goal = seen + 0.0
                error = asked_speed - rate
                summed = min(0.4, max(-0.4, summed + 3000.0 * inertia * error * 10 * STEP))
                torque = 120.0 * inertia * error + summed
            elif machine.moved == 'sweep':
                hertz = 0.15 * (12.0 ** (t / machine.duration))
                phases[0] += 2.0 * math.pi * hertz * 10 * STEP
                size = min(machine.swing, machine.top / (2.0 * math.pi * hertz))
                goal = size * (math.sin(phases[0]) + 0.3 * math.sin(0.37 * phases[0] + phases[1]))
                torque = 6000.0 * inertia * (goal - seen) - 100.0 * inertia * rate
            else:
                if t >= until:
                    pushed = dry * rng.uniform(-6.0, 6.0)
                    until = t + rng.exponential(0.12) + 0.03
                goal = 0.0
                torque = pushed - 5.0 * dry * seen / machine.swing
            torque = min(1.0, max(-1.0, torque))
        given = torque
        if machine.soft and abs(given) > machine.soft:
            given = math.copysign(
                machine.soft + (abs(given) - machine.soft) / (
                    1.0 + 4.0 * (abs(given) - machine.soft) / machine.soft), given)
        given *= 1.0 + machine.ripple[1] * math.cos(machine.ripple[0] * shaft + 1.1)
        load = machine.spring[0] * max(0.0, shaft - machine.spring[1]) if (
            machine.spring[0]) else 0.0
        other = load + machine.poles[1] * math.cos(machine.poles[0] * shaft + 0.3)
        part = 1.0 + math.copysign(machine.side, speed)
        other += part * machine.drag * speed + machine.square * speed * abs(speed)
        level = part * dry * (1.0 + machine.rest[0] / (1.0 + abs(speed) / machine.rest[1]))
        level = level * (1.0 + machine.wear * t / machine.duration) + machine.grip * abs(load)
        if machine.bristle:
            bristle += STEP * (speed - abs(speed) * bristle) / machine.bristle
            speed += STEP * (given - other - level * bristle) / inertia
        else:
            free = speed + STEP * (given - other) / inertia
            most = STEP * level / inertia
            speed = 0.0 if abs(free) <= most else free - math.copysign(most, free)
        shaft += STEP * speed
        logged += (torque - logged) * (STEP / machine.slow if machine.slow else 1.0)
        out[:, k] = t, round(shaft / TICK) * TICK, logged / machine.constant, goal
    found = out[:, ::every]
    return {'t': found[0], 'phi': found[1],
            'i': found[2] + rng.normal(0.0, machine.noise, found.shape[1]), 'goal': found[3]}


@dataclass(frozen=True)
class ForeignTable(BenchTable):
    """A table of a machine."""

    machine: Machine = Machine()

    def sampled(self, seed: int) -> dict[str, np.ndarray]:
        """Return what the logger writes down."""
        return measured(self.machine, seed, self.every)


def _polish(path: Path, run: dict[str, np.ndarray]) -> None:
    """As a Polish Excel saves it: a line that names the separator, current before angle."""
    text = rows_of([run['t'], run['i'], np.rad2deg(run['phi'])], '%.4f %.4f %.4f', ';')
    path.write_text('sep=;\nCzas [s];Prąd silnika [A];Kąt wału [°]\n' + text.replace('.', ','),
                    encoding='cp1250')


def _japanese(path: Path, run: dict[str, np.ndarray]) -> None:
    """A Japanese logger, Shift-JIS; the drive's command stands beside what was measured."""
    head = '計測日,2026/11/20\n機種,AC-400\n\n時間[ms],指令角度[deg],実角度[deg],トルク[N･m]\n'
    path.write_text(head + rows_of(
        [1e3 * run['t'], np.rad2deg(run['goal']), np.rad2deg(run['phi']), 0.08 * run['i']],
        '%.1f %.3f %.3f %.5f', ','), encoding='cp932')


def _labview(path: Path, run: dict[str, np.ndarray]) -> None:
    """A LabVIEW measurement file: a long head, tabs, remarks in a last column."""
    head = ('LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n'
            'Date\t2026/11/20\nTime\t14:03:11.27\n***End_of_Header***\t\n\t\t\t\n'
            'Channels\t2\t\t\nSamples\t%d\t%d\t\n***End_of_Header***\t\t\t\n'
            'X_Value\tShaft angle (rad)\tTorque (Nm)\tComment\n')
    path.write_text(head % (run['t'].size, run['t'].size) + rows_of(
        [run['t'], run['phi'], 0.08 * run['i'], np.full(run['t'].size, 0)],
        '%.6f %.6f %.6f %.0s', '\t'))


def _trace(path: Path, run: dict[str, np.ndarray]) -> None:
    """A drive's trace: parameters' numbers in the titles, 1/1000° as unit of length."""
    text = rows_of([np.arange(run['t'].size), 1e3 * run['t'], np.rad2deg(run['phi']) * 1e3,
                  0.08 * run['i']], '%.0f %.2f %.0f %.5f', ';').replace('.', ',')
    path.write_text('Nr.;Zeit;r2521[0] Lageistwert LR;r80 Drehmomentistwert\n'
                    ';ms;LU;Nm\n' + text, encoding='cp1252')


def _spanish(path: Path, run: dict[str, np.ndarray]) -> None:
    path.write_text('tiempo (s),ángulo (grados),corriente (mA)\n' + rows_of(
        [run['t'], np.rad2deg(run['phi']), 1e3 * run['i']], '%.5f %.4f %.1f', ','),
        encoding='utf-8')


def _pipes(path: Path, run: dict[str, np.ndarray]) -> None:
    """A table as a report shows it: bars between the columns, blanks around, turns ('tours')."""
    lines = ['| Temps [µs] | Couple [N.m] | Position [tr] |', '|---|---|---|']
    lines += [f'| {1e6 * t:.0f} | {0.08 * i:.5f} | {phi / (2 * np.pi):.6f} |'
              for t, phi, i in zip(run['t'], run['phi'], run['i'], strict=True)]
    path.write_text('\n'.join(lines) + '\n', encoding='utf-8')


def _inches(path: Path, run: dict[str, np.ndarray]) -> None:
    """An American linear axis: elapsed time as a clock, inches, pounds, quotes where Excel puts
    them. One turn of the screw is half an inch."""
    lines = ['"Elapsed time (h:mm:ss)","Position (in)","Force (lbf)"']
    for t, phi, i in zip(run['t'], run['phi'], run['i'], strict=True):
        force = 0.08 * i * 2 * np.pi / 0.0127 / 4.4482216
        lines.append(f'0:{int(t // 60):02d}:{t % 60:09.6f},{phi / (2 * np.pi) * 0.5:.6f},'
                     f'{force:.3f}')
    path.write_text('\r\n'.join(lines) + '\r\n')


def _chinese(path: Path, run: dict[str, np.ndarray]) -> None:
    path.write_text('时间(秒),电机位置(度),电流(安)\n' + rows_of(
        [run['t'], np.rad2deg(run['phi']), run['i']], '%.4f %.4f %.4f', ','), encoding='utf-8')


def _plotter(path: Path, run: dict[str, np.ndarray]) -> None:
    """What an Arduino prints for its plotter: a label before each number."""
    path.write_text(''.join(
        f't_ms:{1e3 * t:.0f},pos_deg:{math.degrees(phi):.3f},cur_mA:{1e3 * i:.0f}\n'
        for t, phi, i in zip(run['t'], run['phi'], run['i'], strict=True)))


def _date_apart(path: Path, run: dict[str, np.ndarray]) -> None:
    """A data logger: date and time of day in two columns."""
    lines = ['Date;Time;Torque [mNm];Angle [mrad]']
    for t, phi, i in zip(run['t'], run['phi'], run['i'], strict=True):
        lines.append(f'20.11.2026;09:{31 + int(t // 60)}:{t % 60:06.3f};{80.0 * i:.2f};'
                     f'{1e3 * phi:.2f}')
    path.write_text('\n'.join(lines) + '\n')


_KT = ('--torque-constant', '0.08')
FOREIGN_TABLES = (
    ForeignTable('stribeck_friction', _polish, 'pomiar.csv', 40, _KT,
                 Machine(rest=(1.5, 2.0))),
    ForeignTable('cogging_torque', _japanese, 'keisoku.csv', 20, (),
                 Machine(moved='sweep', poles=(8.0, 0.012), top=25.0)),
    ForeignTable(None, _labview, 'test_012.txt', 20, (), Machine(spring=(0.01, 0.0))),
    ForeignTable('asymmetric_friction', _trace, 'trace1.csv', 40,
                 ('--unit', 'position=360000/rev'), Machine(side=0.4, moved='speeds')),
    ForeignTable('presliding_friction', _spanish, 'ensayo.csv', 20, _KT,
                 Machine(bristle=0.5, moved='sweep', top=30.0)),
    ForeignTable('nonlinear_viscous_friction', _pipes, 'essai.txt', 20, (),
                 Machine(square=4e-5, top=80.0, swing=30.0)),
    ForeignTable('cogging_torque', _inches, 'axis 2.csv', 40, (),
                 Machine(poles=(4.0, 0.015), rest=(0.8, 1.5), moved='speeds')),
    ForeignTable('friction_drift', _chinese, 'ceshi.csv', 50, _KT,
                 Machine(wear=0.8, moved='torques')),
    ForeignTable('effort_measurement_lag', _plotter, 'serial.txt', 40, _KT,
                 Machine(slow=0.012, moved='sweep', swing=6.0, top=60.0)),
    ForeignTable('load_dependent_friction', _date_apart, 'logger.csv', 40, (),
                 Machine(spring=(0.012, 0.0), grip=0.3, moved='sweep', top=50.0)),
)
