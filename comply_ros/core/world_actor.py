# SPDX-License-Identifier: Apache-2.0
"""The grid world in the conversation: an action in, the next state out."""

from comply_ros.core.dialogue import describe, Episode, problem_of_run, Refused, StateReward, turn
from comply_ros.core.draws import Draws, streams
from comply_ros.core.grid import NO_ACTION
from comply_ros.core.world import first_state, taken_action, World


class WorldActor:
    """
    Asks one question at a time: the current state. An answer to it brings the next.

    Parameters
    ----------
    grid: the `Grid`.
    name: what to call it.
    run: number that tells this run from every other.
    seed: of starts and slips.

    """

    def __init__(self, grid, name, run, seed):
        self._world = World(grid)
        self._draws = Draws(streams(seed)[0], 1)
        self._limit, self._intended = grid.step_limit, float(grid.intended)
        self._successor = memoryview(self._world.successor)
        self._reward = memoryview(self._world.reward)
        self._slips = memoryview(self._world.slips)
        self._starts, self._terminal = grid.starts, self._world.terminal.tolist()
        self.description = describe(grid, name, run)
        self._total = 0.0
        self.question = self._begin(episode=1)

    def waits_for(self):
        """Text of what this world needs before it can go on."""
        return (f'an action in turn {turn(self.question)}: is a learner running, or has it '
                'finished?')

    def hear_action(self, said):
        """
        Return the `StateReward` that follows (an `Episode` before it, if one ends).

        An answer to an earlier question is dropped; one that cannot be right is `Refused`.
        """
        asked = self.question
        if said.run != asked.run:
            return (problem_of_run(said, asked.run, 'an action'),)
        if turn(said) < turn(asked):
            return ()
        if turn(said) > turn(asked):
            return (Refused('answer to no question', f'an action must answer turn {turn(asked)}, '
                            f'got {turn(said)}'),)
        if asked.terminated or asked.truncated:
            return self._after_the_end(said)
        if not 0 <= said.action < 4 or self._successor[asked.state, said.action] < 0:
            return (Refused('action not available', 'an action must be one that the cell has, '
                            f'got {said.action} in state {asked.state}'),)
        return self._move(said.action)

    def _begin(self, episode):
        self._total = 0.0
        u, = self._draws.row()
        return StateReward(self.description.run, episode, 0, first_state(u, self._starts), 0.0,
                           False, False)

    def _after_the_end(self, said):
        if said.action != NO_ACTION:
            return (Refused('action after the end', f'the episode is over: the action must be '
                            f'{NO_ACTION}, got {said.action}'),)
        self.question = self._begin(self.question.episode + 1)
        return (self.question,)

    def _move(self, action):
        run, episode, step, s, *_ = self.question
        u, = self._draws.row()
        taken = taken_action(s, action, u, self._intended, self._slips)
        reward, s2, step = self._reward[s, taken], self._successor[s, taken], step + 1
        self._total += reward
        terminated = self._terminal[s2]
        truncated = not terminated and step == self._limit
        self.question = StateReward(run, episode, step, s2, reward, terminated, truncated)
        if terminated or truncated:
            return (Episode(run, episode, step, self._total, terminated, truncated),
                    self.question)
        return (self.question,)
