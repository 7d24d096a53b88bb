# SPDX-License-Identifier: Apache-2.0
"""A mentor with a budget: N recommendations to give, and when to give one."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.numerics.jit import kernel
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import action_values, policy_probabilities, policy_values

Actions = NDArray[Any]  # of the `action_type` of the world
Bools = NDArray[np.bool_]
Array = Any  # of a kernel: an array in a compiled loop, a memoryview in a node

ADVISING_MODES = ('early', 'important', 'mistakes')
UNLIMITED = 0
NOT_WATCHED = -2  # last_actions[s] where it does not matter what the learner did


def validate_advice_budget(budget: int, when: str) -> None:
    """
    Return if there can be such a mentor.

    Raises
    ------
    MentorError: for a budget below 0 or an unknown `when`.

    """
    if budget < 0:
        raise MentorError(f'budget must be at least 0, got {budget}')
    if when not in ADVISING_MODES:
        raise MentorError(f'advising must be one of {", ".join(ADVISING_MODES)}, got {when!r}')


def validate_advising(budget: int, when: str, world: World) -> None:
    """
    Return if a mentor can spend a budget so in a world.

    Raises
    ------
    MentorError: for `important` in a world without a model.

    """
    if budget != UNLIMITED and when == 'important' and world.model == 'none':
        raise MentorError("advising 'important' must know what an action leads to, and the world "
                          'has no model: use early or mistakes')


class AdviceBudget:
    """
    What a mentor recommends in each state, and how many recommendations remain.

    The learner remembers a recommendation, so repeating it costs nothing: a budget of N is N
    states with advice. After Torrey and Taylor, Teaching on a Budget (AAMAS 2013), the mentor
    gives advice

    early: in the first N states that it observes;
    important: only where much depends on the action: the gap between the best and the worst
        action, valued by the mentor's own policy, is at least the median of all states;
    mistakes: only where the learner's last action was another one. (There the learner announces
        its action; here the mentor sees the one of the last time.)

    Parameters
    ----------
    world: the `World`.
    policy: `policy[s]`, the action to recommend, -1 for none.
    budget: number of recommendations; 0 for no limit.
    when: one of `ADVISING_MODES`; without a limit it does not matter.

    Attributes
    ----------
    policy: see above.
    important: `important[s]`: whether the state is worth a recommendation.
    advised: `advised[s]`: whether a recommendation there is free, since it was given before.
    remaining: `[budget that remains]`.
    last_actions: `last_actions[s]` of the learner, -1 before the first.

    Raises
    ------
    MentorError: as `validate_advising`.

    """

    def __init__(self, world: World, policy: ArrayLike, budget: int = UNLIMITED,
                 when: str = 'early') -> None:
        validate_advising(budget, when, world)
        states = world.n_states
        is_limited = budget != UNLIMITED
        watches = is_limited and when == 'mistakes'
        self.policy = np.array(policy, dtype=world.action_type)
        self.important = np.ones(states, dtype=bool)
        if is_limited and when == 'important':
            gaps = importance(world, self.policy)
            self.important = gaps >= np.median(gaps[world.free])
        self.advised = np.full(states, not is_limited)
        self.remaining = np.array([budget])
        self.last_actions = np.full(states, NO_ACTION if watches else NOT_WATCHED,
                                    dtype=world.action_type)
        self._views = tuple(array.data for array in self.arrays())

    def arrays(self) -> tuple[Actions, Bools, Bools, NDArray[np.int64], Actions]:
        """Return policy, important, advised, remaining and last_actions, not copied."""
        return self.policy, self.important, self.advised, self.remaining, self.last_actions

    def advise(self, s: int) -> int:
        """Return the recommendation in state s, -1 for none; it may cost one of the budget."""
        return advise(s, *self._views)

    def record_action(self, s: int, a: int) -> None:
        """Remember that the learner took action a in state s."""
        record_action(s, a, self.last_actions)


@kernel
def advise(s: int, policy: Array, important: Array, advised: Array, remaining: Array,
           last_actions: Array) -> int:
    """Return the recommendation in state s, -1 for none; a new one changes advised, remaining."""
    a = policy[s]
    if a < 0 or advised[s]:
        return a
    if (remaining[0] == 0 or not important[s] or last_actions[s] == NO_ACTION
            or last_actions[s] == a):
        return NO_ACTION
    advised[s] = True
    remaining[0] -= 1
    return a


@kernel
def record_action(s: int, a: int, last_actions: Array) -> None:
    """Change last_actions[s] to a, if the mentor advises where the learner makes mistakes."""
    if last_actions[s] != NOT_WATCHED:
        last_actions[s] = a


def importance(world: World, policy: Actions) -> NDArray[np.float64]:
    """
    `gap[s]` between the best and the worst action, valued by the policy's own returns.

    Importance advising: I(s) = max Q(s, a) - min Q(s, a). 0 where nobody can act.
    """
    q = action_values(world, policy_values(world, policy_probabilities(world, policy)))
    lowest = np.where(world.available, q, np.inf).min(axis=1)
    return np.where(world.free, q.max(axis=1) - lowest, 0.0)
