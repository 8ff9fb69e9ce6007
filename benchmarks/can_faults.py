# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Kinds of faults of the CAN link, each injected into real frames: what becomes of the link, when.

Codec, protection, both ends of the link and the watch of the mode are the nodes' own; the time is
simulated (status each 1 ms, the bridge's look at the clock each 10 ms), so the same figures come
out on any computer: `python -m benchmarks.can_faults > docs/can-faults.md`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import random
import sys

from engb_ros.can.codec import DriveCodec, DriveCommand, DriveStatus, OFF, TORQUE
from engb_ros.can.drive_watch import DriveState, DriveWatch
from engb_ros.can.end_to_end import frame_crc, LinkState, Protector
from engb_ros.can.link import ControllerEnd, DriveEnd

__all__ = ['KINDS', 'Kind', 'measured', 'page']

Frame = tuple[int, bytes]
LINK_TIMEOUT, MODE_TIMEOUT, TICK, CYCLE = 0.05, 0.1, 0.01, 0.001
SILENCE = LINK_TIMEOUT + TICK + CYCLE
# More than 3 of the last 10 checks failed: with each, or each other, frame wrong.
FOUR, EIGHT = 4 * CYCLE, 8 * CYCLE
CODEC = DriveCodec()


@dataclass(frozen=True)
class Kind:
    """A fault: `spoil(number, frames)` returns what arrives instead; `bound` [s] until the drive
    is not believed any more, None: the link goes on; `mode` the drive reports."""

    name: str
    bound: float | None
    spoil: Callable[[int, list[Frame]], list[Frame]]
    mode: int = TORQUE


def _each(change: Callable[[bytes], bytes]) -> Callable[[int, list[Frame]], list[Frame]]:
    return lambda number, frames: [(identifier, change(data)) for identifier, data in frames]


def _with_counter(counter: Callable[[int], int]) -> Callable[[int, list[Frame]], list[Frame]]:
    def spoil(number: int, frames: list[Frame]) -> list[Frame]:
        changed = []
        for (identifier, data), frame in zip(frames, (CODEC.status_1, CODEC.status_2),
                                             strict=True):
            made = bytearray(data)
            made[1] = made[1] & 0xF0 | counter(number)
            made[0] = frame_crc(made, CODEC.data_id(frame))
            changed.append((identifier, bytes(made)))
        return changed
    return spoil


def _stuck() -> Callable[[int, list[Frame]], list[Frame]]:
    kept: list[Frame] = []

    def spoil(number: int, frames: list[Frame]) -> list[Frame]:
        if number == 0:
            kept[:] = frames
        return list(kept)
    return spoil


def _late(samples: int, in_bursts: bool) -> Callable[[int, list[Frame]], list[Frame]]:
    held: list[Frame] = []

    def spoil(number: int, frames: list[Frame]) -> list[Frame]:
        if number == 0:
            held.clear()
        held.extend(frames)
        if in_bursts:
            out, held[:] = (list(held), []) if number % samples == samples - 1 else ([], held)
            return out
        if number < samples:
            return []
        out, held[:] = held[:2], held[2:]
        return out
    return spoil


def _intruder(valid: bool) -> Callable[[int, list[Frame]], list[Frame]]:
    # He does not know the true sender's counter.
    protectors = (Protector(CODEC.data_id(CODEC.status_1)),
                  Protector(CODEC.data_id(CODEC.status_2)))

    def spoil(number: int, frames: list[Frame]) -> list[Frame]:
        noise = random.Random(number)
        return frames + [
            (identifier, bytes(protector.protect(bytearray(data), (number + 7) % 15)) if valid
             else noise.randbytes(8))
            for protector, (identifier, data) in zip(protectors, frames, strict=True)]
    return spoil


def _of_another_drive() -> Callable[[int, list[Frame]], list[Frame]]:
    def spoil(number: int, frames: list[Frame]) -> list[Frame]:
        return [(identifier, bytes(Protector(40000 + index).protect(bytearray(data), number % 15)))
                for index, (identifier, data) in enumerate(frames)]
    return spoil


KINDS = (
    Kind('nothing arrives (bus off, cable cut, interface gone)', SILENCE, lambda n, f: []),
    Kind('status 1 is lost, status 2 arrives', SILENCE, lambda n, f: f[1:]),
    Kind('status 2 is lost, status 1 arrives', SILENCE, lambda n, f: f[:1]),
    Kind('every other sample is lost', None, lambda n, f: f if n % 2 else []),
    Kind('three of four samples are lost', None, lambda n, f: f if n % 4 == 3 else []),
    Kind('nine of ten samples are lost', 10 * FOUR, lambda n, f: f if n % 10 == 9 else []),
    Kind('each sample arrives twice', EIGHT, lambda n, f: f + f),
    Kind('one sample arrives for ever', FOUR + CYCLE, _stuck()),
    Kind('a bit wrong in each frame', FOUR, _each(lambda d: d[:4] + bytes([d[4] ^ 16]) + d[5:])),
    Kind('a bit wrong in one frame of ten', None, lambda n, f: f if n % 10 else _each(
        lambda d: d[:4] + bytes([d[4] ^ 16]) + d[5:])(n, f)),
    Kind('CRC byte inverted', FOUR, _each(lambda d: bytes([d[0] ^ 255]) + d[1:])),
    Kind('counter stands', FOUR + CYCLE, _with_counter(lambda n: 5)),
    Kind('counter runs backwards', FOUR + CYCLE, _with_counter(lambda n: -n % 15)),
    Kind('counter 15', FOUR, _with_counter(lambda n: 15)),
    Kind('frames too short', FOUR, _each(lambda d: d[:7])),
    Kind('frames too long', FOUR, _each(lambda d: d + b'\0')),
    Kind('frames empty', FOUR, _each(lambda d: b'')),
    Kind('frames of another drive (other data ID)', FOUR, _of_another_drive()),
    Kind('wrong identifier', SILENCE, lambda n, f: [(0x700, d) for _, d in f]),
    Kind('late by 120 ms, in bursts', SILENCE, _late(120, True)),
    Kind('late by 20 ms, constantly', None, _late(20, False)),
    Kind('intruder with valid frames beside the drive', EIGHT, _intruder(True)),
    Kind('intruder with random bytes beside the drive', EIGHT, _intruder(False)),
    Kind('drive reports mode OFF', MODE_TIMEOUT + TICK + CYCLE, lambda n, f: f, OFF),
    Kind('drive reports an unknown mode', MODE_TIMEOUT + TICK + CYCLE, lambda n, f: f, 7),
)


def measured(kind: Kind) -> float | None:
    """Return how long after its begin the drive is not believed any more [s]; None: it is."""
    drive, bridge = DriveEnd(CODEC), ControllerEnd(CODEC, LINK_TIMEOUT)
    watch = DriveWatch(MODE_TIMEOUT)
    begin = 100
    for step in range(begin + 1000):
        now, number = step * CYCLE, step - begin
        bridge.command(DriveCommand(0.1, TORQUE))
        watch.ask(TORQUE, now)
        frames = list(drive.status(DriveStatus(
            1.0, 0.0, 1.0, kind.mode if number >= 0 else TORQUE)))
        for frame in kind.spoil(number, frames) if number >= 0 else frames:
            status = bridge.receive(*frame, now)
            if status is not None:
                watch.report(status, now)
        if step % round(TICK / CYCLE) == 0:
            bridge.watch(now)
        state = watch.state(bridge.state is LinkState.VALID, now)
        if number >= 0 and state is not DriveState.OBEYS:
            return (number + 1) * CYCLE
    return None


def page() -> str:
    """Return the page with the table."""
    lines = ['# Faults of the CAN link, kind by kind', '',
             __doc__.split('\n\n')[1].strip(), '',
             'Not believed: no sample is published, or `drive_state` says `refuses`.', '',
             '| fault | not believed any more within | measured |',
             '| --- | --- | --- |']
    for kind in KINDS:
        took = measured(kind)
        bound = 'goes on' if kind.bound is None else f'{1e3 * kind.bound:.0f} ms'
        lines.append(f'| {kind.name} | {bound} | '
                     + ('goes on' if took is None else f'{1e3 * took:.0f} ms') + ' |')
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    sys.stdout.write(page())
