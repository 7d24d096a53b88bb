# SPDX-License-Identifier: Apache-2.0
"""An agent in one world, observation by observation."""

from dataclasses import replace
import json
from math import isnan

import pytest
from tiny_worlds import corridor, grid, room

from comply_ros.learner.agent import Agent, IterationResult, no_advice
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import LATER_ARRAYS
from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Action, Recommendation, step_id
from comply_ros.protocol.world import WorldMachine
from comply_ros.world.grid import NO_ACTION, RIGHT
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy
from comply_ros.world.state_action_spaces import Spaces


def make_agent(**settings):
    """Return an agent in the corridor, with one episode an iteration and two iterations."""
    agent = Agent(LearnerConfig(**{'episodes': 1, 'iterations': 2, **settings}), seed=0)
    agent.start(corridor())
    return agent


def play_episode(agent, advice=(NO_ACTION, NO_ACTION)):
    """Lead the agent from 0 over 1 to the goal; return its decision there."""
    agent.step(0, 0, 0.0, False, False, (advice[0],))
    agent.step(1, 1, -1.0, False, False, (advice[1],))
    return agent.step(2, 2, 10.0, True, False, (NO_ACTION,))


def test_an_iteration_ends_with_its_result():
    agent = make_agent(temperature=2.0)
    decision = play_episode(agent)
    assert (decision.action, decision.followed, decision.confidence) == (NO_ACTION, False, 0.0)
    result = decision.iteration
    assert type(result) is IterationResult
    assert (result.number, result.mean_return) == (1, 9.0)
    assert (result.steps, result.temperature) == (2, 2.0)
    assert isnan(result.confidence) and not agent.finished
    assert (agent.iterations_done, agent.steps) == (1, 2)
    assert agent.state.temperature[0] == 2.0 * 0.99  # of the next iteration


def test_an_iteration_has_as_many_episodes_as_its_settings_say():
    agent = make_agent(episodes=3)
    results = [play_episode(agent).iteration for _ in range(6)]
    assert [result and result.number for result in results] == [None, None, 1, None, None, 2]
    assert (results[5].steps, results[5].episodes, agent.steps) == (6, 3, 12)


def test_an_iteration_that_gets_shorter_has_the_episodes_that_were_played():
    agent = make_agent(episodes=3)
    for _ in range(2):
        assert play_episode(agent).iteration is None
    agent.reconfigure(replace(agent.config, episodes=1), no_advice(corridor()))
    result = play_episode(agent).iteration
    assert (result.number, result.episodes, result.steps) == (1, 3, 6)
    assert play_episode(agent).iteration.episodes == 1


def test_it_has_finished_after_the_last_iteration():
    agent, finished = make_agent(), []
    for _ in range(2):
        play_episode(agent)
        finished.append(agent.finished)
    assert finished == [False, True]


def test_an_episode_without_its_first_steps_does_not_count_but_teaches():
    agent = make_agent()
    first = agent.step(1, 1, -1.0, False, False, (NO_ACTION,))
    assert agent.step(2, 2, 10.0, True, False, (NO_ACTION,)).iteration is None
    assert agent.state.q[1, first.action] > 0.0
    assert agent.steps == 1
    assert play_episode(agent).iteration.number == 1


def test_after_a_gap_the_reward_teaches_nothing_and_the_episode_does_not_count():
    agent = make_agent(trace_decay=0.9)
    agent.step(0, 0, 0.0, False, False, (NO_ACTION,))
    agent.step(1, 1, -1.0, False, False, (NO_ACTION,))
    assert agent.state.traces.any()
    before = agent.state.q.copy()
    agent.forget_last_action()
    assert agent.step(2, 2, 10.0, True, False, (NO_ACTION,)).iteration is None
    assert (agent.state.q == before).all() and agent.steps == 1
    assert not agent.state.traces.any()


def test_measuring_changes_nothing_but_the_counters():
    agent = make_agent(measuring_iterations=1, trust='head_start', replays=True)
    before = agent.state.digest()
    agent.step(0, 0, 0.0, False, False, (RIGHT,))
    agent.step(1, 1, -1.0, False, False, (RIGHT,))
    assert agent.state.digest() == before and agent.steps == 1
    assert not agent.learns
    agent.step(2, 2, 10.0, True, False, (NO_ACTION,))
    assert agent.learns
    agent.step(0, 0, 0.0, False, False, (RIGHT,))
    assert agent.state.digest() != before


def test_the_confidence_of_an_iteration_is_the_mean_over_the_decisions_with_advice():
    settings = {'trust': 'scheduled', 'confidence': 1.0, 'reuse_factor': 0.5}
    decision = play_episode(make_agent(**settings), advice=(RIGHT, RIGHT))
    assert decision.iteration.confidence == 0.75  # 1 at step 0, 1/2 at step 1
    decision = play_episode(make_agent(**settings), advice=(NO_ACTION, RIGHT))
    assert decision.iteration.confidence == 0.5


def test_a_decision_says_whether_it_follows_advice():
    agent = make_agent(trust='scheduled', confidence=1.0)
    assert agent.step(0, 0, 0.0, False, False, (RIGHT,)) == (RIGHT, True, 1.0, None, 0)
    assert agent.step(1, 1, -1.0, False, False, (NO_ACTION,))[1:] == (False, 0.0, None, -1)


def test_traces_end_with_the_episode():
    agent = make_agent(trace_decay=0.9)
    agent.step(0, 0, 0.0, False, False, (NO_ACTION,))
    agent.step(1, 1, -1.0, False, False, (NO_ACTION,))
    assert agent.state.traces.any()
    agent.step(2, 2, 10.0, True, False, (NO_ACTION,))
    assert not agent.state.traces.any()


