# SPDX-License-Identifier: Apache-2.0
"""Random worlds that are made from a seed."""

import numpy as np
import pytest
from table_planning import outcomes

from comply_ros.storage.map_files import read_map, read_world
from comply_ros.world.garnet import garnet_table, reaches_last
from comply_ros.world.grid import MapError

# Whoever draws in another order, or with another generator, gets other worlds.
HASHES = {0: 'dadf64596ade30e4ac969b1ab2fcf4949f09f69aabe258fad440a1e452b9e3fa',
          1: '8d69ec6b5cfc32330b8d1e13cec5cbfbd0f0849ef0857cc78be8b9bd72d9aa78',
          2: '603c468103ea1776281463226cfb243a3d7bb547a62295cd811268424d08438c'}


@pytest.mark.parametrize('seed', HASHES)
def test_the_same_seed_gives_the_same_world(seed):
    assert garnet_table(seed).sha256 == HASHES[seed]
    assert read_map(f'garnet:{seed}', 'published') == garnet_table(seed)


@pytest.mark.parametrize('seed, states', [(3, 50), (4, 200), (5, 800)])
def test_the_remainder_of_the_seed_is_the_size(seed, states):
    table = garnet_table(seed)
    assert table.n_states == states
    assert table.successor.shape == (states * 4 * 3,)
    assert (table.starts, table.step_limit) == ((0,), 320)
    assert np.flatnonzero(table.terminal).tolist() == [states - 1]


def test_each_action_leads_to_three_states_with_chances_that_add_up_to_1():
    table = garnet_table(6)
    for s in range(49):
        for a in table.actions:
            chances = outcomes(table, s, a)
            assert len({s2 for s2, _ in chances}) == 3
            assert sum(chances.values()) == pytest.approx(1.0, abs=1e-12)


def test_a_tenth_of_the_states_costs_5_and_neither_the_start_nor_the_goal_is_one():
    table = garnet_table(6)
    reward_into = dict(zip(table.successor.tolist(), table.reward.tolist(), strict=True))
    assert set(zip(table.successor.tolist(), table.reward.tolist())) == set(reward_into.items())
    assert reward_into[49] == 10.0
    assert reward_into.get(0, -0.1) == -0.1
    assert sorted(set(reward_into.values())) == [-5.0, -0.1, 10.0]
    assert sum(reward == -5.0 for reward in reward_into.values()) == 5


def test_every_state_reaches_the_goal():
    table, reach = garnet_table(6), {49}
    for _ in range(50):  # no way is longer
        reach |= {s for s in range(49) for a in table.actions
                  if any(s2 in reach for s2, _ in outcomes(table, s, a))}
    assert reach == set(range(50))


@pytest.mark.parametrize('successors, reaches', [
    ([[[1]], [[2]], [[0]]], True),  # 0 -> 1 -> 2
    ([[[1]], [[0]], [[0]]], False),  # 0 <-> 1
    ([[[0], [1]], [[1], [0]], [[2], [2]]], False),
    ([[[0], [1]], [[0], [2]], [[2], [2]]], True)])  # by the second action of each
def test_a_way_to_the_last_state_may_be_of_any_length(successors, reaches):
    assert reaches_last(np.array(successors)) is reaches


@pytest.mark.parametrize('name, message', [
    ('garnet:x', "a Garnet must be named garnet:SEED, with a whole number, got 'x'"),
    ('garnet:', "a Garnet must be named garnet:SEED, with a whole number, got ''"),
    ('garnet:1.5', "a Garnet must be named garnet:SEED, with a whole number, got '1.5'"),
    ('garnet:-1', 'the seed of a Garnet must lie in [0, 9007199254740992], got -1'),
    ('garnet:9007199254740993',
     'the seed of a Garnet must lie in [0, 9007199254740992], got 9007199254740993'),
    ('garnet:1?states=9', "a Garnet has no arguments, got 'states'")])
def test_a_wrong_seed_is_one_sentence(name, message):
    with pytest.raises(MapError) as error:
        read_world(name, 'published')
    assert str(error.value) == f'map {name!r}: {message}'
