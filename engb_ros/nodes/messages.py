# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Messages to numbers and back: every value cast, since rclpy doesn't check types by itself."""

from __future__ import annotations

from array import array
from importlib import import_module
import math
import struct
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from engb_ros.interface import Topic

__all__ = ['CLAMP', 'JointMessage', 'JointSample', 'StampClock',
           'StampedCommand', 'joint_sample', 'message_class', 'publisher_qos', 'scalar',
           'stamped_command', 'subscription_qos']

_NAN = math.nan

# Plain CDR (OMG CORBA 3.3, part 2, 9.3): four bytes say the byte order, the number follows.
_FLOAT64, _LITTLE_ENDIAN = struct.Struct('<4sd').pack, bytes((0, 1, 0, 0))

# A source's name is cut to this: nobody shall fill the memory.
_LONGEST_NAME = 64

# How much a publisher keeps for those who are late: Fast DDS repairs what a busy computer lost at
# its next heartbeat, up to 3 s later, and a recorder must get it then, at 1 kHz, too. A drive must
# never get an old command.
_DEPTH = {'state': 10_000, 'command': 1, 'request': 1, 'status': 1}

# A controller hears every request, not the newest alone: one of two sources that speaks right
# after the other, or while the controller waits, would hide it. Two at 100 Hz fill this in the
# time after which a source counts as silent.
_REQUESTS = 50


def message_class(name: str) -> Any:
    """Return the class of 'package/msg/Name' or 'package/srv/Name'."""
    package, kind, type_name = name.split('/')
    return getattr(import_module(f'{package}.{kind}'), type_name)


def publisher_qos(topic: Topic) -> QoSProfile:
    """Return the QoS with which a topic is published."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=_DEPTH[topic.kind],
        reliability=ReliabilityPolicy.RELIABLE,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if topic.kind == 'status'
                    else DurabilityPolicy.VOLATILE))


def subscription_qos(topic: Topic, every: bool = False) -> QoSProfile:
    """Return the QoS with which a topic is read: the newest message only, but for requests, or
    every one."""
    if topic.kind == 'status':
        return publisher_qos(topic)
    if every:
        return QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=_DEPTH['state'],
                          reliability=ReliabilityPolicy.RELIABLE)
    # Best effort hears reliable publishers too, and SensorDataQoS and micro-ROS as well; what was
    # lost would come again too late to be of use.
    return QoSProfile(history=HistoryPolicy.KEEP_LAST,
                      depth=_REQUESTS if topic.kind == 'request' else 1,
                      reliability=ReliabilityPolicy.BEST_EFFORT)


class JointSample(NamedTuple):
    """One joint out of a JointState: position [rad], velocity [rad/s], effort [N·m]; NaN where
    the message gives none."""

    position: float
    velocity: float
    effort: float


def joint_sample(message: JointState, joint: str) -> JointSample | None:
    """Return the joint called `joint`, or None where the message doesn't hold its position."""
    names = message.name
    if len(names) == 1 and names[0] == joint:
        index = 0
    else:
        try:
            index = names.index(joint)
        except ValueError:
            return None
    position, velocity, effort = message.position, message.velocity, message.effort
    if index >= len(position):
        return None
    return JointSample(
        position[index],
        velocity[index] if index < len(velocity) else _NAN,
        effort[index] if index < len(effort) else _NAN)


class StampedCommand(NamedTuple):
    """What a stamped command asks for: value, source, stamp [ns], and counter or None."""

    value: float
    source: str
    stamp: int
    counter: int | None


# The entries of a stamped command beside the joint's.
COUNTER = 'counter'
CLAMP = 'clamp'


def stamped_command(message: JointState, entry: str, by_force: bool) -> StampedCommand | None:
    """Return what a stamped command says of `entry`; None where it says nothing of it."""
    values = message.effort if by_force else message.position
    named = dict(zip(message.name, values, strict=False))
    if entry not in named:
        return None
    counter = named.get(COUNTER)
    stamp = message.header.stamp
    return StampedCommand(
        named[entry], message.header.frame_id[:_LONGEST_NAME],
        stamp.sec * 1_000_000_000 + stamp.nanosec,
        int(counter) if counter is not None and math.isfinite(counter) else None)


class StampClock:
    """Stamps to seconds from the first one: whole seconds are taken off before they are floats."""

    def __init__(self) -> None:
        self._origin: int | None = None

    def seconds(self, stamp: Time) -> float:
        """Return `stamp` in seconds from the first stamp seen."""
        return self.seconds_of(stamp.sec, stamp.nanosec)

    def seconds_of(self, sec: int, nanosec: int) -> float:
        """Return a stamp in seconds from the first stamp seen."""
        if self._origin is None:
            self._origin = sec
        return (sec - self._origin) + 1e-9 * nanosec


class JointMessage:
    """A JointState of one joint that is filled anew each cycle instead of being built anew."""

    def __init__(self, joint: str) -> None:
        self.message = JointState(name=[joint], position=array('d', [0.0]),
                                  velocity=array('d', [0.0]), effort=array('d', [0.0]))
        self._stamp = self.message.header.stamp
        self._position = self.message.position
        self._velocity = self.message.velocity
        self._effort = self.message.effort

    def fill(self, nanoseconds: int, position: float, velocity: float,
             effort: float) -> JointState:
        """Set stamp [ns] and values [rad, rad/s, N·m]; return the message (reused next time)."""
        self._stamp.sec, self._stamp.nanosec = divmod(int(nanoseconds), 1_000_000_000)
        self._position[0] = position
        self._velocity[0] = velocity
        self._effort[0] = effort
        return self.message

    def fill_at(self, sec: int, nanosec: int, position: float, velocity: float,
                effort: float) -> JointState:
        """Do as `fill`, with the stamp of another message."""
        self._stamp.sec, self._stamp.nanosec = sec, nanosec
        self._position[0] = position
        self._velocity[0] = velocity
        self._effort[0] = effort
        return self.message


def scalar(value: float) -> bytes:
    """Return a serialised Float64: rclpy publishes it as it is, for a third of the time."""
    return _FLOAT64(_LITTLE_ENDIAN, value)