def test_an_agent_that_is_reset_is_as_a_new_one():
    agent, new = make_agent(iterations=4), make_agent(iterations=4)
    for _ in range(3):
        play_episode(agent)
    agent.reset()
    assert (agent.iterations_done, agent.steps, agent.draws.used) == (0, 0, 0)
    for _ in range(3):
        assert repr(play_episode(agent)) == repr(play_episode(new))  # nan is not equal to itself
    assert agent.state.digest() == new.state.digest()


@pytest.mark.parametrize('steps', range(6))
def test_an_agent_that_is_restored_at_any_step_continues_with_the_same_bits(steps):
    observations = [(0, 0, 0.0, False, False, (RIGHT,)), (1, 1, -1.0, False, False, (RIGHT,)),
                    (2, 2, 10.0, True, False, (NO_ACTION,))] * 3
    settings = {'trust': 'beta', 'trace_decay': 0.5, 'iterations': 9}
    agent, again = make_agent(**settings), make_agent(**settings)
    for observation in observations[:steps]:
        agent.step(*observation)
    values, arrays = agent.state_dict()
    values = json.loads(json.dumps(values))
    again.load_state_dict(values, {name: array.copy() for name, array in arrays.items()})
    for observation in observations[steps:]:
        assert repr(again.step(*observation)) == repr(agent.step(*observation))
    assert again.state.digest() == agent.state.digest()
    assert (again.steps, again.iterations_done) == (agent.steps, agent.iterations_done)


def test_a_state_that_was_saved_before_a_new_array_is_restored():
    agent, again = make_agent(), make_agent()
    agent.step(0, 0, 0.0, False, False, (RIGHT,))
    values, arrays = agent.state_dict()
    again.load_state_dict(values, {name: array for name, array in arrays.items()
                                   if name not in LATER_ARRAYS})
    assert again.state.digest() == agent.state.digest()


def test_a_state_of_another_world_is_rejected():
    other = Agent(LearnerConfig(), seed=0)
    other.start(room())
    with pytest.raises(ValueError) as error:
        make_agent().load_state_dict(*other.state_dict())
    assert str(error.value) == 'q must have the shape (3, 4), got (9, 4)'


RUN = 7
TINY = grid('G.#', '...', starts=(1, 4), limit=4, intended=0.7)
POLICY = optimal_policy(World(TINY))
CONFIG = replace(find_method('explicit', 'published'), episodes=5, iterations=3)


class SlowMentorNetwork:
    """
    World, learner and a mentor that receives only the newest action, as a latched topic keeps it.

    Attributes
    ----------
    missed: actions that the mentor waits for and did not receive when they were published first.

    """

    def __init__(self):
        self.world, self.learner = WorldMachine(TINY, 'tiny', RUN, seed=4), new_learner()
        self.mentor = Mentor(3, 'mistakes')
        for actor in (self.mentor, self.learner):
            actor.on_world(self.world.description)
        self.mentor.use(POLICY)
        self.newest, self.missed = None, 0
        self._advised, self._received = None, None  # step ids

    def observe(self):
        """Publish the open observation, for the first time or again; deliver every answer once."""
        observation = self.world.observation
        outputs = list(self.learner.observe(observation))
        self._keep_newest(outputs)
        advice = ()
        if self.newest:
            advice = self.mentor.on_action(self.newest)
            self._received = step_id(self.newest)
        for msg in (*advice, *self.mentor.observe(observation)):
            if type(msg) is Recommendation:
                self._advised = step_id(msg)
            answers = self.learner.on_recommendation(msg)
            self._keep_newest(answers)
            outputs += answers
        for msg in outputs:
            if type(msg) is Action:
                self.world.on_action(msg)

    def _keep_newest(self, outputs):
        """Let the newest action replace one that the mentor may not have received."""
        for msg in outputs:
            if type(msg) is Action:
                if self.newest and step_id(msg) > step_id(self.newest):
                    self.missed += self._advised == step_id(self.newest) != self._received
                self.newest = msg


def new_learner():
    """Return a learner that waits for every advice."""
    return Learner(CONFIG, seed=4, remembers_advice=False)


def restarted(learner):
    """Return a learner that was killed and continues from its checkpoint."""
    values, arrays = learner.state_dict()
    again = new_learner()
    again.load_state_dict(values, {name: array.copy() for name, array in arrays.items()}, [])
    return again


@pytest.mark.parametrize('killed', [False, True])
def test_a_mentor_that_missed_the_last_action_before_a_goal_receives_it_again(killed):
    training = Training(World(TINY), AdviceBudget(World(TINY), POLICY, 3, 'mistakes'), CONFIG,
                        seed=4)
    for _ in range(3):
        training.iterate()
    network = SlowMentorNetwork()
    for number in range(1000):
        if network.learner.finished:
            break
        network.observe()
        if killed and number % 3 == 0:
            network.learner = restarted(network.learner)
    assert network.learner.finished, f'stands still at {step_id(network.world.observation)}'
    assert network.missed > 3
    assert network.learner.state.digest() == training.state.digest()


def test_an_agent_learns_in_a_world_without_a_model():  # (2.15): q = 0 + 1 * (5 - 0)
    agent = Agent(LearnerConfig(episodes=1, iterations=1), seed=0)
    agent.start(World(Spaces(300, ('go', 'wait', 'turn'), 10)))
    first = agent.step(299, 0, 0.0, False, False, (NO_ACTION,))
    last = agent.step(7, 1, 5.0, True, False, (NO_ACTION,))
    assert (last.action, last.iteration.mean_return, agent.finished) == (NO_ACTION, 5.0, True)
    assert agent.state.q[299, first.action] == 5.0
    assert agent.state.q.sum() == 5.0
    assert agent.learned([-1] * 300).policy[299] == first.action
