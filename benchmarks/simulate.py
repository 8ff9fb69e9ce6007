# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Inner steps per second of the closed loop: this package, plain C, plain Python, two threads.

    .venv/bin/python benchmarks/simulate.py [--seconds 60] [--rounds 7]

The paper's plant in its loop (1 kHz, 20 inner steps a tick), and the same with effects. The same
loop in C (simulate.c, with the machine's compiler, -O3 -march=native) is run in turn with this
package's kernel, so that both see the same machine; per pair the ratio, of all the median. Steps
are counted by processor time. The C loop's numbers must agree with the kernel's.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import ctypes
from dataclasses import replace
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile
import time

from bench import NOMINAL, PAIR, ROOT, strokes
import numpy as np

from engb_core.model import EffectSetting, Model
from engb_core.physics.compiled import COMPILED
from engb_core.physics.simulation import INNER_STEP, simulate_closed_loop
from engb_core.recording import Recording, Reference

TARGET, TARGET_RATIO = 20.0, 2.0
SOURCE = Path(__file__).with_name('simulate.c')
SETS = {'nominal': (), 'asymmetric friction': (EffectSetting('asymmetric_friction',
                                                            {'asymmetry': 0.2}),),
        'Stribeck + hysteresis': PAIR,
        'backlash': (EffectSetting('backlash', {'gap': 0.3}),)}


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=60.0, help='that are simulated')
    parser.add_argument('--rounds', type=int, default=7)
    parser.add_argument('--plain', type=float, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    recording = reference(arguments.plain or arguments.seconds)
    steps = recording.time.size * round(1e-3 / INNER_STEP) / 1e6
    if arguments.plain:
        print(f'{steps / timed(lambda: simulate_closed_loop(recording, NOMINAL)):.3f}')
        return
    if not COMPILED:
        print('numba is not installed: plain Python is measured')
    print(f'{steps:.1f} M inner steps of {1e6 * INNER_STEP:g} µs a run; million steps/s')
    for name, effects in SETS.items():
        model = replace(NOMINAL, effects=effects)
        simulate_closed_loop(recording, model)
        speed = steps / min(timed(lambda model=model: simulate_closed_loop(recording, model))
                            for _ in range(arguments.rounds))
        target = f'   (target {TARGET:g})' if name == 'nominal' else ''
        print(f'  {name:<24}{speed:8.1f}{target}', flush=True)
    beside_c(recording, steps, arguments.rounds)
    print(f'  {"plain Python (no numba)":<24}{plain():8.3f}')
    threads(recording, steps)


def reference(seconds: float) -> Recording:
    """Return a recording that holds the reference to follow, and nothing measured."""
    trajectory = strokes(seconds)
    time_ = np.arange(round(seconds * 1000)) * 1e-3
    position, velocity, _ = trajectory.sample(time_)
    return Recording('loop', time_, np.zeros(time_.size), np.zeros(time_.size),
                     reference=Reference(time_, position, velocity))


def timed(action: Callable[[], object]) -> float:
    """Return the processor time of `action` [s]."""
    begin = time.process_time()
    action()
    return time.process_time() - begin


def beside_c(recording: Recording, steps: float, rounds: int) -> None:
    """Print this package's speed and that of C, run in turn."""
    compiler = next((name for name in (os.environ.get('CC'), 'cc', 'gcc', 'clang')
                     if name and shutil.which(name)), None)
    if compiler is None:
        print('  no C compiler found (set CC): nothing to compare with')
        return
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / 'simulate.so'
        subprocess.run([compiler, '-O3', '-march=native', '-ffp-contract=off', '-shared', '-fPIC',
                        str(SOURCE), '-o', str(library), '-lm'], check=True)
        run = in_c(ctypes.CDLL(str(library)), recording, NOMINAL)
        own, theirs = [], []
        for _ in range(rounds):
            own.append(timed(lambda: simulate_closed_loop(recording, NOMINAL)))
            theirs.append(timed(run))
        position, _ = simulate_closed_loop(recording, NOMINAL)
        apart = float(np.max(np.abs(run()[:, 0] - position)))
    ratio = float(np.median(np.array(own) / np.array(theirs)))
    print(f'  {f"the same in C ({compiler})":<24}{steps / min(theirs):8.1f}   kernel takes '
          f'{ratio:.2f} × the time of C (target {TARGET_RATIO:g}); positions differ by '
          f'{apart:.0e} rad')


def in_c(library: ctypes.CDLL, recording: Recording, model: Model) -> Callable[[], np.ndarray]:
    """Return a call of the C loop on the same reference; it gives position and velocity."""
    loop, load = model.controller, model.load_torque
    numbers = [model.motor.inertia, model.motor.viscous_friction, model.friction.coulomb,
               model.friction.load_gain, model.friction.saturation_velocity,
               np.nan if load.contact_angle is None else load.contact_angle]
    gains = [loop.proportional, loop.integral, loop.derivative, loop.effort_limit,
             1.0 / loop.rate, INNER_STEP]
    terms = [*load.coefficients, *[0.0] * (12 - len(load.coefficients))]

    class Brake(ctypes.Structure):
        _fields_ = [('numbers', ctypes.c_double * 6), ('terms', ctypes.c_long),
                    ('load', ctypes.c_double * 12), ('gains', ctypes.c_double * 6)]

    brake = Brake((ctypes.c_double * 6)(*numbers), len(load.coefficients),
                  (ctypes.c_double * 12)(*terms), (ctypes.c_double * 6)(*gains))
    wanted = recording.reference
    ticks = np.ascontiguousarray(np.stack([wanted.position, wanted.velocity], axis=1))
    out = np.empty_like(ticks)
    pointer = ctypes.POINTER(ctypes.c_double)

    def run() -> np.ndarray:
        library.run(ctypes.byref(brake), ctypes.c_long(ticks.shape[0]), ctypes.c_long(20),
                    ticks.ctypes.data_as(pointer), out.ctypes.data_as(pointer))
        return out

    return run


def plain() -> float:
    """Return the speed without numba, in a process that can't import it [M steps/s]."""
    script = ('import runpy, sys; sys.modules["numba"] = None; '
              f'sys.argv = ["simulate", "--plain", "0.5"]; sys.path.insert(0, {str(ROOT)!r}); '
              f'sys.path.insert(0, {str(SOURCE.parent)!r}); '
              f'runpy.run_path({__file__!r}, run_name="__main__")')
    done = subprocess.run([sys.executable, '-c', script], check=True, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True)
    return float(done.stdout)


def threads(recording: Recording, steps: float) -> None:
    """Print how much faster runs are side by side (the kernel lets other threads run)."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count()
    runs = 4 * cores
    begin = time.perf_counter()
    for _ in range(runs):
        simulate_closed_loop(recording, NOMINAL)
    one = time.perf_counter() - begin
    begin = time.perf_counter()
    with ThreadPoolExecutor(cores) as pool:
        list(pool.map(lambda _: simulate_closed_loop(recording, NOMINAL), range(runs)))
    many = time.perf_counter() - begin
    print(f'  {f"{runs} runs, {cores} threads":<24}{runs * steps / many:8.1f}   '
          f'{one / many:.2f} × one thread (wall time)')


if __name__ == '__main__':
    main()
