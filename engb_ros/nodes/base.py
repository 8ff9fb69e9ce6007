# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What all nodes share: managed start, and errors of one line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import inspect
import time
from typing import Any, ClassVar, TYPE_CHECKING

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import (
    HistoryPolicy,
    qos_policy_name_from_kind,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.serialization import deserialize_message

from engb_core.errors import InputError
from engb_ros.interface import Service, Topic
from engb_ros.nodes.executor import make_executor, spin_once
from engb_ros.nodes.known_publisher import KnownPublisherSubscription
from engb_ros.nodes.messages import message_class, publisher_qos, subscription_qos
from engb_ros.nodes.parameters import declare, ParameterSpec, values_with
from engb_ros.nodes.run import run

if TYPE_CHECKING:
    from rclpy.impl.rcutils_logger import RcutilsLogger

__all__ = ['ManagedNode', 'make_executor', 'run', 'spin_once']

# A node that has not handled what came so long ago [s] is too late for any control.
QUEUE_IS_EMPTY = 0.25

AUTOSTART = ParameterSpec('autostart', True, 'configure and activate the node by itself')


class ManagedNode(LifecycleNode):
    """A managed (lifecycle) node that configures and activates itself, if parameter `autostart`.

    A node states its `parameters`; `configure(values)` builds what it needs and raises
    InputError where that can't be; `start()` and `stop()` are its entry to and exit from
    active; `reconfigure(values)` takes changed live parameters. In rclpy only publishers are
    managed, so callbacks look at `active` themselves.
    """

    node_name: ClassVar[str]
    poll_period: float = 0.1
    parameters: ClassVar[Sequence[ParameterSpec]] = ()

    def __init__(self, **options: Any) -> None:
        super().__init__(self.node_name, **options)
        self.active = self._starting = False
        self.failure: InputError | None = None
        self.broken: InputError | None = None   # what ended the work in the midst of it
        self._less_is_offered: list[tuple[Topic, Callable[[Any], None]]] = []
        self._owned: list[tuple[Callable[[Any], Any], Any]] = []
        self._silenced: list[tuple[float, KnownPublisherSubscription]] = []
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.specs = (AUTOSTART, *self.parameters)
        self.values = declare(self, self.specs)
        self.sim_time = bool(self.get_parameter('use_sim_time').value)
        self._guard_services()
        self._guard_clock()
        # The first line of a log costs 20 to 50 ms otherwise: rclpy asks `inspect` for its place,
        # which looks through all modules then. It would be that of a fault, in the control loop.
        inspect.getframeinfo(inspect.stack(0)[0].frame)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._take_parameters)

    def autostart(self) -> None:
        """Configure and activate, if the parameter says so; InputError where that fails."""
        if not self.values['autostart']:
            return
        self._starting = True
        if (self.trigger_configure() != TransitionCallbackReturn.SUCCESS
                or self.trigger_activate() != TransitionCallbackReturn.SUCCESS):
            raise self.failure or InputError('could not be started; its log says why')
        self._starting = False

    if TYPE_CHECKING:   # rclpy gives it no type
        def get_logger(self) -> RcutilsLogger: ...

    # What a node fills in.

    def configure(self, values: dict[str, Any]) -> None:
        """Build what the parameters ask for; InputError where that can't be."""

    def validate(self, values: dict[str, Any]) -> None:
        """Raise InputError where changed parameters don't fit together."""

    def reconfigure(self, values: dict[str, Any]) -> None:
        """Take up changed live parameters, already validated."""

    def start(self) -> None:
        """Begin to work; publishers are open."""

    def stop(self) -> None:
        """Cease to work; publishers are still open for a last word."""

    def poll(self) -> None:
        """Look at the clock: called after every callback, and every `poll_period` without any.

        A watchdog here costs nothing while messages come; a timer's wake-up costs as much as a
        control cycle.
        """

    def finishing(self) -> bool:
        """Return whether callbacks must go on after the signal to stop; asked every 0.1 s."""
        return False

    def close(self) -> None:
        """Give back what a cleanup must give back (files, buses)."""

    # Helpers; what they make is given back by a cleanup.

    def caught(self, callback: Callable[..., None]) -> Callable[..., None]:
        """Return a callback whose InputError ends the node in one line: an executor would print
        where it was raised."""
        def call(*args: Any) -> None:
            try:
                callback(*args)
            except InputError as error:
                self.broken = self.broken or error

        return call

    def advertise(self, topic: Topic) -> Any:
        """Return a managed publisher of `topic`."""
        publisher = self.create_lifecycle_publisher(
            message_class(topic.type), topic.name, publisher_qos(topic),
            event_callbacks=PublisherEventCallbacks(
                incompatible_qos=lambda event: self._tell_who_asks_for_more(topic, event)))
        self._owned.append((self.destroy_lifecycle_publisher, publisher))
        return publisher

    def listen(self, topic: Topic, callback: Callable[[Any], None], every: bool = False,
               raw: bool = False) -> Any:
        """Return a subscription to `topic`: to its newest message, or to `every` one; `raw`: to
        its serialised bytes.

        To hear every message it asks for reliable ones; once somebody offers less, it says so
        and takes what there is.
        """
        kind, qos = message_class(topic.type), subscription_qos(topic, every)
        callback, events = self.caught(callback), None
        if qos.reliability == ReliabilityPolicy.RELIABLE:
            events = SubscriptionEventCallbacks(
                incompatible_qos=lambda event: self._less_is_offered.append((topic, callback)))
        subscription = self.create_subscription(kind, topic.name, callback, qos,
                                                event_callbacks=events, raw=raw)
        self._owned.append((self.destroy_subscription, subscription))
        return subscription

    def listen_by_publisher(self, topic: Topic, callback: Callable[[Any, bytes | None], None],
                            raw: bool = False) -> Any:
        """Call `callback` with the newest message of each publisher, and what tells that one from
        the others (None where rcl cannot be asked, and of the newest of all then); return the
        subscription. `raw`: with the serialised bytes."""
        kind, callback = message_class(topic.type), self.caught(callback)

        def taken(data: bytes, publisher: bytes | None) -> None:
            try:
                message = deserialize_message(data, kind)
            except rclpy_implementation.RMWError:   # bytes that are no message
                return
            callback(message, publisher)

        try:
            subscription = KnownPublisherSubscription(
                self, kind, topic.name, callback if raw else taken)
        except (OSError, AttributeError) as error:
            self.get_logger().warning(
                f'publishers of {topic.name} cannot be told apart, all are heard: {error}')
            return self.listen(topic, lambda message: callback(message, None), raw=raw)
        self._owned.append((self._silence, subscription))
        return subscription

    def _silence(self, subscription: KnownPublisherSubscription) -> None:
        subscription.silence()
        self._silenced.append((time.monotonic(), subscription))

    def destroy_silenced(self, older_than: float = QUEUE_IS_EMPTY) -> None:
        """Destroy what was silenced so long ago [s] that no event of it is in a queue; called
        between two callbacks."""
        while self._silenced and time.monotonic() - self._silenced[0][0] >= older_than:
            self._silenced.pop(0)[1].destroy()

    def _tell_who_asks_for_more(self, topic: Topic, event: Any) -> None:
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        self.get_logger().warning(
            f'somebody subscribes to {topic.name} and hears nothing: its QoS asks for more '
            f'{policy.lower()} than {topic.name} has; let it ask for '
            + ('reliable or best effort, transient local or volatile' if topic.kind == 'status'
               else 'reliable or best effort, volatile, and no deadline or liveliness'))

    def settle_for_less(self) -> None:
        """Read best effort what somebody offers no better; called between two callbacks."""
        while self._less_is_offered:
            topic, callback = self._less_is_offered.pop()
            mine = [entry for entry in self._owned if getattr(entry[1], 'callback', None)
                    is callback and entry[1].qos_profile.reliability
                    == ReliabilityPolicy.RELIABLE]
            if not mine:
                continue
            self.get_logger().warning(
                f'somebody publishes {topic.name} with a QoS that promises less (best effort, as '
                'SensorDataQoS and micro-ROS do): it is read best effort too; samples may be '
                'lost')
            subscription = self.create_subscription(
                message_class(topic.type), topic.name, callback, QoSProfile(
                    history=HistoryPolicy.KEEP_LAST, depth=mine[0][1].qos_profile.depth,
                    reliability=ReliabilityPolicy.BEST_EFFORT), raw=mine[0][1].raw)
            self._owned.remove(mine[0])
            self.destroy_subscription(mine[0][1])
            self._owned.append((self.destroy_subscription, subscription))

    def every(self, period: float, callback: Callable[[], None]) -> Any:
        """Return a timer on the steady clock: no jump of the time of day reaches it [s]."""
        timer = self.create_timer(period, self.caught(callback), clock=self._steady)
        self._owned.append((self.destroy_timer, timer))
        return timer

    def serve(self, service: Service, callback: Callable[[], str]) -> Any:
        """Return a Trigger service; `callback` returns the message, or raises InputError."""
        def answer(request: Any, response: Any) -> Any:
            try:
                response.message = str(callback())
                response.success = True
            except InputError as error:
                response.message = str(error)
                response.success = False
            return response

        made = self.create_service(message_class(service.type), service.name, answer)
        self._owned.append((self.destroy_service, made))
        return made

    # Transitions.

    def _guard_services(self) -> None:
        """Refuse what rclpy's own services cannot answer (a transition that the state has not, a
        parameter of a type that is none): rclpy would end the node."""
        for service in self.services:
            service.callback = self._guarded(service.callback, service.srv_name)

    def _guard_clock(self) -> None:
        """Leave out a time that rclpy cannot take (below nought): it would end the node."""
        for subscription in self.subscriptions:
            if subscription.topic == '/clock':
                take = subscription.callback
                subscription.callback = lambda message, take=take: (
                    take(message) if message.clock.sec >= 0 else None)

    def _guarded(self, callback: Callable[[Any, Any], Any],
                 name: str) -> Callable[[Any, Any], Any]:
        def answer(request: Any, response: Any) -> Any:
            try:
                return callback(request, response)
            except Exception as error:   # whatever was asked, the node goes on
                self.get_logger().warning(
                    f'{name}: a request is refused: {" ".join(str(error).split())}')
                return type(response)()

        return answer

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Configure; on failure stay unconfigured, keep nothing, and say why in one line."""
        try:
            self.configure(self.values)
        except Exception as error:   # whatever it is, a lifecycle manager may try again
            self._give_back()
            self.failure = error if isinstance(error, InputError) else InputError(
                f'could not be configured: {type(error).__name__}: {" ".join(str(error).split())}')
            if not self._starting:   # at the start `run` prints it
                self.get_logger().error(str(self.failure))
            return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the publishers, then begin."""
        result = super().on_activate(state)
        if result == TransitionCallbackReturn.SUCCESS:
            self.active = True
            try:
                self.start()
            except Exception as error:   # rclpy would swallow it
                self.active = False
                self.failure = InputError(
                    f'could not be activated: {type(error).__name__}: {error}')
                self.get_logger().error(str(self.failure))
                super().on_deactivate(state)
                return TransitionCallbackReturn.FAILURE
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Cease, then close the publishers."""
        if self.active:
            self.stop()
        self.active = False
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give everything back; ERROR, told in one line, where a bag cannot be closed, say."""
        try:
            self._give_back()
        except InputError as error:
            self._give_back()   # the rest
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.ERROR
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Cease and give everything back."""
        if self.active:
            self.stop()
        self.active = False
        self._give_back()
        return super().on_shutdown(state)

    def destroy_node(self) -> None:
        """Give everything back, threads too: one that runs on keeps services in the graph that
        nobody answers."""
        try:
            self._give_back()
            self.destroy_silenced(0.0)
        finally:
            LifecycleNode.destroy_node(self)

    def _give_back(self) -> None:
        self.close()
        while self._owned:
            destroy, entity = self._owned.pop()
            destroy(entity)
        self._less_is_offered.clear()

    def _check_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        for change in changes:
            # Time itself, and with it the age of all that comes, must not change under way.
            if change.name == 'use_sim_time' and change.value != self.sim_time:
                return SetParametersResult(successful=False, reason='use_sim_time is set at the '
                                           'start; restart the node to change it')
        try:
            self.validate(values_with(self.values, self.specs, changes))
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _take_parameters(self, changes: list[Parameter]) -> None:
        self.values = values_with(self.values, self.specs, changes)
        self.reconfigure(self.values)
