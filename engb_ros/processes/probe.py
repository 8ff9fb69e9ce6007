# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A node inside this process: looks at the graph, calls services, listens (for the runner)."""

from __future__ import annotations

from collections.abc import Callable
import os
import threading
import time
from typing import Any

from lifecycle_msgs.srv import GetState
import rclpy
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from engb_ros.interface import DEFAULT_NAMESPACE, Service, Topic
from engb_ros.nodes.base import make_executor, spin_once
from engb_ros.nodes.messages import message_class, publisher_qos
from engb_ros.nodes.transport import stay_on_this_computer

__all__ = ['Probe']

# A state that is asked for comes within milliseconds, or not at all [s].
ASK_AGAIN = 1.0


class Probe:
    """Listens to and speaks with the nodes that a `Runner` has started.

    It has a context of its own, so several can live in one process, each in its ROS domain.

    Args:
        domain: ROS_DOMAIN_ID; None: the environment's.
        namespace: of the brake.
    """

    def __init__(self, domain: int | None = None, namespace: str = DEFAULT_NAMESPACE) -> None:
        stay_on_this_computer(os.environ)
        self._context = rclpy.Context()
        self._context.init(domain_id=domain)
        self.node = rclpy.create_node('probe', context=self._context, namespace=namespace)
        self._executor = make_executor(self._context)
        self._executor.add_node(self.node)
        self._clients: dict[str, Any] = {}
        self._discovered: set[Any] = set()
        self._publishers: dict[str, Any] = {}
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []

    def __enter__(self) -> Probe:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the graph."""
        self._closing.set()
        for thread in self._threads:
            thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def spin(self, timeout: float = 0.02) -> None:
        """Handle what has come, waiting no longer than `timeout` [s]."""
        spin_once(self._executor, timeout)

    def listen(self, topic: Topic, callback: Callable[[Any], None] | None = None,
               depth: int = 10000) -> list[Any]:
        """Subscribe and return the list in which messages gather (or call `callback`)."""
        messages: list[Any] = []
        # Every message, also of a status that two nodes publish at the same moment.
        qos = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth,
                         reliability=ReliabilityPolicy.RELIABLE,
                         durability=publisher_qos(topic).durability)
        self.node.create_subscription(message_class(topic.type), topic.name,
                                      callback or messages.append, qos)
        return messages

    def advertise(self, topic: Topic) -> Any:
        """Return the publisher of `topic`."""
        if topic.name not in self._publishers:
            self._publishers[topic.name] = self.node.create_publisher(
                message_class(topic.type), topic.name, publisher_qos(topic))
        return self._publishers[topic.name]

    def publish(self, topic: Topic, value: Any) -> None:
        """Publish a message, or a Float64 of a number."""
        kind = message_class(topic.type)
        self.advertise(topic).publish(
            value if isinstance(value, kind) else kind(data=float(value)))

    def repeat(self, period: float, callback: Callable[[], None]) -> None:
        """Call `callback` every `period` [s] until the probe is closed, whatever this thread does
        meanwhile: in a thread of its own, which may publish what was advertised before."""
        def serve() -> None:
            due = time.monotonic() + period
            while not self._closing.wait(max(due - time.monotonic(), 0.0)):
                callback()
                due = max(due + period, time.monotonic())

        thread = threading.Thread(target=serve, name='repeat', daemon=True)
        self._threads.append(thread)
        thread.start()

    def publishers(self, topic: Topic) -> int:
        """Return how many publish `topic`."""
        return self.node.count_publishers(topic.name)

    def subscribers(self, topic: Topic) -> int:
        """Return how many listen to `topic`."""
        return self.node.count_subscribers(topic.name)

    def ready(self, node: str, service: Service) -> bool:
        """Whether `node` offers `service`."""
        return bool(self._client(node, service).service_is_ready())

    def call(self, node: str, service: Service, timeout: float = 20.0, request: Any = None) -> Any:
        """Call a node's service and return the response.

        Raises:
            TimeoutError: no answer within `timeout` [s].
        """
        client = self._client(node, service)
        end = time.monotonic() + timeout
        if client not in self._discovered:
            self._wait_until_discovered(node, end)
            self._discovered.add(client)
        self._wait_until_ready(client, end)
        future = client.call_async(request or message_class(service.type).Request())
        while not future.done():
            self.spin()
            if time.monotonic() > end:
                raise TimeoutError(f'{client.srv_name} did not answer')
        return future.result()

    def _wait_until_discovered(self, node: str, end: float) -> None:
        """Wait until `node` has discovered every client that was made so far.

        A server that has discovered where a request comes from, and not yet where its answer is to
        go, throws the answer away after 0.1 s (rmw_fastrtps issue 842): whoever asked waits for
        ever. Discovery keeps the order in which endpoints were made, so whoever answers a client
        made now has discovered all that were made before; and asking for a state does no harm
        twice.
        """
        client = self.node.create_client(GetState, f'{node}/get_state')
        try:
            while True:
                self._wait_until_ready(client, end)
                future = client.call_async(GetState.Request())
                again = time.monotonic() + ASK_AGAIN
                while not future.done() and time.monotonic() < min(again, end):
                    self.spin()
                if future.done():
                    return
                client.remove_pending_request(future)
        finally:
            self.node.destroy_client(client)

    def _wait_until_ready(self, client: Any, end: float) -> None:
        while not client.service_is_ready():
            self.spin()
            if time.monotonic() > end:
                raise TimeoutError(f'{client.srv_name} is not there')
        if time.monotonic() > end:
            raise TimeoutError(f'{client.srv_name} did not answer')

    def _client(self, node: str, service: Service) -> Any:
        name = service.name.replace('~', node)
        if name not in self._clients:
            self._clients[name] = self.node.create_client(message_class(service.type), name)
        return self._clients[name]
