# SPDX-License-Identifier: Apache-2.0
"""The worlds of textbooks that come with the package: their optima, without Gymnasium."""

import numpy as np
import pytest
from table_planning import action_values, from_starts, optimal_values, outcomes, policy_values

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.storage.map_files import parse_map, read_map
from comply_ros.storage.map_name import map_names
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import expected_return, policy_probabilities
from comply_ros.world.transition_table import Table

# What the tables of Gymnasium 1.4 give: FrozenLake-v1, CliffWalking-v1 and Taxi-v4.
GYMNASIUM = {'frozen_lake': 0.8235, 'frozen_lake_8x8': 1.0, 'cliff_walking': -13.0, 'taxi': 7.93}
WITHIN_THE_LIMIT = {'frozen_lake': 0.7402, 'frozen_lake_8x8': 0.8857, 'cliff_walking': -13.0,
                    'taxi': 7.93}


def best_within_the_limit(table):
    """Return what the policy that is best without a limit has within the limit."""
    policy = action_values(table, optimal_values(table)).argmax(axis=1)
    return from_starts(table, policy_values(table, policy, table.step_limit))


@pytest.mark.parametrize('name', GYMNASIUM)
def test_the_optimum_is_that_of_gymnasium(name):
    table = read_map(name, 'report')
    assert from_starts(table, optimal_values(table)) == pytest.approx(GYMNASIUM[name], abs=5e-5)
    assert best_within_the_limit(table) == pytest.approx(WITHIN_THE_LIMIT[name], abs=5e-5)


@pytest.mark.parametrize('name', ['frozen_lake', 'frozen_lake_8x8'])
def test_ice_that_is_not_slippery_is_crossed_for_certain(name):
    table = parse_map(f'extends: {name}\nintended: 1\n', 'report')
    assert set(table.probability) == {1.0}
    assert from_starts(table, optimal_values(table)) == 1.0


def test_the_shortest_way_through_the_wind_has_15_steps():
    table = read_map('windy', 'report')
    assert from_starts(table, optimal_values(table)) == -15.0


def test_with_king_s_moves_the_way_through_the_wind_has_7_steps():  # exercise 6.9
    table = parse_map('extends: windy\nmoves: 8\n', 'report')
    assert from_starts(table, optimal_values(table)) == -7.0


def test_the_stochastic_wind_varies_by_one_a_third_of_the_time_each():
    table = read_map('stochastic_windy', 'report')
    assert outcomes(table, 3 * 10 + 4, 'right') == pytest.approx(
        {(35, -1.0): 1 / 3, (45, -1.0): 1 / 3, (55, -1.0): 1 / 3})
    assert outcomes(table, 3 * 10, 'right') == {(31, -1.0): 1.0}
    assert from_starts(table, optimal_values(table)) == pytest.approx(-10.9646, abs=5e-5)


def test_the_four_rooms_have_four_hallways():
    table = read_map('four_rooms', 'report')
    assert (len(table.starts), table.cells.count('#')) == (103, 17)
    assert outcomes(table, 0, 'up') == pytest.approx(
        {(11, 0.0): 2 / 3, (0, 0.0): 2 / 9, (1, 0.0): 1 / 9})
    assert table.terminal.nonzero()[0].tolist() == [4 * 11 + 8]


def test_the_race_track_is_driven_in_twelve_steps():
    table = read_map('racetrack', 'report')
    assert len(table.starts) == 6
    assert from_starts(table, optimal_values(table)) == pytest.approx(-11.6946, abs=5e-5)


def test_without_noise_the_race_track_is_driven_in_the_fewest_steps():
    table = parse_map('extends: racetrack\nnoise: 0\n', 'report')
    best = optimal_values(table)[list(table.starts)].max()
    assert best == -fewest_steps(table) == -10.0


def fewest_steps(table):
    """Return the fewest steps from a start to an end, by breadth-first search."""
    border, seen, steps = set(table.starts), set(table.starts), 0
    while not any(table.terminal[s] for s in border):
        ahead = {int(s2) for s in border for s2 in table.successor[
            table.first[s * len(table.actions)]:table.first[(s + 1) * len(table.actions)]]}
        border, steps = ahead - seen, steps + 1
        seen |= border
    return steps


@pytest.mark.parametrize('name', [name for name in map_names()
                                  if isinstance(read_map(name, 'report'), Table)])
def test_every_shipped_world_has_places_and_cells_to_draw(name):
    table = read_map(name, 'report')
    assert table.positions.shape == (len(table.terminal), 2)
    assert len(table.cells) == len(table.terminal)


def test_on_the_cliff_q_learning_learns_the_edge_and_sarsa_the_safe_way():
    """Sutton and Barto (2018), example 6.6: while learning, the edge earns less."""
    world, nobody = World(read_map('cliff_walking', 'published')), np.full(48, NO_ACTION)

    def learned(method, seed):
        """Return the mean return of the last 300 episodes, and that of the learned policy."""
        config = find_method(method, 'published')
        training = Training(world, nobody, config, seed)
        returns = [training.iterate().mean_return for _ in range(config.iterations)]
        policy = policy_probabilities(world, training.learned().policy)
        return np.mean(returns[-60:]), expected_return(world, policy)
    safe, edge = (np.array([learned(method, seed) for seed in range(5)])
                  for method in ('sarsa_epsilon', 'q_learning_epsilon'))
    assert (edge[:, 1] == -13.0).all()  # the shortest way
    assert np.median(safe[:, 1]) == -17.0  # one row away from the edge, and more
    assert safe[:, 0].mean() > -35.0 > edge[:, 0].mean()  # -25 and -50 in the book's figure
