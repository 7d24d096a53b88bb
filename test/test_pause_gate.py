# SPDX-License-Identifier: Apache-2.0
"""Pause, step, reset and parameters in every order, on the actors, without ROS."""

from dataclasses import replace
from itertools import permutations, product

from actor_network import DecodedMessages
import pytest
from tiny_worlds import grid

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.learner_state import CONFIDENCE, LearnerState, TEMPERATURE
from comply_ros.learner.presets import METHODS
from comply_ros.learner.reconfigure import changed_memory
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import (
    Action,
    describe_world,
    Ignored,
    Notice,
    Progress,
    Recommendation,
    Rejected,
    StateReward,
    WorldDescription,
)
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

ROOM = grid('..G', '.#.', '...', limit=12)
ROW = replace(METHODS['published']['beta_implicit'], episodes=2, iterations=3)
RUN = 7


def conversation(row=ROW, budget=0, when='early', iterations=3):
    """Return three actors that begin to talk in the room."""
    mentor = Mentor(budget, when)
    mentor.on_world(describe_world(ROOM, 'room', RUN))
    mentor.use(optimal_policy(World(ROOM)))
    learner = Learner(replace(row, iterations=iterations), seed=3)
    return DecodedMessages(GridWorld(ROOM, 'room', RUN, 3), mentor, learner)


def finished(talk):
    """Return the digest at the end of a conversation that goes on undisturbed."""
    talk.run()
    assert talk.learner.finished
    return talk.learner.memory.digest()


@pytest.fixture(scope='module')
def expected():
    """Return the digest of an undisturbed conversation."""
    return finished(conversation())


def reset_world(talk, run=8):
    """Reset the world; let the others hear of it."""
    talk.say(talk.world.reset(run, began=1.0))


@pytest.mark.parametrize('messages', range(1, 40, 3))
def test_a_pause_holds_the_next_question_and_changes_no_bit(expected, messages):
    talk = conversation()
    talk.run(messages)
    talk.say(talk.world.pause_gate.pause(True))
    talk.run()
    before = len(talk.asked)
    assert talk.run() == 0 and talk.world.pause_gate.held
    assert talk.world.waiting_for() is None
    talk.say(talk.world.pause_gate.pause(True))  # again: nothing
    talk.run()
    assert len(talk.asked) == before
    talk.say(talk.world.pause_gate.pause(False))
    assert finished(talk) == expected


@pytest.mark.parametrize('orders', list(product(('step', 'hear'), repeat=4)))
def test_a_step_lets_one_question_out_whenever_it_comes(expected, orders):
    talk = conversation()
    talk.say(talk.world.pause_gate.pause(True))
    for order in orders:
        if order == 'step':
            talk.say(talk.world.pause_gate.step())
        else:
            talk.run()
    talk.run()
    assert len(talk.asked) == 1 + orders.count('step')
    talk.say(talk.world.pause_gate.pause(False))
    assert finished(talk) == expected


def test_a_step_that_was_not_used_is_forgotten_when_the_world_goes_on():
    talk = conversation()
    talk.world.pause_gate.pause(True)
    talk.world.pause_gate.step()
    talk.world.pause_gate.pause(False)
    talk.world.pause_gate.pause(True)
    talk.run()
    assert len(talk.asked) == 1


def test_a_rate_holds_until_a_tick_and_a_step_does_not_wait_for_it():
    talk = conversation()
    assert talk.world.pause_gate.pace(True) == ()
    talk.run()
    assert len(talk.asked) == 1
    talk.say(talk.world.pause_gate.tick())
    talk.run()
    assert len(talk.asked) == 2
    talk.world.pause_gate.pause(True)
    assert talk.world.pause_gate.tick() == ()
    assert len(talk.world.pause_gate.step()) == 1
    assert talk.world.pause_gate.pause(False) == talk.world.pause_gate.pace(False) == ()


RESETS = ('pause', 'learner', 'world', 'hear')


@pytest.mark.parametrize('messages, budget, order', [
    (messages, budget, order) for messages in (2, 3, 4, 30, 10_000) for budget in (0, 2)
    for order in permutations(RESETS) if order.index('pause') < order.index('world')])
def test_after_a_pause_and_two_resets_in_any_order_it_is_a_fresh_start(messages, budget, order):
    talk = conversation(budget=budget)
    talk.run(messages)
    deeds = {'pause': lambda: talk.world.pause_gate.pause(True),
             'learner': talk.learner.reset, 'hear': talk.run}
    for deed in order:
        if deed == 'world':
            reset_world(talk)
        else:
            msg = deeds[deed]()
            talk.say(msg if deed != 'hear' else ())
    talk.run()
    if order.index('learner') < order.index('pause'):
        talk.say(talk.learner.reset())  # it may have learned in between
    assert not [each for each in talk.asked if each.run == 8]
    talk.say(talk.world.pause_gate.pause(False))
    assert finished(talk) == finished(conversation(budget=budget))
    assert not [each for each in talk.msg if type(each) is Rejected]


