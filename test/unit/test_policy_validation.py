# SPDX-License-Identifier: Apache-2.0
"""Whether a policy fits a world: rule, value and state are named where it does not."""

from array import array

import numpy as np
import pytest
from tiny_tables import hall, machine
from tiny_worlds import grid

from comply_ros.mentor.policy_validation import PolicyError, validate_advice, validate_policy
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP
from comply_ros.world.mdp import World

# States 0 to 4 are the lower row. No way leads from state 9 to the goal, though its cell is free.
WORLD = World(grid('..G#.', '.#.##'))
GOOD = [UP, -1, UP, -1, -1, RIGHT, RIGHT, -1, -1, -1]
IN_GOAL, IN_OBSTACLE, IN_POCKET = 7, 1, 9


def changed(state, action):
    """Return a policy that fits but for one action."""
    policy = np.array(GOOD)
    policy[state] = action
    return policy


@pytest.mark.parametrize('policy', [
    GOOD, tuple(GOOD), array('b', GOOD), np.array(GOOD, dtype=np.int8), np.array(GOOD), 10 * [-1]])
def test_a_policy_that_fits_comes_back_as_a_copy_in_int8(policy):
    found = validate_policy(policy, WORLD)
    assert found.dtype == np.int8 and found.tolist() == list(policy)
    assert found is not policy and not np.may_share_memory(found, np.asarray(policy))


@pytest.mark.parametrize('state, action, message', [
    (0, 4, 'an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, got 4 in state '
     '0 (row 2, column 1)'),
    (6, -2, 'an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, got -2 in '
     'state 6 (row 1, column 2)'),
    (9, 300, 'an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, got 300 in '
     'state 9 (row 1, column 5)'),
    (5, UP, "an action must not leave the grid, got '^' in state 5 (row 1, column 1)"),
    (0, LEFT, "an action must not leave the grid, got '<' in state 0 (row 2, column 1)")])
@pytest.mark.parametrize('clear_not_free', [False, True])
def test_an_action_that_does_not_fit_is_named_with_its_state(
        state, action, message, clear_not_free):
    with pytest.raises(PolicyError) as error:
        validate_policy(changed(state, action), WORLD, clear_not_free=clear_not_free)
    assert str(error.value) == message
    with pytest.raises(PolicyError) as error:
        validate_advice(state, action, WORLD)
    assert str(error.value) == message


@pytest.mark.parametrize('state, place', [
    (IN_GOAL, 'row 1, column 3'), (IN_OBSTACLE, 'row 2, column 2'),
    (IN_POCKET, 'row 1, column 5')])
def test_advice_where_nobody_can_act_is_an_error_or_cleared(state, place):
    policy = changed(state, DOWN)
    with pytest.raises(PolicyError) as error:
        validate_policy(policy, WORLD)
    assert str(error.value) == ('a policy has advice in free cells only, from which a goal can be '
                                f"reached, got 'v' in state {state} ({place})")
    with pytest.raises(PolicyError, match='a policy has advice in free cells only'):
        validate_advice(state, DOWN, WORLD)
    assert validate_policy(policy, WORLD, clear_not_free=True).tolist() == GOOD
    assert policy[state] == DOWN


def test_of_many_actions_that_do_not_fit_the_first_is_named():
    policy = np.array(GOOD)
    policy[[2, 5, 6]] = 7, UP, -3
    with pytest.raises(PolicyError, match='got 7 in state 2 '):
        validate_policy(policy, WORLD)


@pytest.mark.parametrize('policy, message', [
    (GOOD[:-1], r'a policy must have the 10 states of the map, got an array of shape \(9,\)'),
    ((), r'a policy must have the 10 states of the map, got an array of shape \(0,\)'),
    ([GOOD], r'a policy must have the 10 states of the map, got an array of shape \(1, 10\)'),
    (3, r'a policy must have the 10 states of the map, got an array of shape \(\)'),
    ([[1], [1, 2]], 'a policy must be one action for each state, got a nested one'),
    ([float(action) for action in GOOD], 'a policy must be of whole numbers, got float64'),
    (10 * [True], 'a policy must be of whole numbers, got bool'),
    (10 * [2 ** 80], 'a policy must be of whole numbers, got object'),
    (np.array(GOOD).astype(np.uint8), 'got 255 in state 1')])
def test_what_is_not_an_action_for_each_state_is_rejected(policy, message):
    with pytest.raises(PolicyError, match=message):
        validate_policy(policy, WORLD)


@pytest.mark.parametrize('state', [-1, 10, 0.0, True, None])
def test_advice_in_a_state_that_does_not_exist_is_rejected(state):
    with pytest.raises(PolicyError) as error:
        validate_advice(state, UP, WORLD)
    assert str(error.value) == f'a state must lie in [0, 9], got {state!r}'


@pytest.mark.parametrize('action', [1.0, True, None, '>', 2 ** 80])
def test_advice_that_is_no_action_is_rejected(action):
    with pytest.raises(PolicyError) as error:
        validate_advice(0, action, WORLD)
    assert f'got {action!r} in state 0 (row 2, column 1)' in str(error.value)


def test_no_advice_fits_everywhere():
    for state in range(10):
        validate_advice(state, -1, WORLD)


@pytest.mark.parametrize('state, action, message', [
    (0, 3, 'an action must be 0 run, 1 stop, 2 repair, or -1 for no advice, got 3 in state 0'),
    (0, 2, "an action must be one that the state has, got 'repair' in state 0"),
    (2, 0, 'a policy has advice only in states in which an episode can go on, got '
     "'run' in state 2"),
    (3, 0, 'a state must lie in [0, 2], got 3')])
def test_without_a_grid_messages_name_states_and_actions(state, action, message):
    with pytest.raises(PolicyError) as error:
        validate_advice(state, action, World(machine()))
    assert str(error.value) == message


def test_of_many_actions_a_message_has_the_range():
    with pytest.raises(PolicyError) as error:
        validate_advice(0, 20, World(hall(3, 20)))
    assert str(error.value) == ('an action must be a number in [0, 19], or -1 for no advice, got '
                                '20 in state 0')


def test_a_policy_of_another_world_without_a_grid_is_rejected():
    with pytest.raises(PolicyError, match='a policy must have the 3 states of the world, got'):
        validate_policy([0, 0], World(machine()))


@pytest.mark.parametrize('n_actions, kind', [(3, np.int8), (200, np.int16)])
def test_a_policy_has_the_type_of_the_actions_of_its_world(n_actions, kind):
    policy = validate_policy([n_actions - 1, 0, -1], World(hall(3, n_actions)))
    assert policy.dtype == kind
    assert policy.tolist() == [n_actions - 1, 0, -1]
