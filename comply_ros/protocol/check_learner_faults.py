# SPDX-License-Identifier: Apache-2.0
"""What a learner learns from the same messages again, with and without faults."""

from __future__ import annotations

from math import nan
from typing import NamedTuple

import numpy as np

from comply_ros.protocol.channel_faults import fault_streams, Faults, FaultyChannel
from comply_ros.protocol.check_learner_answers import LearnerAnswers
from comply_ros.protocol.emulated_world import EmulatedWorld
from comply_ros.protocol.messages import Action, ANYONE, StateReward
from comply_ros.protocol.rule_report import Channel, FAIL, PASS, QUIET, RuleReport

RULES = {
    'P6': 'late, repeated and wrong messages change nothing',
    'L14': 'nothing is learned from the action of another one',
    'L15': 'what was learned stays in a new run',
    'L19': 'the same messages teach the same'}
NEEDED = ('L4', 'L5', 'L10', 'L11')  # where one is broken, so is P6
STEPS = 40  # observations of a transcript
FAULTS = Faults(drop=0.2, delay=0.2, duplicate=0.2, reorder=0.2, longest_delay=0.1)
PAUSE, LONGEST_PAUSE = 0.02, 1.0  # seconds before an observation with faults is repeated
LONGEST = 60.0  # seconds that a transcript with faults may take


class Taught(NamedTuple):
    """
    What came of a transcript.

    actions: without their run. digest: None if the learner says none.
    learned: whether there is a digest, and it changed with the transcript.
    """

    actions: tuple[tuple[object, ...], ...]
    digest: str | None
    learned: bool


class LearnerReplays:
    """
    Lets a learner that was reset learn from the same transcript several times.

    Parameters
    ----------
    played: the world of the check.
    channel: to the learner, which is asked to start anew before each transcript.
    report: takes the verdicts.
    answers: plays the mentor.
    seed: of the faults, and of a learner that is started again.

    """

    def __init__(self, played: EmulatedWorld, channel: Channel, report: RuleReport,
                 answers: LearnerAnswers, seed: int) -> None:
        self._played, self._channel, self._report = played, channel, report
        self._answers, self._seed = answers, seed
        self._waits = False  # whether the learner waits for advice in a state without any
        self._taught: Taught | None = None
        self._first_digest: str | None = None

    def note_digest(self) -> None:
        """Remember the digest of a learner that has learned nothing yet."""
        self._first_digest = self._channel.digest()

    def check_keeps(self) -> None:
        """Start a run of the same world: what was learned stays."""
        before = self._channel.digest()
        if before is None or before == self._first_digest:
            return
        self._played.describe()
        self._channel.wait(lambda: False, QUIET)
        after = self._channel.digest()
        self._report.check('L15', after == before, 'the digest of before in a new run of the same '
                           f'world, {before[:16]}', str(after)[:16], self._played.observation)

    def check_same_transcript(self) -> None:
        """Let the learner start anew, and give it the same messages twice."""
        first, second = self._teach(), self._teach()
        if first and second:
            self._report.check('L19', first == second, 'the same actions and digest for the same '
                               'messages', _difference(first, second), self._played.observation)
            self._taught = first

    def check_joined_reward(self) -> None:
        """Let the learner join an episode with another reward: it must learn the same."""
        if not self._is_steady():
            return
        world = self._played.world
        rewards = np.unique(world.reward if world.model == 'grid' else world.table.reward)
        one, other = (self._teach(joined_reward=float(rewards[k])) for k in (0, -1))
        if one and other and one.learned and len(rewards) > 1:
            self._report.check('L14', one == other, 'the same actions and digest, whatever the '
                               'reward of an action that it did not take',
                               _difference(one, other), self._played.observation)

    def check_faults(self) -> None:
        """Give it the same messages, of which a fifth is lost, late, doubled, and reordered."""
        if not self._is_steady() or any(self._report.result(rule) == FAIL for rule in NEEDED):
            return
        found = self._teach(faulty=True)
        if found:
            self._report.check('P6', found == self._taught, 'the actions and the digest of the '
                               'same messages without faults',
                               _difference(self._taught, found), self._played.observation)

    def _is_steady(self) -> bool:
        return self._taught is not None and self._report.result('L19') == PASS

    def _teach(self, joined_reward: float | None = None, faulty: bool = False) -> Taught | None:
        """Return what a learner that was reset has learned; None if it does not answer."""
        if not self._begin_anew():
            return None
        self._played.describe()
        self._channel.wait(lambda: False, QUIET)
        before = self._channel.digest()
        if joined_reward is not None and not self._join(joined_reward):
            return None
        if joined_reward is None:
            self._probe()
        actions = self._play_with_faults() if faulty else self._play()
        self._channel.wait(lambda: False, QUIET)
        digest = self._channel.digest()
        return Taught(actions, digest, digest != before) if actions else None

    def _begin_anew(self) -> bool:
        """Let the learner forget everything; return whether it can."""
        if self._channel.reset():
            return True
        self._answers.number = None  # another start may have another number
        return self._channel.restart(self._seed)

    def _probe(self) -> None:
        """Find out whether the learner waits where there is no advice."""
        observation = self._played.observation
        self._played.publish(observation)
        self._waits = not self._played.wait(observation, QUIET)

    def _join(self, reward: float) -> bool:
        """Let the learner join in the middle of an episode, at a reward."""
        middle = self._answers.skip_to_the_middle()
        if middle is None:
            return False
        observation = middle._replace(reward=reward)
        self._played.publish(observation)
        self._channel.wait(lambda: False, QUIET)
        self._publish(observation)
        action = self._answers.checked(observation)
        return action is not None and self._answers.move(action)

    def _publish(self, observation: StateReward) -> None:
        self._played.publish(observation)
        if self._waits and not observation.terminated:
            self._answers.advise(observation)

    def _play(self) -> tuple[tuple[object, ...], ...]:
        """Return the actions for a transcript without faults."""
        actions = []
        for _ in range(STEPS):
            observation = self._played.observation
            self._publish(observation)
            action = self._answers.checked(observation)
            if action is None or not self._answers.move(action):
                return ()
            actions.append(_content(action))
        return tuple(actions)

    def _play_with_faults(self) -> tuple[tuple[object, ...], ...]:
        """Return the actions for a transcript with faults; the world repeats what was lost."""
        way, last = FaultyWay(self._channel, self._seed), None
        self._played.allow_excess()
        actions, end = [], self._channel.time + LONGEST
        while len(actions) < STEPS and self._channel.time < end:
            observation, pause, due = self._played.observation, PAUSE, 0.0
            while self._played.observation == observation and self._channel.time < end:
                if self._channel.time >= due:
                    self._put(way, observation)
                    pause, due = min(2.0 * pause, LONGEST_PAUSE), self._channel.time + pause
                for action in way.pass_on():
                    if self._played.observation == observation:
                        last = action
                        self._answers.move_by(action)
            if last and self._played.observation != observation:
                actions.append(_content(last))
        return tuple(actions)

    def _put(self, way: FaultyWay, observation: StateReward) -> None:
        """Put an observation on its way, with advice, and now and then with a wrong one."""
        self._played.allow_answer(observation)
        way.put(observation)
        if self._waits and not observation.terminated:
            way.put(self._answers.advice(observation))
        if observation.step % 5 == 3:
            self._channel.send(observation._replace(step=observation.step + 1, reward=nan))
            self._channel.send(observation._replace(state=self._played.world.n_states + 1,
                                                    learner=ANYONE))


