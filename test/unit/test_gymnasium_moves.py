# SPDX-License-Identifier: Apache-2.0
"""Environments of Gymnasium as worlds of the nodes. Skipped where Gymnasium is not installed."""

import json
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

from comply_ros.protocol.messages import Action, StateReward
from comply_ros.protocol.world import WorldMachine
from comply_ros.storage.gymnasium_moves import EnvironmentFault, EnvironmentMoves, PictureError
from comply_ros.storage.gymnasium_world import environment_source
from comply_ros.storage.map_files import read_map
from comply_ros.storage.state_numbers import StateNumbers
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.state_action_spaces import Spaces
from comply_ros.world.transition_table import Table

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
    return WorldMachine(source, name, RUN, seed, moves=moves)


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

    def __init__(self, observation=0, reward=0.0, ends=(False, False), picture=None):
        self._observation, self._reward, self._ends = observation, reward, ends
        self._picture, self.render_mode = picture, 'rgb_array'

    def reset(self, *, seed=None, options=None):
        return 0, {}

    def step(self, action):
        return self._observation, self._reward, *self._ends, {}

    def render(self):
        if isinstance(self._picture, Exception):
            raise self._picture
        return self._picture


def moves_of_scripted(**script):
    """Return the moves of such an environment, whose episodes have ten steps at most."""
    return EnvironmentMoves(Scripted(**script), 'Own-v0', Spaces(3, ('0', '1'), 10),
                            StateNumbers(Scripted.observation_space), 0)


@pytest.mark.parametrize('observation, reward, message', [
    (7, 0.0, 'ValueError in episode 1, step 1: an observation must lie in its space, got 7'),
    (-1, 0.0, 'ValueError in episode 1, step 1: an observation must lie in its space, got -1'),
    (None, 0.0, 'TypeError in episode 1, step 1: '),
    (0, np.nan, 'ValueError in episode 1, step 1: a reward must be a finite number, got nan'),
    (0, None, 'TypeError in episode 1, step 1: ')])
def test_what_an_environment_returns_is_checked(observation, reward, message):
    moves = moves_of_scripted(observation=observation, reward=reward)
    moves.start(1)
    with pytest.raises(EnvironmentFault) as error:
        moves.move(0, 0, 1)
    assert str(error.value).startswith(f"environment 'Own-v0' raised {message}")


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




@pytest.mark.parametrize('step, ends, expected', [
    (0, (True, False), (True, False)), (0, (False, True), (False, True)),
    (0, (True, True), (True, False)),  # an end counts more than a limit: no value follows it
    (9, (False, False), (False, True)), (9, (True, True), (True, False))])
def test_an_episode_has_one_of_both_ends(step, ends, expected):
    moves = moves_of_scripted(ends=ends)
    moves.start(1)
    assert moves.move(step, 0, 0)[2:] == expected


def test_an_environment_that_raises_in_the_middle_of_an_episode_keeps_what_was_before():
    class Worn(Scripted):
        def step(self, action):
            if action == 1:
                raise OSError('the cable is loose')
            return super().step(action)
    numbers = StateNumbers(Worn.observation_space)
    source = Spaces(3, ('0', '1'), 10)
    world = WorldMachine(source, 'Worn-v0', RUN, 0,
                      moves=EnvironmentMoves(Worn(2), 'Worn-v0', source, numbers, 0))
    for step in range(2):
        world.on_action(Action(RUN, 1, step, 0, False, 0.0, 9))
    before = world.observation
    with pytest.raises(EnvironmentFault) as error:
        world.on_action(Action(RUN, 1, 2, 1, False, 0.0, 9))
    assert str(error.value) == ("environment 'Worn-v0' raised OSError in episode 1, step 3: the "
                                'cable is loose')
    assert world.observation == before and (before.step, before.state) == (2, 2)


def test_a_picture_is_that_of_the_environment():
    picture = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    moves = moves_of_scripted(picture=picture)
    moves.start(1)
    assert moves.gives_pictures
    assert (moves.picture() == picture).all()


@pytest.mark.parametrize('picture, message', [
    (RuntimeError('no display'), "environment 'Own-v0' gives no pictures: no display"),
    (None, "a picture of environment 'Own-v0' must be of uint8 and the shape (height, width, 3), "
     'got object of shape ()'),
    (np.zeros((2, 2)), "a picture of environment 'Own-v0' must be of uint8 and the shape (height, "
     'width, 3), got float64 of shape (2, 2)')])
def test_what_is_no_picture_is_named(picture, message):
    moves = moves_of_scripted(picture=picture)
    moves.start(1)
    with pytest.raises(PictureError) as error:
        moves.picture()
    assert str(error.value) == message
