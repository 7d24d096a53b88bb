# SPDX-License-Identifier: Apache-2.0
"""Pause, step, reset and parameters in every order, on the state machines, without ROS."""

from dataclasses import replace
from itertools import permutations, product

from actor_network import OrderedNetwork, RUN
import pytest
from tiny_worlds import grid

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.learner_state import initial_state
from comply_ros.learner.presets import METHODS
from comply_ros.learner.reconfigure import changed_state
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import (
    Action,
    Ignored,
    Notice,
    Progress,
    Recommendation,
    Rejected,
    StateReward,
)
from comply_ros.protocol.world import WorldMachine
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

ROOM = grid('..G', '.#.', '...', limit=12)
CONFIG = replace(METHODS['published']['beta_implicit'], episodes=2, iterations=3)


def make_network(config=CONFIG, budget=0, iterations=3):
    """Return the three in the room, before the first message."""
    mentor = Mentor(budget)
    mentor.on_world(describe_world(ROOM, 'room', RUN))
    mentor.use(optimal_policy(World(ROOM)))
    learner = Learner(replace(config, iterations=iterations), seed=3)
    return OrderedNetwork(WorldMachine(ROOM, 'room', RUN, 3), mentor, learner)


def finish(network):
    """Run until the learner has finished; return its digest."""
    network.run()
    assert network.learner.finished
    return network.learner.state.digest()


@pytest.fixture(scope='module')
def expected():
    """Return the digest of an undisturbed training."""
    return finish(make_network())


def reset_world(network, run=8):
    """Reset the world, and publish its outputs."""
    network.publish(network.world.reset(run, began=1.0))


def restart_learner(network):
    """Replace the learner by another one that continues from its checkpoint."""
    values, arrays = network.learner.state_dict()
    network.learner = Learner(replace(CONFIG, iterations=3), seed=3, number=99)
    network.learner.load_state_dict(values, arrays, [])


@pytest.mark.parametrize('messages', range(1, 40, 3))
def test_a_pause_holds_the_next_observation_and_changes_no_bit(expected, messages):
    network = make_network()
    network.run(messages)
    network.publish(network.world.pause_gate.pause(True))
    network.run()
    before = len(network.observations)
    assert network.run() == 0 and network.world.pause_gate.held
    assert network.world.waiting_for() is None
    network.publish(network.world.pause_gate.pause(True))  # again: nothing
    network.run()
    assert len(network.observations) == before
    network.publish(network.world.pause_gate.pause(False))
    assert finish(network) == expected


@pytest.mark.parametrize('orders', list(product(('step', 'run'), repeat=4)))
def test_a_step_releases_one_observation_whenever_it_comes(expected, orders):
    network = make_network()
    network.publish(network.world.pause_gate.pause(True))
    for order in orders:
        if order == 'step':
            network.publish(network.world.pause_gate.step())
        else:
            network.run()
    network.run()
    assert len(network.observations) == 1 + orders.count('step')
    network.publish(network.world.pause_gate.pause(False))
    assert finish(network) == expected


def test_a_step_that_was_not_used_is_forgotten_when_the_world_continues():
    network = make_network()
    network.world.pause_gate.pause(True)
    network.world.pause_gate.step()
    network.world.pause_gate.pause(False)
    network.world.pause_gate.pause(True)
    network.run()
    assert len(network.observations) == 1


def test_a_rate_holds_until_a_tick_and_a_step_does_not_wait_for_it():
    network = make_network()
    assert network.world.pause_gate.pace(True) == ()
    network.run()
    assert len(network.observations) == 1
    network.publish(network.world.pause_gate.tick())
    network.run()
    assert len(network.observations) == 2
    network.world.pause_gate.pause(True)
    assert network.world.pause_gate.tick() == ()
    assert len(network.world.pause_gate.step()) == 1
    assert network.world.pause_gate.pause(False) == network.world.pause_gate.pace(False) == ()


RESETS = ('pause', 'learner', 'world', 'run')


@pytest.mark.parametrize('messages, budget, order', [
    (messages, budget, order) for messages in (2, 3, 4, 30, 10_000) for budget in (0, 2)
    for order in permutations(RESETS) if order.index('pause') < order.index('world')])
def test_after_a_pause_and_two_resets_in_any_order_everything_starts_again(
        messages, budget, order):
    network = make_network(budget=budget)
    network.run(messages)
    for each in order:
        if each == 'world':
            reset_world(network)
        elif each == 'run':
            network.run()
        elif each == 'pause':
            network.publish(network.world.pause_gate.pause(True))
        else:
            network.publish(network.learner.reset())
    network.run()
    if order.index('learner') < order.index('pause'):
        network.publish(network.learner.reset())  # it may have learned in between
    assert not [msg for msg in network.observations if msg.run == 8]
    network.publish(network.world.pause_gate.pause(False))
    assert finish(network) == finish(make_network(budget=budget))
    assert not [msg for msg in network.outputs if type(msg) is Rejected]


