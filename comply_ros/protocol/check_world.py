# SPDX-License-Identifier: Apache-2.0
"""A check of a world: this side plays the learner."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.check_plan_shortening import Plan
from comply_ros.protocol.check_world_disturbances import RULES as DISTURBANCES
from comply_ros.protocol.check_world_disturbances import WorldDisturbances
from comply_ros.protocol.check_world_seeds import RULES as HISTORIES
from comply_ros.protocol.check_world_seeds import WorldHistories
from comply_ros.protocol.emulated_learner import EmulatedLearner
from comply_ros.protocol.emulated_world import other_number
from comply_ros.protocol.messages import (
    ANYONE,
    NO_RUN,
    StateReward,
    step_id,
    WorldDescription,
)
from comply_ros.protocol.observation_checks import ObservationChecks
from comply_ros.protocol.observation_checks import RULES as OBSERVATIONS
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

RULES = {'P6': DISTURBANCES['P6'], **dict(sorted({
    'W1': 'the description comes first', 'W2': 'its fields follow their rules',
    'W3': 'it does not change within a run', 'W4': 'the number of the run is not 0',
    'W5': 'one observation is open at a time', 'W11': DISTURBANCES['W11'],
    'W12': DISTURBANCES['W12'],
    'W14': 'a silent learner loses the run', 'W16': 'a reset starts a new run',
    'W18': 'what was answered is not repeated', 'W19': 'another world is answered',
    'W20': 'a world that was answered stays', **OBSERVATIONS, **HISTORIES}.items(),
    key=lambda each: int(each[0][1:])))}
STEPS = 2000  # of which the frequencies of successors are compared with the model
RELEASE = 12.0  # seconds after which a world must have freed its run: 3 s and a pause of W11
LEARNER, SECOND_LEARNER = 33, 34


def world_plan(steps: int = STEPS) -> Plan:
    """Return what a check of a world does, with so many steps."""
    return ('step', 'step', 'step', 'repeats', 'step', 'late', 'step', 'wrong', 'step', 'wrong',
            *('step',) * max(0, steps - 6), 'wait', 'other world', 'reset', 'same seed',
            'other seed')


class WorldCheck:
    """
    Takes steps in a world, sends actions that are wrong, waits, and takes more steps.

    Parameters
    ----------
    channel: to the world.
    seed: of the actions.
    plan: what to do.
    patience: seconds that an answer may take.

    """

    def __init__(self, channel: Channel, seed: int = 0, plan: Plan | None = None,
                 patience: float = PATIENCE) -> None:
        self._channel, self._patience = channel, patience
        self._plan = world_plan() if plan is None else plan
        self._rng = random_streams(seed)[1]
        self._seen_end = False
        self.report = RuleReport(RULES, channel)
        histories = WorldHistories(channel, self.report, self._step_with, seed)
        self._items: dict[str, Callable[[], object]] = {
            'step': self._step, 'wait': self._check_waiting,
            'other world': self._check_other_world, 'reset': self._check_reset,
            'same seed': histories.check_after_reset, 'other seed': histories.check_after_restart}

    def run(self) -> tuple[Verdict, ...]:
        """Check the world; return a verdict on each rule."""
        if self._find_world():
            description = self._last('WorldDescription')
            # A run that another learner owns is free after some seconds.
            self._channel.wait(lambda: self._last('StateReward').learner in (
                ANYONE, LEARNER, SECOND_LEARNER), RELEASE)
            self._learner.number = self._learner.observation.learner or LEARNER
            if self._checks.check_first(self._learner.observation):
                self.report.follow(self._plan, self._do)
            self._checks.compare_moves()
            self._check_whole_run(description)
        return self.report.verdicts()

    def _do(self, item: str) -> object:
        """Do an item of the plan; the moves of steps alone are compared with the model."""
        self._checks.counts_moves = item == 'step'
        return self._items[item]()

    def _find_world(self) -> bool:
        """Check the description and the first observation; return whether a check can begin."""
        check = self.report.check
        there = self._channel.wait(
            lambda: self._received('WorldDescription') and self._received('StateReward'),
            self._patience)
        if not check('W1', there, 'a description and an observation',
                     f'not both within {self._patience:g} s'):
            return False
        description, first = self._last('WorldDescription'), self._last('StateReward')
        check('W1', description.run == first.run, 'a description of the run of the observation, '
              f'{first.run}', description.run, description, first)
        check('W4', first.run != NO_RUN, 'a run that is not 0', first.run, first)
        try:
            self._world = World(world_from_description(description))
        except ValueError as error:
            return check('W2', False, 'a description that follows the rules of its fields', error,
                         description)
        check('W2', True, '')
        self._checks = ObservationChecks(self._world, self._channel, self.report)
        self._learner = EmulatedLearner(self._world, self._channel, self.report, LEARNER,
                                        self._patience)
        self._disturbances = disturbances = WorldDisturbances(
            self._learner, self._checks, self._channel, self.report, self._rng, self._patience)
        self._items |= {'repeats': disturbances.check_repeats, 'late': disturbances.send_late,
                        'wrong': disturbances.send_wrong}
        return True

    def _received(self, name: str) -> list[Received]:
        return self._channel.received[name]

    def _last(self, name: str) -> Any:
        return self._received(name)[-1].message

    def _step(self) -> bool:
        """Take a step; return whether the world can go on."""
        return self._step_with(self._learner.observation, self._rng)[1] is not None

    def _step_with(self, observation: StateReward, rng: Any) -> tuple[int, StateReward | None]:
        """Take a step by random numbers; return the action, and the observation that follows."""
        if step_id(observation) == (1, 0) and not self._checks.check_first(observation):
            return NO_ACTION, None
        if (observation.terminated or observation.truncated) and not self._seen_end:
            self._seen_end = True
            self._disturbances.send_wrong_action(observation, 0)
        action = self._learner.choose(observation, rng)
        after = self._learner.act(observation, action)
        if after is None or not self._checks.check_next(observation, action, after,
                                                        self._learner.number):
            return action, None
        return action, after

    def _check_waiting(self) -> None:
        """Publish nothing for seconds: the run must be freed, and taken by another learner."""
        descriptions = len(self._received('WorldDescription'))
        freed = self._channel.wait(
            lambda: self._last('StateReward').learner == ANYONE
            and len(self._received('WorldDescription')) > descriptions, RELEASE)
        if self.report.check('W14', freed, 'learner 0 and the description again, after 3 s '
                             'without an action', f'neither within {RELEASE:g} s',
                             self._last('StateReward')):
            self._learner.number = SECOND_LEARNER
            self._step()

    def _check_other_world(self) -> bool:
        """Describe another world: this one describes itself too; return whether it stays."""
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
        learner, observation = self._learner, self._learner.observation
        return bool(learner.act(observation, learner.choose(observation, self._rng), 'W20'))

    def _check_reset(self) -> bool:
        """Reset the world; return whether it goes on."""
        before: WorldDescription = self._last('WorldDescription')
        if not self._channel.reset():
            return True
        came = self._channel.wait(
            lambda: self._last('WorldDescription').run != before.run
            and self._last('StateReward').run == self._last('WorldDescription').run,
            self._patience)
        after, first = self._last('WorldDescription'), self._last('StateReward')
        self.report.check(
            'W16', came and after.replaces == before.run and step_id(first) == (1, 0)
            and first.learner == ANYONE, 'after a reset a new run that replaces the old one, with '
            'its first observation and learner 0', f'run {after.run} replaces {after.replaces}, '
            f'step id {step_id(first)}, learner {first.learner}', after, first)
        self.report.check('W4', after.run != NO_RUN, 'a run that is not 0', after.run, after)
        return came and self._checks.check_first(first)

    def _check_whole_run(self, description: WorldDescription) -> None:
        """Check what was received in the whole check; its run was described first."""
        messages = [each.message for each in self.report.transcript()]
        again = [msg for msg in messages if type(msg) is WorldDescription
                 and msg.run == description.run]
        changed = [msg for msg in again if not is_same_world(msg, description)]
        if len(again) > 1:
            self.report.check('W3', not changed, 'the same world within a run', 'another one',
                              description, *changed)
        newest: dict[int, StateReward] = {}
        for msg in messages:
            if type(msg) is StateReward and (last := newest.setdefault(msg.run, msg)) is not msg:
                self.report.check('W18', step_id(msg) >= step_id(last), 'no observation again '
                                  'that was answered', step_id(msg), last, msg)
                newest[msg.run] = max(last, msg, key=step_id)
