# SPDX-License-Identifier: Apache-2.0
"""Whether a world gives the same history for the same seed, and another one for another."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.messages import StateReward, step_id, WorldDescription
from comply_ros.protocol.rule_report import Channel, PATIENCE, RuleReport

RULES = {
    'W17': 'a new start continues its run, or takes a new one',
    'W23': 'the same seed gives the same history', 'W24': 'another seed gives another one'}
STEPS = 200  # of a history
LEAST_RANDOM = 8  # steps that must have been random for another seed to show

# Called with an observation and random numbers; returns the next action and observation.
Step = Callable[[StateReward, Any], tuple[int, StateReward | None]]
# For each observation: the action that led there, and what it says, without run and learner.
History = tuple[tuple[int, tuple[Any, ...]], ...]


class WorldHistories:
    """
    Takes the same actions from the first observation of a run, again and again.

    Parameters
    ----------
    channel: to the world.
    report: takes the verdicts.
    step: takes a step.
    seed: of the actions, and of a world that is started again.

    """

    def __init__(self, channel: Channel, report: RuleReport, step: Step, seed: int) -> None:
        self._channel, self._report, self._step, self._seed = channel, report, step, seed

    def check_after_reset(self) -> None:
        """Reset the world twice: both histories must be the same."""
        first = self._history(self._channel.reset)
        self._compare('W23', first, self._history(self._channel.reset))

    def check_after_restart(self) -> None:
        """Start the world again, with its seed and with another one."""
        before = self._last('WorldDescription'), self._last('StateReward')
        first = self._history(lambda: self._channel.restart(self._seed), before)
        again = self._history(lambda: self._channel.restart(self._seed))
        self._compare('W23', first, again)
        if first == again and _random_steps(first) >= LEAST_RANDOM:
            other = self._history(lambda: self._channel.restart(self._seed + 1))
            if other:
                self._report.check('W24', other != first, 'another history with seed '
                                   f'{self._seed + 1} than with {self._seed}, since chance has a '
                                   'part in it', 'the same', self._last('StateReward'))

    def _compare(self, rule: str, first: History, second: History) -> None:
        if not first or not second:
            return
        number = next((k for k, (one, other) in enumerate(zip(first, second)) if one != other), 0)
        self._report.check(
            rule, first == second, 'the same observations for the same actions and the same seed',
            f'{second[number]} instead of {first[number]} (action; episode, step, state, reward, '
            'terminated, truncated)', self._last('StateReward'))

    def _history(self, start: Callable[[], bool],
                 before: tuple[WorldDescription, StateReward] | None = None) -> History:
        """Return what a run has from its start on; empty where it cannot be started."""
        old = self._last('StateReward').run
        if not start():
            return ()
        self._channel.wait(lambda: self._last('StateReward').run != old and self._last(
            'WorldDescription').run == self._last('StateReward').run, PATIENCE)
        description, observation = self._last('WorldDescription'), self._last('StateReward')
        if before:
            self._check_start(*before, description, observation)
        if step_id(observation) != (1, 0):
            return ()
        rng, history = random_streams(self._seed)[1], [(0, observation)]
        for _ in range(STEPS):
            action, after = self._step(observation, rng)
            if after is None:
                return ()
            history.append((action, after))
            observation = after
        return tuple((action, each[1:-1]) for action, each in history)

    def _check_start(self, old: WorldDescription, open_before: StateReward,
                     description: WorldDescription, observation: StateReward) -> None:
        """Check the first messages of a world that was started again."""
        if description.run == old.run:
            kept = observation[:4] == open_before[:4]
        else:
            kept = description.replaces == 0 and step_id(observation) == (1, 0)
        self._report.check(
            'W17', kept, 'a new run that replaces 0, or the run of before with the observation '
            'that was open', f'run {description.run} replaces {description.replaces}, step id '
            f'{step_id(observation)}', old, open_before, description, observation)

    def _last(self, name: str) -> Any:
        return self._channel.received[name][-1].message


def _random_steps(history: History) -> int:
    """Return how many steps went another way than the usual one of their state and action."""
    seen: defaultdict[tuple[int, int], Counter[Any]] = defaultdict(Counter)
    for (_, before), (action, after) in pairwise(history):
        seen[before[2], action][after[2:4]] += 1
    return sum(counts.total() - max(counts.values()) for counts in seen.values())
