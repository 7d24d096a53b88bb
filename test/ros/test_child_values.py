# SPDX-License-Identifier: Apache-2.0
"""What is given to the nodes that are started arrives as it was, whatever it looks like."""

from argparse import Namespace

import pytest
import rclpy
from ros_client import ros_client

from comply_ros.dashboard.teaching_demo import world_and_learner
from comply_ros.nodes.node_processes import parameter_arguments, yaml_for_rcl
from comply_ros.nodes.topics import WORLD

VALUES = [  # texts that look like something else, and what they look like
    'maze #2.yaml', '1e3', '1E3', '.5e3', '010', '0x1f', '0o17', '1_000', '12:30:45', '-5',
    '.inf', 'true', 'no', 'null', '~', '', ' ', 'a: b', '- a', '[a]', '{a}', '"', "'",
    'it\'s "so"', '\\',
    'a\\nb', 'a\nb', '\ttab ', '!!int 3', '&a', '*a', '%', '@', '`', '|', '>', '? a', '$HOME',
    '$(x)', '~/x', 'map:=maze', '--ros-args', 'küche', '迷路', '🤖', ' leading',
    'trailing ', 'a' * 3000,
    1, 1000, 0.5, 1e-05, 1e300, True, False, ['a #b', '1e3', 'true']]
ROWS = ('..G',)
MAP = """{intended: 0.9, step_limit: 40, rewards: {step: -1, goal: 9}, starts: anywhere,
rows: [..G]}"""


def values_in_node(values, *arguments):
    """Return the values of the parameters `p0`, `p1`, ... of a node with these ROS arguments."""
    context = rclpy.Context()
    rclpy.init(args=['node', '--ros-args', *arguments], context=context)
    try:
        node = rclpy.create_node('node', context=context)
        return [node.declare_parameter(f'p{k}', [''] if type(value) is list else type(value)()
                                       ).value for k, value in enumerate(values)]
    finally:
        rclpy.try_shutdown(context=context)


def by_name(values):
    return {f'p{k}': value for k, value in enumerate(values)}


def test_values_on_the_command_line_arrive_as_they_were(domain):
    assert values_in_node(VALUES, *parameter_arguments(by_name(VALUES))) == VALUES


def test_values_in_a_parameter_file_arrive_as_they_were(domain, tmp_path):
    path = tmp_path / 'parameters.yaml'
    path.write_text(yaml_for_rcl({'/**/node': {'ros__parameters': by_name(VALUES)}}))
    assert values_in_node(VALUES, '--params-file', str(path)) == VALUES


@pytest.mark.parametrize('name', ['maze #2.yaml', '1e3', "it's a: map.yaml"])
@pytest.mark.long
def test_the_demo_teaches_in_the_map_of_the_name_that_was_given(
        domain, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(MAP)
    with world_and_learner(
            Namespace(map=name, method='sarsa', namespace=''), tmp_path), ros_client() as client:
        client.subscribe(WORLD)
        worlds = client.received[WORLD.name]
        client.until(lambda: worlds, 'world')
        assert tuple(worlds[0].grid.rows) == ROWS
