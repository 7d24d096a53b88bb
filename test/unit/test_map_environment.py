# SPDX-License-Identifier: Apache-2.0
"""The maps as environments of Gymnasium. Skipped where Gymnasium is not installed."""

from importlib import import_module

import numpy as np
import pytest

from comply_ros.storage.map_files import read_map
from comply_ros.storage.map_name import map_names
from comply_ros.world.grid import MapError
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy, optimal_values

gymnasium = pytest.importorskip('gymnasium')
check_env = import_module('gymnasium.utils.env_checker').check_env
environment_name = import_module('comply_ros.environments').environment_name


def make(name='BarGrid', **arguments):
    return gymnasium.make(f'comply_ros/{name}-v0', **arguments)


def play(env, seed, choose):
    """Return the rewards of one episode, and how it ended."""
    state, info = env.reset(seed=seed)
    rewards, terminated, truncated = [], False, False
    while not (terminated or truncated):
        state, reward, terminated, truncated, info = env.step(choose(state, info))
        rewards.append(reward)
    return rewards, terminated


@pytest.mark.filterwarnings('ignore:.*not have a render mode')
@pytest.mark.parametrize('map_name', [name for name in map_names() if name != 'racetrack'])
def test_every_map_is_an_environment_that_gymnasium_accepts(map_name):
    check_env(gymnasium.make(environment_name(map_name)).unwrapped, skip_render_check=True)


def test_following_the_advice_of_an_optimal_mentor_earns_the_optimum():
    env = make('CliffWalking', mentor='optimal')
    rewards, terminated = play(env, 0, lambda state, info: info['advice'])
    assert (sum(rewards), terminated) == (-13.0, True)


def test_returns_have_the_mean_of_the_exact_values():
    world = World(read_map('bar_grid', 'published'))
    policy, env = optimal_policy(world), make()
    returns = [sum(play(env, seed, lambda state, info: policy[state])[0]) for seed in range(300)]
    expected = optimal_values(world)[world.starts].mean()
    assert np.mean(returns) == pytest.approx(expected, abs=4 * np.std(returns) / 300 ** 0.5)


def test_the_same_seed_gives_the_same_episode_and_another_seed_another():
    def walk(seed):
        rng = np.random.default_rng(7)
        return play(make(), seed, lambda state, info: rng.choice(
            np.flatnonzero(info['action_mask'])))
    assert walk(3) == walk(3)
    assert walk(3) != walk(4)


def test_an_action_that_the_state_lacks_leaves_it_and_costs_a_step():
    env = make()
    state, info = env.reset(seed=0)
    missing = int(np.flatnonzero(info['action_mask'] == 0)[0])  # it starts at the edge
    after, reward, terminated, truncated, _ = env.step(missing)
    assert (after, reward, terminated, truncated) == (state, -0.1, False, False)


def test_an_episode_is_cut_at_the_step_limit_of_the_map():
    env = make()
    limit = World(read_map('bar_grid', 'published')).step_limit
    rewards, terminated = play(env, 0, lambda state, info: int(np.argmin(info['action_mask'])))
    assert (len(rewards), terminated) == (limit, False)


def test_several_environments_step_at_once():
    envs = gymnasium.make_vec('comply_ros/BarGrid-v0', num_envs=3, mentor='noisy:0.3')
    states, info = envs.reset(seed=5)
    for _ in range(20):
        states, rewards, _, _, info = envs.step(info['advice'])
    assert states.shape == rewards.shape == info['advice'].shape == (3,)
    envs.close()


def test_the_robot_is_on_the_picture_in_text():
    env = make(render_mode='ansi')
    env.reset(seed=0)
    text = env.render()
    assert text.count('@') == 1 and len(text.splitlines()) == read_map('bar_grid', 'report').height


def test_mistakes_are_one_sentence():
    env = make().unwrapped
    with pytest.raises(RuntimeError, match='must be reset before its first step'):
        env.step(0)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r'an action must lie in \[0, 3\], got 4'):
        env.step(4)
    with pytest.raises(ValueError, match="render_mode must be ansi or None, got 'human'"):
        make(render_mode='human')
    with pytest.raises(MapError, match="map 'nowhere'"):
        make(map_name='nowhere')
