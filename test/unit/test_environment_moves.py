# SPDX-License-Identifier: Apache-2.0
"""Environments of Gymnasium as worlds of the nodes. Skipped where Gymnasium is not installed."""

import json
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.messages import Action, StateReward
from comply_ros.storage.environment_moves import (
    environment_source,
    EnvironmentFault,
    EnvironmentMoves,
    StateNumbers,
)
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import MapError, NO_ACTION
from comply_ros.world.spaces import Spaces
from comply_ros.world.table import Table

gymnasium = pytest.importorskip('gymnasium')
spaces = gymnasium.spaces
RUN = 7


def moves_of(name, seed=0, **options):
    """Return the moves of an environment, and its source."""
    env = gymnasium.make(name)
    numbers = StateNumbers(env.observation_space, **options)
    source = environment_source(env, numbers)
    return EnvironmentMoves(env, name, source, numbers, seed), source


def world_of(name, seed=0, **options):
    moves, source = moves_of(name, seed, **options)
    return GridWorld(source, name, RUN, seed, moves=moves)


def played(world, steps, seed=3):
    """Return the observations of a world that random actions move, without the learner."""
    rng, seen = np.random.default_rng(seed), [world.observation]
    while len(seen) < steps:
        last = seen[-1]
        over = last.terminated or last.truncated
        action = NO_ACTION if over else int(rng.integers(3))
        outputs = world.on_action(Action(RUN, last.episode, last.step, action, False, 0.0, 9))
        seen.append(next(each for each in outputs if isinstance(each, StateReward)))
    return seen


@pytest.mark.parametrize('space, observation, count, number', [
    (spaces.Discrete(5), 4, 5, 4),
    (spaces.Discrete(5, start=10), np.int64(12), 5, 2),
    (spaces.MultiDiscrete([3, 4]), np.array([2, 1]), 12, 9),  # 2 * 4 + 1
    (spaces.Tuple((spaces.Discrete(32), spaces.Discrete(11), spaces.Discrete(2))),
     (14, 10, 0), 704, 14 * 22 + 10 * 2),
    (spaces.Box(0.0, 1.0, (2,)), np.array([0.999, 0.5]), 100, 95),  # intervals 9 and 5 of 10
    (spaces.Box(0.0, 1.0, (2,)), np.array([1.0, -0.1]), 100, 90)])  # values beyond are at the end
def test_an_observation_is_a_state(space, observation, count, number):
    numbers = StateNumbers(space, bins=[10])
    assert (numbers.count, numbers.number(observation)) == (count, number)


def test_each_dimension_of_a_box_has_its_intervals_and_limits():
    numbers = StateNumbers(spaces.Box(-np.inf, np.inf, (2,)), [4, 2], [(-2.0, 2.0), (0.0, 1.0)])
    assert numbers.count == 8
    assert numbers.number(np.array([0.5, 0.7])) == 2 * 2 + 1


@pytest.mark.parametrize('space, options, message', [
    (spaces.Box(-np.inf, np.inf, (1,)), {}, 'the observation space needs finite limits with the '
     'lower one first, got -inf to inf in dimension 0: give limits'),
    (spaces.Box(0.0, 1.0, (2,)), {'limits': [(1.0, 0.0), (0.0, 1.0)]}, 'the observation space '
     'needs finite limits with the lower one first, got 1 to 0 in dimension 0: give limits'),
    (spaces.Box(0.0, 1.0, (2,)), {'bins': [4, 4, 4]}, 'bins must have one element for each of the '
     '2 dimensions of the observation space, got 3'),
    (spaces.Box(0.0, 1.0, (2,)), {'limits': [(0.0, 1.0)]}, 'limits must have one element for each '
     'of the 2 dimensions of the observation space, got 1'),
    (spaces.Box(0.0, 1.0, (2,)), {'bins': [0]}, 'bins must be at least 1, got 0'),
    (spaces.Text(4), {}, 'the observation space must be Discrete, MultiDiscrete, Box or a Tuple '
     'of such spaces, got Text(')])
def test_observations_that_cannot_be_states_are_rejected(space, options, message):
    with pytest.raises(MapError) as error:
        StateNumbers(space, **options)
    assert str(error.value).startswith(message)


