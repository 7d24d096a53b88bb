# SPDX-License-Identifier: Apache-2.0
"""The learner as a state machine: messages in every order, without ROS."""

from dataclasses import replace
from itertools import permutations
import json

import pytest
from room_messages import (
    advice,
    CONFIG,
    follow_instead,
    make_learner,
    ROOM_MSG,
    RUN,
    state,
    types,
)
from tiny_worlds import grid

from comply_ros.protocol.learner import Learner
from comply_ros.protocol.messages import (
    Action,
    Ignored,
    Notice,
    Progress,
    Rejected,
)
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.grid import RIGHT, UP

FIRST = {'world': ROOM_MSG, 'state': state(), 'advice': advice()}


@pytest.mark.parametrize('order', list(permutations(FIRST)))
def test_it_answers_the_first_observation_in_any_order_of_messages(order):
    learner = Learner(CONFIG, seed=0)
    receive = {'world': learner.on_world, 'state': learner.observe,
               'advice': learner.on_recommendation}
    outputs = [msg for name in order for msg in receive[name](FIRST[name])]
    actions = [msg for msg in outputs if isinstance(msg, Action)]
    assert actions == [Action(RUN, 1, 0, UP, True, 1.0, learner=1, advice=UP)]
    assert not [msg for msg in outputs if isinstance(msg, Rejected)]


def test_a_repeated_observation_gets_the_same_action_and_teaches_nothing():
    learner = make_learner()
    learner.observe(state())
    first = learner.on_recommendation(advice())
    digest = learner.state.digest()
    assert learner.observe(state()) == first
    assert learner.on_recommendation(advice()) == ()
    assert learner.state.digest() == digest


def test_an_old_observation_is_ignored():
    learner = make_learner()
    learner.on_recommendation(advice(step=4))
    learner.observe(state(step=4))
    learner.on_recommendation(advice(step=4))
    assert types(learner.observe(state(step=4))) == [Action]
    assert learner.observe(state(step=3, s=5)) == (
        Ignored('state too late', 'ignored a state of step id (1, 3): it came late, or twice'),)


def beside_the_goal(**settings):
    """Return a learner beside a goal, and the observation with which it arrives there."""
    learner = Learner(replace(CONFIG, trust='none', **settings), seed=0)
    learner.on_world(describe_world(grid('.G'), 'beside', RUN))
    learner.observe(state())
    return learner, state(step=1, s=1, reward=10.0, terminated=True)


def test_an_iteration_is_reported():
    learner, arrival = beside_the_goal(episodes=1, iterations=2, temperature=0.5)
    action, progress = learner.observe(arrival)
    assert action == Action(RUN, 1, 1, -1, False, 0.0, learner=1, advice=-1, observation_count=1)
    assert repr(progress) == repr(Progress(RUN, 1, 2, 1, 1, 10.0, float('nan'), 0.5, False))
    learner.observe(state(episode=2))
    progress, = learner.observe(arrival._replace(episode=2))
    assert (progress.iteration, progress.steps, progress.finished) == (2, 2, True)
    assert list(learner.reports)[-1] == progress and len(learner.reports) == 2


def test_a_report_has_the_number_of_episodes_of_its_iteration():
    learner, arrival = beside_the_goal(episodes=3, iterations=2)
    learner.observe(arrival)
    learner.change({'episodes': 1})
    learner.observe(state(episode=2))
    _, progress = learner.observe(arrival._replace(episode=2))
    assert (progress.iteration, progress.episodes, progress.mean_return) == (1, 2, 10.0)


def test_a_learner_that_has_finished_answers_nothing():
    learner, arrival = beside_the_goal(episodes=1, iterations=1)
    progress, = learner.observe(arrival)
    assert isinstance(progress, Progress) and progress.finished
    assert learner.observe(arrival) == ()


