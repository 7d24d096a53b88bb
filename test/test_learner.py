# SPDX-License-Identifier: Apache-2.0
"""The conversation in every order, on the actors, without ROS."""

from dataclasses import replace
from itertools import permutations, product

import pytest
from tiny_worlds import grid

from comply_ros.learner.presets import METHODS
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import (
    Action,
    describe,
    Episode,
    grid_from_description,
    Ignored,
    Notice,
    Progress,
    Recommendation,
    Rejected,
    StateReward,
)
from comply_ros.world.grid import MapError
from comply_ros.world.mdp import World

RUN = 7
ROOM = grid('..G', '...', '...', starts=(0,))
HERE = describe(ROOM, 'room', RUN)
UP_EVERYWHERE = World(ROOM).free * 3 - ~World(ROOM).free * 1
ROW = replace(METHODS['report']['constant'], confidence=1.0, episodes=2, iterations=3)


def state(episode=1, step=0, s=0, reward=0.0, terminated=False, truncated=False, run=RUN):
    """Return a `StateReward`."""
    return StateReward(run, episode, step, s, reward, terminated, truncated)


def advice(episode=1, step=0, s=0, action=3, run=RUN):
    """Return a `Recommendation`."""
    return Recommendation(run, episode, step, s, action)


def learner(**settings):
    """Return a learner that knows the room."""
    actor = Learner(replace(ROW, **settings), seed=0)
    actor.on_world(HERE)
    return actor


def mentor():
    """Return a mentor that says up everywhere in the room."""
    actor = Mentor()
    assert actor.on_world(HERE)
    assert actor.use(UP_EVERYWHERE) == ()
    return actor


FIRST = {'world': HERE, 'state': state(), 'advice': advice()}


@pytest.mark.parametrize('order', list(permutations(FIRST)))
def test_the_learner_answers_the_first_state_in_any_order(order):
    actor = Learner(ROW, seed=0)
    hear = {'world': actor.on_world, 'state': actor.observe,
            'advice': actor.on_recommendation}
    msg = [answer for name in order for answer in hear[name](FIRST[name])]
    actions = [each for each in msg if isinstance(each, Action)]
    assert actions == [Action(RUN, 1, 0, 3, True, 1.0, learner=1, advice=3)]
    assert not [each for each in msg if isinstance(each, Rejected)]


@pytest.mark.parametrize('order', list(permutations(('world', 'policy', 'state'))))
def test_the_mentor_answers_the_first_state_in_any_order(order):
    actor, msg = Mentor(), []
    for name in order:
        if name == 'world':
            assert actor.on_world(HERE)
        elif name == 'state':
            msg += actor.observe(state())
        elif actor.world is not None:
            msg += actor.use(UP_EVERYWHERE)
    if actor.policy is None:  # it cannot be made before the world is known
        msg += actor.use(UP_EVERYWHERE)
    assert msg == [advice()]


def test_a_repeated_question_gets_the_same_answer_and_teaches_nothing():
    actor = learner()
    actor.observe(state())
    first = actor.on_recommendation(advice())
    digest = actor.memory.digest()
    assert actor.observe(state()) == first
    assert actor.on_recommendation(advice()) == ()
    assert actor.memory.digest() == digest
    actor = mentor()
    assert actor.observe(state()) == actor.observe(state()) == (advice(),)


def test_a_repeated_answer_is_dropped():
    world = GridWorld(ROOM, 'room', RUN, seed=0)
    answer = Action(RUN, 1, 0, 3, True, 1.0)
    question, = world.on_action(answer)
    assert (question.episode, question.step) == (1, 1)
    dropped, = world.on_action(answer)
    assert dropped == Ignored('action too late', 'dropped an action of turn (1, 0): it came late, '
                              'or twice')
    assert world.question is question
    assert world.signs == 1  # but its learner is alive


def test_an_old_question_is_dropped():
    actor = learner()
    actor.on_recommendation(advice(step=4))
    actor.observe(state(step=4))
    actor.on_recommendation(advice(step=4))
    assert [type(each) for each in actor.observe(state(step=4))] == [Action]
    assert actor.observe(state(step=3, s=5)) == (
        Ignored('state too late', 'dropped a state of turn (1, 3): it came late, or twice'),)