def test_a_world_without_a_table_has_no_model():
    _, source = moves_of('MountainCar-v0', bins=[40])
    assert source == Spaces(1600, ('0', '1', '2'), 200)


def test_actions_that_are_not_discrete_are_rejected():
    with pytest.raises(MapError, match=r'the action space must be Discrete, got Box\('):
        moves_of('MountainCarContinuous-v0')


def test_the_environment_moves_as_its_table_says():
    _, source = moves_of('Taxi-v4')
    assert source == read_map('gym:Taxi-v4', 'report')
    seen = played(world_of('Taxi-v4'), 3000)
    for before, after in zip(seen, seen[1:]):
        if after.step:
            assert source.successor[source.first[6 * before.state]:
                                    source.first[6 * before.state + 6]].tolist().count(after.state)
            assert after.terminated == source.terminal[after.state]


def test_an_end_in_a_state_where_others_go_on_has_a_state_of_its_own(tmp_path, monkeypatch):
    class Door(gymnasium.Env):  # action 1 ends the episode where action 0 goes on
        observation_space, action_space = spaces.Discrete(1), spaces.Discrete(2)
        initial_state_distrib = [1.0]
        P = {0: {0: [(1.0, 0, 0.0, False)], 1: [(1.0, 0, 1.0, True)]}}

        def reset(self, *, seed=None, options=None):
            return 0, {}

        def step(self, action):
            return 0, float(action), bool(action), False, {}
    monkeypatch.setitem(gymnasium.registry, 'Door-v0', gymnasium.envs.registration.EnvSpec(
        'Door-v0', Door, max_episode_steps=5))
    moves, source = moves_of('Door-v0')
    assert type(source) is Table and source.n_states == 2
    assert moves.start(1) == 0
    assert moves.move(0, 0, 0) == (0.0, 0, False, False)
    assert moves.move(1, 0, 1) == (1.0, 1, True, False)


def test_an_episode_is_cut_off_where_the_environment_says_so():
    seen = played(world_of('MountainCar-v0', bins=[40]), 202)
    assert [each.truncated for each in seen[:202]].index(True) == 200
    assert seen[201].step == 0 and seen[201].episode == 2


def test_the_same_seed_gives_the_same_run_and_another_seed_another():
    name = 'CliffWalking-v1'
    assert played(world_of('FrozenLake-v1', 1), 200) == played(world_of('FrozenLake-v1', 1), 200)
    assert played(world_of('FrozenLake-v1', 1), 200) != played(world_of('FrozenLake-v1', 2), 200)
    assert played(world_of(name), 50)[0].state == 36


@pytest.mark.parametrize('kill', [1, 57, 130])
def test_a_killed_world_comes_back_by_repeating_one_episode(kill):
    whole = played(world_of('FrozenLake-v1', 5), 200)
    killed = world_of('FrozenLake-v1', 5)
    played(killed, kill)
    values, arrays = killed.state_dict()
    again = world_of('FrozenLake-v1', 5)
    again.load_state_dict(json.loads(json.dumps(values)), arrays, [])
    assert again.observation == whole[kill - 1]
    rng = np.random.default_rng(3)
    for each in whole[:kill - 1]:  # as many random numbers as were used before
        if not (each.terminated or each.truncated):
            rng.integers(3)
    seen = [again.observation]
    while len(seen) < 200 - kill:
        last = seen[-1]
        over = last.terminated or last.truncated
        action = NO_ACTION if over else int(rng.integers(3))
        outputs = again.on_action(Action(RUN, last.episode, last.step, action, False, 0.0, 9))
        seen.append(next(each for each in outputs if isinstance(each, StateReward)))
    assert seen == whole[kill - 1:kill - 1 + len(seen)]


def test_an_environment_that_raises_is_named_with_the_moment():
    class Broken(gymnasium.Env):
        observation_space, action_space = spaces.Discrete(3), spaces.Discrete(1)

        def reset(self, *, seed=None, options=None):
            return 0, {}

        def step(self, action):
            raise ZeroDivisionError('the motor\nis off')
    numbers = StateNumbers(Broken.observation_space)
    moves = EnvironmentMoves(Broken(), 'Broken-v0', Spaces(3, ('0',), 10), numbers, 0)
    moves.start(4)
    with pytest.raises(EnvironmentFault) as error:
        moves.move(0, 0, 0)
    assert str(error.value) == ("environment 'Broken-v0' raised ZeroDivisionError in episode 4, "
                                'step 1: the motor is off')