def test_a_learner_that_joins_late_learns_nothing_from_what_it_has_not_observed():
    learner = make_learner()
    digest = learner.state.digest()
    late = state(episode=3, step=9, s=1, reward=-1.0)
    learner.on_recommendation(advice(episode=3, step=9, s=1))
    assert learner.observe(late) == (Ignored('joins late', 'joins a run at step id (3, 9): takes '
                                             'part when that state is repeated'),)
    assert types(learner.observe(late)) == [Action]
    assert learner.state.digest() == digest
    assert learner.agent.steps == 0


def test_changed_advice_counts_from_the_next_visit_on():
    learner = make_learner()
    learner.observe(state())
    assert learner.on_recommendation(advice(action=UP))[0].action == UP
    learner.observe(state(step=1, s=3, reward=-1.0))
    assert len(learner.on_recommendation(advice(step=1, s=3))) == 1
    assert learner.observe(state(step=2, s=0, reward=-1.0))[0].action == UP
    assert learner.on_recommendation(advice(step=2, action=RIGHT)) == ()
    assert learner.on_recommendation(advice(step=0, action=UP)) == ()  # late: not the newest
    learner.observe(state(step=3, s=3, reward=-1.0))
    assert learner.observe(state(step=4, s=0, reward=-1.0))[0].action == RIGHT


def test_a_learner_that_does_not_remember_advice_waits_for_every_recommendation():
    learner = make_learner(remembers_advice=False)
    learner.observe(state())
    assert len(learner.on_recommendation(advice())) == 1
    learner.observe(state(step=1, s=3, reward=-1.0))
    assert len(learner.on_recommendation(advice(step=1, s=3))) == 1
    assert learner.observe(state(step=2, s=0, reward=-1.0)) == ()
    assert len(learner.on_recommendation(advice(step=2))) == 1


def test_advice_for_the_goal_has_no_effect():
    assert make_learner().on_recommendation(advice(step=1, s=8, action=UP)) == ()


def test_a_recommendation_may_be_no_advice():
    learner = make_learner()
    learner.observe(state())
    action, = learner.on_recommendation(advice(action=-1))
    assert (action.followed, action.confidence) == (False, 0.0)
    assert action.action in (RIGHT, UP)


def test_without_advice_in_time_it_acts_as_if_there_was_none():
    waiting, without = make_learner(), make_learner()
    for learner in (waiting, without):
        learner.observe(state())
    assert waiting.continue_without_advice() == without.on_recommendation(advice(action=-1))
    assert waiting.continue_without_advice() == ()  # nothing waits now
    assert waiting.state.digest() == without.state.digest()
    waiting.on_recommendation(advice(action=UP))  # it comes late, and counts the next time
    waiting.observe(state(step=1, s=3, reward=-1.0))
    waiting.continue_without_advice()
    assert len(waiting.observe(state(step=2, s=0, reward=-1.0))) == 1


def test_a_restarted_world_leaves_what_was_learned_and_another_world_does_not():
    learner = make_learner(trust='none')
    learner.observe(state())
    learner.observe(state(step=1, s=1, reward=-1.0))
    digest = learner.state.digest()
    notice, action = follow_instead(learner, ROOM_MSG._replace(run=8))
    assert notice == Notice("continues in world 'room', run 8")
    assert isinstance(action, Action)
    assert learner.state.digest() == digest
    notice, action = follow_instead(learner, describe_world(grid('.G'), 'other', 9))
    assert notice == Notice("starts to learn in world 'other', run 9")
    assert learner.state.q.shape == (2, 4)


def test_a_world_beside_the_one_that_it_follows_changes_nothing():
    learner = make_learner(trust='none')
    learner.observe(state())
    learner.on_world(ROOM_MSG._replace(run=8))
    for step in range(1, 5):
        assert learner.observe(state(run=8)) == ()
        rejected, action = learner.observe(state(step=step, s=step % 2, reward=-1.0))
        assert rejected.kind == 'another run' and isinstance(action, Action)
        assert learner.tick() == ()
    assert learner.tracker.run == RUN


