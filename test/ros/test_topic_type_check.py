# SPDX-License-Identifier: Apache-2.0
"""Publishers and subscribers of another type, and of another version of a type, are named once."""

import pytest
from rclpy.topic_endpoint_info import TopicEndpointInfo, TopicEndpointTypeEnum
from rclpy.type_hash import TypeHash

from comply_ros.nodes import topics
from comply_ros.nodes.topic_type_check import TopicTypeCheck

HERE, OTHER, NONE = (TypeHash(version, bytes([number]) * 32) for version, number in (
    (1, 1), (1, 2), (-1, 0)))
STATE = 'comply_msgs/msg/StateReward'


def end(node, kind=STATE, type_hash=HERE, role=TopicEndpointTypeEnum.PUBLISHER):
    """Return what the graph knows of a publisher or subscriber."""
    return TopicEndpointInfo(node, '/', kind, type_hash, role)


class Graph:
    """A node `learner` in a graph with these publishers, and its own subscriber."""

    def __init__(self, publishers, own_hash=HERE):
        self._publishers = publishers
        self._own = end('learner', STATE, own_hash, TopicEndpointTypeEnum.SUBSCRIPTION)

    def get_fully_qualified_name(self):
        return '/learner'

    def resolve_topic_name(self, name):
        return f'/{name}'

    def count_publishers(self, name):
        return len(self._publishers)

    def get_publishers_info_by_topic(self, name):
        return self._publishers

    def get_subscriptions_info_by_topic(self, name):
        return [self._own]


def problems(graph):
    """Return the sentences of two ticks."""
    check = TopicTypeCheck(graph)
    check.watch(topics.STATE)
    return [*check.tick(), *check.tick()]


def test_a_publisher_of_another_version_of_the_type_is_named_once():
    assert problems(Graph([end('grid_world'), end('old_world', type_hash=OTHER)])) == [
        f'topic /state must have the type {STATE}, but the publisher of /old_world has another '
        'version of it: its messages cannot be read; run nodes of one version of comply_ros']


@pytest.mark.parametrize('publisher, own', [
    (end('grid_world'), HERE), (end('grid_world', type_hash=NONE), HERE),
    (end('grid_world'), NONE)])
def test_a_middleware_that_does_not_tell_the_version_of_a_type_is_no_reason(publisher, own):
    assert problems(Graph([publisher], own)) == []


def test_a_publisher_of_another_type_is_named_once():
    assert problems(Graph([end('radio', 'std_msgs/msg/String', OTHER)])) == [
        f'topic /state must have the type {STATE}, but the publisher of /radio has '
        'std_msgs/msg/String: no messages are exchanged with it']
