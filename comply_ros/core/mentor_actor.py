# SPDX-License-Identifier: Apache-2.0
"""The mentor in the conversation: a state in, a recommended action out."""

from comply_ros.core.dialogue import grid_of, problem_of_run, problem_of_state, Recommendation
from comply_ros.core.grid import NO_ACTION
from comply_ros.core.world import World


class MentorActor:
    """
    Answers every state with its policy's action; holds the last one until it has a policy.

    Attributes
    ----------
    world: the `World` that was described last, None before.
    policy: list of actions by state, None until there is one for this world.

    """

    def __init__(self):
        self.world = None
        self.policy = None
        self._run, self._held = None, None

    def hear_world(self, said):
        """
        Return whether this is another world, for which a policy is needed.

        Raises
        ------
        ValueError: if it cannot be a world.

        """
        grid = grid_of(said)
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
        return self.hear_held()

    def hear_held(self):
        """Return what is to be said about the state that came too early, if there is one."""
        held, self._held = self._held, None
        return self.hear_state(held) if held else ()

    def hear_state(self, said):
        """Return the `Recommendation` for a state; none where the episode is over."""
        if self.policy is None or said.run != self._run:
            self._held = said
            return ()
        if self._held:  # of another run than the world that goes on here
            held, self._held = self._held, None
            return (problem_of_run(held, self._run, 'a state'), *self.hear_state(said))
        problem = problem_of_state(said, self.world)
        if problem:
            return (problem,)
        if said.terminated:
            return ()
        return (Recommendation(said.run, said.episode, said.step, said.state,
                               self.policy[said.state]),)

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
