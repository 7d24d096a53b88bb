# SPDX-License-Identifier: Apache-2.0
"""The kernels of an agent's steps: which it uses, and that a change of them changes no bit."""

from dataclasses import replace

from array_kernels import on_arrays
import numpy as np
import pytest
from tiny_worlds import corridor

from comply_ros.learner.agent import Agent
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.presets import find_method
from comply_ros.learner.step_kernels import compiled_kernels, PLAIN, step_types
from comply_ros.world.grid import NO_ACTION, RIGHT

CONFIG = replace(find_method('model_based', 'published'), episodes=2, iterations=0)
EPISODE = [(0, 0, 0.0, False, False, (RIGHT,)), (1, 1, -1.0, False, False, (RIGHT,)),
           (1, 2, -5.0, False, False, (NO_ACTION,)), (2, 3, 10.0, True, False, (NO_ACTION,))]


def make_agent(config=CONFIG, mentors=('',)):
    """Return an agent in the corridor."""
    agent = Agent(config, seed=0, mentors=mentors)
    agent.start(corridor())
    return agent


def played(change_at, make=on_arrays):
    """Return the decisions and the digest of an agent with other kernels from a step on."""
    agent, decisions = make_agent(), []
    for number, observation in enumerate(3 * EPISODE):
        if number == change_at:
            agent.use_kernels(make(agent))
            assert agent.runs_machine_code
        decisions.append(repr(agent.step(*observation)))
    return decisions, agent.state.digest(), repr(agent.state_dict()[0])


@pytest.mark.parametrize('step', range(len(3 * EPISODE)))
def test_other_kernels_from_any_step_on_change_no_bit(step):
    assert played(step) == played(None)


@pytest.mark.long
def test_compiled_kernels_from_any_step_on_change_no_bit():
    agent = make_agent()
    compiled = compiled_kernels(agent.kernel_config, agent.state)
    assert compiled.types == agent.step_types
    for step in range(len(3 * EPISODE)):
        assert played(step, lambda agent: compiled) == played(None)


def test_only_steps_of_a_learner_with_a_model_are_worth_it():
    assert make_agent().step_types is not None
    assert make_agent(LearnerConfig()).step_types is None
    assert make_agent(replace(CONFIG, learns=False)).step_types is None


def test_kernels_are_used_only_while_they_fit():
    agent = make_agent()
    agent.use_kernels(on_arrays(agent))
    agent.add_mentor('anna')  # advice of two mentors is another type of settings
    assert not agent.runs_machine_code
    agent.use_kernels(on_arrays(agent))
    assert agent.runs_machine_code
    agent.reconfigure(replace(CONFIG, learns=False), np.full(6, NO_ACTION))
    assert not agent.runs_machine_code
    agent.reconfigure(CONFIG, np.full(6, NO_ACTION))
    assert agent.runs_machine_code
    agent.use_kernels(PLAIN)
    assert not agent.runs_machine_code


def test_machine_code_for_other_arrays_does_not_fit():
    agent = make_agent()
    narrow = agent.state._replace(values=agent.state.values.astype(np.float32))
    assert step_types(agent.kernel_config, narrow) != agent.step_types
    turned = agent.state._replace(q=np.asfortranarray(agent.state.q))
    assert step_types(agent.kernel_config, turned) != agent.step_types
