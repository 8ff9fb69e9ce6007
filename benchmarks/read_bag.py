# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reading bags: this package, rosbags and mcap's own reader on the same files, side by side.

    .venv/bin/python benchmarks/read_bag.py [--samples 500000] [--hour]

Makes bags of N JointStates and as many Float64s (so 2 N messages) in a temporary folder and reads
each with
  engb      `read_recording`: everything, to the cleaned recording
  rosbags   all messages deserialised, the numbers kept
  mcap      mcap's own reader, all messages as raw bytes (nothing is decoded)
Prints messages per second of processor time (wall time on a quiet machine) and ratios. Each
figure is the best of three (engb) or one run (the others, which take long). --hour adds an hour
of 1 kHz, 7.2 M messages, and the memory that reading it takes, in a process of its own.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
import subprocess
import sys
import tempfile
import time

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

FORMATS = [('mcap', 'none'), ('mcap', 'chunk'), ('mcap', 'message'), ('sqlite3', 'none'),
           ('sqlite3', 'file')]


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--samples', type=int, default=500_000)
    parser.add_argument('--hour', action='store_true')
    parser.add_argument('--read', help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.read:
        _read_once(Path(arguments.read))
        return
    with tempfile.TemporaryDirectory(prefix='engb-bench-') as folder:
        print(f'{arguments.samples} JointStates and as many Float64s; million messages/s\n')
        print(f'{"format":<18}{"engb":>8}{"rosbags":>9}{"mcap raw":>10}{"engb/rosbags":>14}'
              f'{"engb/mcap":>11}')
        for storage, compression in FORMATS:
            path = Path(folder) / f'{storage}_{compression}'
            make(path, arguments.samples, storage, compression)
            count = 2 * arguments.samples
            own = count / min(timed(lambda path=path: read_engb(path)) for _ in range(3))
            other = count / timed(lambda path=path: read_rosbags(path))
            raw = count / timed(lambda path=path: read_mcap(path)) if storage == 'mcap' else None
            print(f'{storage + " " + compression:<18}{own / 1e6:8.2f}{other / 1e6:9.3f}'
                  + (f'{raw / 1e6:10.3f}' if raw else f'{"–":>10}') + f'{own / other:13.0f}×'
                  + (f'{own / raw:10.0f}×' if raw else ''), flush=True)
        if arguments.hour:
            path = Path(folder) / 'hour'
            make(path, 3_600_000, 'mcap', 'chunk')
            done = subprocess.run([sys.executable, __file__, '--read', str(path)], check=True,
                                  capture_output=True, text=True)
            print(f'\nan hour at 1 kHz, 7.2 M messages, zstd: {done.stdout.strip()}')


def make(path: Path, size: int, storage: str, compression: str) -> None:
    """Write a bag of `size` JointStates and Float64s."""
    from engb_core.io.bags.write import FloatTable, JointTable, write_bag
    stamp = 1_767_000_000_000_000_000 + np.arange(size, dtype=np.int64) * 1_000_000
    time_ = np.arange(size) / 1000
    noise = np.random.default_rng(0).standard_normal(size)
    position = np.round(20 * np.sin(time_) / 0.0015) * 0.0015     # an encoder's steps
    effort = 0.1 * np.sin(time_) + 1e-3 * noise
    write_bag(path, {
        '/engb/joint_states': JointTable(stamp, position, np.gradient(position, time_), effort,
                                         log_time=stamp + 300_000),
        '/engb/effort_command': FloatTable(stamp + 400_000, effort)}, storage, compression)


def timed(action: Callable[[], None]) -> float:
    """Return the processor time of `action` [s]; all readers run in one thread."""
    begin = time.process_time()
    action()
    return time.process_time() - begin


def read_engb(path: Path) -> None:
    """Read with this package."""
    from engb_core.io.bags.read import read_recording
    recording = read_recording(path)
    assert recording.signals['effort_command'].value.size == recording.time.size


def read_rosbags(path: Path) -> None:
    """Read with rosbags, message by message, and keep the same numbers."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import get_typestore, Stores
    store = get_typestore(Stores.ROS2_JAZZY)
    states, values = [], []
    with AnyReader([path], default_typestore=store) as reader:
        for connection, log_time, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.msgtype.endswith('Float64'):
                values.append((log_time, message.data))
            else:
                stamp = message.header.stamp
                states.append((stamp.sec + 1e-9 * stamp.nanosec, message.position[0],
                               message.velocity[0], message.effort[0]))
    assert len(states) == len(values)


def read_mcap(path: Path) -> None:
    """Iterate over the raw messages with mcap's own reader."""
    from mcap.reader import make_reader
    with next(path.glob('*.mcap')).open('rb') as file:
        for _ in make_reader(file).iter_messages():
            pass


def _peak() -> float:
    """Return the most memory that this process has had [MiB] (a child inherits ru_maxrss)."""
    for line in Path('/proc/self/status').read_text().splitlines():
        if line.startswith('VmHWM'):
            return int(line.split()[1]) / 1024
    return float('nan')


def _read_once(path: Path) -> None:
    from engb_core.io.bags.read import read_recording
    before = _peak()
    begin = time.process_time()
    recording = read_recording(path)
    seconds = time.process_time() - begin
    peak = _peak()
    arrays = [recording.time, recording.position, recording.velocity, recording.effort]
    for signal in recording.signals.values():
        arrays += [signal.time, signal.value]
    kept = sum(array.nbytes for array in arrays) / 2**20
    print(f'{seconds:.2f} s, {7.2 / seconds:.2f} M messages/s, peak {peak:.0f} MiB (of it '
          f'{before:.0f} MiB before reading, {kept:.0f} MiB for the recording itself)')


if __name__ == '__main__':
    main()
