# SPDX-License-Identifier: Apache-2.0
"""Which nodes have a row on the page."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import pytest
import rclpy
from ros_client import ros_client

from comply_ros.dashboard.dashboard_node import DashboardNode, MAX_OTHER_NODES
from comply_ros.nodes.topics import WORLD


@pytest.fixture
def dashboard(domain):
    """Give the node of a page, in the default context."""
    rclpy.init()
    node = DashboardNode()
    yield node
    node.close()
    node.destroy_node()
    rclpy.shutdown()


def status(name):
    return DiagnosticStatus(level=DiagnosticStatus.OK, name=name, message='runs ' * 1000)


def test_only_nodes_of_this_lesson_have_a_row_and_not_too_many(dashboard):
    with ros_client() as client:
        publisher = client.create_publisher(DiagnosticArray, '/diagnostics', 10)
        ours = [rclpy.create_node(f'world_{number}', context=client.context)
                for number in range(MAX_OTHER_NODES + 5)]
        for node in ours:
            node.create_publisher(WORLD.message, WORLD.name, WORLD.qos)
        crowd = [status(f'stranger_{number}') for number in range(300)]

        def shown():
            publisher.publish(DiagnosticArray(status=[
                *crowd, *(status(node.get_name()) for node in ours), status('learner')]))
            dashboard.update()
            return dashboard.page_state.nodes
        client.until(lambda: len(shown()) == MAX_OTHER_NODES + 1, 'rows')
        nodes = shown()
        assert not [name for name in nodes if name.startswith('stranger')]
        assert 'learner' in nodes and all(len(each.message) <= 200 for each in nodes.values())
        for node in ours:
            node.destroy_node()
