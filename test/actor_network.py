# SPDX-License-Identifier: Apache-2.0
"""A world, a mentor and a learner that talk without ROS: what one says, the others hear."""

from collections import deque

from comply_ros.protocol.messages import Action, Recommendation, StateReward, WorldDescription


class DecodedMessages:
    """
    Three actors on a network that loses nothing.

    Attributes
    ----------
    asked: every `StateReward` that was said, repetitions left out.
    said: everything that was said.

    """

    def __init__(self, world, mentor, learner):
        self.world, self.mentor, self.learner = world, mentor, learner
        self.msg, self._way = [], deque()
        self.say(world.recall())

    @property
    def asked(self):
        """Return the questions that were said, each once."""
        questions = [each for each in self.msg if type(each) is StateReward]
        return [each for before, each in zip([None, *questions], questions) if each != before]

    def say(self, outputs):
        """Let everybody hear this, later."""
        self.msg += outputs
        self._way += outputs

    def run(self, messages=float('inf')):
        """Deliver so many messages, or until nothing is said any more; return how many."""
        count = 0
        while self._way and count < messages:
            msg = self._way.popleft()
            for hear in self._ears(msg):
                self.say(hear(msg))
            count += 1
        return count

    def _ears(self, msg):
        return {WorldDescription: (self.mentor.on_world, self.learner.on_world),
                StateReward: (self.mentor.observe, self.learner.observe),
                Recommendation: (self.learner.on_recommendation,),
                Action: (self.world.on_action,)}.get(type(msg), ())
