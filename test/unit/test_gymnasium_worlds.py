# SPDX-License-Identifier: Apache-2.0
"""The worlds that Gymnasium has too: the same tables. Skipped where Gymnasium is not installed."""

import pytest
from table_planning import outcomes

from comply_ros.storage.map_files import parse_map, read_map

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
