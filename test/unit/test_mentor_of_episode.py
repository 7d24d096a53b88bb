# SPDX-License-Identifier: Apache-2.0
"""Choice of one mentor for each episode (RLPA), by examples worked by hand."""

from dataclasses import replace
import math

from bar_grid_training import use_plain_kernels
import numpy as np
import pytest
from tiny_worlds import advised, Bench, corridor, room

from comply_ros.learner.action_choice import choose
from comply_ros.learner.agent import Agent
from comply_ros.learner.confidence import confidence_map, most_trusted_mentor
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import EPISODES, MEAN
from comply_ros.learner.mentor_of_episode import choose_mentor, record_return
from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import DOWN, LEFT, NO_ACTION, RIGHT, UP
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

RETURNS = {'trust': 'returns', 'return_bonus': 0.1}


def known(*records, bonus=0.1):
    """Return a bench that knows episodes, mean, lowest and highest return of each mentor."""
    bench = Bench(room(), len(records), trust='returns', return_bonus=bonus)
    bench.state.followed[...] = records
    return bench


def chosen(as_run, bench):
    """Return the mentor of the next episode."""
    as_run(choose_mentor)(bench.kernel_config, bench.state)
    return bench.state.followed_mentor[0]


def record(as_run, bench, *returns):
    """Let episodes with the mentor that is followed end with these returns."""
    for each in returns:
        as_run(record_return)(each, bench.kernel_config, bench.state)


# 20 episodes, so sqrt(2 log 20) = 2.4477; the returns go from -30 to 10, so 40 times the bonus of
# 0.1 is 4: 4 * 2.4477 = 9.7909 over the root of the episodes of each.
# First: 5 + 9.7909 / sqrt(16) = 7.4477. Second: 3 + 9.7909 / sqrt(4) = 7.8955.
@pytest.mark.parametrize('bonus, mentor', [(0.1, 1), (0.05, 0), (0.0, 0)])
def test_the_mentor_with_the_highest_bound_of_its_return_is_chosen(as_run, bonus, mentor):
    # With 0.05: 5 + 1.2239 and 3 + 2.4477.
    bench = known((16, 5.0, -30.0, 10.0), (4, 3.0, 0.0, 6.0), bonus=bonus)
    assert chosen(as_run, bench) == mentor


def test_who_was_not_followed_yet_comes_first_and_ties_go_to_the_first(as_run):
    assert chosen(as_run, known((3, 9.0, 9.0, 9.0), (0, 0, 0, 0), (0, 0, 0, 0))) == 1
    assert chosen(as_run, known((1, 9.0, 9.0, 9.0), (1, 9.0, 9.0, 9.0))) == 0


def test_a_single_mentor_is_always_followed(as_run):
    bench = known((0, 0, 0, 0))
    assert chosen(as_run, bench) == 0
    record(as_run, bench, -4.0)
    assert chosen(as_run, bench) == 0


def test_a_return_counts_for_the_mentor_that_was_followed(as_run):
    bench = known((0, 0, 0, 0), (0, 0, 0, 0))
    bench.state.followed_mentor[0] = 1
    record(as_run, bench, -3.0, 6.0, 0.0)
    assert bench.state.followed.tolist() == [[0, 0, 0, 0], [3, 1.0, -3.0, 6.0]]


def test_after_an_episode_the_one_with_the_best_mean_is_followed(as_run):
    bench = known((5, 2.0, 2.0, 2.0), (1, 1.0, 1.0, 1.0))
    bench.state.followed_mentor[0] = 1
    record(as_run, bench, 1.5)  # its mean is 1.25
    assert bench.state.followed_mentor[0] == 0
    bench.state.followed_mentor[0] = 1
    record(as_run, bench, 9.5)  # 4
    assert bench.state.followed_mentor[0] == 1


def test_where_nobody_was_chosen_no_return_is_recorded(as_run):
    bench = known((0, 0, 0, 0))
    record(as_run, bench, 5.0)
    assert not bench.state.followed.any()
    assert chosen(as_run, bench) == 0


def test_it_alone_is_trusted_and_where_it_has_no_advice_nobody_is(as_run):
    bench = known((0, 0, 0, 0), (0, 0, 0, 0))
    bench.state.followed_mentor[0] = 1
    advice = [advised(LEFT, UP), advised(LEFT, -1)]
    arguments = bench.kernel_config, bench.state
    assert as_run(most_trusted_mentor)(4, advice[0], 7, *arguments) == (1, 1.0)
    assert bench.state.confidences.tolist() == [0.0, 1.0]
    assert as_run(most_trusted_mentor)(4, advice[1], 7, *arguments)[1] == 0.0
    bench.state.q[4, DOWN] = 1e6  # its own softmax
    assert as_run(choose)(4, advice[1], 7, 0.0, 0.5, *arguments)[0] == DOWN


def make_agent(**settings):
    """Return an agent with two mentors in the corridor."""
    agent = Agent(LearnerConfig(**{**RETURNS, 'episodes': 2, **settings}), 0, None, ('a', 'b'))
    agent.start(corridor())
    return agent


