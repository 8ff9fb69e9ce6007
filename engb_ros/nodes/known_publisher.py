# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Subscriptions that tell whose each message is.

The middleware gives the identifier of its publisher (GID) with each message; rclpy on Jazzy does
not hand it on. rcl, which is below it, does: messages are taken by its C function here.
"""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.type_support import check_is_valid_msg_type
from rclpy.waitable import NumberOfEntities, Waitable

__all__ = ['KnownPublisherSubscription']

# So many messages of others may come before the one that counts is read: a tenth of a second of
# somebody who sends as fast as a process can. Of each publisher only the newest is handed on.
_DEPTH = 1000

# Of rclpy, whose functions have no types.
_check_message_type: Callable[[Any], None] = check_is_valid_msg_type
_make_subscription: Callable[..., Any] = rclpy_implementation.Subscription
_make_qos: Callable[..., Any] = QoSProfile
_one_subscription: Callable[..., NumberOfEntities] = NumberOfEntities


class _Allocator(ctypes.Structure):
    """rcutils_allocator_t."""

    _fields_ = [(name, ctypes.c_void_p) for name in (
        'allocate', 'deallocate', 'reallocate', 'zero_allocate', 'state')]


class _Bytes(ctypes.Structure):
    """rcutils_uint8_array_t, which is rmw_serialized_message_t."""

    _fields_ = [('buffer', ctypes.c_void_p), ('length', ctypes.c_size_t),
                ('capacity', ctypes.c_size_t), ('allocator', _Allocator)]


class _Info(ctypes.Structure):
    """rmw_message_info_t of Jazzy, with room for what other versions have more."""

    _fields_ = [('source_timestamp', ctypes.c_int64), ('received_timestamp', ctypes.c_int64),
                ('publication_sequence_number', ctypes.c_uint64),
                ('reception_sequence_number', ctypes.c_uint64),
                ('gid_implementation', ctypes.c_void_p), ('gid', ctypes.c_uint8 * 16),
                ('room', ctypes.c_uint8 * 64)]


class _Rcl:
    """The functions of rcl and what is below it that are needed; OSError or AttributeError where
    they are not to be found."""

    def __init__(self) -> None:
        rcl = ctypes.CDLL('librcl.so')   # what it depends on is found with it
        self.take = rcl.rcl_take_serialized_message
        self.take.argtypes = [ctypes.c_void_p] * 4
        self.default_allocator = rcl.rcutils_get_default_allocator
        self.default_allocator.restype = _Allocator
        self.init = rcl.rcutils_uint8_array_init
        self.init.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
        self.call_back = rcl.rcl_subscription_set_on_new_message_callback
        self.call_back.argtypes = [ctypes.c_void_p] * 3
        self.fini = rcl.rcutils_uint8_array_fini
        self.fini.argtypes = [ctypes.c_void_p]
        identifier = rcl.rmw_get_implementation_identifier
        identifier.restype = ctypes.c_void_p
        self.implementation = identifier()


class KnownPublisherSubscription(Waitable):
    """A subscription to serialised messages that tells whose each is: to the newest of each
    publisher, so that nobody who speaks right after another one hides what that one said.

    Args:
        node: to whose executor it belongs.
        kind: class of the messages.
        topic: relative to the node's namespace.
        callback: called with the bytes of a message, and what tells its publisher from the others
            (its GID), or None where the middleware does not say.
    Raises:
        OSError, AttributeError: rcl's own functions are not to be found here.

    Attributes:
        topic_name: as it is after remapping.
    """

    def __init__(self, node: Node, kind: Any, topic: str,
                 callback: Callable[[bytes, bytes | None], None]) -> None:
        self._rcl = _Rcl()
        _check_message_type(kind)
        self._callback = callback
        self._info, self._bytes = _Info(), _Bytes(allocator=self._rcl.default_allocator())
        self._rcl.init(ctypes.byref(self._bytes), 256, ctypes.byref(self._bytes.allocator))
        with node.handle:
            self._handle = _make_subscription(
                node.handle, kind, topic, _make_qos(
                    history=HistoryPolicy.KEEP_LAST, depth=_DEPTH,
                    reliability=ReliabilityPolicy.BEST_EFFORT).get_c_qos_profile())
        super().__init__(node.default_callback_group)  # type: ignore[no-untyped-call]
        self._node, self._index, self._given_back = node, -1, False
        self._arguments = (self._handle.pointer, ctypes.byref(self._bytes),
                           ctypes.byref(self._info), None)
        self.topic_name: str = self._handle.get_topic_name()
        self._events: list[Any] = SubscriptionEventCallbacks().create_event_handlers(
            self.callback_group, self._handle, topic)
        for waitable in (self, *self._events):
            node.add_waitable(waitable)

    def silence(self) -> None:
        """Hear nothing more: what comes from now on makes no event in an executor's queue."""
        self._given_back = True
        self._rcl.call_back(self._handle.pointer, None, None)

    def destroy(self) -> None:
        """Give it back, some time after it was silenced.

        The EventsExecutor lets go of a waitable that was removed while an event of it was in its
        queue without the interpreter's lock, which ends the process in a segmentation fault.
        """
        self.silence()
        for waitable in (self, *self._events):
            self._node.remove_waitable(waitable)
        for event in self._events:
            event.destroy()
        self._handle.destroy_when_not_in_use()
        self._rcl.fini(ctypes.byref(self._bytes))

    # What the executors ask of a Waitable.

    def __enter__(self) -> None:
        """Keep the subscription while somebody waits for it."""
        self._handle.__enter__()

    def __exit__(self, kind: Any, value: Any, traceback: Any) -> None:
        """Let it go."""
        self._handle.__exit__(kind, value, traceback)

    def get_num_entities(self) -> NumberOfEntities:
        """Return what has to be waited for."""
        return _one_subscription(num_subs=1)

    def add_to_wait_set(self, wait_set: Any) -> None:
        """Have it waited for."""
        self._index = wait_set.add_subscription(self._handle)

    def is_ready(self, wait_set: Any) -> bool:
        """Return whether something has come."""
        return bool(wait_set.is_ready('subscription', self._index))

    def take_data(self) -> None:
        """Hand on each publisher's newest message: at once, since the EventsExecutor does
        `execute` later."""
        info, data = self._info, self._bytes
        if self._given_back:   # an event of it was in the executor's queue
            return
        newest: dict[bytes | None, bytes] = {}
        with self._handle:
            while not self._rcl.take(*self._arguments):
                known = info.gid_implementation == self._rcl.implementation
                publisher = bytes(info.gid) if known else None
                newest.pop(publisher, None)   # in the order in which they came
                newest[publisher] = ctypes.string_at(data.buffer, data.length)
        for publisher, message in newest.items():
            self._callback(message, publisher)

    async def execute(self, taken: None) -> None:
        """Do nothing: all has been handed on."""