@pytest.mark.parametrize('began', [-1e300, 0.0, 10.0, 1e300])
@pytest.mark.parametrize('other_began', [-1e300, 0.0, 10.0, 1e300])
def test_it_keeps_the_first_world_that_it_receives_whenever_the_worlds_began(began, other_began):
    learner = Learner(replace(CONFIG, trust='none'), seed=0)
    assert types(learner.on_world(ROOM_MSG._replace(began=began))) == [Notice]
    assert learner.on_world(ROOM_MSG._replace(run=8, began=other_began)) == ()
    assert learner.on_world(ROOM_MSG._replace(run=3, began=other_began)) == ()
    learner.observe(state())
    assert learner.on_world(ROOM_MSG._replace(run=2, began=other_began)) == ()
    assert learner.tracker.run == RUN


def test_an_observation_of_an_unknown_run_waits_for_its_world():
    learner = Learner(replace(CONFIG, trust='none'), seed=0)
    assert learner.observe(state()) == ()
    assert types(learner.on_world(ROOM_MSG)) == [Notice, Action]


def test_advice_of_another_run_is_rejected_when_the_world_here_continues():
    learner = make_learner()
    assert learner.on_recommendation(advice(run=5)) == ()
    rejected, = learner.observe(state())
    assert rejected.reason == ('a recommendation must belong to run 7 of the world here, '
                               'got run 5')


def test_an_observation_out_of_order_is_rejected():
    learner = make_learner(trust='none')
    learner.observe(state())
    rejected, = learner.observe(state(episode=9, step=3))
    assert rejected.reason == ('a state must have the step id after (1, 0), got (9, 3): is there '
                               'another learner?')
    assert len(learner.observe(state(step=1, s=1, reward=-1.0))) == 1


def test_an_episode_that_was_not_observed_from_its_start_does_not_count():
    learner = make_learner(trust='none', episodes=1)
    for _ in range(2):
        learner.observe(state(step=3, s=5, reward=-1.0))
    outputs = learner.observe(state(step=4, s=8, reward=10.0, terminated=True))
    assert types(outputs) == [Action]
    for step, s in enumerate((0, 1, 2, 5)):
        learner.observe(state(episode=2, step=step, s=s, reward=-1.0 * (step > 0)))
    outputs = learner.observe(state(episode=2, step=4, s=8, reward=10.0, terminated=True))
    assert types(outputs) == [Action, Progress]


def test_a_learner_that_has_finished_stays_so_when_its_world_is_restarted():
    learner, arrival = beside_the_goal(episodes=1, iterations=1)
    learner.observe(arrival)
    digest = learner.state.digest()
    notice, = follow_instead(learner, describe_world(grid('.G'), 'beside', 8))
    assert 'continues' in notice.text
    assert learner.observe(state(run=8)) == ()
    assert learner.state.digest() == digest
    notice, action = follow_instead(learner, describe_world(grid('..G'), 'other', 9))
    assert 'starts to learn' in notice.text
    assert (learner.finished, learner.agent.iterations_done) == (False, 0)


def test_it_says_what_it_waits_for():
    assert Learner(CONFIG, seed=0).waiting_for() == 'a world: is a grid_world running?'
    learner = make_learner()
    assert learner.waiting_for() is None
    learner.observe(state())
    assert learner.waiting_for() == 'a recommendation in state 0: is a mentor running?'
    learner.on_recommendation(advice())
    assert learner.waiting_for() is None


def test_it_says_when_the_world_has_lost_the_end_of_its_state():
    learner = make_learner(trust='none')
    learner.observe(state())
    learner.observe(state(step=1, s=1, reward=-1.0))
    learner.observe(state())
    assert learner.waiting_for() == ('a state after step id (1, 1): the world repeats step id '
                                     '(1, 0); has it lost the end of its state?')


@pytest.mark.parametrize('msg, reason', [
    (advice(s=9), 'a recommendation must be for a state in [0, 8], got 9'),
    (advice(action=0), 'a recommendation must be an action that the state has, or -1, got 0 in '
                       'state 0'),
    (advice(action=7), 'a recommendation must be an action that the state has, or -1, got 7 in '
                       'state 0')])
