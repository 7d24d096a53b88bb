# SPDX-License-Identifier: Apache-2.0
"""The parameters of a lesson's world: the environment of `gym:NAME` is the same in the node."""

from types import SimpleNamespace

from comply_ros.nodes.gym_world import read_arguments
from comply_ros.nodes.lesson_parameters import world_parameters
from comply_ros.storage.gymnasium_world import read_limits
from comply_ros.world.state_action_spaces import Spaces


def test_the_node_reads_what_the_name_of_the_map_says():
    name = 'gym:Sign-v0?text=%F0%9F%98%80&step=1e-5&wide=true&bins=4,5&limits=-1e-9,0.1;0,1'
    found = world_parameters(SimpleNamespace(
        source=Spaces(20, ('0', '1'), 9), map_name=name, profile='published'))
    assert read_arguments(found['env_args']) == {'text': '\U0001f600', 'step': 1e-5, 'wide': True}
    assert (found['env'], found['bins'], found['use_table']) == ('Sign-v0', [4, 5], True)
    assert read_limits(found['limits']) == ((-1e-9, 0.1), (0.0, 1.0))