def test_a_reset_world_asks_at_once_if_it_is_not_paused_and_says_what_it_replaces():
    talk = conversation()
    talk.run(20)
    notice, world, question = talk.world.reset(8, began=5.0)
    assert notice == Notice('begins anew: run 8 takes the place of run 7')
    assert (world.run, world.replaces, world.began) == (8, 7, 5.0)
    assert question == StateReward(8, 1, 0, talk.asked[0].state, 0.0, False, False)


def test_what_is_late_from_before_a_reset_is_dropped():
    talk = conversation()
    talk.run(20)
    reset_world(talk)
    talk.run(4)
    dropped, = talk.world.on_action(Action(7, 1, 3, 0, False, 0.0, 1))
    assert dropped == Ignored('before a reset', 'dropped an action of run 7, which ended with a '
                              'reset')
    late, = talk.learner.observe(StateReward(7, 1, 3, 0, -1.0, False, False))
    assert late.kind == 'before a reset' and 'a state of run 7' in late.reason
    late, = talk.learner.on_recommendation(Recommendation(7, 1, 3, 0, 3))
    assert late.kind == 'before a reset'
    assert talk.learner.on_world(describe_world(ROOM, 'room', 7)) == ()
    assert talk.world.on_world(describe_world(ROOM, 'room', 7)) == ()
    assert talk.learner.described.run == 8


def test_another_map_or_another_run_cannot_take_the_place_of_this_one():
    for other in (describe_world(grid('..G', '...'), 'other', 9)._replace(replaces=7),
                  describe_world(ROOM, 'room', 9)._replace(replaces=6),
                  describe_world(ROOM, 'room', 9)):
        talk = conversation()
        talk.run(20)
        assert talk.learner.on_world(other) == ()
        assert talk.learner.described.run == 7


def test_a_world_that_is_restored_remembers_what_it_replaces():
    world = GridWorld(ROOM, 'room', RUN, 3)
    world.reset(8, began=1.0)
    again = GridWorld(ROOM, 'room', 9, 3)
    again.restore(*world.state(), [])
    assert again.description == world.description


def test_a_learner_that_forgets_goes_on_in_its_run_and_answers_repetitions_as_before():
    talk = conversation()
    talk.run(21)
    last, answer = talk.learner._respondent.last, talk.learner._respondent.answer
    notice, = talk.learner.reset()
    assert notice == Notice('forgets all that it learned')
    assert talk.learner.memory.digest() == LearnerState.fresh(World(ROOM), ROW).digest()
    assert (talk.learner.turns, talk.learner.student.steps, len(talk.learner.reports)) == (0, 0, 0)
    assert talk.learner.observe(last) == (answer,)
    talk.say((talk.world.question,))
    assert finished(talk)


def test_a_learner_that_forgets_after_its_end_lets_the_next_episode_begin():
    talk = conversation()
    finished(talk)
    asked = talk.world.question
    notice, answer = talk.learner.reset()
    assert answer == Action(*asked[:3], -1, False, 0.0, 1)
    talk.say((answer,))
    assert finished(talk)
    assert [each.iteration for each in talk.msg if type(each) is Progress] == [1, 2, 3, 1, 2, 3]


def test_a_learner_that_forgets_before_there_is_a_world_has_nothing_to_forget():
    assert Learner(ROW, 3).reset() == ()


def test_a_learner_that_is_killed_after_it_forgot_goes_on_as_if_it_had_not_been():
    def forgets(kill):
        talk = conversation()
        talk.run(21)
        talk.learner.reset()
        if kill:
            facts, arrays = talk.learner.state()
            talk.learner = Learner(replace(ROW, iterations=3), seed=3, number=99)
            talk.learner.restore(facts, arrays, [])
        talk.say((talk.world.question,))
        return finished(talk)
    assert forgets(kill=True) == forgets(kill=False)


def test_who_hears_nothing_of_a_pause_says_what_it_may_be():
    talk = conversation()
    talk.run(20)
    for _ in range(6):
        talk.learner.look()
    talk.learner.asked = None
    assert 'is its grid_world running, and not paused?' in talk.learner.waiting_for()


