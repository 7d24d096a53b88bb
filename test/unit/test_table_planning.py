# SPDX-License-Identifier: Apache-2.0
"""Planning in worlds without a grid, by hand in a small machine and by brute force in others."""

from itertools import product

from hypothesis import given
import numpy as np
import pytest
from tiny_tables import frozen_lake, hall, machine, tables

from comply_ros.world.mdp import World
from comply_ros.world.planning import (
    action_values,
    expected_return,
    optimal_policy,
    optimal_values,
    PlanningError,
    policy_probabilities,
    policy_values,
    ReferenceReturns,
    uniform_probabilities,
)
from comply_ros.world.state_action_spaces import Spaces
from comply_ros.world.transition_table import Table
from examples import examples

RUN, STOP, REPAIR = range(3)
MACHINE = World(machine())


def table_of(*rows, limit=50):
    """Return a table from the outcomes of each state, the last state being terminal."""
    return World(Table.from_transitions(rows, (0,), limit))


def test_action_values_look_one_step_ahead():  # (2.12)
    q = action_values(MACHINE, np.array([4.0, 0.0, 0.0]))
    assert q[0].tolist() == [2 + 0.5 * 4, 0.0, -np.inf]
    assert q[1].tolist() == [0.75 * 1 - 0.25 * 4, 0.0, -5 + 4]
    assert q[2].tolist() == 3 * [-np.inf]
    assert action_values(MACHINE, np.array([4.0, 0.0, 0.0]), 0.5)[0, RUN] == 2 + 0.5 * 0.5 * 4


def test_the_best_is_to_run_the_machine_until_it_is_worn():  # V0 = 2 + V0 / 2
    assert optimal_values(MACHINE) == pytest.approx([4.0, 0.0, 0.0])
    assert optimal_policy(MACHINE).tolist() == [RUN, STOP, -1]


def test_discount_weighs_what_follows():  # V0 = 2 + 0.9 * (V0 + V1) / 2, V1 = 0
    assert optimal_values(MACHINE, 0.9) == pytest.approx([2 / 0.55, 0.0, 0.0])


def test_policy_evaluation_sweeps_once_a_step():  # (2.11)
    runs = policy_probabilities(MACHINE, np.array([RUN, RUN, -1]))
    assert expected_return(World(machine(1)), runs) == 2.0
    assert expected_return(World(machine(2)), runs) == 2 + 0.5 * 2 + 0.5 * -0.25  # 2.875
    one = uniform_probabilities(MACHINE)
    assert policy_values(World(machine(1)), one) == pytest.approx([1.0, -5.25 / 3, 0.0])


@given(tables(most_states=4, most_actions=3))
@examples(60)
def test_optimal_values_are_those_of_the_best_of_all_policies(table):
    world, discounts = World(table), (1.0, 0.9)
    choices = [np.flatnonzero(row).tolist() or [0] for row in table.available]
    for discount in discounts:
        best = np.max([solved(table, policy, discount) for policy in product(*choices)], axis=0)
        best[~world.free] = 0.0
        assert optimal_values(world, discount) == pytest.approx(best, abs=1e-8)
    best = np.max([solved(table, policy, 1.0) for policy in product(*choices)], axis=0)
    found = solved(table, np.maximum(optimal_policy(world), 0), 1.0)
    assert found[world.free] == pytest.approx(best[world.free], abs=1e-7)


def dynamics(table, policy):
    """Return `P[s, s2]` and the expected reward `r[s]` of a policy with an action a state."""
    p, r = np.zeros((table.n_states, table.n_states)), np.zeros(table.n_states)
    for s, a in enumerate(policy):
        pair = s * len(table.actions) + a
        for k in range(table.first[pair], table.first[pair + 1]):
            p[s, table.successor[k]] += table.probability[k]
            r[s] += table.probability[k] * table.reward[k]
    return p, r


