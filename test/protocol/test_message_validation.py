# SPDX-License-Identifier: Apache-2.0
"""Messages that cannot be right are rejected, with one sentence for each rule."""

import pytest
from room_messages import CONFIG, make_learner, make_mentor, ROOM, ROOM_MSG, RUN, state
from tiny_worlds import grid

from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.message_validation import validate_observation, validate_same_world
from comply_ros.protocol.messages import Rejected
from comply_ros.protocol.world_description import describe_world, world_from_description
from comply_ros.world import grid as grid_module
from comply_ros.world import reachability
from comply_ros.world.grid import MapError
from comply_ros.world.mdp import World


@pytest.mark.parametrize('make', [make_learner, make_mentor])
@pytest.mark.parametrize('msg, kind, reason', [
    (state(s=9), 'state outside the world', 'a state must lie in [0, 8], got 9'),
    (state(reward=float('nan')), 'reward not a number',
     'a reward must be a finite number, got nan'),
    (state(reward=float('-inf')), 'reward not a number',
     'a reward must be a finite number, got -inf'),
    (state(terminated=True), 'wrong end',
     'terminated must be true at a goal and nowhere else, got True in state 0'),
    (state(s=8), 'wrong end',
     'terminated must be true at a goal and nowhere else, got False in state 8'),
    (state(step=60), 'wrong step',
     'an episode must be truncated at step 50 and nowhere else, got False at step 60'),
    (state(truncated=True), 'wrong step',
     'an episode must be truncated at step 50 and nowhere else, got True at step 0'),
    (state(s=1), 'wrong start', 'an episode must start in one of the starts with reward 0, got '
     'reward 0.0 in state 1'),
    (state(reward=-1.0), 'wrong start', 'an episode must start in one of the starts with reward '
     '0, got reward -1.0 in state 0')])
def test_an_observation_that_cannot_be_right_is_rejected(make, msg, kind, reason):
    assert make().observe(msg) == (Rejected(kind, reason),)


def test_an_observation_in_an_obstacle_is_rejected():
    rejected = validate_observation(state(s=4), World(grid('.#G', '...')))
    assert rejected == Rejected('state in an obstacle',
                                'a state must not be an obstacle, got 4 at (1, 1)')


@pytest.mark.parametrize('make', [make_learner, make_mentor])
def test_an_observation_of_another_run_is_rejected_when_the_world_here_continues(make):
    actor = make()
    assert actor.observe(state(run=5)) == ()
    rejected, *answer = actor.observe(state())
    assert rejected == Rejected('another run', 'a state must belong to run 7 of the world here, '
                                'got run 5')
    assert tuple(answer) == make().observe(state())


@pytest.mark.parametrize('changes, message', [
    ({'grid': ROOM_MSG.grid._replace(rows=('..G', '..', '...'))},
     'all rows must have the same length'),
    ({'states': 12}, 'states must be the cells of the rows, 3 x 3, got 12'),
    ({'states': 0}, 'a world must have 1 to 16777216 states, got 0'),
    ({'actions': ('west', 'right', 'down', 'up')}, 'the actions of a grid must be left, right, '
     "down, up, got 'west, right, down, up'"),
    ({'step_limit': 51}, 'sha256 must be that of the world'),
    ({'grid': ROOM_MSG.grid._replace(intended=float('nan'))},
     'intended must be a finite number of at most 1000000, got nan'),
    ({'model': 3}, 'model must be 0 NONE, 1 GRID, 2 TABLE, got 3'),
    ({'model': 0}, 'grid.rows must be empty in a world of model NONE, got 3 elements'),
    ({'cells': ('a',)}, 'cells must be empty in a world of model GRID, got 1 elements'),
    ({'protocol': 1}, 'its messages must have protocol 3, as those of this version of '
     'comply_ros, got protocol 1: run nodes of one version'),
    ({'starts': (99,)}, 'a start must lie in the grid of 9 cells, got state 99')])
def test_a_message_that_does_not_describe_a_world_is_rejected(changes, message):
    for actor in (Mentor(), Learner(CONFIG, seed=0)):
        with pytest.raises(ValueError) as error:
            actor.on_world(ROOM_MSG._replace(**changes))
        assert message in str(error.value)


def test_a_description_is_all_that_is_needed_to_rebuild_the_world():
    assert world_from_description(ROOM_MSG) == ROOM
    assert issubclass(MapError, ValueError)


@pytest.mark.parametrize('make', [make_learner, make_mentor])
def test_a_run_cannot_turn_into_another_world(make):
    other = describe_world(grid('.G'), 'other', RUN)
    assert make().on_world(other) == (Rejected(
        'another world', "the world of run 7 must stay 'room', got 'other'"),)


def test_a_world_with_a_wrong_hash_is_rejected_before_its_ways_are_searched(monkeypatch):
    for name, value in list(vars(grid_module).items()):
        if getattr(value, '__module__', '') == reachability.__name__:
            monkeypatch.setattr(grid_module, name, None)
    with pytest.raises(TypeError):
        world_from_description(ROOM_MSG)
    with pytest.raises(ValueError, match='sha256 must be that of the world'):
        world_from_description(ROOM_MSG._replace(sha256='x'))


def test_a_name_of_megabytes_is_not_written_to_a_log():
    with pytest.raises(ValueError, match='a name must have at most 255 characters, got 1000000'):
        world_from_description(ROOM_MSG._replace(name='x' * 1_000_000))
    rejected, = validate_same_world(ROOM_MSG._replace(name='x' * 1_000_000, sha256='0'), ROOM_MSG)
    assert len(rejected.reason) < 400


def test_a_world_that_gives_no_hash_is_not_checked_for_it_and_gets_its_own():
    learner = Learner(CONFIG, seed=0)
    learner.on_world(ROOM_MSG._replace(sha256=''))
    assert learner.tracker.description == ROOM_MSG
    assert learner.on_world(ROOM_MSG._replace(sha256='')) == ()
    other = describe_world(grid('.G'), 'other', RUN)._replace(sha256='')
    assert learner.on_world(other) == (Rejected(
        'another world', "the world of run 7 must stay 'room', got 'other'"),)