def test_a_reset_world_publishes_at_once_if_it_is_not_paused_and_names_the_run_it_replaces():
    network = make_network()
    network.run(20)
    notice, world, observation = network.world.reset(8, began=5.0)
    assert notice == Notice('starts again: run 8 replaces run 7')
    assert (world.run, world.replaces, world.began) == (8, 7, 5.0)
    assert observation == StateReward(8, 1, 0, network.observations[0].state, 0.0, False, False)


def test_messages_from_before_a_reset_that_come_late_are_ignored():
    network = make_network()
    network.run(20)
    reset_world(network)
    network.run(4)
    ignored, = network.world.on_action(Action(7, 1, 3, 0, False, 0.0, 1))
    assert ignored == Ignored('before a reset', 'ignored an action of run 7, which ended with a '
                              'reset')
    late, = network.learner.observe(StateReward(7, 1, 3, 0, -1.0, False, False))
    assert late.kind == 'before a reset' and 'a state of run 7' in late.reason
    late, = network.learner.on_recommendation(Recommendation(7, 1, 3, 0, 3))
    assert late.kind == 'before a reset'
    assert network.learner.on_world(describe_world(ROOM, 'room', 7)) == ()
    assert network.world.on_world(describe_world(ROOM, 'room', 7), 10.0) == ()
    assert network.learner.tracker.run == 8


def test_another_map_or_another_run_cannot_replace_this_one():
    for other in (describe_world(grid('..G', '...'), 'other', 9)._replace(replaces=7),
                  describe_world(ROOM, 'room', 9)._replace(replaces=6),
                  describe_world(ROOM, 'room', 9)):
        network = make_network()
        network.run(20)
        assert network.learner.on_world(other) == ()
        assert network.learner.tracker.run == 7


def test_a_restored_world_knows_which_run_it_replaces():
    world = WorldMachine(ROOM, 'room', RUN, 3)
    world.reset(8, began=1.0)
    again = WorldMachine(ROOM, 'room', 9, 3)
    again.load_state_dict(*world.state_dict(), [])
    assert again.description == world.description


def test_a_learner_that_is_reset_stays_in_its_run_and_answers_repetitions_as_before():
    network = make_network()
    network.run(21)
    learner = network.learner
    answer, = learner.last_outputs()[-1:]
    last, = (msg for msg in network.observations if msg[:3] == answer[:3])
    assert type(answer) is Action and learner.observe(last) == (answer,)
    notice, = learner.reset()
    assert notice == Notice('forgets everything that it learned')
    assert learner.state.digest() == initial_state(World(ROOM), CONFIG).digest()
    assert (learner.step_count, learner.agent.steps, len(learner.reports)) == (0, 0, 0)
    assert learner.observe(last) == (answer,)
    network.publish((network.world.observation,))
    assert finish(network)


def test_a_finished_learner_that_is_reset_lets_the_next_episode_start():
    network = make_network()
    finish(network)
    notice, action = network.learner.reset()
    assert action == Action(*network.world.observation[:3], -1, False, 0.0, 1)
    network.publish((action,))
    assert finish(network)
    progress = [msg.iteration for msg in network.outputs if type(msg) is Progress]
    assert progress == [1, 2, 3, 1, 2, 3]


def test_a_learner_without_a_world_has_nothing_to_reset():
    assert Learner(CONFIG, 3).reset() == ()


def test_a_learner_that_is_killed_after_a_reset_continues_as_if_it_had_not_been():
    def digest(kill):
        network = make_network()
        network.run(21)
        network.learner.reset()
        if kill:
            restart_learner(network)
        network.publish((network.world.observation,))
        return finish(network)
    assert digest(kill=True) == digest(kill=False)


def test_a_learner_that_receives_nothing_says_that_the_world_may_be_paused():
    network = make_network()
    network.run(21)
    assert network.learner.waiting is None
    for _ in range(6):
        network.learner.tick()
    assert 'is its grid_world running, and not paused?' in network.learner.waiting_for()


CHANGES = ({'learning_rate': 0.3}, {'discount': 0.5, 'temperature': 0.2}, {'episodes': 1},
           {'iterations': 5}, {'remembers_advice': False}, {'trace_decay': 0.5},
           {'trust': 'scheduled', 'confidence': 0.3}, {'trust': 'none'}, {'learns_prior': True},
           {'belief_listen': 1.0}, {'initial_value': 3.0}, {'advice_timeout': 2.0})


@pytest.mark.parametrize('changes', CHANGES, ids=str)
def test_a_change_counts_and_survives_a_kill(changes):
    def changed(kill):
        network = make_network()
        network.run(21)
        network.publish(network.learner.change(changes))
        assert network.learner.needs_checkpoint
        if kill:
            restart_learner(network)
            network.publish(network.learner.last_outputs()[-1:])
        return finish(network), network.learner
    digest, learner = changed(kill=True)
    expected, other = changed(kill=False)
    assert digest == expected
    assert learner.config == other.config
    assert learner.changes == other.changes == changes
    if not {'remembers_advice', 'advice_timeout'} & set(changes):
        assert digest != finish(make_network())


