# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The base of every node: QoS, namespace, parameters from a model, the run loop.

Of this package only this module and `run_topics` import rclpy; the nodes import what they need of
it from here, so that `dds` has checked the machine before.
"""

# ruff: noqa: E402, PLC0414 - rclpy is imported after that check, and re-exported

import functools
import signal
import sys
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Any, Protocol, TypeVar, cast

from rotor_interfaces import dds

dds.exit_unless_loadable()

import rclpy
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.exceptions import InvalidNamespaceException
from rclpy.exceptions import InvalidTopicNameException as InvalidTopicNameException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node as Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy as DurabilityPolicy
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.qos import ReliabilityPolicy as ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.validate_namespace import validate_namespace

from rotor_common.configuration import ConfigModel, bounds_of, range_text, unit_of
from rotor_common.errors import ConfigError, RigError, refusal
from rotor_common.exit_code import ExitCode
from rotor_common.interrupt import Interrupted, interruptible
from rotor_interfaces import messages, topics
from rotor_interfaces.topics import Topic

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that end a node in order."""
ACKNOWLEDGEMENT_S = 1.0
IDLE_S = 0.1
"""The run loop wakes this often without a message, so that a signal is noticed."""


Model = TypeVar('Model', bound=ConfigModel)


class RigNode(Protocol):
    """A node that the run loop can drive."""

    def is_done(self) -> bool:
        """Say whether the run is over; always False for a node that only listens."""

    def finish(self) -> None:
        """Complete pending work (acknowledgements, files) before the node is destroyed."""

    def destroy_node(self) -> None:
        """Release the ROS entities; rclpy's own."""


def qos(topic: Topic, *, subscribe: bool = False, volatile: bool = False) -> QoSProfile:
    """Return the profile of a topic; `volatile`: only new messages, even of a latched topic."""
    best_effort = subscribe and topic.best_effort
    latched = topic.latched and not volatile
    return QoSProfile(
        depth=topic.depth,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE),
    )


def publisher(node: Node, topic: Topic) -> Any:
    """Return a publisher with the type and QoS of the contract."""
    return node.create_publisher(messages.ros_class(topic.type), topic.name, qos(topic))


def subscription(
    node: Node, topic: Topic, callback: Callable[[Any], None], *, raw: bool = False
) -> Any:
    """Return a subscription with the type and QoS of the contract; raw = CDR bytes."""
    return node.create_subscription(
        messages.ros_class(topic.type),
        topic.name,
        _guarded(node, callback),
        qos(topic, subscribe=True),
        raw=raw,
    )


def wait_until_acknowledged(publishers: Iterable[Any]) -> None:
    """Wait until all readers have what was published, at most ACKNOWLEDGEMENT_S altogether.

    A reader that was killed stays known for a while and acknowledges nothing.
    """
    deadline = time.monotonic() + ACKNOWLEDGEMENT_S
    for each in publishers:
        each.wait_for_all_acked(Duration(seconds=max(deadline - time.monotonic(), 0.0)))


def timer(node: Node, period_s: float, callback: Callable[[], None]) -> Any:
    """Return a timer on the steady clock: it must not wait for the /clock that it may drive."""
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    return node.create_timer(period_s, _guarded(node, callback), clock=clock)


def declare(node: Node, name: str, default: Any, description: str) -> Any:
    """Declare a parameter that is fixed once the node runs; return its value.

    A whole number is accepted for a float. Raises ConfigError for any other type.
    """
    descriptor = ParameterDescriptor(description=description, read_only=True, dynamic_typing=True)
    value = node.declare_parameter(name, default, descriptor).value
    if isinstance(default, float) and type(value) is int:
        value = float(value)
    if type(value) is not type(default):
        raise ConfigError(
            f'{name} = {value!r} is not allowed; it must be of type {type(default).__name__}, '
            f'such as {default!r} ({description})'
        )
    return value


