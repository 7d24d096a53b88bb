# SPDX-License-Identifier: Apache-2.0
"""What is said again: a mentor that watches can miss a move, and must hear it all the same."""

from dataclasses import replace

import pytest
from tiny_worlds import grid

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Action, step_id
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

RUN = 7
TINY = grid('G.#', '...', starts=(1, 4), limit=4, intended=0.7)
POLICY = optimal_policy(World(TINY))
ROW = replace(find_method('explicit', 'published'), episodes=5, iterations=3)


class Slow:
    """
    A conversation whose mentor hears only the newest action, as a latched topic keeps it.

    Attributes
    ----------
    missed: actions that the mentor did not hear when they were said first.

    """

    def __init__(self):
        self.world, self.learner = GridWorld(TINY, 'tiny', RUN, seed=4), fresh()
        self.mentor = Mentor(3, 'mistakes')
        for actor in (self.mentor, self.learner):
            actor.on_world(self.world.description)
        self.mentor.use(POLICY)
        self.newest, self.missed = None, 0

    def ask(self):
        """Let the world say its question, again if it is open still, and all answer it once."""
        question = self.world.question
        msg = list(self.learner.observe(question))
        self.keep(msg)
        advice = self.mentor.on_action(self.newest) if self.newest else ()
        for each in (*advice, *self.mentor.observe(question)):
            answers = self.learner.on_recommendation(each)
            self.keep(answers)
            msg += answers
        for each in msg:
            if type(each) is Action:
                self.world.on_action(each)

    def keep(self, msg):
        """Let the newest action take the place of one that the mentor has not heard."""
        for each in msg:
            if type(each) is Action:
                asked = self.mentor._asked
                self.missed += (self.newest is not None and asked is not None
                                and step_id(each) > step_id(self.newest) == step_id(asked)
                                and self.mentor._acted != step_id(asked))
                self.newest = each


def fresh():
    """Return a learner that waits for every advice."""
    return Learner(ROW, seed=4, remembers_advice=False)


def restarted(learner):
    """Return a learner that was killed and goes on from what was kept."""
    facts, arrays = learner.state()
    again = fresh()
    again.restore(facts, {name: array.copy() for name, array in arrays.items()}, [])
    return again


@pytest.mark.parametrize('killed', [False, True])
def test_a_mentor_that_misses_the_move_to_a_goal_is_told_it_again(killed):
    training = Training(World(TINY), AdviceBudget(World(TINY), POLICY, 3, 'mistakes'), ROW, seed=4)
    for _ in range(3):
        training.iterate()
    table = Slow()
    for number in range(1000):
        if table.learner.finished:
            break
        table.ask()
        if killed and number % 3 == 0:
            table.learner = restarted(table.learner)
    assert table.learner.finished, f'stands still at {step_id(table.world.question)}'
    assert table.missed > 3
    assert table.learner.memory.digest() == training.memory.digest()
