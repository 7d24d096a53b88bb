# SPDX-License-Identifier: Apache-2.0
"""A check of a world: this side plays the learner."""

from __future__ import annotations

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
from comply_ros.protocol.outcome_statistics import OutcomeCounts
from comply_ros.protocol.played_world import other_number
from comply_ros.protocol.rule_report import (
    Channel,
    PATIENCE,
    QUIET,
    Received,
    RuleReport,
    Verdict,
)
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
STEPS = 2000  # steps of which the frequencies of successors are compared with the model
RELEASE = 12.0  # seconds after which a world must have freed its run: 3 s and a pause of W11
LEARNER, SECOND_LEARNER = 33, 34


class WorldCheck:
    """
    Takes steps in a world, sends actions that are wrong, waits, and takes more steps.

    channel: to the world. seed: of the actions. steps: to take.
    """

    def __init__(self, channel: Channel, seed: int = 0, steps: int = STEPS) -> None:
        self._channel, self._steps = channel, steps
        self._rng = random_streams(seed)[1]
        self._learner, self._seen_end, self._return = LEARNER, False, 0.0
        self.report = RuleReport(RULES)

    def run(self) -> tuple[Verdict, ...]:
        """Check the world; return a verdict on each rule."""
        check = self.report.check
        there = self._channel.wait(
            lambda: self._received('WorldDescription') and self._received('StateReward'), PATIENCE)
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
        self._counts = OutcomeCounts(self._world)
        if step_id(first) == (1, 0):
            check('W6', True, '')
        # A run that another learner owns is free after some seconds.
        self._channel.wait(lambda: self._last('StateReward').learner == ANYONE, RELEASE)
        first = self._last('StateReward')
        self._saw_start = first.step == 0
        if self._check_state(first) and self._play(first):
            self._check_waiting()
            self._check_other_world()
            self._check_reset()
        for kept, expected, got in self._counts.comparisons():
            check('W22', kept, expected, got)
        changed = [each.message for each in self._received('WorldDescription')
                   if each.message.run == description.run
                   and not is_same_world(each.message, description)]
        check('W3', not changed, 'the same world within a run', 'another one', description,
              *changed)
        return self.report.verdicts()

    def _received(self, name: str) -> list[Received]:
        return self._channel.received[name]

    def _last(self, name: str) -> Any:
        return self._received(name)[-1].message

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
        for each in reversed(self._received('StateReward')):
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
            self._counts.add(before.state, action, after.state, after.reward)
        if after.terminated or after.truncated:
            self._check_report(after)
        return True

    def _check_report(self, last: StateReward) -> None:
        """Check the report of an episode; its return is known where the check saw its start."""
        def reports() -> list[Episode]:
            return [each.message for each in self._received('Episode')[-5:]
                    if each.message[:3] == last[:3]]
        self._channel.wait(reports, QUIET)
        expected = Episode(*last[:3], self._return, last.terminated, last.truncated)
        kept = expected in reports() if self._saw_start else reports()
        self.report.check('W15', kept, f'{expected} before the last observation',
                          reports() or 'none', last)
        self._saw_start = True

    def _check_repeats(self, observation: StateReward) -> None:
        """Leave an observation open: it must be repeated, and nothing else must follow."""
        def repeats() -> list[StateReward]:
            return [each.message for each in self._received('StateReward')
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
            (right, {'run': other_number(observation.run)}),
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
        """Publish nothing for seconds: the run must be freed, and taken by another learner."""
        observation = self._last('StateReward')
        descriptions = len(self._received('WorldDescription'))
        freed = self._channel.wait(
            lambda: self._last('StateReward').learner == ANYONE
            and len(self._received('WorldDescription')) > descriptions, RELEASE)
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
        count = len(self._received('WorldDescription'))
        for _ in range(10):
            before = len(self._received('WorldDescription'))
            self._channel.send(mine._replace(run=other_number(mine.run), replaces=NO_RUN))
            self._channel.wait(
                lambda before=before: len(self._received('WorldDescription')) > before, QUIET)
        answers = len(self._received('WorldDescription')) - count
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