def test_advice_that_cannot_be_right_is_rejected_and_teaches_nothing(msg, reason):
    learner = make_learner()
    learner.observe(state())
    digest = learner.state.digest()
    rejected, = learner.on_recommendation(msg)
    assert rejected.reason == reason
    assert learner.state.digest() == digest
    assert len(learner.on_recommendation(advice())) == 1


def test_advice_that_is_known_already_is_not_written_to_the_journal_again():
    learner = make_learner()
    learner.observe(state())
    learner.on_recommendation(advice())
    count = len(learner.journal_entries)
    for _ in range(100):
        learner.on_recommendation(advice())
    assert len(learner.journal_entries) == count


def test_answers_are_noted_for_the_journal_only_where_there_is_one():
    noting, other = make_learner(), make_learner()
    other.keeps_journal = False
    for learner in (noting, other):
        learner.observe(state())
    assert noting.continue_without_advice() == other.continue_without_advice()
    assert (len(noting.journal_entries), len(other.journal_entries)) == (1, 0)


def test_late_advice_after_a_checkpoint_is_restored_from_the_journal():
    learner = make_learner()
    learner.observe(state())
    learner.continue_without_advice()
    values, arrays = learner.state_dict()
    learner.journal_entries.clear()
    learner.on_recommendation(advice(action=UP))
    restored = Learner(CONFIG, seed=0)
    restored.load_state_dict(json.loads(json.dumps(values)), arrays, learner.journal_entries)
    assert restored.advice().tolist() == learner.advice().tolist()
    assert restored.advice()[0] == UP


@pytest.mark.parametrize('remembers_advice', [False, True])
def test_advice_whose_observation_the_journal_lost_answers_the_repeated_observation(
        remembers_advice):
    learner = make_learner(remembers_advice=remembers_advice)
    values, arrays = learner.state_dict()
    arrays = {name: array.copy() for name, array in arrays.items()}
    learner.observe(state())
    action, = learner.on_recommendation(advice())
    recommendation, _ = learner.journal_entries  # the second entry is lost
    restored = Learner(CONFIG, 0, remembers_advice)
    restored.load_state_dict(json.loads(json.dumps(values)), arrays, [recommendation])
    assert restored.observe(state()) == (action,)


def restored_from(values, arrays, journal, **settings):
    """Return a learner that continues from a checkpoint on disk and its journal."""
    learner = Learner(replace(CONFIG, **settings), seed=0)
    learner.load_state_dict(json.loads(json.dumps(values)), arrays, journal)
    return learner


def checkpoint(learner):
    """Write the checkpoint that a learner needs; return it."""
    learner.needs_checkpoint = False
    learner.journal_entries.clear()
    values, arrays = learner.state_dict()
    return json.loads(json.dumps(values)), {name: array.copy() for name, array in arrays.items()}


def test_a_learner_restored_from_a_journal_with_a_gap_learned_the_same():
    learner = make_learner(trust='none', learning_rate=0.5)
    saved = checkpoint(learner)
    learner.observe(state())
    learner.allow_gap()
    learner.tick()
    later = state(step=7, s=4, reward=-1.0)
    for _ in range(2):
        learner.observe(later)
        learner.tick()
    assert types(learner.observe(later)) == [Action]
    learner.observe(state(step=8, s=5, reward=-1.0))
    assert learner.agent.steps == 1 and not learner.needs_checkpoint
    restored = restored_from(*saved, learner.journal_entries, trust='none', learning_rate=0.5)
    assert restored.state.digest() == learner.state.digest()
    assert restored.agent.steps == 1


def test_a_learner_restored_after_another_one_made_a_move_learned_the_same():
    learner = make_learner(trust='none', learning_rate=0.5)
    saved = checkpoint(learner)
    learner.observe(state())
    moved = state(step=1, s=1, reward=-1.0)
    learner.observe(moved._replace(learner=5))
    assert types(learner.observe(moved)) == [Action]  # the other learner is gone
    if learner.needs_checkpoint:
        saved = checkpoint(learner)
    restored = restored_from(*saved, learner.journal_entries, trust='none', learning_rate=0.5)
    assert restored.state.digest() == learner.state.digest()
    assert restored.agent.steps == learner.agent.steps == 0
