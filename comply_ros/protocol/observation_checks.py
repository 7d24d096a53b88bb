# SPDX-License-Identifier: Apache-2.0
"""What holds for every observation of a world that is checked, and for two that follow."""

from __future__ import annotations

from math import isfinite

from comply_ros.protocol.messages import Episode, StateReward, step_id
from comply_ros.protocol.outcome_statistics import OutcomeCounts
from comply_ros.protocol.rule_report import Channel, QUIET, RuleReport
from comply_ros.world.mdp import World

RULES = {
    'W6': 'step ids follow each other', 'W7': 'episodes begin at a start',
    'W8': 'terminated in terminal states alone', 'W9': 'truncated at the step limit alone',
    'W10': 'states and rewards are possible',
    'W13': 'observations have the number of their learner', 'W15': 'episodes are reported',
    'W21': 'states are those that the model leads to',
    'W22': 'moves and rewards are those of the model'}


class ObservationChecks:
    """
    Checks observations one by one, and counts what actions led to.

    Parameters
    ----------
    world: as it is described.
    channel: to it.
    report: takes the verdicts.

    Attributes
    ----------
    counts_moves: whether what follows is compared with the model; not where it is taken again.

    """

    def __init__(self, world: World, channel: Channel, report: RuleReport) -> None:
        self._world, self._channel, self._check = world, channel, report.check
        self._counts, self._return, self._saw_start = OutcomeCounts(world), 0.0, False
        self.counts_moves = True

    def check_first(self, observation: StateReward) -> bool:
        """Check the first observation that is seen of a run; return whether it can go on."""
        self._saw_start, self._return = observation.step == 0, 0.0
        return self._check_alone(observation)

    def lose_track(self) -> None:
        """Expect no return of this episode: the world has moved as it must not."""
        self._saw_start = False

    def check_next(self, before: StateReward, action: int, after: StateReward,
                   learner: int) -> bool:
        """
        Check what holds for an observation after another one; return whether it can go on.

        action: that led from the one to the other. learner: whose action that was.
        """
        over = before.terminated or before.truncated
        expected = (before.episode + 1, 0) if over else (before.episode, before.step + 1)
        self._check('W6', step_id(after) == expected, f'step id {expected}', step_id(after),
                    before, after)
        self._check('W13', after.learner == learner, f'learner {learner}, whose action was '
                    'accepted', after.learner, before, after)
        if not self._check_alone(after):
            return False
        self._return = 0.0 if over else self._return + after.reward
        if not over and self._world.model != 'none':
            leads = self._check('W21', self._world.leads(before.state, after.state), 'a state '
                                'that the model leads to', f'{after.state} from {before.state}',
                                before, after)
            if leads and self.counts_moves:
                self._counts.add(before.state, action, after.state, after.reward)
        if after.terminated or after.truncated:
            self._check_report(after)
        return True

    def compare_moves(self) -> None:
        """Compare how often outcomes came with the model."""
        for kept, expected, got in self._counts.comparisons():
            self._check('W22', kept, expected, got)

    def _check_alone(self, observation: StateReward) -> bool:
        """Check what holds for every observation by itself; return whether it can go on."""
        check, world, s = self._check, self._world, observation.state
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
        return self._check_end(observation) and acts

    def _check_end(self, observation: StateReward) -> bool:
        check, world, s = self._check, self._world, observation.state
        right = world.model == 'none' or check(
            'W8', observation.terminated == world.terminal[s],
            'terminated in the terminal states and nowhere else',
            f'{observation.terminated} in state {s}', observation)
        at_limit = observation.step == world.step_limit and not observation.terminated
        cut = observation.truncated == at_limit or (
            world.model == 'none' and observation.truncated and not observation.terminated)
        if right:  # a wrong `terminated` must not show twice
            check('W9', cut and observation.step <= world.step_limit,
                  f'truncated at step {world.step_limit}, unless terminated, and nowhere else',
                  f'{observation.truncated} at step {observation.step}', observation)
        return right

    def _check_report(self, last: StateReward) -> None:
        """Check the report of an episode; its return is known where the check saw its start."""
        def reports() -> list[Episode]:
            return [each.message for each in self._channel.received['Episode'][-5:]
                    if each.message[:2] == last[:2]]
        self._channel.wait(reports, QUIET)
        expected = Episode(*last[:3], self._return, last.terminated, last.truncated)
        kept = expected in reports() if self._saw_start else reports()
        self._check('W15', kept, f'{expected} before the last observation',
                    reports() or 'none', last)
        self._saw_start = True
