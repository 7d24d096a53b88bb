# SPDX-License-Identifier: Apache-2.0
"""The mentor in the conversation: a state in, a recommended action out."""

from comply_ros.core.advising import Advising, WITHOUT_LIMIT
from comply_ros.core.dialogue import (
    grid_of,
    problem_of_run,
    problem_of_state,
    Recommendation,
    turn,
)
from comply_ros.core.grid import NO_ACTION
from comply_ros.core.world import World


class MentorActor:
    """
    Answers every state with its policy's action; holds the last one until it has a policy.

    Parameters
    ----------
    budget: how many recommendations it has to give; 0 for no limit.
    when: when it gives one; see `Advising`. Where it counts mistakes, it answers a state only
        after it has heard what the learner did in the one before.

    Attributes
    ----------
    world: the `World` that was described last, None before.
    policy: list of actions by state, None until there is one for this world.
    watches: whether it needs to hear the learner's actions.

    """

    def __init__(self, budget=WITHOUT_LIMIT, when='early'):
        self.world = None
        self.policy = None
        self.watches = budget != WITHOUT_LIMIT and when == 'mistakes'
        self._budget, self._when, self._advising = budget, when, None
        self._run, self._held = None, None
        self._forget_the_turn()

    def _forget_the_turn(self):
        self._asked, self._answer, self._acted = None, (), None

    def hear_world(self, said):
        """
        Return whether this is another world, for which a policy is needed.

        Raises
        ------
        ValueError: if it cannot be a world.

        """
        grid = grid_of(said)
        if said.run != self._run:
            self._forget_the_turn()
        self._run = said.run
        if self.world is not None and self.world.grid == grid:
            return False
        self.world, self.policy = World(grid), None
        return True

    def waits_for(self):
        """Text of what this mentor needs before it can go on; None where it has it all."""
        return 'a world: is a grid_world running?' if self.world is None else None

    def use(self, policy):
        """Advise by `policy[s]` from now on; return what is to be said about a held state."""
        self.policy = policy.tolist()
        self._advising = Advising(self.world, policy, self._budget, self._when)
        return self.hear_held()

    def hear_held(self):
        """Return what is to be said about the state that came too early, if there is one."""
        held, self._held = self._held, None
        return self.hear_state(held) if held else ()

    def hear_state(self, said):
        """Return the `Recommendation` for a state; none where the episode is over."""
        if self.policy is None or said.run != self._run or self._must_see_first(said):
            if not self._held or said.run != self._held.run or turn(said) > turn(self._held):
                self._held = said
            return ()
        if self._held and self._held.run != self._run:  # the world here goes on without it
            held, self._held = self._held, None
            return (problem_of_run(held, self._run, 'a state'), *self.hear_state(said))
        if self._held and turn(said) >= turn(self._held):
            self._held = None
        problem = problem_of_state(said, self.world)
        if problem:
            return (problem,)
        if said.terminated:
            return ()
        if self.watches and self._asked and turn(said) <= turn(self._asked):
            return self._answer if turn(said) == turn(self._asked) else ()
        self._asked = said
        self._answer = (Recommendation(said.run, said.episode, said.step, said.state,
                                       self._advising.advise(said.state)),)
        return self._answer

    def hear_action(self, said):
        """Remember what the learner did; return what is to be said about a state that waited."""
        asked = self._asked
        if asked is None or said.run != self._run or turn(said) != turn(asked) \
                or turn(said) == self._acted:
            return ()
        self._acted = turn(said)
        if said.action in range(4):
            self._advising.watch(asked.state, said.action)
        return self.hear_held()

    def _must_see_first(self, said):
        """Tell whether what the learner did in the last state matters, and is not known yet."""
        return (self.watches and self._asked is not None and turn(said) > turn(self._asked)
                and self._acted != turn(self._asked))

    def advice(self, state):
        """
        Return the action for a state: -1 for no advice, also where nobody can act.

        Raises
        ------
        ValueError: if the state is outside of the grid, or there is no policy yet.

        """
        if self.policy is None:
            raise ValueError('the mentor must have a world and a policy first, and has none yet')
        if not 0 <= state < len(self.policy):
            raise ValueError(f'a state must lie in [0, {len(self.policy) - 1}], got {state}')
        return self.policy[state] if self.world.free[state] else NO_ACTION
