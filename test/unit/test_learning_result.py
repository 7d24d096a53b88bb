# SPDX-License-Identifier: Apache-2.0
"""What was learned: the policy of it, what can begin from it, and what cannot."""

from dataclasses import replace

from bar_grid_training import bar_grid, best_policy, use_plain_kernels, use_shared_code
import numpy as np
import pytest
from tiny_worlds import corridor, FOUR, room

from comply_ros.learner.action_choice import policy_action
from comply_ros.learner.agent import Agent, no_advice
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import DISCARD, initial_state, LISTEN
from comply_ros.learner.learning_result import (
    begin_from,
    learned_by,
    learned_policy,
    LearningError,
)
from comply_ros.learner.presets import METHODS
from comply_ros.learner.training import Training
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import DOWN, LEFT, NO_ACTION, RIGHT, UP
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy, ReferenceReturns

ROOM = room()  # state 4 is in its middle and has all four moves


def policy_at_4(config, advice=NO_ACTION, tried=None, p=0.0):
    """Return the learned action in state 4; tried: values by action, p: confidence there."""
    state, received = initial_state(ROOM, config), no_advice(ROOM)
    for action, value in (tried or {}).items():
        state.q[4, action], state.visits[4, action] = value, 2.0
        state.departures[4] = 2.0
    received[4] = advice
    confidence = np.full(9, p)
    policy = learned_policy(config, state, received, confidence, ROOM)
    assert (np.delete(policy, 4) == NO_ACTION).all()
    return policy[4]


BETA = LearnerConfig(trust='beta', initial_value=3.0)


@pytest.mark.parametrize(('p', 'action'), [(0.51, LEFT), (0.5, DOWN), (0.0, DOWN)])
def test_advice_is_followed_where_the_confidence_is_above_one_half(p, action):
    assert policy_at_4(BETA, LEFT, {DOWN: 1.0, LEFT: 0.0}, p) == action


def test_without_advice_the_best_action_that_was_tried_counts():
    # RIGHT and LEFT were never tried: their 3.0 is the initial value, which nothing earned.
    assert policy_at_4(BETA, tried={UP: -2.0, DOWN: -1.0}) == DOWN


def test_a_state_of_which_nothing_is_known_has_no_action():
    assert policy_at_4(BETA) == NO_ACTION
    assert policy_at_4(BETA, LEFT, p=0.2) == NO_ACTION


@pytest.mark.parametrize('settings', [
    {'trust': 'scheduled', 'reuse_factor': 0.95}, {'trust': 'jump_start'}, {'trust': 'none'}])
def test_trust_by_time_is_no_trust_in_a_state(settings):
    assert policy_at_4(LearnerConfig(**settings), LEFT, {UP: 1.0}, p=1.0) == UP


def test_every_action_of_a_state_that_was_left_counts_where_visits_are_not_counted():
    config = LearnerConfig(visit_growth=0.0)
    state = initial_state(ROOM, config)
    state.q[4, UP], state.departures[4] = 1.0, 2.0
    assert learned_policy(config, state, no_advice(ROOM), np.zeros(9), ROOM)[4] == UP


def test_where_a_policy_knows_nothing_any_action_of_the_state_is_taken(as_run):
    q = initial_state(ROOM, BETA).q
    policy = np.array([NO_ACTION, LEFT, *7 * [NO_ACTION]], dtype=np.int8)

    def actions(s):
        return [as_run(policy_action)(s, u, policy, q, FOUR) for u in (0.0, 0.49, 0.5, 0.999)]
    assert actions(0) == [RIGHT, RIGHT, UP, UP]  # the lower left corner
    assert actions(1) == 4 * [LEFT]
    assert actions(4) == [LEFT, RIGHT, DOWN, UP]


def trained(method, profile='published', world=None, iterations=8, **settings):
    """Return a short training on the small map of the package, with a mentor."""
    policy = optimal_policy(world) if world else best_policy(profile)
    config = replace(METHODS[profile][method], iterations=iterations, **settings)
    training = Training(world or bar_grid(profile), policy, config, seed=4)
    for _ in range(iterations):
        training.iterate()
    return training


@pytest.mark.parametrize('method', METHODS['published'])
def test_the_exact_return_of_the_policy_is_what_it_earns_without_exploration(monkeypatch, method):
    use_shared_code(monkeypatch, METHODS['published'][method])
    learned = trained(method).learned()
    world = bar_grid('published')
    expected = ReferenceReturns(world).return_of(learned.policy)
    config = replace(METHODS['published'][method], learns=False, episodes=3000)
    acting = Training(world, best_policy('published'), config, seed=9, initial=learned)
    before = acting.state.digest()
    acting.iterate()
    error = acting.returns.std() / np.sqrt(len(acting.returns))
    assert abs(acting.returns.mean() - expected) < 4.0 * error + 1e-9
    assert acting.state.digest() == before  # it has learned nothing
    for name in ('policy', 'confidence', 'advice'):  # not of the fresh schedules of this one
        assert (getattr(acting.learned(), name) == getattr(learned, name)).all(), name


