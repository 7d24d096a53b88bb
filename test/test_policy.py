# SPDX-License-Identifier: Apache-2.0
"""Policies as text."""

import pytest
from worlds import grid

from comply_ros.core.policy import format_policy, parse_policy, PolicyError
from comply_ros.core.world import World

WORLD = World(grid('..G', '.#.'))


def test_a_policy_is_read_and_written_in_the_shape_of_the_map():
    policy = parse_policy('>>G\n^#.\n', WORLD)
    assert policy.tolist() == [3, -1, -1, 1, 1, -1]
    assert format_policy(policy, WORLD) == '>>G\n^#.\n'


@pytest.mark.parametrize('text, message', [
    ('>>G\n', 'a policy must have the shape of the map, 3 x 2 cells, got 3 x 1'),
    ('>>G\n^#', 'a policy must have the shape of the map, 3 x 2 cells, got 2 or 3 x 2'),
    ('', 'a policy must have the shape of the map, 3 x 2 cells, got 0 x 0'),
    ('>>G\n<#.', "an action must not leave the grid, got '<' at (0, 0)"),
    ('>?G\n^#.', "a policy is written in <>v^.#G, got '?' at (1, 1)"),
    ('>>G\n^>.', "a policy has advice in free cells only, got '>' at (1, 0), which is '#' in "
     'the map'),
    ('>#G\n^#.', "a policy has advice in free cells only, got '#' at (1, 1), which is '.' in "
     'the map'),
])
def test_a_policy_that_does_not_fit_is_refused(text, message):
    with pytest.raises(PolicyError) as error:
        parse_policy(text, WORLD)
    assert str(error.value) == message
