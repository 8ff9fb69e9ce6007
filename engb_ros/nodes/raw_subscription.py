# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A subscription that is emptied now and then, and tells when each message was sent and received.

rclpy's EventsExecutor hands no such information on (a callback that asks for it crashes), and a
callback for each message costs ten times what taking it does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.type_support import check_is_valid_msg_type

__all__ = ['RawSubscription']

# Of rclpy, whose functions have no types.
_check_message_type: Callable[[Any], None] = check_is_valid_msg_type
_make_subscription: Callable[..., Any] = rclpy_implementation.Subscription


class RawSubscription:
    """Serialised messages of one topic, which no executor takes.

    Args:
        node: whose it is.
        kind: class of the messages.
        topic: its name.
        qos: keeps what comes between two looks.
        callback: called with the bytes of a message, and when it was sent and received, by the
            clocks of publisher and of this computer [ns]; 0 where the middleware does not say.

    Attributes:
        qos_profile: as given.
    """

    def __init__(self, node: Node, kind: Any, topic: str, qos: QoSProfile,
                 callback: Callable[[bytes, int, int], None]) -> None:
        _check_message_type(kind)
        self.qos_profile = qos
        self._kind, self._callback = kind, callback
        with node.handle:
            self._handle = _make_subscription(node.handle, kind, topic,
                                              qos.get_c_qos_profile())

    def take(self) -> None:
        """Hand on all that has come."""
        with self._handle:
            while (taken := self._handle.take_message(self._kind, True)) is not None:
                message, info = taken
                self._callback(message, info['source_timestamp'] or 0,
                               info['received_timestamp'] or 0)

    def destroy(self) -> None:
        """Give it back."""
        self._handle.destroy_when_not_in_use()
