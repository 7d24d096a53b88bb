# SPDX-License-Identifier: Apache-2.0
"""The learner takes a shorter way for a usual step, with the same result."""

from dataclasses import replace
import random

from array_kernels import on_arrays
import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.presets import find_method
from comply_ros.learner.step_kernels import PLAIN
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.messages import Action, ANYONE, Recommendation, StateReward
from comply_ros.protocol.world import WorldMachine
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

RUN, OTHER_RUN, NUMBER, OTHER = 7, 8, 5, 6
GRID = grid('G..', '.#.', '...', starts=(0, 2), limit=6)
AVAILABLE = World(GRID).available
OTHER_MSG = describe_world(GRID, 'other', OTHER_RUN)
CHANGES = ({'temperature': 0.3}, {'trust': 'none'}, {'trust': 'scheduled'}, {'episodes': 1},
           {'remembers_advice': False}, {'remembers_advice': True}, {'iterations': 0},
           {'iterations': 40})


class Twins:
    """A learner, and one like it that never takes the shorter way, with the same messages."""

    def __init__(self, method, remembers_advice, seed, publishes_early=False):
        self.random, self.seed = random.Random(seed), seed
        self.config = replace(find_method(method, 'published'), episodes=2,
                              iterations=self.random.choice((3, 0)))
        self.remembers_advice, self.usual_steps = remembers_advice, 0
        self.publishes_early, self.early_actions = publishes_early, 0
        self.world = WorldMachine(GRID, 'small', RUN, seed)
        self.history = [self.world.observation]
        self.fast, self.slow = self._make_learner(), self._make_learner()
        self.both('on_world', self.world.description)

    def _make_learner(self):
        return Learner(self.config, self.seed, self.remembers_advice, NUMBER)

    def both(self, name, *arguments):
        """Call a method of both, and check that they are alike; return the outputs."""
        if name == 'observe' and self.fast.tracker.expected is not None:
            self.usual_steps += arguments[0][:3] == self.fast.tracker.expected
        self.slow.tracker.expected = None
        if self.publishes_early:
            return self._both_early(name, arguments)
        outputs = getattr(self.fast, name)(*arguments)
        assert repr(getattr(self.slow, name)(*arguments)) == repr(outputs), (name, arguments)
        self._check_states(name, arguments)
        return outputs

    def _both_early(self, name, arguments):
        early: list[Action] = []
        self.fast.publish_early = early.append
        outputs = getattr(self.fast, name)(*arguments) or ()
        outputs = (*early, *outputs)
        self.early_actions += len(early)
        expected = getattr(self.slow, name)(*arguments) or ()
        assert sorted(map(repr, outputs)) == sorted(map(repr, expected)), (name, arguments)
        self._check_states(name, arguments)
        return outputs

    def _check_states(self, name, arguments):
        facts, other_facts = snapshot(self.fast), snapshot(self.slow)
        for fact, value in facts.items():
            assert value == other_facts[fact], (fact, name, arguments)

    def deliver(self, outputs):
        """Let the world receive the actions among these outputs."""
        for msg in outputs or ():
            if type(msg) is Action:
                self.world.on_action(msg)
                if self.world.observation != self.history[-1]:
                    self.history.append(self.world.observation)

    def act(self):
        """Let something happen, most often the next observation or its advice."""
        self.random.choices(
            (self._observation, self._advice, self._early_advice, self._repeated, self._foreign,
             self._impossible, self._strange_advice, self._tick, self._world, self._restart,
             self._allow_gap, self._change, self._reset, self._no_advice, self._release),
            (60, 40, 5, 8, 8, 12, 8, 4, 1, 1, 1, 1, 1, 2, 1))[0]()

    def _observation(self):
        self.deliver(self.both('observe', self.world.observation))

    def _advice(self):
        here = self.fast.waiting or self.world.observation
        action = self._any_action(here.state)
        self.deliver(self.both('on_recommendation', Recommendation(*here[:4], action)))

    def _early_advice(self):
        here = self.world.observation
        action = self._any_action(here.state)
        self.deliver(self.both('on_recommendation', Recommendation(*here[:4], action)))

    def _any_action(self, s):
        there = np.flatnonzero(AVAILABLE[s]).tolist()
        return self.random.choice([NO_ACTION, *there])

    def _repeated(self):
        self.deliver(self.both('observe', self.random.choice(self.history[-4:])))

    def _foreign(self):
        msg = self.random.choice(self.history[-2:])
        changes = self.random.choice((
            {'learner': OTHER}, {'learner': ANYONE}, {'learner': NUMBER}, {'run': OTHER_RUN},
            {'learner': OTHER, 'step': msg.step + 1, 'truncated': msg.step + 1 == 6}))
        for _ in range(self.random.choice((1, 1, 2, 3))):
            self.deliver(self.both('observe', msg._replace(**changes)))

    def _impossible(self):
        msg = self.random.choice(self.history[-2:])
        changes = self.random.choice((
            {'state': self.random.randrange(-2, 11)}, {'reward': float('nan')},
            {'reward': float('inf')}, {'reward': self.random.choice((-1.0, 3.5))},
            {'terminated': not msg.terminated}, {'truncated': not msg.truncated},
            {'step': self.random.randrange(8)}, {'episode': self.random.randrange(5)},
            {'step': msg.step + 1}, {'step': msg.step + 1, 'learner': ANYONE},
            {'step': msg.step + 1, 'state': self.random.randrange(-2, 11)},
            {'episode': msg.episode + 1, 'step': 0, 'reward': 0.0}))
        for _ in range(self.random.choice((1, 1, 2))):
            self.deliver(self.both('observe', msg._replace(**changes)))

    def _strange_advice(self):
        msg = self.random.choice(self.history[-4:])
        changes = self.random.choice((
            {'action': 7}, {'state': 4}, {'state': 77}, {'run': OTHER_RUN}, {'step': msg.step + 1},
            {'episode': 90}, {}))
        good = Recommendation(*msg[:4], self.random.randrange(-1, 4))
        self.deliver(self.both('on_recommendation', good._replace(**changes)))

    def _tick(self):
        self.deliver(self.both('tick'))

    def _world(self):
        self.deliver(self.both('on_world', self.random.choice(
            (OTHER_MSG, self.world.description, self.world.description._replace(sha256='x')))))

    def _restart(self):
        """Continue with learners that were restored from a checkpoint."""
        for name in ('fast', 'slow'):
            values, arrays = getattr(self, name).state_dict()
            setattr(self, name, self._make_learner())
            getattr(self, name).load_state_dict(
                values, {key: array.copy() for key, array in arrays.items()}, [])
        self.deliver(self.both('last_outputs'))

    def _allow_gap(self):
        self.both('allow_gap')

    def _change(self):
        changes = self.random.choice(CHANGES)
        try:
            self.fast.check_changes(changes)
        except ConfigError:  # with a model, trust cannot be scheduled
            return
        self.deliver(self.both('change', changes))

    def _reset(self):
        self.deliver(self.both('reset'))

    def _no_advice(self):
        self.deliver(self.both('continue_without_advice'))

    def _release(self):
        self.world.repeat(10.0)  # any learner may answer
        self.history.append(self.world.observation)