def begin(agent):
    """Play the first two steps of an episode; both mentors have advice."""
    agent.step(0, 0, 0.0, False, False, (RIGHT, RIGHT))
    return agent.step(1, 1, -1.0, False, False, (RIGHT, LEFT))


def finish(agent, terminated=True):
    """Play its last one."""
    return agent.step(2, 2, 10.0, terminated, not terminated, (NO_ACTION, NO_ACTION))


def test_one_mentor_is_followed_through_an_episode_and_the_other_one_in_the_next():
    agent = make_agent()
    assert begin(agent).action == RIGHT and finish(agent).action == NO_ACTION
    assert agent.state.followed.tolist() == [[1, 9.0, 9.0, 9.0], [0, 0, 0, 0]]
    decision = begin(agent)
    assert (decision.action, decision.mentor, decision.confidence) == (LEFT, 1, 1.0)


def test_an_episode_that_was_cut_off_counts_with_its_return_so_far():
    agent = make_agent()
    begin(agent)
    finish(agent, terminated=False)
    assert agent.state.followed[0].tolist() == [1, 9.0, 9.0, 9.0]


def test_an_episode_that_was_abandoned_does_not_count():
    agent = make_agent()
    begin(agent)
    begin(agent)  # the world began anew
    assert not agent.state.followed.any() and agent.state.followed_mentor[0] == 0
    finish(agent)
    assert agent.state.followed[:, 0].tolist() == [1, 0]
    begin(agent)
    agent.forget_last_action()  # a gap
    finish(agent)
    assert agent.state.followed[:, 0].tolist() == [1, 0]


def test_while_it_only_measures_it_follows_nobody():
    agent = make_agent(measuring_iterations=1)
    for _ in range(2):
        assert begin(agent).confidence == 0.0
        finish(agent)
    assert not agent.state.followed.any() and agent.learns
    assert begin(agent).confidence == 1.0


def test_a_mentor_that_joins_is_followed_next_and_what_is_known_stays():
    agent = make_agent()
    for _ in range(2):
        begin(agent)
        finish(agent)
    agent.add_mentor('c')
    agent.step(0, 0, 0.0, False, False, (LEFT, LEFT, RIGHT))
    assert agent.state.followed[:, 0].tolist() == [1, 1, 0]
    assert agent.state.followed_mentor[0] == 2


def test_another_kind_of_trust_knows_nothing_of_the_returns():
    agent = make_agent()
    begin(agent)
    finish(agent)
    nobody = np.full(6, -1)
    agent.reconfigure(replace(agent.config, trust='scheduled'), nobody)
    assert agent.state.followed.size == 0
    begin(agent)
    agent.reconfigure(LearnerConfig(**RETURNS, episodes=2), nobody)
    finish(agent)  # began under other settings
    assert not agent.state.followed.any()
    assert begin(agent).confidence == 1.0


def test_it_continues_in_the_middle_of_an_episode_from_what_was_saved():
    agents = make_agent(), make_agent()
    begin(agents[0])
    values, arrays = agents[0].state_dict()
    agents[1].load_state_dict(values, {name: array.copy() for name, array in arrays.items()})
    for agent in agents:
        finish(agent)
        begin(agent)
        finish(agent)
    assert agents[0].state.followed[:, 0].tolist() == [1, 1]
    assert agents[0].state.digest() == agents[1].state.digest()


def test_of_a_good_and_a_bad_mentor_the_good_one_is_followed_most(monkeypatch):
    use_plain_kernels(monkeypatch)
    world = World(read_map('bar_grid', 'published'))
    good = optimal_policy(world)
    bad = np.where(good >= 0, (good + 1) % 4, good)
    bad = np.where(world.available[np.arange(world.n_states), bad], bad, good)
    mentors = {'bad': AdviceBudget(world, bad), 'good': AdviceBudget(world, good)}
    training = Training(world, mentors, find_method('rlpa', 'published'), 0)
    for _ in range(20):
        result = training.iterate()
    episodes = training.state.followed[:, 0]
    assert episodes.sum() == 300 and episodes[1] > 200
    assert result.confidences[1] > 0.5 and math.isfinite(result.mean_return)
    learned = training.learned()
    assert (learned.policy[good >= 0] == good[good >= 0]).mean() > 0.9


def test_what_is_learned_is_the_advice_of_the_best_mentor_also_while_another_one_is_tried():
    bench = Bench(room(), n_mentors=2, trust='returns')
    bench.state.followed[:, EPISODES], bench.state.followed[:, MEAN] = 3.0, [9.0, -5.0]
    bench.state.followed_mentor[0] = 1
    advice = np.full(2 * 9, RIGHT)
    p = confidence_map(bench.config, bench.state, advice)
    assert p.tolist() == 9 * [1.0] + 9 * [0.0]
    assert bench.state.followed_mentor[0] == 1  # the episode goes on with the other one
    bench.state.followed[:, EPISODES] = 0.0
    assert not confidence_map(bench.config, bench.state, advice).any()  # nobody was followed yet