def test_an_episode_ends_with_no_action_and_the_next_begins():
    world = GridWorld(grid('..G', starts=(1,), intended=1.0), 'corridor', RUN, seed=0)
    episode, final = world.on_action(Action(RUN, 1, 0, 1, False, 0.0))
    assert episode == Episode(RUN, 1, 1, 10.0, True, False)
    assert final == state(step=1, s=2, reward=10.0, terminated=True)
    refused, = world.on_action(Action(RUN, 1, 1, 0, False, 0.0))
    assert refused.reason == 'the episode is over: the action must be -1, got 0'
    assert world.on_action(Action(RUN, 1, 1, -1, False, 0.0)) == (state(episode=2, s=1),)


def test_the_step_limit_truncates():
    world = GridWorld(grid('..G', limit=1), 'corridor', RUN, seed=0)
    episode, final = world.on_action(Action(RUN, 1, 0, 1, False, 0.0))
    assert (final.terminated, final.truncated) == (False, True)
    assert (episode.terminated, episode.truncated) == (False, True)


def at_the_goal(**settings):
    """Return a learner beside a goal, and the state in which it arrives there."""
    actor = Learner(replace(ROW, trust='none', **settings), seed=0)
    actor.on_world(describe(grid('.G'), 'beside', RUN))
    actor.observe(state())
    return actor, state(step=1, s=1, reward=10.0, terminated=True)


def test_a_learner_that_is_finished_answers_no_more():
    actor, arrived = at_the_goal(episodes=1, iterations=1)
    progress, = actor.observe(arrived)
    assert isinstance(progress, Progress) and progress.finished
    assert actor.observe(arrived) == ()


def test_who_comes_late_learns_nothing_from_what_it_has_not_seen():
    actor = learner()
    digest = actor.memory.digest()
    late, early = state(episode=3, step=9, s=1, reward=-1.0), advice(episode=3, step=9, s=1)
    actor.on_recommendation(early)
    assert actor.observe(late) == (Ignored('joins late', 'joins a run in turn (3, 9): takes '
                                              'part as soon as that is asked again'),)
    assert [type(each) for each in actor.observe(late)] == [Action]
    assert actor.memory.digest() == digest
    assert actor.student.steps == 0


def test_a_mentor_that_changes_its_mind_is_heard_from_the_next_visit_on():
    actor = learner()
    actor.observe(state())
    assert actor.on_recommendation(advice(action=3))[0].action == 3
    actor.observe(state(step=1, s=3, reward=-1.0))
    assert len(actor.on_recommendation(advice(step=1, s=3))) == 1
    msg = actor.observe(state(step=2, s=0, reward=-1.0))
    assert msg[0].action == 3
    assert actor.on_recommendation(advice(step=2, action=1)) == ()
    assert actor.on_recommendation(advice(step=0, action=3)) == ()  # late: not the newest word
    actor.observe(state(step=3, s=3, reward=-1.0))
    assert actor.observe(state(step=4, s=0, reward=-1.0))[0].action == 1


def test_who_does_not_remember_waits_for_every_advice():
    actor = Learner(ROW, seed=0, remembers_advice=False)
    actor.on_world(HERE)
    actor.observe(state())
    assert len(actor.on_recommendation(advice())) == 1
    actor.observe(state(step=1, s=3, reward=-1.0))
    assert len(actor.on_recommendation(advice(step=1, s=3))) == 1
    assert actor.observe(state(step=2, s=0, reward=-1.0)) == ()
    assert len(actor.on_recommendation(advice(step=2))) == 1


def test_advice_for_the_goal_is_idle():
    assert learner().on_recommendation(advice(step=1, s=8, action=3)) == ()


def test_no_advice_is_an_advice_of_its_own():
    actor = learner()
    actor.observe(state())
    action, = actor.on_recommendation(advice(action=-1))
    assert (action.followed, action.confidence) == (False, 0.0)
    assert action.action in (1, 3)


def test_a_world_that_comes_back_keeps_what_was_learned_and_another_does_not():
    actor = learner(trust='none')
    actor.observe(state())
    actor.observe(state(step=1, s=1, reward=-1.0))
    digest = actor.memory.digest()
    notice, action = turn_to(actor, HERE._replace(run=8))
    assert isinstance(notice, Notice) and 'goes on' in notice.text
    assert isinstance(action, Action)
    assert actor.memory.digest() == digest
    notice, action = turn_to(actor, describe(grid('.G'), 'other', 9))
    assert 'begins to learn' in notice.text
    assert actor.memory.q.shape == (2, 4)


def turn_to(actor, described):
    """Have another world ask twice, and the one here be silent for two looks."""
    assert actor.on_world(described) == ()
    for _ in range(2):
        assert actor.observe(state(run=described.run)) == ()
    assert actor.look() == ()
    return actor.look()


