# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Picks the topics of one brake out of all that a bag holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from engb_core.errors import InputError
from engb_core.io.bags.storage import Channel
from engb_core.io.recorded_topics import (
    FLOAT64,
    JOINT_STATE,
    JOINT_STATES,
    RECORDED_TOPICS,
    REFERENCE,
)

__all__ = ['Selection', 'select']

_CONTRACT = {topic.name: topic.type for topic in RECORDED_TOPICS}


@dataclass(frozen=True)
class Selection:
    """The topics to read: full names; `signals` maps a full name to the signal's name."""

    joint_states: str
    reference: str | None
    signals: dict[str, str]

    @property
    def all(self) -> set[str]:
        """Every topic to read."""
        topics = {self.joint_states, *self.signals}
        return topics | {self.reference} if self.reference else topics


def select(channels: Sequence[Channel], source: str, namespace: str | None = None) -> Selection:
    """Find `joint_states` by the last part of its name, and its neighbours.

    Args:
        channels: the bag's topics.
        source: the bag's name, for messages.
        namespace: the brake's namespace, e.g. '/front_left'; None where there is but one.

    Raises:
        InputError: no joint_states, several of them, or one of the contract's topics has
            another type or encoding.
    """
    if not channels:
        raise InputError(f'{source}: holds no topic at all; record again')
    kinds = {channel.topic: channel for channel in channels}
    states = [topic for topic in kinds if _split(topic)[1] == JOINT_STATES.name]
    if namespace is not None:
        wanted = '/' + namespace.strip('/')
        chosen = [topic for topic in states if '/' + _split(topic)[0].strip('/') == wanted]
        if not chosen:
            raise InputError(f'{source}: no {JOINT_STATES.name} in namespace {wanted}; '
                             f'there is {_listed(states or list(kinds))}')
    else:
        chosen = states
        right = [topic for topic in states if kinds[topic].type == JOINT_STATE]
        if len(right) == 1:
            chosen = right
    if not chosen:
        raise InputError(f'{source}: no topic {JOINT_STATES.name} ({JOINT_STATE}); '
                         f'there is {_listed(kinds)}')
    if len(chosen) > 1:
        raise InputError(f'{source}: {len(chosen)} topics {JOINT_STATES.name} '
                         f'({_listed(chosen)}); pick one with --namespace')
    prefix = _split(chosen[0])[0]
    others = [_split(topic)[0] for topic in states if topic != chosen[0]]
    reference, signals = None, {}
    for topic, channel in kinds.items():
        name = _relative(topic, prefix)
        if name in _CONTRACT:
            _check(channel, _CONTRACT[name], source)
        if name == REFERENCE.name:
            reference = topic
        elif channel.type == FLOAT64 and channel.encoding in ('cdr', ''):
            if name is not None:
                signals[topic] = name
            elif not any(_relative(topic, other) is not None for other in others):
                # From outside the brake's namespace, such as a car's /disc_speed.
                signals.setdefault(topic, _split(topic)[1])
    taken = {name for topic, name in signals.items() if _relative(topic, prefix) is not None}
    signals = {topic: name for topic, name in signals.items()
               if _relative(topic, prefix) is not None or name not in taken}
    return Selection(chosen[0], reference, signals)


def _split(topic: str) -> tuple[str, str]:
    """Return the namespace ('' on top) and the last part of a topic's name."""
    space, _, name = topic.rpartition('/')
    return space, name


def _relative(topic: str, prefix: str) -> str | None:
    return topic[len(prefix) + 1:] if topic.startswith(prefix + '/') else (
        topic if not prefix and '/' not in topic else None)


def _check(channel: Channel, kind: str, source: str) -> None:
    if channel.type != kind:
        raise InputError(f'{source}: topic {channel.topic} is {channel.type or "of no type"}; it '
                         f'must be {kind}')
    if channel.encoding not in ('cdr', ''):
        raise InputError(f'{source}: topic {channel.topic} is encoded as {channel.encoding}; '
                         'it must be cdr, as ROS 2 records it')


def _listed(topics: Sequence[str] | dict[str, Channel]) -> str:
    names = sorted(topics)
    return ', '.join(names[:8]) + (f' and {len(names) - 8} more' if len(names) > 8 else '')
