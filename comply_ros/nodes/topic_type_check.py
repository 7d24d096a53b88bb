# SPDX-License-Identifier: Apache-2.0
"""Checks the types and the number of publishers on a node's topics: DDS reports neither."""

from collections.abc import Iterator

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from comply_ros.nodes.topics import node_name, Topic

PATIENCE = 30  # ticks with two publishers before a warning: a dead one is seen for 20 seconds


class TopicTypeCheck:
    """Finds publishers and subscribers of another type on a node's topics, and second ones."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._types: dict[str, str] = {}  # by full name of the topic
        self._own = node.get_fully_qualified_name()
        self._crowded_ticks: dict[str, int] = {}  # of topics with a single publisher
        self._reported: set[tuple[str, ...]] = set()

    def watch(self, topic: Topic, single_publisher: bool = False) -> None:
        """Check this topic too; single_publisher: whether a second publisher is one too many."""
        name = self._node.resolve_topic_name(topic.name)
        self._types[name] = type_name(topic.message)
        if single_publisher:
            self._crowded_ticks[name] = 0

    def tick(self) -> Iterator[str]:
        """Yield one sentence for everything that is wrong and was not reported yet."""
        for name, ticks in self._crowded_ticks.items():
            publishers = self._node.count_publishers(name)
            self._crowded_ticks[name] = ticks + 1 if publishers > 1 else 0
            if self._crowded_ticks[name] == PATIENCE:
                yield (f'topic {name} must have one publisher, got {publishers}: messages of all '
                       'are used, and results cannot be reproduced; end all but one')
        for name, expected in self._types.items():
            ends = (*self._node.get_publishers_info_by_topic(name),
                    *self._node.get_subscriptions_info_by_topic(name))
            own_hash = next((str(end.topic_type_hash) for end in ends
                             if node_name(end) == self._own and end.topic_type == expected), '')
            for end in ends:
                problem = self._problem(end, expected, own_hash)
                if problem and self._is_new(name, end):
                    yield (f'topic {name} must have the type {expected}, but the '
                           f'{end.endpoint_type.name.lower()} of {node_name(end)} has {problem}')

    def _problem(self, end: TopicEndpointInfo, expected: str, own_hash: str) -> str | None:
        """Return what is wrong with the type of a publisher or subscriber, or None."""
        if end.topic_type != expected:
            return f'{end.topic_type}: no messages are exchanged with it'
        found = str(end.topic_type_hash)
        if own_hash and found != own_hash and 'INVALID' not in found + own_hash:
            return ('another version of it: its messages cannot be read; run nodes of one version '
                    'of comply_ros')
        return None

    def _is_new(self, name: str, end: TopicEndpointInfo) -> bool:
        found = name, end.topic_type, str(end.topic_type_hash), node_name(end)
        is_new = found not in self._reported
        self._reported.add(found)
        return is_new


def type_name(message: type) -> str:
    """Name of a message type as the graph has it, such as `std_msgs/msg/Float64`."""
    return f'{message.__module__.partition(".")[0]}/msg/{message.__name__}'
