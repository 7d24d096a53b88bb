# SPDX-License-Identifier: Apache-2.0
"""`topic list | info | echo | hz`, for machines without the `ros2` command line."""

from collections import deque
import sys
import time

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosidl_parser.definition import NamespacedType

from tools.ros_graph import command_parser, find, run_command, settled, type_named

WINDOW = 1000  # messages over which the rate is measured
OWN = {'/parameter_events', '/rosout'}  # topics that every node has, this one too
LONGEST = 128  # elements of an array that are printed


def main(argv):
    """Run the command; return the exit code."""
    return run_command(_parser(), argv)


def _parser():
    return command_parser('topic', 'Look at topics.', (
        ('list', show_list, 'names of all topics', {}),
        ('info', show_info, 'who speaks and listens on a topic, and its QoS', {'topic': {}}),
        ('echo', show_messages, 'the messages of a topic, as YAML', {
            'topic': {},
            '--once': {'action': 'store_true', 'help': 'stop after one message'},
            '--full-length': {
                'action': 'store_true',
                'help': f'print arrays of more than {LONGEST} elements whole'}}),
        ('hz', show_rate, 'messages per second of a topic', {'topic': {}})))


def show_list(node, given):
    """Print the names of all topics."""
    for name, _ in sorted(settled(node, node.get_topic_names_and_types, given.timeout,
                                  lambda seen: set(dict(seen)) - OWN)):
        print(name)
    return 0


def show_info(node, given):
    """Print the type of a topic, and every node at its two ends with its QoS."""
    name, kind = _find(node, given)
    print(f'Type: {kind}')
    for title, look in (('Publisher', node.get_publishers_info_by_topic),
                        ('Subscription', node.get_subscriptions_info_by_topic)):
        ends = settled(node, lambda: [_end(end) for end in look(name)], given.timeout,
                       lambda seen: 'UNKNOWN' not in ''.join(seen))
        print(f'\n{title} count: {len(ends)}')
        for end in sorted(ends):
            print(f'  {end}')
    return 0


def show_messages(node, given):
    """Print the messages of a topic as they come."""
    seen = []

    def show(message):
        print(as_yaml(message, sys.maxsize if given.full_length else LONGEST), '---', sep='\n',
              flush=True)
        seen.append(message)
    _subscribe(node, given, show)
    while not (given.once and seen):
        rclpy.spin_once(node)
    return 0


def show_rate(node, given):
    """Print the messages per second of a topic, once a second."""
    times = deque(maxlen=WINDOW)
    _subscribe(node, given, lambda message: times.append(time.monotonic()))
    while not times:
        rclpy.spin_once(node)
    due = time.monotonic() + 1.0
    while True:
        rclpy.spin_once(node, timeout_sec=0.1)
        if time.monotonic() >= due:
            due += 1.0
            rate = (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0
            print(f'{rate:.1f} messages a second, over the last {len(times)}', flush=True)


def as_yaml(message, most, indent=''):
    """Text of a message as `ros2 topic echo` prints it: a field a line, `most` array elements."""
    lines = []
    for (name, _), kind in zip(message.get_fields_and_field_types().items(), message.SLOT_TYPES):
        value = getattr(message, name)
        if isinstance(kind, NamespacedType):
            lines += [f'{indent}{name}:', as_yaml(value, most, indent + '  ')]
        elif isinstance(value, (str, bytes, bool, int, float)):
            lines.append(f'{indent}{name}: {_scalar(value)}')
        else:
            lines += [f'{indent}{name}:' + ('' if len(value) else ' []'),
                      *(_element(each, most, indent) for each in value[:most])]
            lines += [f"{indent}- '...'"] if len(value) > most else []
    return '\n'.join(lines)


def _element(value, most, indent):
    """Text of an element of an array, which may be a message."""
    if not hasattr(value, 'get_fields_and_field_types'):
        return f'{indent}- {_scalar(value)}'
    return f'{indent}- ' + as_yaml(value, most, indent + '  ').lstrip()


def _scalar(value):
    if isinstance(value, bytes):
        return value[0]
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, str) and not value.isidentifier() else value


def _subscribe(node, given, callback):
    """Subscribe with the QoS that its publishers offer, so that latched messages come too."""
    name, kind = _find(node, given)
    offers = _offers(node, name, given.timeout)
    latched = bool(offers) and all(
        qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offers)
    reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offers)
    node.create_subscription(type_named(kind), name, callback, QoSProfile(
        depth=WINDOW,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT))


def _offers(node, name, seconds):
    """Return the QoS of all publishers; who listens can be found before who speaks."""
    end = time.monotonic() + seconds
    while not node.get_publishers_info_by_topic(name) and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)
    return [each.qos_profile for each in node.get_publishers_info_by_topic(name)]


def _find(node, given):
    """(name, type) of a topic; raises GraphError if nobody speaks or listens there."""
    return find(node, node.get_topic_names_and_types, given.topic, given.timeout, 'topic')


def _end(end):
    """Return one end of a topic as text: its node, and the QoS that counts."""
    qos = end.qos_profile
    return (f'{end.node_namespace.rstrip("/")}/{end.node_name}: '
            f'{qos.reliability.name.lower()}, {qos.durability.name.lower()}')


if __name__ == '__main__':
    sys.exit(main(sys.argv))