CHANGES = ({'learning_rate': 0.3}, {'discount': 0.5, 'temperature': 0.2}, {'episodes': 1},
           {'iterations': 5}, {'remembers_advice': False}, {'trace_decay': 0.5},
           {'trust': 'scheduled', 'confidence': 0.3}, {'trust': 'none'}, {'learns_prior': True},
           {'belief_listen': 1.0}, {'initial_value': 3.0}, {'advice_timeout': 2.0})


@pytest.mark.parametrize('changes', CHANGES, ids=str)
def test_a_change_counts_and_survives_a_kill(changes):
    def changed(kill):
        talk = conversation()
        talk.run(21)
        talk.say(talk.learner.change(changes))
        assert talk.learner.begins
        if kill:
            facts, arrays = talk.learner.state()
            talk.learner = Learner(replace(ROW, iterations=3), seed=3, number=99)
            talk.learner.restore(facts, arrays, [])
            talk.say(talk.learner.recall()[-1:])
        return finished(talk), talk.learner
    digest, learner = changed(kill=True)
    expected, other = changed(kill=False)
    assert digest == expected
    assert learner.method == other.method
    assert learner.changed == other.changed == changes
    if not {'remembers_advice', 'advice_timeout'} & set(changes):
        assert digest != finished(conversation())


def test_confidence_and_temperature_hold_from_now_on():
    talk = conversation(replace(METHODS['published']['constant'], episodes=2))
    talk.run(60)
    talk.learner.change({'confidence': 0.25, 'temperature': 2.0})
    schedule = talk.learner.memory.schedule
    assert schedule[CONFIDENCE] == 0.25 and schedule[TEMPERATURE] == 2.0
    talk.learner.change({'discount': 0.9})
    assert schedule[CONFIDENCE] == 0.25  # and is not set back by another change


def test_a_first_value_holds_only_for_what_was_never_tried():
    world, before = World(ROOM), replace(ROW, initial_value=1.0)
    memory = LearnerState.fresh(world, before)
    memory.q[0, 3], memory.visits[0, 3], memory.arrivals[0] = 7.0, 2.0, 2.0
    memory.belief[0] = 9.0, 1.0, 1.0
    after = replace(before, initial_value=4.0, belief_listen=5.0)
    changed = changed_memory(memory, world, before, after)
    assert changed.q[0, 3] == 7.0 and changed.q[0, 1] == 4.0 and changed.q[0, 0] == -float('inf')
    assert changed.belief[0].tolist() == [9.0, 1.0, 1.0]
    assert changed.belief[1].tolist() == [5.0, 2.0, 0.0]
    assert memory.q[0, 1] == 1.0


@pytest.mark.parametrize('changes, sentence', [
    ({'learning_rate': 2.0}, 'learning_rate must lie in [0, 1], got 2.0'),
    ({'discount': float('nan')}, 'discount must lie in [0, 1], got nan'),
    ({'iterations': 1}, 'iterations must be 0, or above the 2 that are done, got 1'),
    ({'replays': True}, 'replays must stay false while a learner runs: what it remembers is of '
                        'another kind, got true'),
    ({'belief_listen': 0.0}, 'belief_listen and belief_discard must be above 0 where trust is '
                             'beta, got 0.0 and 2.0'),
    ({'trust': 'explicit'}, 'trust_rate must lie in [0, 1] where trust is explicit, got 2.0')])
def test_a_change_that_cannot_be_is_refused_with_one_sentence_and_changes_nothing(
        changes, sentence):
    talk = conversation()
    while talk.learner.student is None or talk.learner.student.iterations_done < 2:
        talk.run(1)
    with pytest.raises(ConfigError) as refused:
        talk.learner.change(changes)
    assert str(refused.value) == sentence
    assert finished(talk) == finished(conversation())


def test_more_iterations_wake_a_learner_that_rests():
    talk = conversation()
    finished(talk)
    talk.say(talk.learner.change({'iterations': 5}))
    assert finished(talk) == finished(conversation(iterations=5))


def test_a_learner_whose_trust_ends_answers_the_state_that_waited_for_advice():
    learner = Learner(ROW, seed=3)
    learner.on_world(describe_world(ROOM, 'room', RUN))
    assert learner.observe(StateReward(RUN, 1, 0, 0, 0.0, False, False)) == ()
    notice, answer = learner.change({'trust': 'none'})
    assert notice == Notice('goes on with trust none')
    assert type(answer) is Action


def test_a_world_of_before_has_no_run_that_it_replaces():
    assert describe_world(ROOM, 'room', RUN).replaces == 0
    assert WorldDescription._fields[-1] == 'replaces'