@pytest.mark.parametrize('method', METHODS['report'])
def test_a_learner_begins_with_values_and_beliefs_and_with_schedules_of_its_own(
        monkeypatch, method):
    use_shared_code(monkeypatch, METHODS['report'][method])
    before = trained(method, 'report')
    world, config = World(read_map('bar_grid', 'report')), METHODS['report'][method]
    state, fresh = begin_from(before.learned(), world, config), initial_state(world, config)
    for name, array in state._asdict().items():
        own = name in ('scheduled_confidence', 'temperature', 'trust_rate', 'guided_stage',
                       'best_return', 'traces', 'trail', 'queue', 'queued', 'workspace',
                       'priority', 'sampled', 'followed_mentor')
        assert (array == getattr(fresh if own else before.state, name)).all(), name
        assert not np.shares_memory(array, getattr(before.state, name))


def test_beliefs_begin_anew_with_another_kind_of_trust():
    config = METHODS['published']['explicit']
    learned = trained('beta_implicit').learned()
    state = begin_from(learned, bar_grid('published'), config)
    assert (state.belief[:, LISTEN] == config.belief_listen).all()
    assert (state.belief[:, DISCARD] == config.belief_discard).all()
    assert (state.q[state.visits > 1.0] == learned.state.q[learned.state.visits > 1.0]).all()


def test_a_learning_without_a_model_cannot_begin_one_with_a_model(monkeypatch):
    use_plain_kernels(monkeypatch)
    world = bar_grid('published')
    with pytest.raises(LearningError, match='must be of a learner with replays true'):
        begin_from(trained('sarsa', iterations=1).learned(), world,
                   METHODS['published']['head_start'])
    with pytest.raises(LearningError, match='must be of a learner with learns_model true'):
        begin_from(trained('sarsa', iterations=1).learned(), world,
                   METHODS['published']['model_based'])
    with pytest.raises(LearningError, match='must be of a learner with planner psrl, as this one '
                                            'is, got one with planner r_max'):
        begin_from(trained('r_max', iterations=1).learned(), world, METHODS['published']['psrl'])


def test_a_learning_of_another_world_is_rejected_with_both_hashes():
    learned = learned_by(BETA, initial_state(ROOM, BETA), no_advice(ROOM), ROOM)
    with pytest.raises(LearningError, match='was learned in another world') as error:
        Agent(BETA, 0, learned).start(corridor())
    for world in (ROOM, corridor()):
        assert world.grid.sha256[:12] in str(error.value)


@pytest.mark.parametrize(('name', 'value', 'message'), [
    ('q', np.nan, 'not all of q is -inf where'), ('visits', 0.5, 'not all of visits is finite'),
    ('belief', np.inf, 'not all of belief is finite'),
    ('departures', -np.inf, 'not all of departures is finite'),
    ('pool_size', 0.0, 'not all of pool_size is finite'),
    ('advice_agreed', 2.0, 'at most advice_seen')])
def test_values_that_cannot_be_are_rejected(name, value, message):
    state = initial_state(ROOM, BETA)
    getattr(state, name)[...] = value
    with pytest.raises(LearningError, match=message):
        learned_by(BETA, state, no_advice(ROOM), ROOM).validate(ROOM)


def test_a_reset_returns_to_what_the_learner_began_with():
    training = trained('beta_implicit')
    world, config = bar_grid('published'), training.agent.config
    agent = Agent(config, 1, training.learned())
    agent.start(world)
    begun = agent.state.digest()
    agent.step(60, 0, 0.0, False, False, (UP,))
    agent.step(61, 1, -1.0, False, False, (UP,))
    agent.state.q[60, UP] = 7.0
    agent.reset()
    assert agent.state.digest() == begun
    assert (agent.learned(agent.earlier_advice).policy
            == learned_policy(config, agent.state, training.advice,
                              training.learned().confidence, world)).all()


def test_a_learner_that_stops_to_learn_acts_by_its_policy_and_changes_nothing():
    agent = Agent(replace(BETA, iterations=0, episodes=1), 1)
    agent.start(ROOM)
    for step, s in enumerate((0, 3, 4)):
        agent.step(s, step, -1.0 if step else 0.0, False, False, (UP,))
    advice = no_advice(ROOM)
    advice[[0, 3, 4]] = UP
    agent.reconfigure(replace(agent.config, learns=False), advice)
    before = agent.state.digest()
    assert [agent.step(s, 3 + k, -1.0, False, False, (NO_ACTION,))[:3]
            for k, s in enumerate((0, 3, 4))] == 3 * [(UP, False, 0.0)]
    assert agent.state.digest() == before
    agent.reconfigure(replace(agent.config, learns=True), advice)
    agent.step(3, 6, -1.0, False, False, (UP,))
    assert agent.state.digest() != before


def test_a_state_dict_has_the_policy_that_a_learner_acts_by():
    learned = trained('vanishing').learned()  # fresh schedules would give another policy
    world = bar_grid('published')
    agent = Agent(replace(learned.config, learns=False), 1, learned)
    agent.start(world)
    restored = Agent(agent.config, 1)
    restored.start(world)
    restored.load_state_dict(*agent.state_dict())
    assert (restored.learned(restored.earlier_advice).confidence == learned.confidence).all()
    assert (restored.policy == learned.policy).all()
    assert (restored.earlier_advice == learned.advice).all()