def test_a_changed_confidence_or_temperature_counts_from_now_on():
    network = make_network(replace(METHODS['published']['constant'], episodes=2))
    network.run(60)
    network.learner.change({'confidence': 0.25, 'temperature': 2.0})
    state = network.learner.state
    assert state.scheduled_confidence[0] == 0.25 and state.temperature[0] == 2.0
    network.learner.change({'discount': 0.9})
    again = network.learner.state  # another change does not set it back
    assert again.scheduled_confidence[0] == 0.25


def test_a_changed_first_value_counts_only_for_actions_and_states_that_were_never_tried():
    world, before = World(ROOM), replace(CONFIG, initial_value=1.0)
    state = initial_state(world, before)
    state.q[0, 3], state.visits[0, 3], state.departures[0] = 7.0, 2.0, 2.0
    state.belief[0] = 9.0, 1.0, 1.0
    after = replace(before, initial_value=4.0, belief_listen=5.0)
    changed = changed_state(state, world, before, after)
    assert changed.q[0, 3] == 7.0 and changed.q[0, 1] == 4.0 and changed.q[0, 0] == -float('inf')
    assert changed.belief[0].tolist() == [9.0, 1.0, 1.0]
    assert changed.belief[1].tolist() == [5.0, 2.0, 0.0]
    assert (changed.pool_listen[0], changed.pool_discard[0]) == (5.0, 2.0)
    assert state.q[0, 1] == 1.0 and state.pool_listen[0] == 8.0


def test_another_kind_of_trust_starts_again_and_what_else_was_learned_stays():
    world = World(ROOM)
    state = initial_state(world, CONFIG)
    for number, array in enumerate(state, 1):
        array += number
    after = replace(CONFIG, trust='explicit', trust_rate=0.5)
    changed, fresh = changed_state(state, world, CONFIG, after), initial_state(world, after)
    starts_again = {'belief', 'trust_rate', 'guided_stage', 'best_return', 'advice_agreed',
                    'advice_seen', 'pool_size', 'pool_listen', 'pool_discard'}
    for name, array in changed._asdict().items():
        expected = getattr(fresh if name in starts_again else state, name)
        assert array.tolist() == expected.tolist(), name


@pytest.mark.parametrize('changes, sentence', [
    ({'learning_rate': 2.0}, 'learning_rate must lie in [0, 1], got 2.0'),
    ({'discount': float('nan')}, 'discount must lie in [0, 1], got nan'),
    ({'iterations': 1}, 'iterations must be 0, or above the 2 that are done, got 1'),
    ({'learns_model': True}, 'learns_model must stay false while a learner runs, since its arrays '
     'differ, got true'),
    ({'replays': True}, 'replays must stay false while a learner runs, since its arrays differ, '
                        'got true'),
    ({'planner': 'r_max'}, 'planner must stay none while a learner runs, since its arrays differ, '
                           'got r_max'),
    ({'belief_listen': 0.0}, 'belief_listen and belief_discard must be above 0 where trust is '
                             'beta, got 0.0 and 2.0'),
    ({'trust': 'explicit'}, 'trust_rate must lie in [0, 1] where trust is explicit, got 2.0')])
def test_a_change_that_is_not_allowed_is_rejected_with_one_sentence_and_changes_nothing(
        changes, sentence):
    network = make_network()
    while not network.learner.reports or network.learner.reports[-1].iteration < 2:
        network.run(1)
    for try_change in (network.learner.check_changes, network.learner.change):
        with pytest.raises(ConfigError) as error:
            try_change(changes)
        assert str(error.value) == sentence
    assert finish(network) == finish(make_network())


def test_a_finished_learner_continues_when_it_gets_more_iterations():
    network = make_network()
    finish(network)
    network.publish(network.learner.change({'iterations': 5}))
    assert finish(network) == finish(make_network(iterations=5))


def test_a_learner_whose_trust_ends_answers_the_observation_that_waited_for_advice():
    learner = Learner(CONFIG, seed=3)
    learner.on_world(describe_world(ROOM, 'room', RUN))
    assert learner.observe(StateReward(RUN, 1, 0, 0, 0.0, False, False)) == ()
    notice, action = learner.change({'trust': 'none'})
    assert notice == Notice('continues with trust none')
    assert type(action) is Action


@pytest.mark.parametrize('changes, words', [
    ({'confidence': 0.5}, 'continues with confidence 0.5; while trust is beta, confidence has no '
     'effect'),
    ({'confidence': 0.5, 'guided_steps': 9}, 'continues with confidence 0.5, guided_steps 9; '
     'while trust is beta, confidence, guided_steps have no effect'),
    ({'confidence': 0.5, 'trust': 'scheduled'}, 'continues with confidence 0.5, trust scheduled'),
    ({'trust_rate': 0.3, 'remembers_advice': False},
     'continues with trust_rate 0.3, remembers_advice False')])
def test_a_learner_says_which_changed_setting_has_no_effect(changes, words):
    learner = Learner(METHODS['published']['beta_implicit'], seed=3)
    learner.on_world(describe_world(ROOM, 'room', RUN))
    assert learner.change(changes)[0] == Notice(words)


def test_a_world_at_its_first_start_replaces_no_run():
    assert describe_world(ROOM, 'room', RUN).replaces == 0
