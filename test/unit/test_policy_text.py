# SPDX-License-Identifier: Apache-2.0
"""Policies as text."""

import pytest
from tiny_tables import hall, machine
from tiny_worlds import grid

from comply_ros.mentor.policy_text import format_policy, parse_policy
from comply_ros.mentor.policy_validation import PolicyError
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


MACHINE = World(machine())


def test_a_policy_without_a_grid_has_a_line_for_each_state_with_advice():
    policy = parse_policy('1 repair\n\n 0 run \n', MACHINE)
    assert policy.tolist() == [0, 2, -1]
    assert format_policy(policy, MACHINE) == '0 run\n1 repair\n'
    assert parse_policy('', MACHINE).tolist() == [-1, -1, -1]
    assert parse_policy('2 run', MACHINE).tolist() == [-1, -1, -1]  # there, nobody can act


def test_the_name_of_an_action_may_have_blanks():
    world = World(machine(actions=('run on', 'stop', 'repair')))
    assert format_policy(parse_policy('0 run on', world), world) == '0 run on\n'


@pytest.mark.parametrize('text, message', [
    ('run', "in a world that is no grid, a line of a policy must be a state and the name of an "
     "action, such as '0 run', got 'run' in line 1"),
    ('0\n', "such as '0 run', got '0' in line 1"), ('-1 run', "got '-1 run' in line 1"),
    ('0 run\n3 stop', 'a state must lie in [0, 2], got 3 in line 2'),
    (30 * '9' + ' stop', 'a state must lie in [0, 2], got 99999999999999999999 in line 1'),
    ('0 go', "an action must be one of run, stop, repair, got 'go' in line 1"),
    ('0 run\n0 stop', 'a policy must have one action for each state, got a second one for state '
     '0 in line 2'),
    ('0 repair', "an action must be one that the state has, got 'repair' in state 0")])
def test_a_policy_by_states_that_does_not_fit_is_rejected(text, message):
    with pytest.raises(PolicyError) as error:
        parse_policy(text, MACHINE)
    assert message in str(error.value)


def test_a_message_names_only_the_first_of_many_actions():
    with pytest.raises(PolicyError) as error:
        parse_policy('0 go', World(hall(3, 20)))
    assert str(error.value) == ("an action must be one of 0, 1, 2, 3, 4, 5, 6, 7, ..., got 'go' "
                                'in line 1')