def test_a_world_that_only_speaks_beside_the_one_here_gets_no_attention():
    actor = learner(trust='none')
    actor.observe(state())
    actor.on_world(HERE._replace(run=8))
    for step in range(1, 5):
        assert actor.observe(state(run=8)) == ()
        refused, action = actor.observe(state(step=step, s=step % 2, reward=-1.0))
        assert refused.kind == 'another run' and isinstance(action, Action)
        assert actor.look() == ()
    assert actor.described.run == RUN


def test_of_two_worlds_the_first_is_attended_to_where_nothing_was_answered_yet():
    actor = Learner(replace(ROW, trust='none'), seed=0)
    assert len(actor.on_world(HERE._replace(run=8, began=20.0))) == 1
    assert len(actor.on_world(HERE._replace(began=10.0))) == 1
    assert actor.on_world(HERE._replace(run=9, began=30.0)) == ()
    actor.observe(state())
    assert actor.on_world(HERE._replace(run=3, began=1.0)) == ()  # too late
    assert actor.described.run == RUN


def test_a_state_of_a_run_that_is_not_known_yet_waits_for_its_world():
    actor = Learner(replace(ROW, trust='none'), seed=0)
    assert actor.observe(state()) == ()
    assert [type(each) for each in actor.on_world(HERE)] == [Notice, Action]


@pytest.mark.parametrize('make', [learner, mentor])
def test_a_state_of_another_run_is_refused_when_the_world_here_goes_on(make):
    actor = make()
    assert actor.observe(state(run=5)) == ()
    refused, *answer = actor.observe(state())
    assert refused == Rejected('another run', 'a state must belong to run 7 of the world here, '
                              'got run 5')
    assert tuple(answer) == make().observe(state())


def test_advice_of_another_run_is_refused_when_the_world_here_goes_on():
    actor = learner()
    assert actor.on_recommendation(advice(run=5)) == ()
    refused, = actor.observe(state())
    assert refused.reason == ('a recommendation must belong to run 7 of the world here, '
                              'got run 5')


def test_a_question_out_of_turn_is_refused():
    actor = learner(trust='none')
    actor.observe(state())
    refused, = actor.observe(state(episode=9, step=3))
    assert refused.reason == ('a state must follow turn (1, 0), got (9, 3): is there another '
                              'learner?')
    assert len(actor.observe(state(step=1, s=1, reward=-1.0))) == 1


def test_an_episode_that_was_not_seen_whole_does_not_count():
    actor = learner(trust='none', episodes=1)
    for _ in range(2):
        actor.observe(state(step=3, s=5, reward=-1.0))
    msg = actor.observe(state(step=4, s=8, reward=10.0, terminated=True))
    assert [type(each) for each in msg] == [Action]
    for step, s in enumerate((0, 1, 2, 5)):
        actor.observe(state(episode=2, step=step, s=s, reward=-1.0 * (step > 0)))
    msg = actor.observe(state(episode=2, step=4, s=8, reward=10.0, terminated=True))
    assert [type(each) for each in msg] == [Action, Progress]


def test_a_learner_that_is_finished_rests_also_when_its_world_comes_back():
    actor, arrived = at_the_goal(episodes=1, iterations=1)
    actor.observe(arrived)
    digest = actor.memory.digest()
    notice, = turn_to(actor, describe(grid('.G'), 'beside', 8))
    assert 'goes on' in notice.text
    assert actor.observe(state(run=8)) == ()
    assert actor.memory.digest() == digest
    notice, action = turn_to(actor, describe(grid('..G'), 'other', 9))
    assert 'begins to learn' in notice.text
    assert (actor.finished, actor.student.iterations_done) == (False, 0)


def test_who_waits_says_for_what():
    assert 'a world' in Learner(ROW, seed=0).waiting_for()
    assert 'a world' in Mentor().waiting_for()
    actor = learner()
    assert actor.waiting_for() is None
    actor.observe(state())
    assert actor.waiting_for() == 'a recommendation in state 0: is a mentor running?'
    assert mentor().waiting_for() is None
    assert 'an action in episode 1, step 0' in GridWorld(ROOM, 'room', RUN, seed=0).waiting_for()


IN_THE_ROOM = list(product((learner, mentor), (
    (state(s=9), 'state outside the grid', 'a state must lie in [0, 8], got 9'),
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
     'an episode must be truncated at step 50 and nowhere else, got True at step 0'))))


@pytest.mark.parametrize('make, wrong', IN_THE_ROOM)
def test_a_state_that_cannot_be_right_is_refused(make, wrong):
    msg, kind, reason = wrong
    assert make().observe(msg) == (Rejected(kind, reason),)


