# SPDX-License-Identifier: Apache-2.0
"""A check of a world: this side plays the learner."""

from __future__ import annotations

from collections import Counter, defaultdict
from math import isfinite
from typing import Any

import numpy as np

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.messages import (
    Action,
    ANYONE,
    Episode,
    NO_RUN,
    StateReward,
    step_id,
    WorldDescription,
)
from comply_ros.protocol.outcome_statistics import (
    chi_squared,
    chi_squared_tail,
    LEAST,
    outcomes,
)
from comply_ros.protocol.rule_report import Channel, RuleReport, Verdict
from comply_ros.protocol.world_description import is_same_world, world_from_description
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

RULES = {
    'W1': 'the description comes first', 'W2': 'its fields follow their rules',
    'W3': 'it does not change within a run', 'W4': 'the number of the run is not 0',
    'W5': 'one observation is open at a time', 'W6': 'step ids follow each other',
    'W7': 'episodes begin at a start', 'W8': 'terminated in terminal states alone',
    'W9': 'truncated at the step limit alone', 'W10': 'states and rewards are possible',
    'W11': 'an open observation is repeated', 'W12': 'wrong actions are not accepted',
    'W13': 'observations have the number of their learner',
    'W14': 'a silent learner loses the run',
    'W15': 'episodes are reported', 'W16': 'a reset starts a new run',
    'W19': 'another world is answered', 'W20': 'a world that was answered stays',
    'W21': 'states are those that the model leads to',
    'W22': 'moves and rewards are those of the model'}
PATIENCE = 10.0  # seconds that an observation may take
QUIET = 0.3  # seconds without a message that count as silence
STEPS = 2000  # steps of which the frequencies of successors are compared with the model
RELEASE = 12.0  # seconds after which a world must have freed its run: 3 s and a pause of W11
ALPHA = 1e-4  # chance that a right world fails because of its frequencies
LEARNER, SECOND_LEARNER = 33, 34


