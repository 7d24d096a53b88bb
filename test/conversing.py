# SPDX-License-Identifier: Apache-2.0
"""A world, a mentor and a learner that talk without ROS: what one says, the others hear."""

from collections import deque

from comply_ros.core.dialogue import Action, Recommendation, StateReward, WorldDescription


class Conversation:
    """
    Three actors on a network that loses nothing.

    Attributes
    ----------
    asked: every `StateReward` that was said, repetitions left out.
    said: everything that was said.

    """

    def __init__(self, world, mentor, learner):
        self.world, self.mentor, self.learner = world, mentor, learner
        self.said, self._way = [], deque()
        self.say(world.recall())

    @property
    def asked(self):
        """Return the questions that were said, each once."""
        questions = [each for each in self.said if type(each) is StateReward]
        return [each for before, each in zip([None, *questions], questions) if each != before]

    def say(self, utterances):
        """Let everybody hear this, later."""
        self.said += utterances
        self._way += utterances

    def run(self, messages=float('inf')):
        """Deliver so many messages, or until nothing is said any more; return how many."""
        count = 0
        while self._way and count < messages:
            said = self._way.popleft()
            for hear in self._ears(said):
                self.say(hear(said))
            count += 1
        return count

    def _ears(self, said):
        return {WorldDescription: (self.mentor.hear_world, self.learner.hear_world),
                StateReward: (self.mentor.hear_state, self.learner.hear_state),
                Recommendation: (self.learner.hear_recommendation,),
                Action: (self.world.hear_action,)}.get(type(said), ())
