# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads a rosbag2 recording: a folder, an .mcap or a .db3 file, plain or zstd, also cut off."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.bags.assemble import assemble
from engb_core.io.bags.bag_files import bag_files, recording_name
from engb_core.io.bags.cdr import float64_values
from engb_core.io.bags.compression import unpacked
from engb_core.io.bags.joints import DEFAULT_JOINT, JointCollector, JointTrack
from engb_core.io.bags.mcap_file import McapFile
from engb_core.io.bags.sqlite_file import SQLITE_MAGIC, SqliteFile
from engb_core.io.bags.storage import Batch, Channel, StorageFile, unwrapped
from engb_core.io.bags.topics import select, Selection
from engb_core.io.recorded_topics import JOINT_STATE, JOINT_STATES
from engb_core.recording import Recording

__all__ = ['joint_namespaces', 'read_recording']

Times = NDArray[np.int64]
Values = NDArray[np.float64]

def read_recording(path: str | os.PathLike[str], joint: str | None = None,
                   namespace: str | None = None, effort_optional: bool = False) -> Recording:
    """Read one recording after the contract's section 1.

    Args:
        path: a bag's folder (with or without a usable metadata.yaml), or one .mcap or .db3 file,
            plain or zstd-compressed; splits are put together.
        joint: the joint's name; None: 'motor', else the only joint there is.
        namespace: the brake's, where the bag holds several joint_states.
        effort_optional: a recording without effort will do.

    Returns:
        The cleaned recording; its `notes` tell what was repaired. Float64 topics become
        `signals`, their log times shifted to the clock of the stamps.

    Raises:
        InputError: nothing readable, no usable joint_states, or too few samples.
    """
    name = recording_name(path)
    notes: list[str] = []
    with _bag(path, notes) as (files, channels):
        try:
            selection = select(channels, str(path), namespace)
        except InputError as error:
            for note in (note for file in files for note in file.notes):
                raise InputError(f'{error} ({note})') from None
            raise
        states, reference, signals, damaged = _collect(files, selection, joint, str(path))
        for file in files:
            notes.extend(file.notes)
    if damaged:
        notes.append(f'{damaged} messages could not be decoded and are left out')
    if joint and joint != DEFAULT_JOINT and states.joint != joint:
        notes.append(f'the model names joint {joint!r}; the recording holds only '
                     f'{states.joint!r}, which was taken')
    return assemble(name, str(path), states, reference, signals, notes, effort_optional)


def joint_namespaces(path: str | os.PathLike[str]) -> list[str]:
    """Return the namespaces of a bag that hold joint_states ('/' for none), sorted.

    Raises:
        InputError: nothing readable.
    """
    with _bag(path, []) as (_, channels):
        return sorted({'/' + channel.topic.rpartition('/')[0].strip('/') for channel in channels
                       if channel.topic.rpartition('/')[2] == JOINT_STATES.name
                       and channel.type == JOINT_STATE})


@contextlib.contextmanager
def _bag(path: str | os.PathLike[str], notes: list[str]) -> Iterator[
        tuple[list[StorageFile], list[Channel]]]:
    """Open all files of a bag; give them and the topics in them, each once."""
    with contextlib.ExitStack() as stack:
        files: list[StorageFile] = []
        for file in bag_files(path, notes):
            try:
                files.append(stack.enter_context(_opened(file, notes)))
            except InputError as error:
                # One bad file of a split bag doesn't spoil the others.
                failure = error
                notes.append(str(error))
        if not files:
            raise failure
        channels: dict[str, Channel] = {}
        for storage in files:
            for channel in storage.channels():
                channels.setdefault(channel.topic, channel)
        yield files, list(channels.values())


@contextlib.contextmanager
def _opened(path: Path, notes: list[str]) -> Iterator[StorageFile]:
    """Open a storage file by what it holds, not by its name."""
    try:
        with unpacked(path, notes) as plain:
            with plain.open('rb') as file:
                database = file.read(len(SQLITE_MAGIC)) == SQLITE_MAGIC
            with (SqliteFile if database else McapFile)(plain, str(path)) as storage:
                yield storage
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror or error}); give a '
                         'recording that you may read') from error


def _collect(files: list[StorageFile], selection: Selection, joint: str | None, source: str,
             ) -> tuple[JointTrack, JointTrack | None, dict[str, tuple[Times, Values]], int]:
    """Read all messages; signals come as name → log time (k,) [ns], value (k,)."""
    collectors = {topic: JointCollector(joint)
                  for topic in (selection.joint_states, selection.reference) if topic}
    parts: dict[str, list[tuple[Times, Values]]] = {}
    damaged = 0
    for file in files:
        for wrapped in file.batches(selection.all):
            batch, lost = unwrapped(wrapped)
            damaged += lost
            if not len(batch):
                continue
            if batch.topic in collectors:
                collectors[batch.topic].add(batch)
            else:
                parts.setdefault(selection.signals[batch.topic], []).append(
                    (batch.log_time, _floats(batch)))
    states = collectors[selection.joint_states].track(selection.joint_states, source)
    if states is None:
        for note in (note for file in files for note in file.notes):
            raise InputError(f'{source}: {note}; nothing of {selection.joint_states} is left; '
                             'copy the recording again')
        raise InputError(f'{source}: topic {selection.joint_states} holds no message; '
                         'record again while the drive publishes')
    reference = None
    if selection.reference:
        reference = collectors[selection.reference].track(selection.reference, source)
    damaged += sum(collector.damaged for collector in collectors.values())
    signals = {name: (np.concatenate([time for time, _ in values]),
                      np.concatenate([value for _, value in values]))
               for name, values in parts.items()}
    return states, reference, signals, damaged


def _floats(batch: Batch) -> Values:
    if isinstance(batch.rows, np.ndarray):
        return float64_values(batch.rows)
    return np.concatenate([float64_values(np.frombuffer(row or b'\0', np.uint8)[None])
                           for row in batch.rows])
