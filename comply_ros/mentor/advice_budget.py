# SPDX-License-Identifier: Apache-2.0
"""A mentor with a budget: N recommendations to give, and when to give one."""

import numpy as np

from comply_ros.numerics.jit import kernel
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import action_values, probabilities, values_of

ADVISING_MODES = ('early', 'important', 'mistakes')
UNLIMITED = 0
NEVER_WATCHED = -2  # did[s] where what the learner did does not matter


class MentorError(ValueError):
    """A mentor that cannot be; the message names the rule and the value."""


def validate_advice_budget(budget, when):
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


class AdviceBudget:
    """
    What a mentor says state by state, and what it has left to say.

    A recommendation is for good: the learner keeps it in mind, so saying it again costs nothing,
    and a budget of N is N states that are advised. After Torrey and Taylor, Teaching on a Budget
    (AAMAS 2013), the mentor speaks

    early: in the first N states that it is asked about;
    important: only where much depends on the action: the gap between the best and the worst
        action, valued by the mentor's own policy, is at least the median of all states;
    mistakes: only where the learner last did something else. (There the learner announces what
        it is about to do; here the mentor sees what it did the last time.)

    Parameters
    ----------
    world: the `World`.
    policy: `policy[s]`, the action it would recommend, -1 for none.
    budget: how many recommendations it has; 0 for no limit.
    when: one of `ADVISING_MODES`; without a limit it speaks always.

    """

    def __init__(self, world, policy, budget=UNLIMITED, when='early'):
        states = len(world.terminal)
        limited = budget != UNLIMITED
        watches = limited and when == 'mistakes'
        self.policy = np.array(policy, dtype=np.int8)
        self.worth = np.ones(states, dtype=bool)
        if limited and when == 'important':
            gaps = importance(world, self.policy)
            self.worth = gaps >= np.median(gaps[world.free])
        self.told = np.full(states, not limited)
        self.left = np.array([budget])
        self.did = np.full(states, NO_ACTION if watches else NEVER_WATCHED, dtype=np.int8)
        self._views = tuple(memoryview(array) for array in self.arrays())

    def arrays(self):
        """Return `policy, worth, told, left, did`, which kernels take, without copying them."""
        return self.policy, self.worth, self.told, self.left, self.did

    def advise(self, s):
        """Return the recommendation in state s, -1 for none; it may cost one of the budget."""
        return advise(s, *self._views)

    def watch(self, s, a):
        """Remember that the learner took action a in state s."""
        watch(s, a, self.did)


@kernel
def advise(s, policy, worth, told, left, did):
    """Return the recommendation in state s, -1 for none; change told and left if it is new."""
    a = policy[s]
    if a < 0 or told[s]:
        return a
    if left[0] == 0 or not worth[s] or did[s] == NO_ACTION or did[s] == a:
        return NO_ACTION
    told[s] = True
    left[0] -= 1
    return a


@kernel
def watch(s, a, did):
    """Change did[s] to a, if what the learner does matters to the mentor."""
    if did[s] != NEVER_WATCHED:
        did[s] = a


def importance(world, policy):
    """
    `gap[s]` between the best and the worst action, valued by the policy's own returns.

    Importance advising: I(s) = max Q(s, a) - min Q(s, a). 0 where nobody can act.
    """
    q = action_values(world, values_of(world, probabilities(world, policy)))
    lowest = np.where(world.available, q, np.inf).min(axis=1)
    return np.where(world.free, q.max(axis=1) - lowest, 0.0)