@pytest.mark.parametrize('name, mean', [('swing', -120.0), ('look', -105.0), ('right', -200.0)])
def test_the_mentors_of_mountain_car_earn_what_their_page_says(name, mean):
    pytest.importorskip('comply_msgs')
    mentors = run_path(str(Path(__file__).parents[2] / 'examples' / 'mountain_car_mentor.py'))
    moves, _ = moves_of('MountainCar-v0', bins=[mentors['BINS']])
    returns = []
    for episode in range(1, 101):
        s, step, over = moves.start(episode), 0, False
        while not over:
            _, s, terminated, truncated = moves.move(
                step, s, mentors['advice'](mentors[name], s))
            step, over = step + 1, terminated or truncated
        returns.append(-step)
    assert np.mean(returns) == pytest.approx(mean, abs=3.0)


class Scripted(gymnasium.Env):
    """An environment that returns what a test says."""

    observation_space, action_space = spaces.Discrete(3), spaces.Discrete(2)

    def __init__(self, observation=0, reward=0.0):
        self._observation, self._reward = observation, reward

    def reset(self, *, seed=None, options=None):
        return 0, {}

    def step(self, action):
        return self._observation, self._reward, False, False, {}


@pytest.mark.parametrize('observation, reward, message', [
    (7, 0.0, 'ValueError in episode 1, step 1: an observation must lie in its space, got 7'),
    (-1, 0.0, 'ValueError in episode 1, step 1: an observation must lie in its space, got -1'),
    (None, 0.0, 'TypeError in episode 1, step 1: '),
    (0, np.nan, 'ValueError in episode 1, step 1: a reward must be a finite number, got nan'),
    (0, None, 'TypeError in episode 1, step 1: ')])
def test_what_an_environment_returns_is_checked(observation, reward, message):
    moves = EnvironmentMoves(Scripted(observation, reward), 'Own-v0', Spaces(3, ('0', '1'), 10),
                             StateNumbers(Scripted.observation_space), 0)
    moves.start(1)
    with pytest.raises(EnvironmentFault) as error:
        moves.move(0, 0, 1)
    assert str(error.value).startswith(f"environment 'Own-v0' raised {message}")


def test_no_number_is_no_state_of_a_box():
    numbers = StateNumbers(spaces.Box(0.0, 1.0, (2,)), [4])
    assert numbers.number(np.array([0.5, np.nan])) < 0


def test_a_space_of_too_many_states_is_rejected():
    with pytest.raises(MapError, match=r'the observation space must have 1 to 16777216 states, '
                       'got far more: give fewer bins'):
        StateNumbers(spaces.Box(0, 255, (210, 160, 3), np.uint8))


def test_an_environment_that_moves_otherwise_than_its_table_says_so():
    env = gymnasium.make('Taxi-v4', fickle_passenger=True)
    numbers = StateNumbers(env.observation_space)

    def played_by_chance(use_table):
        source = environment_source(env, numbers, use_table)
        moves, rng = EnvironmentMoves(env, 'Taxi-v4', source, numbers, 0), np.random.default_rng(1)
        for episode in range(1, 60):
            s, step, over = moves.start(episode), 0, False
            while not over:
                _, s, terminated, truncated = moves.move(step, s, int(rng.integers(6)))
                step, over = step + 1, terminated or truncated
    with pytest.raises(EnvironmentFault, match='which its table P does not have: set use_table to '
                       'false'):
        played_by_chance(True)
    played_by_chance(False)


def test_our_own_maps_keep_their_step_limit_as_environments():
    _, source = moves_of('comply_ros.environments:comply_ros/BarGrid-v0')
    assert source.step_limit == read_map('bar_grid', 'published').step_limit


def test_a_table_that_is_no_map_is_not_used(monkeypatch):
    class Uneven(Scripted):
        initial_state_distrib, P = [0.75, 0.25, 0.0], {}
    numbers = StateNumbers(Uneven.observation_space)
    assert environment_source(Uneven(), numbers) == Spaces(3, ('0', '1'), 30)