def solved(table, policy, discount):
    """Return `v[s]` of a policy by a linear equation: (I - discount P) v = r."""
    p, r = dynamics(table, policy)
    return np.linalg.solve(np.eye(len(r)) - discount * p, r)


@given(tables())
@examples(40)
def test_policy_values_are_those_of_multiplied_matrices(table):
    policy = table.available.argmax(axis=1)
    p, r = dynamics(table, policy)
    expected = np.zeros(table.n_states)
    for _ in range(table.step_limit):
        expected = r + p @ expected
    world = World(table)
    found = policy_values(world, policy_probabilities(world, policy))
    assert found == pytest.approx(expected, abs=1e-9)


def test_of_equally_good_actions_one_that_ends_is_taken():
    world = table_of([[(1.0, 0, 0.0, False)], [(1.0, 1, 0.0, True)]], [[], []])
    assert optimal_values(world).tolist() == [0.0, 0.0]
    assert optimal_policy(world).tolist() == [1, -1]


def test_of_equally_good_ways_the_shortest_is_taken():
    far, near = [(1.0, 1, 0.0, False)], [(1.0, 2, 3.0, True)]
    world = table_of([far, near], [[(1.0, 2, 3.0, True)], []], [[], []])
    assert optimal_policy(world).tolist() == [1, 0, -1]


def test_of_equally_good_actions_one_that_is_certain_to_end_is_taken():
    may = [(0.5, 2, 0.0, True), (0.5, 1, 0.0, False)]  # in state 1 nothing ever happens
    must = [(1.0, 3, 0.0, False)]
    world = table_of([may, must], [[(1.0, 1, 0.0, False)], []], [[], []],
                     [[(1.0, 2, 0.0, True)], []])
    assert optimal_policy(world).tolist() == [1, 0, -1, 0]


def test_where_no_end_is_certain_a_possible_one_is_taken():
    may = [(0.5, 2, 0.0, True), (0.5, 1, 0.0, False)]
    world = table_of([[(1.0, 0, 0.0, False)], may], [[(1.0, 1, 0.0, False)], []], [[], []])
    assert optimal_policy(world).tolist() == [1, 0, -1]


def test_the_optimal_policy_of_a_frozen_lake_arrives():
    world = World(frozen_lake())
    assert optimal_values(world)[0] == pytest.approx(1.0)
    reference = ReferenceReturns(world)
    assert reference.optimal_return == pytest.approx(0.8856539)
    assert 0 < reference.random_return < 0.01


def test_a_long_way_has_a_finite_value():
    world = World(hall(1500, 2))
    assert optimal_values(world)[0] == -1499.0
    assert optimal_policy(world)[:-1].all()


@pytest.mark.parametrize('world, message', [
    (World(machine(repair=-3.0)), 'from state 0 on an episode can earn about 0.33 a step'),
    (table_of([[(1.0, 1, 1.0, False)]], [[(1.0, 0, 0.0, False)]]),  # it earns in every other step
     'from state 0 on an episode can earn about 0.5 a step'),
    (table_of([[(0.5, 2, 0.0, True), (0.5, 1, 0.0, False)]], [[(1.0, 1, -1.0, False)]], [[]]),
     'from state 1 on every episode loses about 1 a step')])
def test_an_optimum_that_is_not_finite_is_rejected_with_a_state(world, message):
    with pytest.raises(PlanningError) as error:
        optimal_values(world)
    assert str(error.value) == f'the best return without discount must be finite, but {message} '\
        'without end: let an action there end the episode, or change a reward'
    assert np.isfinite(optimal_values(world, 0.9)).all()


def test_without_a_model_nothing_is_planned():
    world = World(Spaces(3, ('go', 'wait'), 10))
    for plan in (optimal_values, optimal_policy, ReferenceReturns,
                 lambda world: policy_values(world, uniform_probabilities(world))):
        with pytest.raises(PlanningError, match='and this world has no model: use a mentor from '):
            plan(world)