class WorldCheck:
    """
    Takes steps in a world, sends actions that are wrong, waits, and takes more steps.

    channel: to the world. seed: of the actions. steps: to take.
    """

    def __init__(self, channel: Channel, seed: int = 0, steps: int = STEPS) -> None:
        self._channel, self._steps, self._seed = channel, steps, seed
        self._rng = random_streams(seed)[1]
        self._learner, self._seen_end, self._return = LEARNER, False, 0.0
        self._seen: dict[tuple[int, int], Counter[tuple[int, float]]] = defaultdict(Counter)
        self.report = RuleReport(RULES)

    def run(self) -> tuple[Verdict, ...]:
        """Check the world; return a verdict on each rule."""
        check = self.report.check
        there = self._channel.wait(
            lambda: self._heard('WorldDescription') and self._heard('StateReward'), PATIENCE)
        if not check('W1', there, 'a description and an observation',
                     f'not both within {PATIENCE:g} s'):
            return self.report.verdicts()
        description, first = self._last('WorldDescription'), self._last('StateReward')
        check('W1', description.run == first.run, 'a description of the run of the observation, '
              f'{first.run}', description.run, description, first)
        check('W4', first.run != NO_RUN, 'a run that is not 0', first.run, first)
        try:
            self._world = World(world_from_description(description))
        except ValueError as error:
            check('W2', False, 'a description that follows the rules of its fields', error)
            return self.report.verdicts()
        check('W2', True, '')
        if step_id(first) == (1, 0):
            check('W6', True, '')
        # A run that another learner owns is free after some seconds.
        self._channel.wait(lambda: self._last('StateReward').learner == ANYONE, RELEASE)
        first = self._last('StateReward')
        self._joined_at_start = first.step == 0
        if self._check_state(first) and self._play(first):
            self._check_waiting()
            self._check_other_world()
            self._check_reset()
        self._check_frequencies()
        changed = [each.message for each in self._heard('WorldDescription')
                   if each.message.run == description.run
                   and not is_same_world(each.message, description)]
        check('W3', not changed, 'the same world within a run', 'another one', description,
              *changed)
        return self.report.verdicts()

    def _heard(self, name: str) -> list[Any]:
        return self._channel.heard[name]

    def _last(self, name: str) -> Any:
        return self._heard(name)[-1].message

    def _play(self, observation: StateReward) -> bool:
        """Take steps from an observation on; return whether the world went on with all."""
        for number in range(self._steps):
            if number == 3:
                self._check_repeats(observation)
            if number in (5, 6):
                self._send_wrong_actions(observation)
            if (observation.terminated or observation.truncated) and not self._seen_end:
                self._seen_end = True
                self._send_wrong(observation, 0, {})
            action = self._choose(observation)
            after = self._act(observation, action)
            if after is None or not self._check_next(observation, action, after):
                return False
            observation = after
        return True

    def _choose(self, observation: StateReward) -> int:
        if observation.terminated or observation.truncated:
            return NO_ACTION
        actions = np.flatnonzero(self._world.available[observation.state])
        return int(self._rng.choice(actions))

    def _send(self, observation: StateReward, action: int, **changes: Any) -> None:
        self._channel.send(Action(*observation[:3], action, False, 0.0,
                                  self._learner)._replace(**changes))

    def _new(self, observation: StateReward) -> StateReward | None:
        """Return the first observation of the run after this one, if it was received."""
        found = None
        for each in reversed(self._heard('StateReward')):
            if each.message.run != observation.run or step_id(each.message) <= step_id(
                    observation):
                break
            found = each.message
        return found

    def _act(self, observation: StateReward, action: int,
             rule: str = 'W5') -> StateReward | None:
        """Send an action; return the observation that follows, None if none does."""
        self._send(observation, action)
        came = self._channel.wait(lambda: self._new(observation), PATIENCE)
        self.report.check(rule, came, 'the next observation after an action for the open one',
                          f'none within {PATIENCE:g} s', observation)
        return self._new(observation)

    def _check_state(self, observation: StateReward) -> bool:
        """Check what holds for every observation by itself; return whether it can go on."""
        check, world, s = self.report.check, self._world, observation.state
        within = 0 <= s < world.n_states and not world.obstacle[s]
        if not check('W10', within and isfinite(observation.reward), 'a state of the description, '
                     'and a finite reward', f'state {s}, reward {observation.reward:g}',
                     observation):
            return False
        over = observation.terminated or observation.truncated
        acts = over or bool(world.available[s].any())
        if world.model == 'none':
            check('W10', acts, 'an action where the episode goes on', f'none in state {s}',
                  observation)
        if observation.step == 0:
            right = observation.reward == 0.0 and not observation.terminated and (
                world.model == 'none' or world.begins[s])
            check('W7', right, 'at step 0 one of the starts, reward 0, not terminated',
                  f'state {s}, reward {observation.reward:g}', observation)
        if world.model != 'none':
            check('W8', observation.terminated == world.terminal[s], 'terminated in the terminal '
                  'states and nowhere else', f'{observation.terminated} in state {s}', observation)
        at_limit = observation.step == world.step_limit and not observation.terminated
        right = observation.truncated == at_limit or (
            world.model == 'none' and observation.truncated and not observation.terminated)
        check('W9', right and observation.step <= world.step_limit,
              f'truncated at step {world.step_limit}, unless terminated, and nowhere else',
              f'{observation.truncated} at step {observation.step}', observation)
        return acts

    def _check_next(self, before: StateReward, action: int, after: StateReward) -> bool:
        """Check what holds for an observation after another one; return as `_check_state`."""
        check, over = self.report.check, before.terminated or before.truncated
        expected = (before.episode + 1, 0) if over else (before.episode, before.step + 1)
        check('W6', step_id(after) == expected, f'step id {expected}', step_id(after), before,
              after)
        check('W13', after.learner == self._learner, f'learner {self._learner}, whose action was '
              'accepted', after.learner, before, after)
        if not self._check_state(after):
            return False
        self._return = 0.0 if over else self._return + after.reward
        if not over and self._world.model != 'none':
            check('W21', self._world.leads(before.state, after.state), 'a state that the model '
                  'leads to', f'{after.state} from {before.state}', before, after)
            self._seen[before.state, action][after.state, after.reward] += 1
        if after.terminated or after.truncated:
            def reports() -> list[Any]:
                return [each.message for each in self._heard('Episode')[-5:]
                        if each.message[:3] == after[:3]]
            self._channel.wait(reports, QUIET)
            right = self._joined_at_start and reports()[:1] == [Episode(
                *after[:3], self._return, after.terminated, after.truncated)]
            check('W15', right or not self._joined_at_start and reports(),
                  f'an Episode of return {self._return:g} before the last observation',
                  reports() or 'none', after)
            self._joined_at_start = True
        return True

    def _check_repeats(self, observation: StateReward) -> None:
        """Leave an observation open: it must be repeated, and nothing else must follow."""
        def repeats() -> list[StateReward]:
            return [each.message for each in self._heard('StateReward')
                    if each.message[:3] == observation[:3]]
        count = len(repeats())
        self._channel.wait(lambda: False, 4 * QUIET)
        self._channel.wait(lambda: len(repeats()) > count, PATIENCE)
        same = [each._replace(learner=ANYONE) == observation._replace(learner=ANYONE)
                for each in repeats()]
        self.report.check('W11', len(same) > count and all(same), 'the open observation again, '
                          f'with the same fields, within {PATIENCE:g} s',
                          f'{len(same) - count} more, {same.count(False)} with other fields',
                          *repeats())
        self.report.check('W5', self._new(observation) is None, 'no new observation without an '
                          'action', 'one', observation, self._new(observation))

    def _send_wrong_actions(self, observation: StateReward) -> None:
        """Send actions that must not be accepted."""
        if observation.terminated or observation.truncated:
            return
        missing = np.flatnonzero(~self._world.available[observation.state])
        right = self._choose(observation)
        wrong: list[tuple[int, dict[str, Any]]] = [
            (right, {'run': observation.run % (2 ** 32 - 2) + 1}),
            (right, {'learner': SECOND_LEARNER}),
            (NO_ACTION, {}), (self._world.n_actions, {}),
            (right, {'step': observation.step + 1})]
        wrong += [(int(missing[0]), {})] if len(missing) else []
        wrong += [(right, {'step': observation.step - 1})] if observation.step else []
        for action, changes in wrong:
            self._send_wrong(observation, action, changes)

    def _send_wrong(self, observation: StateReward, action: int, changes: dict[str, Any]) -> None:
        self._send(observation, action, **changes)
        moved = self._channel.wait(lambda: self._new(observation), QUIET)
        self.report.check('W12', not moved, 'no move by an action of another run, of another '
                          'learner, for another observation, or that the state lacks',
                          f'a move by action {action} {changes or ""}', observation,
                          self._new(observation))

    def _check_waiting(self) -> None:
        """Say nothing for some seconds: the run must be freed, and taken by another learner."""
        observation = self._last('StateReward')
        descriptions = len(self._heard('WorldDescription'))
        freed = self._channel.wait(
            lambda: self._last('StateReward').learner == ANYONE
            and len(self._heard('WorldDescription')) > descriptions, RELEASE)
        if not self.report.check('W14', freed, 'learner 0 and the description again, after 3 s '
                                 'without an action', f'neither within {RELEASE:g} s',
                                 self._last('StateReward')):
            return
        self._learner = SECOND_LEARNER
        action = self._choose(observation)
        after = self._act(observation, action)
        if after is not None:
            self._check_next(observation, action, after)

    def _check_other_world(self) -> None:
        """Describe another world: this one publishes its own description, and stays."""
        mine = self._last('WorldDescription')
        count = len(self._heard('WorldDescription'))
        for _ in range(10):
            before = len(self._heard('WorldDescription'))
            self._channel.send(mine._replace(run=mine.run % (2 ** 32 - 2) + 1, replaces=NO_RUN))
            self._channel.wait(
                lambda before=before: len(self._heard('WorldDescription')) > before, QUIET)
        answers = len(self._heard('WorldDescription')) - count
        self.report.check('W19', 1 <= answers <= 8, 'its description after that of another run, '
                          'at most 8 times', f'{answers} times', mine)
        observation = self._last('StateReward')
        self._act(observation, self._choose(observation), 'W20')

    def _check_reset(self) -> None:
        before: WorldDescription = self._last('WorldDescription')
        if not self._channel.reset():
            return
        came = self._channel.wait(
            lambda: self._last('WorldDescription').run != before.run
            and self._last('StateReward').run == self._last('WorldDescription').run, PATIENCE)
        after, first = self._last('WorldDescription'), self._last('StateReward')
        self.report.check(
            'W16', came and after.replaces == before.run and step_id(first) == (1, 0)
            and first.learner == ANYONE, 'after a reset a new run that replaces the old one, with '
            'its first observation and learner 0', f'run {after.run} replaces {after.replaces}, '
            f'step id {step_id(first)}, learner {first.learner}', after, first)
        self.report.check('W4', after.run != NO_RUN, 'a run that is not 0', after.run, after)
        self._check_state(first)

    def _check_frequencies(self) -> None:
        """
        Compare rewards, and how often each successor came, with the model.

        Each action of each state has a chi-squared test, in which outcomes that are rare are
        counted together; one more test is about all of them: how often the outcome that is most
        likely did not come. The chance to fail a right world is ALPHA in all.
        """
        if not self._seen or self._world.model == 'none':
            return
        level = ALPHA / (len(self._seen) + 1)
        missed, expected_misses, variance = 0, 0.0, 0.0
        for (s, a), seen in self._seen.items():
            expected, total = outcomes(self._world, s, a), sum(seen.values())
            strange = [each for each in seen if each not in expected]
            if not self.report.check('W22', not strange, 'rewards and successors of the model: '
                                     + ', '.join(map(str, expected)),
                                     f'{strange[:1]} in state {s}, action {a}'):
                continue
            likely = max(expected, key=lambda each: expected[each])
            missed += total - seen[likely]
            expected_misses += total * (1.0 - expected[likely])
            variance += total * expected[likely] * (1.0 - expected[likely])
            self._check_tail(level, *chi_squared(seen, expected),
                             f'successors as often as the model says, in state {s}, action {a}')
        if variance > LEAST:
            self._check_tail(level, (missed - expected_misses) ** 2 / variance, 1,
                             f'{expected_misses:.0f} steps that do not lead where they usually do,'
                             f' and not {missed}')

    def _check_tail(self, level: float, statistic: float, degrees: int, expected: str) -> None:
        tail = chi_squared_tail(statistic, degrees)
        self.report.check('W22', tail >= level, expected,
                          f'chi-squared {statistic:.1f}: chance {tail:.1e}')