def declare_model(
    node: Node,
    base: Model,
    *,
    prefix: str = '',
    settable: Collection[str] = (),
    skip: Collection[str] = (),
) -> Model:
    """Declare every scalar field of `base` as a parameter and return the model they make.

    Description, unit and range come from the model, so `ros2 param describe` and the docs
    agree. Fields that are lists, mappings or unset, or named in `skip`, stay as `base` has them.

    Raises:
        ConfigError: an override that the model refuses.

    """
    values = base.model_dump(mode='json')
    for path, field, value in _leaves(base):
        if path in skip:
            continue
        name = prefix + path
        declared = _declare_field(node, name, field, value, read_only=path not in settable)
        owner = values
        *parents, leaf = path.split('.')
        for parent in parents:
            owner = owner[parent]
        owner[leaf] = declared
    return type(base).from_mapping(values)


def _leaves(model: ConfigModel, prefix: str = '') -> Iterator[tuple[str, Any, Any]]:
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if isinstance(value, ConfigModel):
            yield from _leaves(value, f'{prefix}{name}.')
        elif isinstance(value, bool | int | float | str):
            yield prefix + name, field, value


def _declare_field(node: Node, name: str, field: Any, value: Any, *, read_only: bool) -> Any:
    unit = unit_of(field)
    text = field.description or name
    descriptor = ParameterDescriptor(
        description=f'{text} [{unit}]' if unit not in ('', '1') else text, read_only=read_only
    )
    bounds = bounds_of(field)
    if bounds:
        descriptor.additional_constraints = f'allowed: {range_text(field)}'
        low = bounds.get('ge', bounds.get('gt'))
        high = bounds.get('le', bounds.get('lt'))
        if isinstance(value, float):
            descriptor.floating_point_range = [
                FloatingPointRange(
                    from_value=-1e308 if low is None else low,
                    to_value=1e308 if high is None else high,
                )
            ]
        elif isinstance(value, int) and not isinstance(value, bool):
            descriptor.integer_range = [
                IntegerRange(
                    from_value=-(2**62) if low is None else int(low),
                    to_value=2**62 if high is None else int(high),
                    step=1,
                )
            ]
    try:
        return node.declare_parameter(name, value, descriptor).value
    except Exception as error:  # noqa: BLE001 - rclpy raises several unrelated types here
        raise ConfigError(f'{name}: {error}; allowed: {range_text(field)}') from None


def accept_changes(node: Node, apply: dict[str, Callable[[float], None]]) -> None:
    """Let the named parameters change while the node runs; every other change is refused.

    `apply[name]` makes the change or raises RigError with the reason, which the caller of
    `ros2 param set` then reads.
    """

    def on_set(parameters: list[Parameter]) -> SetParametersResult:
        if len(parameters) > 1:
            # applied one by one they would not be atomic: a later refusal would come too late
            return SetParametersResult(successful=False, reason='set one parameter at a time')
        for parameter in parameters:
            if parameter.name not in apply:
                return SetParametersResult(
                    successful=False,
                    reason=f'{parameter.name} is fixed while the rig runs; set it in the '
                    f'scenario and start again (can change now: {", ".join(apply)})',
                )
            try:
                apply[parameter.name](parameter.value)
            except RigError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(on_set)


def run(
    create: Callable[[], Sequence[RigNode]],
    arguments: Sequence[str] | None = None,
    *,
    has_end: bool = False,
) -> int:
    """Create nodes, run them until one is done or a signal comes, and return the exit code.

    SIGINT and SIGTERM end the loop; what has arrived by then is still handled, then every node
    finishes in order. While nodes are being created they end that at once: compiling may take a
    minute. If the run `has_end`, ending it early is INTERRUPTED. A RigError or OSError becomes one
    sentence on standard error.
    """
    # blocked until they are handled; the process that started this one may have done it already
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    signals: list[int] = []
    for number in SIGNALS:
        signal.signal(number, lambda got, _: signals.append(got))
    try:
        with dds.environment():
            is_over = _run(create, arguments, signals)
    except Interrupted:
        is_over = False
    except RigError as error:
        sys.stderr.write(f'error: {error}\n')
        # the rig's errors about given values are ValueErrors too
        return ExitCode.BAD_INPUT if isinstance(error, ValueError) else ExitCode.PROCESS_FAILED
    except OSError as error:
        sys.stderr.write(f'error: {refusal(error)}\n')
        return ExitCode.BAD_INPUT
    return ExitCode.DONE if is_over or not has_end else ExitCode.INTERRUPTED


