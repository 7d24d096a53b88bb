# SPDX-License-Identifier: Apache-2.0
"""What a viewer knows, from what it heard."""

from typing import NamedTuple

import pytest
from tiny_worlds import grid

from comply_ros.protocol.messages import describe, Notice, Rejected, StateReward
from comply_ros.protocol.viewer_state import MAPS, MENTOR, ROBOT, TRUST, VALUES, ViewerState, WORLD

HERE = describe(grid('..G', '...'), 'room', 7)


def state(s, step, episode=1, run=7):
    """Return a question."""
    return StateReward(run, episode, step, s, 0.0 if step == 0 else -1.0, s == 5, False)


class Map(NamedTuple):
    """A map over all states, as the messages of maps are."""

    run: int
    width: int
    height: int
    content: list


def maps(content, run=7, width=3):
    """Return a map over all states."""
    return Map(run, width, 2, content)


@pytest.fixture
def scene():
    """Return a scene that shows the room."""
    made = ViewerState(3)
    notice, = made.on_world(HERE)
    assert notice == Notice("shows world 'room', run 7")
    return made


def test_a_new_world_is_shown_whole(scene):
    assert scene.changed == {WORLD, ROBOT, *MAPS}


def test_the_trail_is_the_way_of_this_episode_and_not_longer_than_it_may_be(scene):
    scene.changed.clear()
    for step, s in enumerate((0, 0, 1, 2)):
        assert scene.observe(state(s, step)) == ()
    assert (scene.trail, scene.changed) == ([0, 1, 2], {ROBOT})
    scene.observe(state(5, 4))
    assert scene.trail == [1, 2, 5]
    scene.observe(state(0, 0, episode=2))
    assert scene.trail == [0]


def test_a_repeated_state_changes_nothing(scene):
    scene.observe(state(0, 0))
    scene.changed.clear()
    scene.observe(state(0, 0))
    assert (scene.trail, scene.changed) == ([0], set())


def test_a_state_that_cannot_be_right_is_refused_and_not_shown(scene):
    refused, = scene.observe(state(9, 1))
    assert type(refused) is Rejected
    assert scene.trail == []


def test_a_map_that_came_before_its_world_is_shown():
    scene = ViewerState(3)
    scene.on_state_map(TRUST, maps([0.5] * 6))
    scene.on_state_map(TRUST, maps([0.9] * 6, run=8))
    scene.on_world(HERE)
    assert scene.map(TRUST).tolist() == [0.5] * 6
    assert scene.map(VALUES) is None


def test_a_map_of_another_run_changes_nothing(scene):
    scene.changed.clear()
    scene.on_state_map(TRUST, maps([0.9] * 6, run=8))
    assert (scene.changed, scene.map(TRUST)) == (set(), None)


@pytest.mark.parametrize('name, msg, message', [
    (TRUST, maps([0.5] * 5), r'trust must have 3 x 2 states, got 5 of 3 x 2'),
    (TRUST, maps([0.5] * 6, width=2), r'trust must have 3 x 2 states, got 6 of 2 x 2'),
    (TRUST, maps([0.5] * 5 + [float('nan')]), r'trust must lie in \[0, 1\], got nan'),
    (VALUES, maps([float('inf')] * 6), r'values must be finite numbers, got inf'),
    (MENTOR, maps([0] + [-1] * 5), r'mentor_policy must be actions that the cells have, or -1, '
     'got 0 in state 0'),
    (MENTOR, maps([4] + [-1] * 5), r'got 4 in state 0')])
def test_a_map_that_cannot_be_right_is_not_shown(scene, name, msg, message):
    scene.on_state_map(name, msg)
    with pytest.raises(ValueError, match=message):
        scene.map(name)


def test_another_world_is_shown_when_this_one_is_silent_and_that_one_asks(scene):
    scene.observe(state(0, 0))
    scene.on_world(describe(grid('.G'), 'beside', 8))
    for _ in range(3):
        scene.observe(state(0, 0, run=8))
        looked = scene.look()
    assert (scene.run, scene.trail) == (8, [0])
    assert looked or scene.world.grid == grid('.G')