def test_a_state_in_an_obstacle_is_refused():
    actor = Mentor()
    actor.on_world(describe(grid('.#G', '...'), 'wall', RUN))
    actor.use(World(grid('.#G', '...')).free * 0 - 1)
    assert actor.observe(state(s=4))[0].reason == (
        'a state must not be an obstacle, got 4 at (1, 1)')


@pytest.mark.parametrize('msg, reason', [
    (advice(s=9), 'a recommendation must be for a state in [0, 8], got 9'),
    (advice(action=0),
     'a recommendation must be an action that the cell has, or -1, got 0 in state 0'),
    (advice(action=7),
     'a recommendation must be an action that the cell has, or -1, got 7 in state 0')])
def test_advice_that_cannot_be_right_is_refused_and_not_learned_from(msg, reason):
    actor = learner()
    actor.observe(state())
    digest = actor.memory.digest()
    refused, = actor.on_recommendation(msg)
    assert refused.reason == reason
    assert actor.memory.digest() == digest
    assert len(actor.on_recommendation(advice())) == 1


@pytest.mark.parametrize('msg, reason', [
    (Action(5, 1, 0, 1, False, 0.0), 'an action must belong to run 7 of the world here, got '
     'run 5'),
    (Action(RUN, 1, 0, 0, False, 0.0),
     'an action must be one that the cell has, got 0 in state 0'),
    (Action(RUN, 1, 0, 9, False, 0.0),
     'an action must be one that the cell has, got 9 in state 0'),
    (Action(RUN, 1, 0, -1, False, 0.0),
     'an action must be one that the cell has, got -1 in state 0'),
    (Action(RUN, 2, 0, 1, False, 0.0), 'an action must answer turn (1, 0), got (2, 0)')])
def test_an_action_that_cannot_be_right_is_refused_and_moves_nothing(msg, reason):
    world = GridWorld(ROOM, 'room', RUN, seed=0)
    question = world.question
    assert world.on_action(msg)[0].reason == reason
    assert world.question is question


@pytest.mark.parametrize('changes, message', [
    ({'rows': ('..G', '..', '...')}, 'all rows must have the same length'),
    ({'width': 4}, 'width and height must be those of the rows, 3 x 3, got 4 x 3'),
    ({'step_limit': 51}, 'sha256 must be that of the world'),
    ({'intended': float('nan')}, 'intended must be a finite number of at most 1000000, got nan'),
    ({'starts': (99,)}, 'a start must lie in the grid of 9 cells, got state 99')])
def test_a_description_that_is_no_world_is_refused(changes, message):
    for actor in (Mentor(), Learner(ROW, seed=0)):
        with pytest.raises(ValueError) as error:
            actor.on_world(HERE._replace(**changes))
        assert message in str(error.value)


def test_a_description_is_all_that_is_needed_to_rebuild_the_world():
    assert grid_from_description(HERE) == ROOM
    assert issubclass(MapError, ValueError)


def test_a_watching_mentor_that_the_learner_went_on_without_advises_again():
    actor = Mentor(budget=9, when='mistakes')
    actor.on_world(HERE)
    actor.use(UP_EVERYWHERE)
    actor.observe(state())
    missed, now = state(step=5, s=1), Action(RUN, 1, 4, 3, False, 0.0, learner=5)
    assert actor.observe(missed) == ()  # it has not seen what was done in the first state
    assert actor.on_action(now) == ()
    assert [type(each) for each in actor.observe(missed)] == [Ignored]
    assert [type(each) for each in actor.observe(missed)] == [Recommendation]


def test_a_watching_mentor_that_lost_the_end_of_an_episode_advises_in_the_next():
    actor = Mentor(budget=9, when='mistakes')
    actor.on_world(HERE)
    actor.use(UP_EVERYWHERE)
    actor.observe(state())
    actor.allow_gap()
    assert actor.observe(state(episode=2)) == ()
    for _ in range(2):
        actor.on_action(Action(RUN, 1, 7, -1, False, 0.0, learner=5))
        actor.look()
    actor.on_action(Action(RUN, 1, 7, -1, False, 0.0, learner=5))
    msg = [*actor.observe(state(episode=2)), *actor.observe(state(episode=2))]
    assert [type(each) for each in msg] == [Ignored, Recommendation]


def test_the_mentor_answers_tools_too():
    assert mentor().advice(0) == 3
    assert mentor().advice(8) == -1
    with pytest.raises(ValueError, match=r'a state must lie in \[0, 8\], got 9'):
        mentor().advice(9)
    with pytest.raises(ValueError, match='must have a world and a policy first'):
        Mentor().advice(0)
