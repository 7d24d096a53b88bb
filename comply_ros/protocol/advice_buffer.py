# SPDX-License-Identifier: Apache-2.0
"""The newest advice by state, and whether a mentor's advice is still valid."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.protocol.message_validation import validate_recommendation
from comply_ros.protocol.messages import (
    Ignored,
    Outputs,
    Recommendation,
    Rejected,
    step_id,
    StepId,
)
from comply_ros.world.mdp import World

REMEMBERED = 1000  # past observations, at least, for which late advice still counts


class AdviceBuffer:
    """
    The newest advice in every state. Advice counts only for an observation that was made.

    Parameters
    ----------
    run: the run of the observations.
    newest: step id of the last observation so far.

    """

    def __init__(self, run: int | None = None, newest: StepId = (0, -1)) -> None:
        self._run, self._newest = run, newest
        self._advice: dict[int, Recommendation] = {}
        self._observed: dict[StepId, int] = {}  # states of the newest observations
        self._observed_before: dict[StepId, int] = {}  # and of as many before them
        self._early: Recommendation | None = None

    def forget(self) -> None:
        """Forget all advice; the observations stay known."""
        self._advice.clear()

    def add_observation(self, step: StepId, state: int) -> Recommendation | None:
        """Remember an observation; return advice that came before it, or None."""
        self._newest = step
        self._observed[step] = state
        if len(self._observed) >= REMEMBERED:  # cheaper than to delete the oldest each time
            self._observed_before, self._observed = self._observed, {}
        early, self._early = self._early, None
        return early

    def newest_advice(self, state: int) -> Recommendation | None:
        """Return the newest advice in a state, None if there is none."""
        return self._advice.get(state)

    def add_same_advice(self, msg: Recommendation) -> bool:
        """Remember the newest advice of a state once more, if that is what it is: the usual."""
        state, action = msg.state, msg.action
        last = self._advice.get(state)
        if last is None or last.action != action:
            return False
        here = msg.episode, msg.step
        if self._observed.get(here) != state or here <= (last.episode, last.step):
            return False
        self._advice[state] = msg
        return True

    def add_advice(self, msg: Recommendation, world: World) -> tuple[bool, Outputs]:
        """Return whether advice counts, and why not."""
        problem = validate_recommendation(msg, world)
        if problem:
            return False, (problem,)
        here = step_id(msg)
        state = self._observed.get(here, self._observed_before.get(here))
        if state is None:
            return False, self._without_observation(msg)
        if state != msg.state:
            return False, (Rejected('advice for another state', 'a recommendation for step id '
                                    f'{here} must be for state {state}, got {msg.state}'),)
        last = self._advice.get(state)
        counts = last is None or here > step_id(last)
        if counts:
            self._advice[state] = msg
        return counts, ()

    def restore_advice(self, msg: Recommendation) -> None:
        """Remember advice from a journal, which counted when it was received."""
        self._advice[msg.state] = msg

    def _without_observation(self, msg: Recommendation) -> Outputs:
        here = step_id(msg)
        if here <= self._newest:
            return (Ignored('advice too late', f'ignored a recommendation for step id {here}: it '
                            'came late, or twice'),)
        before, self._early = self._early, msg
        if before is None or step_id(before) == here or \
                not (self._observed or self._observed_before):
            return ()
        return (Rejected('advice without observation', 'a recommendation must be for an '
                         f'observation that was made, got step id {step_id(before)} after '
                         f'{self._newest}'),)

    def advice(self, before: NDArray[Any]) -> NDArray[Any]:
        """Return `advice[s]`: the newest action in a state, where there is none that of before."""
        advice = before.copy()
        advice[list(self._advice)] = [msg.action for msg in self._advice.values()]
        return advice

    def array(self) -> NDArray[np.int64]:
        """Return `advice[n]`: state, episode, step and action of every newest advice."""
        rows = [(msg.state, msg.episode, msg.step, msg.action) for msg in self._advice.values()]
        return np.array(rows, dtype=np.int64).reshape(-1, 4)

    def load_array(self, advice: NDArray[np.int64]) -> None:
        """Take over the advice that `array` returned."""
        self._advice = {state: Recommendation(self._run or 0, episode, step, state, action)
                        for state, episode, step, action in advice.tolist()}