def snapshot(learner):
    """Return all that can be seen of a learner, by name."""
    values, arrays = learner.state_dict()
    tracker = learner.tracker
    return {**{name: repr(value) for name, value in values.items()},
            **{name: array.tobytes() for name, array in arrays.items()},
            **{name: getattr(tracker, name) for name in (
                'run', 'silent_ticks', 'answered', 'answered_state', 'episode_ended',
                'gap_allowed', 'inactive', 'left_to_others', 'late')},
            **{name: getattr(learner, name) for name in (
                'number', 'waiting', 'journal_entries', 'needs_checkpoint', 'finished',
                'step_count', 'config')},
            'advice': learner.advice().tolist(), 'waiting_for': learner.waiting_for()}


@pytest.mark.parametrize('seeds', [range(12), pytest.param(range(12, 40), marks=pytest.mark.long)])
@pytest.mark.parametrize('method, remembers_advice', [
    ('q_learning', True), ('beta_implicit', True), ('explicit', False), ('head_start', True)])
def test_a_usual_step_has_the_outputs_and_the_state_of_the_long_way(
        method, remembers_advice, seeds):
    usual_steps = 0
    for seed in seeds:
        twins = Twins(method, remembers_advice, seed)
        for _ in range(80):
            twins.act()
        usual_steps += twins.usual_steps
    assert usual_steps > 100


@pytest.mark.parametrize('seeds', [range(12), pytest.param(range(12, 20), marks=pytest.mark.long)])
@pytest.mark.parametrize('method, remembers_advice', [
    ('sarsa', True), ('beta_implicit', True), ('explicit', False), ('head_start', True),
    ('watkins', True), ('model_based', True)])
def test_actions_that_are_published_early_and_the_state_are_those_of_the_long_way(
        method, remembers_advice, seeds):
    early_actions = 0
    for seed in seeds:
        twins = Twins(method, remembers_advice, seed, publishes_early=True)
        for _ in range(80):
            twins.act()
        early_actions += twins.early_actions
    assert early_actions > 50


def test_an_action_is_published_early_before_its_reward_is_learned():
    learner = Learner(replace(find_method('sarsa', 'published'), measuring_iterations=0), 0)
    learner.on_world(WorldMachine(GRID, 'small', RUN, 0).description)
    digests = []
    learner.publish_early = lambda action: digests.append(learner.state.digest())
    first, = learner.observe(StateReward(RUN, 1, 0, 0, 0.0, False, False))
    assert type(first) is Action and digests == []  # there is nothing to learn from
    before = learner.state.digest()
    assert learner.observe(StateReward(RUN, 1, 1, 1, -0.1, False, False)) == ()
    assert digests == [before] and learner.state.digest() != before


@pytest.mark.parametrize('seeds', [range(6), pytest.param(range(6, 40), marks=pytest.mark.long)])
def test_actions_are_published_early_with_machine_code_too_and_its_start_changes_no_bit(seeds):
    early_actions = 0
    for seed in seeds:
        twins = Twins('model_based', seed % 2 == 0, seed, publishes_early=True)
        chance = random.Random(seed)
        for _ in range(80):
            agent = twins.fast.agent
            if chance.random() < 0.2:
                agent.use_kernels(chance.choice((PLAIN, on_arrays(agent))))
            before, code = twins.early_actions, agent.runs_machine_code
            twins.act()
            early_actions += (twins.early_actions - before) * code
    assert early_actions > 20
