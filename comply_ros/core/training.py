# SPDX-License-Identifier: Apache-2.0
"""The same conversation in one process, as a compiled loop over many steps."""

from collections import namedtuple
from pickle import UnpicklingError

import numpy as np

from comply_ros.core.compiled import compiled, forget, kernel
from comply_ros.core.draws import Draws, streams
from comply_ros.core.grid import NO_ACTION
from comply_ros.core.learning import choose, cool, DRAWS, learn
from comply_ros.core.memory import Memory, TEMPERATURE
from comply_ros.core.world import first_state, taken_action

EPISODE, STEP, STATE, ACTION = range(4)  # place[...]: where the walk is
WEIGHED, TRUSTED = range(2)  # tally[...]: decisions with advice, the sum of their confidences

Iteration = namedtuple('Iteration', 'number mean_return confidence temperature steps')
Iteration.__doc__ = """One mini-batch of episodes.

number: from 1. mean_return: per episode. confidence: mean p over the decisions that had advice
(nan without any). temperature: of the softmax in it. steps: actions taken.
"""


class Training:
    """
    A learner, its world and its mentor in one process.

    Parameters
    ----------
    world: the `World`.
    advice: `advice[s]`, int8: the mentor's action, -1 for none.
    method: the `Method`.
    seed: of the world's and the learner's random numbers.

    Attributes
    ----------
    memory: the learner's `Memory`.
    returns, lengths: of the episodes of the last iteration.

    """

    def __init__(self, world, advice, method, seed):
        self.world, self.method = world, method
        self.memory = Memory.fresh(world, method)
        world_stream, learner_stream = streams(seed)
        self._draws = Draws(world_stream, 1), Draws(learner_stream, DRAWS)
        silence = np.full(len(world.terminal), NO_ACTION)
        self._advice = np.asarray(advice if method.needs_mentor() else silence, dtype=np.int8)
        self._numbers = method.numbers()
        self.iterations_done = 0
        try:
            self._compile()
        except (EOFError, ImportError, OSError, ValueError, UnpicklingError):  # a spoiled cache
            forget()
            self._compile()

    def iterate(self):
        """Play one mini-batch of episodes and return its `Iteration`."""
        learns = self.iterations_done >= self.method.measuring_iterations
        self.returns = np.zeros(self.method.episodes)
        self.lengths = np.zeros(self.method.episodes, dtype=np.int64)
        tally = np.zeros(2)
        place = np.array((0, -1, 0, 0))
        temperature = float(self.memory.schedule[TEMPERATURE])
        while place[EPISODE] < self.method.episodes:
            self._play_a_block(learns, place, tally)
        cool(self._numbers, self.memory.schedule)
        self.iterations_done += 1
        confidence = float(tally[TRUSTED] / tally[WEIGHED]) if tally[WEIGHED] else float('nan')
        return Iteration(self.iterations_done, mean_return(self.returns.tolist()), confidence,
                         temperature, int(self.lengths.sum()))

    def _compile(self):
        """Play nothing at all, so that the first iteration need not wait for the compiler."""
        self._play = compiled(play)
        self.returns, self.lengths = np.zeros(0), np.zeros(0, dtype=np.int64)
        self._play_a_block(False, np.array((0, -1, 0, 0)), np.zeros(2))

    def _play_a_block(self, learns, place, tally):
        """Change place, tally, returns, lengths and the memory: as far as the draws reach."""
        world, (moves, decisions) = self.world, self._draws
        used = self._play(
            learns, world.grid.step_limit, float(world.grid.intended), world.starts,
            world.successor, world.reward, world.terminal, self._advice, self._numbers,
            *self.memory.arrays(), place, tally, self.returns, self.lengths,
            moves.block(), decisions.block())
        moves.use(used)
        decisions.use(used)


def mean_return(returns):
    """Mean of the returns of an iteration, summed in their order (so the bits are the same)."""
    return sum(returns) / len(returns)


@kernel
def play(learns, step_limit, intended, starts, successor, reward, terminal, advice, method,
         q, visits, belief, arrivals, schedule, place, tally, returns, lengths,
         moves, decisions):
    """
    Change place, tally, returns, lengths and the learner's arrays; return the states met.

    Plays until the iteration has all its episodes or the draws are used up, whichever is first.
    place: episode of the iteration, step (-1 before the first state), state, action.
    """
    episode, step, s, a = place[EPISODE], place[STEP], place[STATE], place[ACTION]
    met, most = 0, min(len(moves), len(decisions))
    while met < most and episode < len(returns):
        u = moves[met, 0]
        if step < 0:
            r, s2, done, over = 0.0, first_state(u, starts), False, False
        else:
            b = taken_action(s, a, u, intended, successor)
            r, s2 = reward[s, b], successor[s, b]
            done = terminal[s2]
            over = done or step + 1 == step_limit
        a2 = NO_ACTION
        if not done:
            a2, p = choose(s2, advice[s2], decisions[met, 0], decisions[met, 1], method,
                           q, visits, belief, arrivals, schedule)
            if advice[s2] != NO_ACTION:
                tally[WEIGHED] += 1.0
                tally[TRUSTED] += p
        if step >= 0:
            returns[episode] += r
            if learns:
                learn(s, a, r, s2, a2, done, advice[s], method,
                      q, visits, belief, arrivals, schedule)
        met += 1
        step, s, a = step + 1, s2, a2
        if over:
            lengths[episode] = step
            episode, step = episode + 1, -1
    place[EPISODE], place[STEP], place[STATE], place[ACTION] = episode, step, s, a
    return met
