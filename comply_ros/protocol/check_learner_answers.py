# SPDX-License-Identifier: Apache-2.0
"""What a check expects of every answer of a learner."""

from __future__ import annotations

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.emulated_world import EmulatedWorld
from comply_ros.protocol.messages import Action, ANYONE, Recommendation, StateReward
from comply_ros.protocol.rule_report import Channel, PATIENCE, QUIET, RuleReport
from comply_ros.world.grid import NO_ACTION

RULES = {
    'P3': 'actions belong to an observation', 'L1': 'one number, which is not 0',
    'L3': 'one action for each new observation', 'L7': 'actions and confidences are possible',
    'L8': 'the end of an episode needs no advice', 'L17': 'the learner is described',
    'L18': 'followed is true for advice that was followed'}
MIDDLE = 3  # step at which a learner joins an episode
MOST_MOVES = 2000  # to find one that gets so far


class LearnerAnswers:
    """
    Plays the mentor, which recommends the best action, and checks the answers.

    Parameters
    ----------
    played: the world of the check.
    channel: to the learner.
    report: takes the verdicts.
    patience: seconds that an answer may take.

    Attributes
    ----------
    number: that of the learner, None before its first answer since it was started.

    """

    number: int | None

    def __init__(self, played: EmulatedWorld, channel: Channel, report: RuleReport,
                 patience: float = PATIENCE) -> None:
        self._played, self._channel, self._check = played, channel, report.check
        self._patience, self.number = patience, None
        self._advised: set[int] = set()
        self._before = len(channel.received['Action'])  # of earlier checks

    def was_advised(self, state: int) -> bool:
        """Tell whether there was a recommendation in a state."""
        return state in self._advised

    def advice(self, observation: StateReward) -> Recommendation:
        """Return the recommendation for an observation."""
        return Recommendation(*observation[:4], int(self._played.best[observation.state]))

    def advise(self, observation: StateReward) -> None:
        """Publish the recommendation for an observation."""
        self._advised.add(observation.state)
        self._channel.send(self.advice(observation))

    def checked(self, observation: StateReward) -> Action | None:
        """Wait for the answer to an observation; return it, checked, or None if none comes."""
        rule, expected = 'L3', 'an action for each new observation'
        if observation.terminated:
            rule, expected = 'L8', 'an action where it is terminated, without a recommendation'
        answered = self._played.wait(observation, self._patience)
        if not self._check(rule, answered, expected, f'none within {self._patience:g} s',
                           observation):
            return None
        action: Action = self._played.answers(observation)[0]
        self._check_action(observation, action)
        return action

    def move(self, action: Action) -> bool:
        """Move the world by an action; return whether it moves."""
        before = self._played.observation
        return self._check('L7', self.move_by(action), 'an action that the world accepts',
                           f'action {action.action}', before, action)

    def move_by(self, action: Action) -> bool:
        """Let the world receive an action; return whether it moves."""
        before = self._played.observation
        self._played.machine.on_action(action._replace(learner=self.number or ANYONE))
        return self._played.observation != before

    def skip_to_the_middle(self) -> StateReward | None:
        """
        Move the world to a step in the middle of an episode; return that observation.

        Return None where episodes are too short, in a run that has to begin anew then.
        """
        played, rng = self._played, random_streams(MIDDLE)[1]  # the same at each call
        for _ in range(MOST_MOVES):
            here = played.observation
            over = here.terminated or here.truncated
            if here.step == MIDDLE and not over:
                return here
            actions = played.world.available[here.state].nonzero()[0]
            played.machine.on_action(Action(
                *here[:3], NO_ACTION if over else int(rng.choice(actions)), False, 0.0,
                ANYONE))
        return None

    def check_whole_run(self) -> None:
        """Check what was received in the whole check."""
        check, actions = self._check, self._channel.received['Action'][self._before:]
        if not actions:
            return
        strange, excess = self._played.strange_answers(), self._played.excess_answers()
        check('P3', not strange, 'actions with run, episode and step of an observation',
              f'{len(strange)} of another one', *strange)
        check('L3', not excess, 'exactly one action for a new observation', f'{len(excess)} '
              'actions for observations that were published less often', *excess)
        descriptions = [each for each in self._channel.received['LearnerDescription']
                        if each.message.learner == actions[0].message.learner]
        check('L17', descriptions and descriptions[0].time <= actions[0].time + QUIET,
              'a LearnerDescription before the first action', f'{len(descriptions)} of them',
              actions[0].message)

    def _check_action(self, observation: StateReward, action: Action) -> None:
        check, world = self._check, self._played.world
        over = observation.terminated or observation.truncated
        possible = action.action == NO_ACTION if over else (
            0 <= action.action < world.n_actions
            and world.available[observation.state, action.action])
        check('L7', possible, 'NONE where the episode is over, else an action that the state has',
              f'action {action.action} in state {observation.state}', observation, action)
        check('L7', 0.0 <= action.confidence <= 1.0, 'a confidence in [0, 1]', action.confidence,
              observation, action)
        if self.number is None:
            self.number = action.learner
        check('L1', action.learner == self.number != ANYONE, 'one number, which is not 0',
              action.learner, action)
        advice = self.advice(observation).action if self.was_advised(observation.state) else None
        if action.followed:
            check('L18', action.action == advice, 'followed to be true only '
                  f'for the action that was recommended, {advice}', f'true for {action.action}',
                  observation, action)
