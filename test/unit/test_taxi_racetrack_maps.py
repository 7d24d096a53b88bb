# SPDX-License-Identifier: Apache-2.0
"""Maps with the key `world`: their keys, and every wrong value."""

import pytest

from comply_ros.storage.map_files import parse_map
from comply_ros.world.grid import MapError

TAXI = "world: taxi\nrows: ['A..B']\n"
TRACK = "world: racetrack\nrows: ['S..F']\n"


def test_a_taxi_has_the_rewards_of_its_source_unless_others_are_given():
    assert set(parse_map(TAXI, 'report').reward) == {-1.0, -10.0, 20.0}
    changed = parse_map(TAXI + 'rewards: {step: 0, deliver: 5, wrong: -2}', 'report')
    assert set(changed.reward) == {0.0, -2.0, 5.0}


def test_a_race_track_has_the_noise_and_the_speed_of_its_source_unless_others_are_given():
    table = parse_map(TRACK, 'report')
    assert sorted(set(table.probability)) == [0.1, 0.9, 1.0]
    assert len(table.terminal) == 4 * 25
    changed = parse_map(TRACK + 'noise: 1/4\nlargest_speed: 1\nrewards: {step: -2}', 'report')
    assert sorted(set(changed.probability)) == [0.25, 0.75, 1.0]
    assert (len(changed.terminal), set(changed.reward)) == (4 * 4, {-2.0})


@pytest.mark.parametrize('text', [TAXI, TRACK])
def test_a_step_limit_can_be_given(text):
    assert parse_map(text + 'step_limit: 7', 'report').step_limit == 7


@pytest.mark.parametrize('text, message', [
    ('world: chess', "world must be one of taxi, racetrack, got 'chess'"),
    ('world: [taxi]', "world must be one of taxi, racetrack, got ['taxi']"),
    ('world: taxi', "rows must be a list of texts such as '..#G', got None"),
    ('world: taxi\nrows: []', 'a map needs at least one row of cells, got none'),
    ("world: taxi\nrows: ['AB', '.']",
     'all rows must have the same length: row 2 has 1 cells, row 1 has 2'),
    (TAXI + 'noise: 0.5', "a map of world taxi has the keys world, rows, walls, rewards, "
     "step_limit, got 'noise'"),
    (TAXI + 'rewards: {goal: 5}', "rewards must be a table of step, deliver, wrong, got "
     "the key 'goal'"),
    (TAXI + 'rewards: {wrong: bad}', "reward of wrong must be a number, got 'bad'"),
    (TAXI + 'rewards: {wrong: 1e7}',
     'reward of wrong must be a finite number of at most 1000000, got 10000000.0'),
    (TAXI + 'step_limit: 0', 'step_limit must lie in [1, 1000000], got 0'),
    (TAXI + 'walls: 5', 'walls must be a list of [[x, y], [x, y]], got 5'),
    (TRACK + 'walls: []', 'a map of world racetrack has the keys world, rows, rewards, noise, '
     "largest_speed, step_limit, got 'walls'"),
    (TRACK + 'noise: loud', "noise must be a number, got 'loud'"),
    (TRACK + 'largest_speed: 2.5', 'largest_speed must be a whole number, got 2.5'),
])
def test_a_wrong_map_of_a_world_is_rejected_with_the_rule_that_it_breaks(text, message):
    with pytest.raises(MapError) as error:
        parse_map(text, 'report')
    assert str(error.value) == message
