# SPDX-License-Identifier: Apache-2.0
"""What is said again: a mentor that watches can miss a move, and must hear it all the same."""

from dataclasses import replace

import pytest
from worlds import grid

from comply_ros.core.advising import Advising
from comply_ros.core.dialogue import Action, turn
from comply_ros.core.learner_actor import LearnerActor
from comply_ros.core.mentor_actor import MentorActor
from comply_ros.core.methods import find_method
from comply_ros.core.planning import optimal_policy
from comply_ros.core.training import Training
from comply_ros.core.world import World
from comply_ros.core.world_actor import WorldActor

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
        self.world, self.learner = WorldActor(TINY, 'tiny', RUN, seed=4), fresh()
        self.mentor = MentorActor(3, 'mistakes')
        for actor in (self.mentor, self.learner):
            actor.hear_world(self.world.description)
        self.mentor.use(POLICY)
        self.newest, self.missed = None, 0

    def ask(self):
        """Let the world say its question, again if it is open still, and all answer it once."""
        question = self.world.question
        said = list(self.learner.hear_state(question))
        self.keep(said)
        advice = self.mentor.hear_action(self.newest) if self.newest else ()
        for each in (*advice, *self.mentor.hear_state(question)):
            answers = self.learner.hear_recommendation(each)
            self.keep(answers)
            said += answers
        for each in said:
            if type(each) is Action:
                self.world.hear_action(each)

    def keep(self, said):
        """Let the newest action take the place of one that the mentor has not heard."""
        for each in said:
            if type(each) is Action:
                asked = self.mentor._asked
                self.missed += (self.newest is not None and asked is not None
                                and turn(each) > turn(self.newest) == turn(asked)
                                and self.mentor._acted != turn(asked))
                self.newest = each


def fresh():
    """Return a learner that waits for every advice."""
    return LearnerActor(ROW, seed=4, remembers_advice=False)


def restarted(learner):
    """Return a learner that was killed and goes on from what was kept."""
    facts, arrays = learner.state()
    again = fresh()
    again.restore(facts, {name: array.copy() for name, array in arrays.items()}, [])
    return again


@pytest.mark.parametrize('killed', [False, True])
def test_a_mentor_that_misses_the_move_to_a_goal_is_told_it_again(killed):
    training = Training(World(TINY), Advising(World(TINY), POLICY, 3, 'mistakes'), ROW, seed=4)
    for _ in range(3):
        training.iterate()
    table = Slow()
    for number in range(1000):
        if table.learner.finished:
            break
        table.ask()
        if killed and number % 3 == 0:
            table.learner = restarted(table.learner)
    assert table.learner.finished, f'stands still at {turn(table.world.question)}'
    assert table.missed > 3
    assert table.learner.memory.digest() == training.memory.digest()
