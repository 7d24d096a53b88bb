# SPDX-License-Identifier: Apache-2.0
"""The grid world as a state machine: actions in, observations out, without ROS."""

import pytest
from room_messages import ROOM, RUN, state
from tiny_worlds import grid

from comply_ros.protocol.messages import Action, Episode, Ignored
from comply_ros.protocol.world import RELEASE, WorldMachine
from comply_ros.world.grid import NO_ACTION, RIGHT, UP
from comply_ros.world.mdp import World


def room_world():
    """Return a world at its first observation."""
    return WorldMachine(ROOM, 'room', RUN, seed=0)


def test_a_repeated_action_is_ignored():
    world = room_world()
    action = Action(RUN, 1, 0, UP, True, 1.0)
    observation, = world.on_action(action)
    assert (observation.episode, observation.step) == (1, 1)
    ignored, = world.on_action(action)
    assert ignored == Ignored('action too late', 'ignored an action for step id (1, 0): it came '
                              'late, or twice')
    assert world.observation is observation
    assert world.learner_messages == 1  # its learner is running


def test_an_episode_ends_with_no_action_and_the_next_one_starts():
    world = WorldMachine(grid('..G', starts=(1,), intended=1.0), 'corridor', RUN, seed=0)
    episode, final = world.on_action(Action(RUN, 1, 0, RIGHT, False, 0.0))
    assert episode == Episode(RUN, 1, 1, 10.0, True, False)
    assert final == state(step=1, s=2, reward=10.0, terminated=True)
    rejected, = world.on_action(Action(RUN, 1, 1, 0, False, 0.0))
    assert rejected.reason == 'the episode is over: the action must be -1, got 0'
    assert world.on_action(Action(RUN, 1, 1, NO_ACTION, False, 0.0)) == (state(episode=2, s=1),)


def test_the_step_limit_truncates_an_episode():
    world = WorldMachine(grid('..G', limit=1), 'corridor', RUN, seed=0)
    episode, final = world.on_action(Action(RUN, 1, 0, RIGHT, False, 0.0))
    assert (final.terminated, final.truncated) == (False, True)
    assert (episode.terminated, episode.truncated) == (False, True)


@pytest.mark.parametrize('msg, reason', [
    (Action(5, 1, 0, 1, False, 0.0),
     'an action must belong to run 7 of the world here, got run 5'),
    (Action(RUN, 1, 0, 0, False, 0.0),
     'an action must be one that the state has, got 0 in state 0'),
    (Action(RUN, 1, 0, 9, False, 0.0),
     'an action must be one that the state has, got 9 in state 0'),
    (Action(RUN, 1, 0, -1, False, 0.0),
     'an action must be one that the state has, got -1 in state 0'),
    (Action(RUN, 2, 0, 1, False, 0.0), 'an action must be for step id (1, 0), got (2, 0)'),
    *((Action(RUN, 1, 0, 1, True, confidence),
       f'a confidence must lie in [0, 1], got {confidence}')
      for confidence in (-0.1, 1.1, float('nan'), float('inf')))])
def test_an_action_that_cannot_be_right_is_rejected_and_moves_nothing(msg, reason):
    world = room_world()
    observation = world.observation
    rejected, = world.on_action(msg)
    assert rejected.reason == reason
    assert world.observation is observation and world.journal_entries == []


def test_it_says_what_it_waits_for():
    world = room_world()
    assert world.waiting_for() == ('an action in episode 1, step 0: is a learner running, or has '
                                   'it finished?')
    action = Action(RUN, 1, 0, UP, True, 1.0)
    world.on_action(action)
    world.on_action(action)
    assert world.waiting_for() == ('an action in episode 1, step 1: its learner is there, and '
                                   'waits itself')


def test_a_world_whose_learner_was_replaced_is_restored_where_it_was():
    world, journal, available = room_world(), [], World(ROOM).available
    for learner, step in ((5, 0), (6, 1)):
        world.repeat(RELEASE + 0.1)
        action = int(available[world.observation.state].argmax())
        world.on_action(Action(RUN, 1, step, action, False, 0.0, learner))
        journal.append(world.journal_entries.pop())
    restored = room_world()
    restored.load_state_dict(*room_world().state_dict(), journal)
    assert restored.observation == world.observation
    assert restored.observation.learner == 6