def _run(
    create: Callable[[], Sequence[RigNode]], arguments: Sequence[str] | None, signals: list[int]
) -> bool:
    """Create nodes, run and finish them; say whether one of them was done."""
    nodes: list[RigNode] = []
    try:
        with interruptible(*SIGNALS):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
            initialise(arguments)
            executor = EventsExecutor()
            nodes.extend(create())
        strangers = _warn_about_strangers(set())
        for node in nodes:
            executor.add_node(cast(Node, node))
        while not signals and not any(_failure(node) or node.is_done() for node in nodes):
            executor.spin_once(IDLE_S)
        failures = [failure for node in nodes if (failure := _failure(node))]
        _warn_about_strangers(strangers)
        _finish(executor, [node for node in nodes if not _failure(node)])
        if failures:
            raise failures[0]
        return any(node.is_done() for node in nodes)
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()


def _warn_about_strangers(known: set[int]) -> set[int]:
    """Warn about users, other than the known ones, with whom no data is exchanged; return all."""
    users = set(dds.other_users())
    if users - known:
        sys.stderr.write(f'warning: {dds.warning_about(users)}\n')
    return users | known


def namespace_arguments(namespace: str) -> list[str]:
    """Return the ROS arguments that put all topics of a node under `namespace`; none for ''.

    Also /clock and /diagnostics, which are absolute: those of two rigs would mix.

    Raises:
        ConfigError: not the name of a ROS namespace.

    """
    if not namespace:
        return []
    full = '/' + namespace.removeprefix('/')
    try:
        validate_namespace(full)
        valid = full != '/'
    except InvalidNamespaceException:
        valid = False
    if not valid:
        raise ConfigError(
            f'--namespace {namespace!r} is not allowed; it must be a ROS namespace, such as rig_1 '
            'or fleet/rig_1: letters, digits and underscores, and no part begins with a digit'
        )
    absolute = [topic.name for topic in topics.TOPICS if topic.name.startswith('/')]
    rules = [f'__ns:={full}', *(f'{name}:={full}{name}' for name in absolute)]
    return ['--ros-args', *(word for rule in rules for word in ('-r', rule))]


def initialise(arguments: Sequence[str] | None = None) -> None:
    """Start rclpy without its signal handlers; raises ConfigError."""
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # noqa: BLE001 - rclpy raises several unrelated types here
        reason = str(error).splitlines()[0]
        raise ConfigError(f'the ROS arguments cannot be understood: {reason}') from None


def _guarded(node: Node, callback: Callable[..., None]) -> Callable[..., None]:
    """Return `callback` with a RigError kept for the run loop: rclpy would print a traceback.

    A node that has failed handles no more messages.
    """

    @functools.wraps(callback)
    def call(*arguments: Any) -> None:
        if _failure(node):
            return
        try:
            callback(*arguments)
        except RigError as error:
            node.rig_failure = error

    return call


def _failure(node: Any) -> RigError | None:
    """Return the error that a callback of a node raised, None if there is none."""
    failure: RigError | None = getattr(node, 'rig_failure', None)
    return failure


def _finish(executor: EventsExecutor, nodes: Sequence[RigNode]) -> None:
    """Handle what has arrived, then let every node finish; nothing new begins."""
    for node in nodes:
        for own_timer in cast(Node, node).timers:
            own_timer.cancel()
    spin_until_quiet(executor)
    for node in nodes:
        node.finish()


def spin_until_quiet(executor: EventsExecutor, limit_s: float = 2.0) -> None:
    """Handle what has arrived: spin until nothing comes for IDLE_S, at most `limit_s`."""
    deadline = time.monotonic() + limit_s
    while time.monotonic() < deadline:
        started = time.monotonic()
        executor.spin_once(IDLE_S)
        if time.monotonic() - started >= IDLE_S:
            return
