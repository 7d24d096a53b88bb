# SPDX-License-Identifier: Apache-2.0
"""What the mentor has said, state by state, and which questions it may have been asked."""

import numpy as np

from comply_ros.protocol.messages import Ignored, Recommendation, Rejected, step_id
from comply_ros.protocol.validation import validate_recommendation
from comply_ros.world.grid import NO_ACTION

QUESTIONS = 1000  # past questions to which late advice is still heard


class AdviceBuffer:
    """
    The newest advice in every state, heard only where it belongs to a question that was asked.

    Parameters
    ----------
    run: number of the run that the questions belong to.
    newest: turn of the last question so far.

    """

    def __init__(self, run=None, newest=(0, -1)):
        self._run, self._newest = run, newest
        self._heard, self._asked, self._early = {}, {}, None

    def forget(self):
        """Forget all advice; which questions were asked is still known."""
        self._heard.clear()

    def ask(self, msg):
        """Remember a question; return advice that came before it, or None."""
        self._newest = step_id(msg)
        self._asked[self._newest] = msg.state
        if len(self._asked) > QUESTIONS:
            del self._asked[next(iter(self._asked))]
        early, self._early = self._early, None
        return early

    def last(self, state):
        """Return the newest `Recommendation` in a state, None before."""
        return self._heard.get(state)

    def hear(self, msg, world):
        """Return whether advice counts, and what is to be said about it if not."""
        problem = validate_recommendation(msg, world)
        if problem:
            return False, (problem,)
        state = self._asked.get(step_id(msg))
        if state is None:
            return False, self._hear_without_question(msg)
        if state != msg.state:
            return False, (Rejected('advice for another state', f'a recommendation in turn '
                                   f'{step_id(msg)} must be for state {state}, got {msg.state}'),)
        last = self._heard.get(state)
        counts = last is None or step_id(msg) > step_id(last)
        if counts:
            self.note(msg)
        return counts, ()

    def note(self, msg):
        """Remember advice that counts."""
        self._heard[msg.state] = msg

    def _hear_without_question(self, msg):
        if step_id(msg) <= self._newest:
            return (Ignored('advice too late', f'dropped a recommendation of turn {step_id(msg)}: '
                            'it came late, or twice'),)
        before, self._early = self._early, msg
        if before is None or step_id(before) == step_id(msg) or not self._asked:
            return ()
        return (Rejected('advice for no question', 'a recommendation must be for a question that '
                        f'was asked, got turn {step_id(before)} after turn {self._newest}'),)

    def advice(self, states):
        """Return `advice[s]`, int8: the newest action in a state, -1 where nothing was said."""
        advice = np.full(states, NO_ACTION, dtype=np.int8)
        advice[list(self._heard)] = [msg.action for msg in self._heard.values()]
        return advice

    def arrays(self):
        """Return `heard[n]`, int64: state, episode, step and action of every newest advice."""
        rows = [(each.state, each.episode, each.step, each.action)
                for each in self._heard.values()]
        return {'heard': np.array(rows, dtype=np.int64).reshape(-1, 4)}

    def restore(self, arrays):
        """Change into what those arrays were."""
        self._heard = {state: Recommendation(self._run, episode, step, state, action)
                       for state, episode, step, action in arrays['heard'].tolist()}