class FaultyWay:
    """
    The way to the learner and back, on which messages are lost, late, doubled and reordered.

    channel: to the learner. seed: of the faults.
    """

    def __init__(self, channel: Channel, seed: int) -> None:
        names = ('StateReward', 'Recommendation', 'Action')
        self._channel = channel
        self._ways = {name: FaultyChannel(FAULTS, stream)
                      for name, stream in zip(names, fault_streams(seed, len(names)))}
        self._back = channel.received['Action']
        self._passed = len(self._back)  # actions that are on the way back, or were

    def put(self, message: StateReward | object) -> None:
        """Put a message to the learner on its way."""
        self._ways[type(message).__name__].put(message, self._channel.time)

    def pass_on(self) -> list[Action]:
        """Deliver what is due to the learner; wait a moment; return the actions that are due."""
        for name in ('StateReward', 'Recommendation'):
            for message in self._ways[name].due(self._channel.time):
                self._channel.send(message)
        count = len(self._back)
        self._channel.wait(lambda: len(self._back) > count, PAUSE / 4)
        for each in self._back[self._passed:]:
            self._ways['Action'].put(each.message, self._channel.time)
        self._passed = len(self._back)
        return self._ways['Action'].due(self._channel.time)


def _content(action: Action) -> tuple[object, ...]:
    """Return an action without what tells one run and one learner from another."""
    return (action.episode, action.step, action.action, action.followed, action.confidence)


def _difference(one: Taught | None, other: Taught) -> str:
    """Return what is different, in words."""
    pairs = zip(one.actions, other.actions) if one else ()
    for first, second in pairs:
        if first != second:
            return f'{second} instead of {first} (episode, step, action, followed, confidence)'
    if one and len(one.actions) != len(other.actions):
        return f'{len(other.actions)} actions instead of {len(one.actions)}'
    return f'digest {other.digest and other.digest[:16]} instead of ' \
           f'{one and one.digest and one.digest[:16]}'
