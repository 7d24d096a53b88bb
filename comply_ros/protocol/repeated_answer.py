# SPDX-License-Identifier: Apache-2.0
"""What a learner has published last, and publishes again where its observation is repeated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from comply_ros.learner.agent import Decision
from comply_ros.protocol.messages import Action, StepId
from comply_ros.world.grid import NO_ACTION


class RepeatedAnswer:
    """
    The last action of a learner, and the advice that it had for it.

    Attributes
    ----------
    action: the last action, None where none has to be repeated.
    advised_action: the last one in a state that mentors advise in: such a mentor may wait for it.

    """

    action: Action | None
    advised_action: Action | None

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Have nothing to repeat: a run begins."""
        self.action = self.advised_action = None
        self.forget_advice()

    def forget_advice(self) -> None:
        """Have no last advice: the agent begins anew."""
        self._advice, self._mentor = NO_ACTION, 0
        self._all_advice: tuple[int, ...] = ()

    def add(self, decision: Decision, advice: Sequence[int]) -> None:
        """Note the advice that a decision had; `act` or `end_episode` makes the action of it."""
        m = decision.mentor
        self._mentor = m = m if m > 0 else 0
        self._advice, self._all_advice = advice[m], tuple(advice) if len(advice) > 1 else ()

    def act(self, run: int, episode: int, step: int, decision: Decision, learner: int,
            observation_count: int) -> Action:
        """Return the action of the decision that was added last."""
        a, followed, p, _, _ = decision
        self.action = self.advised_action = action = Action(
            run, episode, step, a, followed, p, learner, self._advice, observation_count,
            self._mentor, self._all_advice)
        return action

    def end_episode(self, run: int, step: StepId, learner: int, observation_count: int) -> Action:
        """Return the action that lets the next episode start."""
        self.action = Action(run, *step, NO_ACTION, False, 0.0, learner, self._advice,
                             observation_count, self._mentor, self._all_advice)
        return self.action

    def state_dict(self) -> dict[str, Any]:
        """Return everything needed to continue later, as values for JSON."""
        return {'last_advice': (self._advice, self._mentor, self._all_advice),
                'action': self.action, 'advised_action': self.advised_action}

    def load_state_dict(self, values: dict[str, Any]) -> None:
        """Continue from what `state_dict` returned; before, the last advice was one number."""
        saved = values['last_advice']
        self._advice, self._mentor, all_advice = \
            (saved, 0, ()) if isinstance(saved, int) else saved
        self._all_advice = tuple(all_advice)
        self.action, self.advised_action = (
            values[name] and _action(values[name]) for name in ('action', 'advised_action'))


def _action(saved: Sequence[Any]) -> Action:
    """Return an action of a checkpoint; those of before have fewer fields."""
    action = Action(*saved)
    return action._replace(all_advice=tuple(action.all_advice))
