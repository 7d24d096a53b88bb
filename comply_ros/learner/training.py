# SPDX-License-Identifier: Apache-2.0
"""The same conversation in one process, as a compiled loop over many steps."""

from collections import namedtuple

import numpy as np

from comply_ros.learner.confidence import apply_advice_prior
from comply_ros.learner.learner_state import LearnerState, TEMPERATURE
from comply_ros.learner.model import end_episode
from comply_ros.learner.update_rules import choose, decay_schedules, DRAWS, learn
from comply_ros.mentor.advice_budget import AdviceBudget, advise, watch
from comply_ros.numerics.jit import compiled, forget, kernel, SPOILED
from comply_ros.numerics.rng import random_streams, UniformRows
from comply_ros.numerics.summation import mean_in_order
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import first_state, taken_action

EPISODE, STEP, STATE, ACTION, SAID = range(5)  # place[...]: where the walk is
FIRST_PLACE = np.array((0, -1, 0, 0, NO_ACTION))
WEIGHED, TRUSTED = range(2)  # tally[...]: decisions with advice, the sum of their confidences

IterationResult = namedtuple('Iteration', 'number mean_return confidence temperature steps')
IterationResult.__doc__ = """One mini-batch of episodes.

number: from 1. mean_return: per episode. confidence: mean p over the decisions that had advice
(nan without any). temperature: of the softmax in it. steps: actions taken.
"""


class Training:
    """
    A learner, its world and its mentor in one process.

    Parameters
    ----------
    world: the `World`.
    advice: `advice[s]`, int8: the mentor's action, -1 for none; or an `AdviceBudget`, which
        remembers what it has said.
    method: the `LearnerConfig`.
    seed: of the world's and the learner's random numbers.

    Attributes
    ----------
    memory: the learner's `LearnerState`.
    returns, lengths: of the episodes of the last iteration.

    """

    def __init__(self, world, advice, method, seed):
        self.world, self.method = world, method
        self.memory = LearnerState.fresh(world, method)
        world_stream, learner_stream = random_streams(seed)
        self._draws = UniformRows(world_stream, 1), UniformRows(learner_stream, DRAWS)
        if not method.needs_mentor():
            advice = np.full(len(world.terminal), NO_ACTION)
        self._mentor = advice if isinstance(advice, AdviceBudget) else AdviceBudget(world, advice)
        self._numbers = method.numbers()
        self.iterations_done = 0
        try:
            self._compile()
        except SPOILED:
            forget()
            self._compile()

    def iterate(self):
        """Play one mini-batch of episodes and return its `IterationResult`."""
        learns = self.iterations_done >= self.method.measuring_iterations
        self.returns = np.zeros(self.method.episodes)
        self.lengths = np.zeros(self.method.episodes, dtype=np.int64)
        tally = np.zeros(2)
        place = FIRST_PLACE.copy()
        temperature = float(self.memory.schedule[TEMPERATURE])
        while place[EPISODE] < self.method.episodes:
            self._play_a_block(learns, place, tally)
        mean = mean_in_order(self.returns.tolist())
        decay_schedules(mean, self._numbers, self.memory.schedule)
        self.iterations_done += 1
        confidence = float(tally[TRUSTED] / tally[WEIGHED]) if tally[WEIGHED] else float('nan')
        return IterationResult(self.iterations_done, mean, confidence, temperature,
                         int(self.lengths.sum()))

    def _compile(self):
        """Play nothing at all, so that the first iteration need not wait for the compiler."""
        self._play = compiled(play)
        self.returns, self.lengths = np.zeros(0), np.zeros(0, dtype=np.int64)
        self._play_a_block(False, FIRST_PLACE.copy(), np.zeros(2))

    def _play_a_block(self, learns, place, tally):
        """Change place, tally, returns, lengths and the memory: as far as the draws reach."""
        world, (moves, decisions) = self.world, self._draws
        used = self._play(
            learns, world.grid.step_limit, float(world.grid.intended), world.starts,
            world.successor, world.reward, world.slips, world.terminal, *self._mentor.arrays(),
            self._numbers, *self.memory.arrays(), place, tally, self.returns, self.lengths,
            moves.block(), decisions.block())
        moves.use(used)
        decisions.use(used)


@kernel
def play(learns, step_limit, intended, starts, successor, reward, slips, terminal,
         policy, worth, told, left, did, method,
         q, visits, belief, arrivals, schedule, traces, trail, outcomes,
         place, tally, returns, lengths,
         moves, decisions):
    """
    Change place, tally, returns, lengths and the learner's arrays; return the states met.

    Plays until the iteration has all its episodes or the draws are used up, whichever is first.
    place: episode of the iteration, step (-1 before the first state), state, action, and what
    the mentor said there.
    """
    episode, step, s, a, msg = (
        place[EPISODE], place[STEP], place[STATE], place[ACTION], place[SAID])
    met, most = 0, min(len(moves), len(decisions))
    while met < most and episode < len(returns):
        r, s2, done, over = next_state(step, s, a, moves[met, 0], step_limit, intended, starts,
                                       successor, reward, slips, terminal)
        a2, said2 = NO_ACTION, NO_ACTION
        if not done:
            said2 = advise(s2, policy, worth, told, left, did)
            if learns:
                apply_advice_prior(s2, said2, method, q, visits, belief, schedule)
            a2, p = choose(s2, said2, step + 1, decisions[met, 0], decisions[met, 1], method,
                           q, visits, belief, arrivals, schedule, traces, trail, outcomes)
            if not over:  # the last choice of a truncated episode is never seen
                watch(s2, a2, did)
            if said2 != NO_ACTION:
                tally[WEIGHED] += 1.0
                tally[TRUSTED] += p
        if step >= 0:
            returns[episode] += r
            if learns:
                learn(s, a, r, s2, a2, done, msg, method,
                      q, visits, belief, arrivals, schedule, traces, trail, outcomes)
        met += 1
        step, s, a, msg = step + 1, s2, a2, said2
        if over:
            end_episode(method, q, visits, outcomes, traces, trail)
            lengths[episode] = step
            episode, step = episode + 1, -1
    place[EPISODE], place[STEP], place[STATE] = episode, step, s
    place[ACTION], place[SAID] = a, msg
    return met


@kernel
def next_state(step, s, a, u, step_limit, intended, starts, successor, reward, slips, terminal):
    """
    Return reward, state, whether it is terminal, and whether the episode ends there.

    step: -1 before the first state of an episode. u: uniform in [0, 1).
    """
    if step < 0:
        return 0.0, first_state(u, starts), False, False
    b = taken_action(s, a, u, intended, slips)
    s2 = successor[s, b]
    done = terminal[s2]
    return reward[s, b], s2, done, done or step + 1 == step_limit
