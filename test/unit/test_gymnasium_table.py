# SPDX-License-Identifier: Apache-2.0
"""The worlds that Gymnasium has too: the same tables. Skipped where Gymnasium is not installed."""

import pytest
from table_planning import outcomes

from comply_ros.storage.gymnasium_table import table_of_environment
from comply_ros.storage.map_files import parse_map, read_map
from comply_ros.world.grid import MapError
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_values

gymnasium = pytest.importorskip('gymnasium')

FROZEN_LAKE = ('left', 'down', 'right', 'up')
CLIFF_WALKING = ('up', 'right', 'down', 'left')
TAXI = ('down', 'up', 'right', 'left', 'pick_up', 'drop_off')


def cell(width, height):
    """Return the function from a state of Gymnasium, by rows from the top, to ours."""
    return lambda s: (height - 1 - s // width) * width + s % width


def taxi_state(s):
    """Return our state of one of Gymnasium's taxi: the cell is what differs."""
    return cell(5, 5)(s // 20) * 20 + s % 20


def merged(transitions, state_of):
    """Return {(successor, reward): probability} of Gymnasium's outcomes of an action."""
    found = {}
    for probability, s2, reward, _ in transitions:
        key = state_of(int(s2)), float(reward)
        found[key] = found.get(key, 0.0) + probability
    return found


def reachable(table, starts):
    """Return Gymnasium's states that can be reached, and whether the episode goes on there."""
    ended, border, seen = set(), list(starts), set(starts)
    while border:
        for transitions in table[border.pop()].values():
            for _, s2, _, terminated in transitions:
                if terminated:
                    ended.add(int(s2))
                elif int(s2) not in seen:
                    seen.add(int(s2))
                    border.append(int(s2))
    assert not seen & ended
    return seen, ended


def check_same(table, name, actions, state_of, **options):
    """Fail unless a table has the outcomes, ends, starts and actions of Gymnasium."""
    env = gymnasium.make(name, **options).unwrapped
    starts = [s for s, chance in enumerate(env.initial_state_distrib) if chance]
    assert len(table.terminal) == env.observation_space.n
    assert len(table.actions) == env.action_space.n
    assert sorted(table.starts) == sorted(map(state_of, starts))
    acting, ended = reachable(env.P, starts)
    assert {state_of(s) for s in ended} <= set(table.terminal.nonzero()[0].tolist())
    assert len(acting) > 10
    for s in acting:
        assert not table.terminal[state_of(s)]
        for a, action in enumerate(actions):
            assert outcomes(table, state_of(s), action) == pytest.approx(
                merged(env.P[s][a], state_of), abs=1e-12), (s, action)


@pytest.mark.parametrize('name, size', [('frozen_lake', 4), ('frozen_lake_8x8', 8)])
@pytest.mark.parametrize('is_slippery', [True, False])
def test_frozen_lake_is_that_of_gymnasium(name, size, is_slippery):
    text = f'extends: {name}\n' + ('' if is_slippery else 'intended: 1\n')
    check_same(parse_map(text, 'report'), 'FrozenLake-v1', FROZEN_LAKE, cell(size, size),
               map_name=f'{size}x{size}', is_slippery=is_slippery)


@pytest.mark.parametrize('name, version', [
    ('frozen_lake', 'FrozenLake-v1'), ('frozen_lake_8x8', 'FrozenLake8x8-v1'),
    ('taxi', 'Taxi-v4')])
def test_the_step_limit_is_that_of_gymnasium(name, version):
    assert read_map(name, 'report').step_limit == gymnasium.spec(version).max_episode_steps


def test_cliff_walking_is_that_of_gymnasium():
    check_same(read_map('cliff_walking', 'report'), 'CliffWalking-v1', CLIFF_WALKING,
               cell(12, 4))


def test_a_slippery_cliff_is_that_of_gymnasium():
    text = 'extends: cliff_walking\nintended: 1/3\nslips: right_angles\n'
    check_same(parse_map(text, 'report'), 'CliffWalking-v1', CLIFF_WALKING, cell(12, 4),
               is_slippery=True)


def test_taxi_is_that_of_gymnasium():
    check_same(read_map('taxi', 'report'), 'Taxi-v4', TAXI, taxi_state)


# The optima are those of Gymnasium's own tables: FrozenLake 0.8235 and 1.0, -13, and 7.93.
@pytest.mark.parametrize('name, optimum, step_limit', [
    ('gym:FrozenLake-v1', 0.8235, 100), ('gym:FrozenLake-v1?map_name=8x8', 1.0, 100),
    ('gym:FrozenLake8x8-v1', 1.0, 200), ('gym:CliffWalking-v1', -13.0, 480),
    ('gym:Taxi-v4', 7.93, 200)])
def test_a_world_of_gymnasium_is_a_map(name, optimum, step_limit):
    world = World(read_map(name, 'published'))
    assert optimal_values(world)[world.starts].mean() == pytest.approx(optimum, abs=0.005)
    assert world.step_limit == step_limit
    assert world.action_names == tuple(map(str, range(world.n_actions)))


def test_arguments_reach_the_environment():
    slippery, dry = (World(read_map(f'gym:FrozenLake-v1?is_slippery={each}', 'report'))
                     for each in ('true', 'false'))
    assert optimal_values(dry)[0] == 1.0 > optimal_values(slippery)[0]


def test_the_cells_of_a_world_of_gymnasium_have_positions():
    positions = read_map('gym:CliffWalking-v1', 'report').positions
    assert positions[0].tolist() == [0.5, 3.5] and positions[47].tolist() == [11.5, 0.5]
    assert read_map('gym:Taxi-v4', 'report').positions is None


OWN_ENVIRONMENT = """
import gymnasium

class Coin(gymnasium.Env):
    observation_space = gymnasium.spaces.Discrete(2)
    action_space = gymnasium.spaces.Discrete(1)
    initial_state_distrib = {starts}
    P = {{0: {{0: [(1.0, 1, 2.0, True)]}}, 1: {{0: [(1.0, 1, 0.0, True)]}}}}

gymnasium.register('Coin-v0', Coin)
"""


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    """Return the function that writes a module with an environment, and gives its map's name."""
    def write(starts):
        (tmp_path / f'coin_{len(starts)}.py').write_text(OWN_ENVIRONMENT.format(starts=starts))
        return f'gym:coin_{len(starts)}:Coin-v0'
    monkeypatch.syspath_prepend(tmp_path)
    return write


def test_an_environment_of_a_module_of_the_user_is_a_map(own_module):
    world = World(read_map(own_module([1.0]), 'report'))
    assert (optimal_values(world)[0], world.step_limit) == (2.0, 20)


def test_starts_that_are_not_equally_likely_are_rejected(own_module):
    with pytest.raises(MapError, match='the starts of a map must be equally likely, got chances '
                       'from 0.25 to 0.75'):
        read_map(own_module([0.75, 0.25]), 'report')


@pytest.mark.parametrize('name, message', [
    ('gym:Nowhere-v0', "environment 'Nowhere-v0' cannot be made: Environment `Nowhere` doesn't "
     'exist.'),
    ('gym:no_such_module:Coin-v0', "environment 'no_such_module:Coin-v0' cannot be made: No "
     "module named 'no_such_module'"),
    ('gym:Taxi-v4?is_rainy', "an argument behind '?' must be NAME=VALUE, with '&' between two, "
     "got 'is_rainy'"),
    ('gym:Taxi-v4?wet=1', "environment 'Taxi-v4' cannot be made: "),
    ('gym:Taxi-v4?is_rainy=true&is_rainy=true', "an argument must be there once, got 'is_rainy' "
     'again'),
    ('gym:Taxi-v4?is_rainy=[', 'argument is_rainy: its value must be valid YAML')])
def test_an_environment_that_cannot_be_a_map_is_named_with_the_reason(name, message):
    with pytest.raises(MapError) as error:
        read_map(name, 'published')
    assert str(error.value).startswith(f'map {name!r}: {message}')
    assert '\n' not in str(error.value)


@pytest.mark.parametrize('table', [
    9.81, {0: {0: [(1.0, 1, 2.0)]}, 1: {}}, {0: {0: [(1.0, None, 2.0, True)]}, 1: {}}])
def test_a_table_of_another_form_is_rejected(table):
    class Odd(gymnasium.Env):
        observation_space = gymnasium.spaces.Discrete(2)
        action_space = gymnasium.spaces.Discrete(1)
        initial_state_distrib, P = [1.0, 0.0], table
    with pytest.raises(MapError, match=r'P must have for each state and action a list of '
                       r'\(probability, state, reward, terminated\): '):
        table_of_environment(Odd())
