# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `recorder`: writes a rosbag2 MCAP bag of the graph, from raw messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
import time
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from engb_core.errors import InputError
from engb_core.io.bags.first_messages import FirstMessages
from engb_core.io.bags.writing import BagWriter, offered_qos
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.messages import message_class
from engb_ros.nodes.parameters import ParameterSpec, path_of
from engb_ros.nodes.raw_subscription import RawSubscription

__all__ = ['RecorderNode', 'main']


# What is recorded where nothing else is asked for.
_OWN = (*interface.TOPICS, interface.DIAGNOSTICS, interface.CLOCK)

# A publisher that has been there for so long [s] and was not heard is told of: to find one another
# takes up to 3 s.
_UNHEARD = 3.0

# Between two looks at what has come [s]: when it came is known of each.
_LOOK = 0.02

# Messages of a topic that may wait while the computer is busy with something else.
_BACKLOG = 100_000


class RecorderNode(ManagedNode):
    """Records the topics of its namespace, or those named, as they are sent.

    Topics are subscribed as they appear. Publishers that are best effort are read so; what is
    transient local is read so. A chunk of the file is finished every `chunk_time` seconds: what
    was recorded before is readable even if the recorder is killed. What comes before simulated
    time has begun is written with the first time there is. A message has the time at which it was
    received; a topic's first ones, which discovery may have kept back for seconds, that at which
    they were sent.
    """

    node_name = 'recorder'
    parameters = (
        ParameterSpec('bag', '', 'folder of the bag, made anew; empty: engb_<time of day>'),
        ParameterSpec('topics', [''], 'topics to record, relative to the namespace; empty: the '
                      'package\'s own, /diagnostics and /clock'),
        ParameterSpec('all', False, 'record every topic of the graph'),
        ParameterSpec('compression', 'none', 'none, or zstd (each chunk)',
                      choices=('none', 'zstd')),
        ParameterSpec('chunk_time', 0.5, 'a chunk is finished at least this often', 's', 0.05,
                      60.0),
        ParameterSpec('split_size', 0, 'a file of the bag is followed by another beyond this; 0: '
                      'one file', 'MB', 0, 1_000_000),
        ParameterSpec('split_time', 0.0, 'a file of the bag is followed by another after this; '
                      '0: one file', 's', 0.0, 1e6),
        ParameterSpec('every', 1, 'keep every n-th message of each topic', '', 1, 1000),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Open the bag."""
        names = [name for name in values['topics'] if name] or [
            topic.name for topic in _OWN]
        self._wanted = {self._resolved(name) for name in names}
        path = path_of('bag', values['bag'] or self._default_path())
        self._writer = BagWriter(path, compressed=values['compression'] == 'zstd',
                                 split_size=1_000_000 * values['split_size'],
                                 split_time=values['split_time'])
        self._is_made = False
        self._recorded: dict[str, Any] = {}
        self._every = values['every']
        self._heard = self._heard_before = 0
        self._came: Counter[str] = Counter()
        self._seen: dict[str, float] = {}       # since when a publisher has been there
        self._unheard: set[str] = set()         # told of
        self._began = False
        self._early: list[tuple[str, bytes]] = []
        self._written: Counter[str] = Counter()
        self._first: dict[str, FirstMessages] = {}
        self._statuses = {self.resolve_topic_name(topic.name) for topic in _OWN
                          if topic.kind == 'status'}
        joint_states = self.resolve_topic_name(interface.JOINT_STATES.name)
        # Without joint states a bag is no recording; of the others many may be silent, unless
        # somebody asks for them by name.
        self._expected = {name for name in self._wanted
                          if any(values['topics']) or name == joint_states}
        for topic in _OWN:
            name = self.resolve_topic_name(topic.name)
            if name in self._wanted:
                self._subscribe(name, topic.type)
        self.serve(interface.RECORDED, self._say_what_is_recorded)
        self.every(_LOOK, self._take)
        self.every(0.2, self._look_around)
        self.every(values['chunk_time'], self._writer.finish_chunk)
        self._look_around()
        self._is_made = True
        self.get_logger().info(f'recording to {path}')

    def start(self) -> None:
        """Record from now on."""
        self._began = True

    def stop(self) -> None:
        """Take what has come so far."""
        self.caught(self._take)()

    def finishing(self) -> bool:
        """Go on while messages that were sent before the signal still come in."""
        before, self._heard_before = self._heard_before, self._heard
        return self._heard > before

    def close(self) -> None:
        """Close the bag: index and metadata are written."""
        for subscription in getattr(self, '_recorded', {}).values():
            if subscription is not None:
                self._destroy(subscription)
        self._recorded = {}
        writer = getattr(self, '_writer', None)
        if writer is not None and writer.is_open and not self._is_made:
            writer.discard()   # the configuration failed
        elif writer is not None and writer.is_open:
            for name in list(self._first):
                self._write_first(name)
            self._write_early(time.time_ns())   # simulated time never began
            count = writer.close()
            self.get_logger().info(f'{count} messages in {writer.path}')
            for name in sorted(self._expected) if self._began else ():
                if not self._written[name]:
                    self.get_logger().warning(
                        f'{writer.path} holds no {name}'
                        + (': a publisher was there, and nothing came of it'
                           if name in self._seen else ', which nobody published'))

    def _resolved(self, name: str) -> str:
        try:
            return str(self.resolve_topic_name(name))
        except rclpy_implementation.RCLError as error:
            reason = str(error).rpartition(', at ')[0].rpartition(': ')[2]   # without rcl's file
            raise InputError(f'parameter topics holds {name!r}, which is no topic: {reason}'
                             ) from None

    def _default_path(self) -> str:
        seconds, _ = divmod(self.get_clock().now().nanoseconds, 1_000_000_000)
        return f'engb_{seconds}'

    def _look_around(self) -> None:
        for name, types in self.get_topic_names_and_types():
            if self.values['all'] or name in self._wanted:
                self._subscribe(name, types[0])
        if self.active:
            self._tell_of_unheard()

    def _tell_of_unheard(self) -> None:
        now = time.monotonic()
        for name in self._expected - self._unheard:
            if self._came[name] or not self.count_publishers(name):
                continue
            if now - self._seen.setdefault(name, now) > _UNHEARD:
                self._unheard.add(name)
                self.get_logger().warning(
                    f'{name}: a publisher has been there for {_UNHEARD:g} s, and nothing has '
                    f'come of it; see whether it speaks, and how: ros2 topic info -v {name}')

    def _subscribe(self, name: str, type_name: str) -> None:
        before = self._recorded.get(name)
        if name in self._recorded and before is None:
            return
        offered = [info.qos_profile for info in self.get_publishers_info_by_topic(name)]
        # A best-effort reader hears both kinds of publisher, a reliable one only its own.
        best_effort = any(entry.reliability == ReliabilityPolicy.BEST_EFFORT for entry in offered)
        # A transient local reader gets what was said before it came, but hears nobody who is
        # volatile. Who publishes is not known at first: what is a status is read as one.
        durable = (all(entry.durability == DurabilityPolicy.TRANSIENT_LOCAL for entry in offered)
                   if offered else name in self._statuses)
        if before is not None:
            was_best_effort = before.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
            was_durable = before.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
            best_effort = best_effort or was_best_effort
            held = name in self._first and self._first[name].count
            if not offered or self._written[name] or held:   # else it would be written twice
                durable = durable and was_durable
            if (best_effort, durable) == (was_best_effort, was_durable):
                return
        try:
            kind = message_class(type_name)
        except (ImportError, AttributeError, ValueError):
            self.get_logger().warning(f'{name}: its type {type_name} is not installed here; '
                                      'not recorded')
            self._recorded[name] = None
            return
        if not self._writer.knows(type_name):
            self.get_logger().warning(f'{name}: rosbags does not know {type_name}; not recorded')
            self._recorded[name] = None
            return
        qos = QoSProfile(
            history=HistoryPolicy.KEEP_LAST, depth=_BACKLOG,
            reliability=(ReliabilityPolicy.BEST_EFFORT if best_effort
                         else ReliabilityPolicy.RELIABLE),
            durability=(DurabilityPolicy.TRANSIENT_LOCAL if durable
                        else DurabilityPolicy.VOLATILE))
        callback = self._recording(name, type_name)
        if self.sim_time:   # only now is known what time it is by /clock
            subscription: Any = self.create_subscription(kind, name, self.caught(callback), qos,
                                                         raw=True)
        else:
            subscription = RawSubscription(self, kind, name, qos, callback)
            if not durable and not self._written[name]:
                self._first.setdefault(name, FirstMessages(time.time_ns()))
        if before is not None:
            self._destroy(before)
        self._recorded[name] = subscription

    def _destroy(self, subscription: Any) -> None:
        if isinstance(subscription, RawSubscription):
            subscription.destroy()
        else:
            self.destroy_subscription(subscription)

    def _take(self) -> None:
        for subscription in self._recorded.values():
            if isinstance(subscription, RawSubscription):
                subscription.take()
        now = time.time_ns()
        for name in [name for name, first in self._first.items() if first.are_complete(now)]:
            self._write_first(name)

    def _write_first(self, name: str) -> None:
        for sent, raw in self._first.pop(name).dated(self.count_publishers(name) == 1):
            self._write(name, sent, raw)

    def _recording(self, name: str, type_name: str) -> Callable[..., None]:
        clock, write, every, count = self.get_clock(), self._write, self._every, 0
        first, known = self._first, False

        def on_message(raw: bytes, sent: int = 0, received: int = 0) -> None:
            nonlocal count, known
            count += 1
            self._heard += 1
            self._came[name] += 1
            if self.active and count % every == 0:
                if not known:   # who sends is known now, and with it what is offered
                    known = self._writer.add_topic(name, type_name, self._offered(name))
                now = received or clock.now().nanoseconds
                if name in first:
                    first[name].hold(sent, now, raw)
                else:
                    write(name, now, raw)

        return on_message

    def _offered(self, name: str) -> list[Any]:
        profiles = [info.qos_profile for info in self.get_publishers_info_by_topic(name)]
        return [offered_qos(int(entry.history), int(entry.depth), int(entry.reliability),
                            int(entry.durability)) for entry in profiles]

    def _write(self, name: str, now: int, raw: bytes) -> None:
        if now == 0:   # simulated time that has not begun is no time
            self._early.append((name, raw))
            return
        if self._early:
            self._write_early(now)
        self._writer.write(name, now, raw)
        self._written[name] += 1

    def _write_early(self, now: int) -> None:
        early, self._early = self._early, []
        for name, raw in early:
            self._write(name, now, raw)

    def _say_what_is_recorded(self) -> str:
        if not self._written:
            raise InputError('nothing yet: ' + ('simulated time has not begun' if self._early
                                                else 'no message came'))
        return ', '.join(f'{count} {name}' for name, count in sorted(self._written.items()))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(RecorderNode, args)
