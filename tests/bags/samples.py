# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Bags made with rosbags' own serialisation: the reader is checked against others' code."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from engb_core.io.bags.write import joint_state_rows

STORE = get_typestore(Stores.ROS2_JAZZY)
JOINT_STATE = 'sensor_msgs/msg/JointState'
FLOAT64 = 'std_msgs/msg/Float64'
START = 1_767_000_000_000_000_000

_PLUGIN = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
_MODE = {'none': CompressionMode.NONE, 'file': CompressionMode.FILE,
         'message': CompressionMode.MESSAGE, 'chunk': CompressionMode.STORAGE}


@dataclass
class Message:
    """One message to be written: topic, type, log time [ns] and the serialised bytes."""

    topic: str
    type: str
    log_time: int
    data: bytes


@dataclass
class Run:
    """A short motion, and messages made of it."""

    size: int = 300
    rate: float = 1000.0
    messages: list[Message] = field(default_factory=list)

    def __post_init__(self) -> None:
        index = np.arange(self.size)
        self.stamp = START + np.rint(index * 1e9 / self.rate).astype(np.int64)
        self.position = np.sin(index / 30.0)
        self.velocity = np.cos(index / 30.0)
        self.effort = 0.1 * np.cos(index / 30.0) + 0.01

    def joint_states(self, topic='/engb/joint_states', names=('motor',), velocity=True,
                     delay=500_000, frame='', column=0, stamp=None):
        """Add joint_states; joint number `column` is the motion, others stand at 9."""
        stamps = self.stamp if stamp is None else stamp
        for index in range(self.size):
            values = [np.full(len(names), 9.0) for _ in range(3)]
            for array, source in zip(values, (self.position, self.velocity, self.effort),
                                     strict=True):
                if array.size:
                    array[column] = source[index]
            self.add(topic, JOINT_STATE, int(self.stamp[index]) + delay, joint_state(
                int(stamps[index]), names, values[0], values[1] if velocity else (), values[2],
                frame))
        return self

    def long(self):
        """Add joint_states fast, with the package's own serialisation (test_write checks it)."""
        rows = joint_state_rows(self.stamp, self.position, self.velocity, self.effort)
        for time, row in zip(self.stamp.tolist(), rows, strict=True):
            self.add('/engb/joint_states', JOINT_STATE, time, row.tobytes())
        return self

    def floats(self, topic, values, delay=300_000):
        """Add a Float64 at every sample."""
        for stamp, value in zip(self.stamp, values, strict=True):
            self.add(topic, FLOAT64, int(stamp) + delay, float64(value))
        return self

    def add(self, topic, kind, log_time, data):
        """Add one message."""
        self.messages.append(Message(topic, kind, log_time, data))
        return self

    def write(self, path: Path, storage='mcap', mode='none') -> Path:
        """Write all messages with rosbags, in the order of their log times."""
        return write(path, self.messages, storage, mode)


def joint_state(stamp, names, position, velocity, effort, frame='') -> bytes:
    """Serialise one JointState with rosbags."""
    types = STORE.types
    header = types['std_msgs/msg/Header'](
        types['builtin_interfaces/msg/Time'](stamp // 10**9, stamp % 10**9), frame)
    message = types[JOINT_STATE](header, list(names), np.asarray(position, float),
                                 np.asarray(velocity, float), np.asarray(effort, float))
    return bytes(STORE.serialize_cdr(message, JOINT_STATE))


def float64(value) -> bytes:
    """Serialise one Float64 with rosbags."""
    return bytes(STORE.serialize_cdr(STORE.types[FLOAT64](float(value)), FLOAT64))


def write(path: Path, messages: list[Message], storage='mcap', mode='none') -> Path:
    """Write messages with rosbags into folder `path`."""
    writer = Writer(path, version=9, storage_plugin=_PLUGIN[storage])
    if mode != 'none':
        writer.set_compression(_MODE[mode], CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for message in sorted(messages, key=lambda entry: entry.log_time):
            if message.topic not in connections:
                connections[message.topic] = writer.add_connection(
                    message.topic, message.type, typestore=STORE)
            writer.write(connections[message.topic], message.log_time, message.data)
    return path


def storage_file(folder: Path) -> Path:
    """Return the one storage file of a bag's folder."""
    found, = (entry for entry in folder.iterdir() if entry.name != 'metadata.yaml')
    return found
