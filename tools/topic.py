# SPDX-License-Identifier: Apache-2.0
"""`topic list | info | echo | hz`, for machines without the `ros2` command line."""

import argparse
from collections import deque
from collections.abc import Callable, Sequence
import sys
import time
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosidl_parser.definition import NamespacedType

from comply_ros.nodes.topics import node_name
from comply_ros.terminal.standard_output import standard_output
from tools.ros_graph import (
    command_parser,
    find,
    GraphNode,
    run_command,
    settled,
    spin_while_read,
    TOPICS_OF_EVERY_NODE,
    type_named,
)

WINDOW = 1000  # messages over which the rate is measured
ARRAY_LIMIT = 128  # elements of an array that are printed


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    return run_command(command_parser('topic', 'Look at topics.', (
        ('list', show_list, 'names of all topics', {}),
        ('info', show_info, 'publishers and subscribers of a topic, and their QoS', {
            'topic': {},
            '-v --verbose': {'action': 'store_true',
                             'help': 'print a line for each setting of the QoS'}}),
        ('echo', show_messages, 'the messages of a topic, as YAML', {
            'topic': {},
            '--once': {'action': 'store_true', 'help': 'stop after one message'},
            '--full-length': {
                'action': 'store_true',
                'help': f'print all elements of arrays with more than {ARRAY_LIMIT}'}}),
        ('hz', show_rate, 'messages per second of a topic', {'topic': {}}))), argv)


def show_list(node: GraphNode, given: argparse.Namespace) -> int:
    """Print the names of all topics."""
    for name, _ in sorted(settled(node, node.get_topic_names_and_types, given.timeout,
                                  lambda seen: set(dict(seen)) - TOPICS_OF_EVERY_NODE)):
        print(name)
    return 0


def show_info(node: GraphNode, given: argparse.Namespace) -> int:
    """
    Print the type of a topic, and each of its publishers and subscribers with its QoS.

    With `--verbose`, each is printed as `ros2 topic info --verbose` prints it.
    """
    name, kind = _find(node, given)
    print(f'Type: {kind}')
    for title, look in (('Publisher', node.get_publishers_info_by_topic),
                        ('Subscription', node.get_subscriptions_info_by_topic)):
        endpoints = settled(node, lambda: sorted(look(name), key=_endpoint), given.timeout,
                            lambda seen: 'UNKNOWN' not in ''.join(map(node_name, seen)))
        print(f'\n{title} count: {len(endpoints)}')
        for each in endpoints:
            print(f'\n{each}' if given.verbose else f'  {_endpoint(each)}')
    return 0


def show_messages(node: GraphNode, given: argparse.Namespace) -> int:
    """Print the messages of a topic as they are received."""
    received: list[Any] = []

    def on_message(msg: Any) -> None:
        print(as_yaml(msg, sys.maxsize if given.full_length else ARRAY_LIMIT), '---', sep='\n',
              flush=True)
        received.append(msg)
    _subscribe(node, given, on_message)
    spin_while_read(node, lambda: given.once and received)
    return 0


def show_rate(node: GraphNode, given: argparse.Namespace) -> int:
    """Print the messages per second of a topic, once a second."""
    times: deque[float] = deque(maxlen=WINDOW)
    _subscribe(node, given, lambda msg: times.append(time.monotonic()))
    spin_while_read(node, lambda: times)
    due = time.monotonic()
    while True:
        due += 1.0
        spin_while_read(node, lambda: time.monotonic() >= due)
        rate = (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0
        print(f'{rate:.1f} messages a second, over the last {len(times)}', flush=True)


def as_yaml(msg: Any, limit: int, indent: str = '') -> str:
    """Text of a message as `ros2 topic echo` prints it: a field a line, arrays cut at a limit."""
    lines = []
    for name, kind in zip(msg.get_fields_and_field_types(), msg.SLOT_TYPES):
        value = getattr(msg, name)
        if isinstance(kind, NamespacedType):
            lines += [f'{indent}{name}:', as_yaml(value, limit, indent + '  ')]
        elif isinstance(value, (str, bytes, bool, int, float)):
            lines.append(f'{indent}{name}: {_scalar(value)}')
        else:
            lines += [f'{indent}{name}:' + ('' if len(value) else ' []'),
                      *(_element(each, limit, indent) for each in value[:limit])]
            lines += [f"{indent}- '...'"] if len(value) > limit else []
    return '\n'.join(lines)


def _element(value: Any, limit: int, indent: str) -> str:
    """Text of an element of an array, which may be a message."""
    if not hasattr(value, 'get_fields_and_field_types'):
        return f'{indent}- {_scalar(value)}'
    return f'{indent}- ' + as_yaml(value, limit, indent + '  ').lstrip()


def _scalar(value: Any) -> Any:
    if isinstance(value, bytes):
        return value[0]
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, str) and not value.isidentifier() else value


def _subscribe(node: GraphNode, given: argparse.Namespace,
               callback: Callable[[Any], None]) -> None:
    """Subscribe with the QoS that the publishers offer, so that latched messages arrive too."""
    name, kind = _find(node, given)
    end = time.monotonic() + given.timeout  # subscribers can be found before publishers
    while not node.get_publishers_info_by_topic(name) and time.monotonic() < end:
        node.spin(0.05)
    offers = [each.qos_profile for each in node.get_publishers_info_by_topic(name)]
    latched = bool(offers) and all(
        qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offers)
    reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offers)
    node.create_subscription(type_named(kind), name, callback, QoSProfile(
        depth=WINDOW,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT))


def _find(node: GraphNode, given: argparse.Namespace) -> tuple[str, str]:
    return find(node, node.get_topic_names_and_types, given.topic, given.timeout, 'topic')


def _endpoint(info: TopicEndpointInfo) -> str:
    """Return a publisher or subscriber as text: its node, and its QoS."""
    qos = info.qos_profile
    return f'{node_name(info)}: {qos.reliability.name.lower()}, {qos.durability.name.lower()}'


if __name__ == '__main__':
    with standard_output():
        sys.exit(main(sys.argv))
