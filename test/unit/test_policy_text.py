# SPDX-License-Identifier: Apache-2.0
"""Policies as text."""

import pytest
from tiny_worlds import grid

from comply_ros.mentor.policy import PolicyError
from comply_ros.mentor.policy_text import format_policy, parse_policy
from comply_ros.world.mdp import World

WORLD = World(grid('..G', '.#.'))


def test_a_policy_is_read_and_written_in_the_shape_of_the_map():
    policy = parse_policy('>>G\n^#.\n', WORLD)
    assert policy.tolist() == [3, -1, -1, 1, 1, -1]
    assert format_policy(policy, WORLD) == '>>G\n^#.\n'


def test_advice_in_a_free_cell_from_which_no_goal_can_be_reached_is_left_out():
    world = World(grid('.G#.', '.##.'))
    assert parse_policy('>G#v\n^##<\n', world).tolist() == [3, -1, -1, -1, 1, -1, -1, -1]


@pytest.mark.parametrize('text, message', [
    ('>>G\n', 'a policy must have a row for each of the 2 rows of the map, got 1'),
    ('>>G\n^#', 'a row of a policy must have the 3 cells of the map, got 2 in row 2'),
    ('', 'a policy must have a row for each of the 2 rows of the map, got 0'),
    ('>>G\n<#.', "an action must not leave the grid, got '<' in state 0 (row 2, column 1)"),
    ('>?G\n^#.', "a policy is written in <>v^.#G, got '?' in state 4 (row 1, column 2)"),
    ('>>G\n^>.', "a policy has advice in free cells only, got '>' in state 1 (row 2, column 2), "
     "which is '#' in the map"),
    ('>#G\n^#.', "a policy has advice in free cells only, got '#' in state 4 (row 1, column 2), "
     "which is '.' in the map"),
    ('>>G\n^..', "a policy has advice in free cells only, got '.' in state 1 (row 2, column 2), "
     "which is '#' in the map"),
    ('>>G\n^G.', "a policy has advice in free cells only, got 'G' in state 1 (row 2, column 2), "
     "which is '#' in the map"),
])
def test_a_policy_that_does_not_fit_is_rejected(text, message):
    with pytest.raises(PolicyError) as error:
        parse_policy(text, WORLD)
    assert str(error.value) == message
