# SPDX-License-Identifier: Apache-2.0
"""A fresh learner that is told what a recorded one was told, and must say the same."""

from dataclasses import asdict
import json

from comply_ros.bags.bag_message import BagError
from comply_ros.learner.learner_config import ConfigError, LearnerConfig
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.messages import (
    Action,
    ANYONE,
    grid_from_description,
    Progress,
    Recommendation,
    step_id,
)
from comply_ros.world.grid import NO_ACTION

BEGIN = (1, 0)  # turn in which a run begins
TRIES = 3  # times that a question is asked: one in the middle of a run is taken the second time


class ReplayDifference(Exception):  # noqa: N818
    """Something that was recorded and is not said again; the message says what."""


class MissingMessage(ReplayDifference):
    """Something that is not in the bag, so that nothing behind it can be proven."""


class RecordedRun:
    """
    What was heard in the recorded runs, as far as it may still be needed.

    Attributes
    ----------
    worlds: `WorldDescription` by run.
    states: `StateReward` by run and turn.
    advised: actions that were recommended, or are in the mentor's policy, by run and state, the
        newest last.

    """

    def __init__(self):
        self.worlds, self.states, self.advised = {}, {}, {}

    def hear(self, topic, msg):
        """Remember what was said."""
        if topic == 'world':
            self.worlds[msg.run] = msg
        elif topic == 'state':
            self.states.setdefault((msg.run, step_id(msg)), msg)
        elif topic == 'recommendation':
            self._advise(msg.run, msg.state, msg.action)
        elif topic == 'mentor_policy':
            for state, action in enumerate(msg.action):
                self._advise(msg.run, state, action)

    def _advise(self, run, state, action):
        actions = self.advised.setdefault((run, state), [])
        if action in actions:
            actions.remove(action)
        actions.append(action)

    def forget(self, run, until):
        """Forget the states of a run up to a turn."""
        for key in [key for key in self.states if key[0] == run and key[1] <= until]:
            del self.states[key]

    def world_of(self, msg):
        """
        Return the `WorldDescription` of the run of a message, and its `Grid`.

        Raises
        ------
        Differs: if it is not in the bag.
        BagError: if it cannot be a world.

        """
        if msg.run not in self.worlds:
            raise MissingMessage(f'the world of run {msg.run} is not in the bag')
        try:
            return self.worlds[msg.run], grid_from_description(self.worlds[msg.run])
        except ValueError as error:
            raise BagError(f'the world of run {msg.run} must be whole: {error}') from None


class LearnerReplay:
    """
    One fresh learner that is told what a recorded one was told, and must answer the same.

    Parameters
    ----------
    described: its first `LearnerDescription`, when it knew nothing yet.
    ear: the `RecordedRun`.

    Attributes
    ----------
    described: as given.
    same: answers that were the same.
    inferred: answers that are not in the bag, but the states that they led to are.
    unheard: answers whose advice is not in the bag.
    digests: digests that were the same; `digest` is the last of them.
    first, last: (run, turn) of the first and the last answer, None before.
    finished: whether it has done all its iterations.

    """

    def __init__(self, described, ear):
        self.described, self._ear = described, ear
        self.same, self.inferred, self.unheard = 0, 0, 0
        self.digests, self.digest = 0, None
        self.first, self.last, self._ended = None, None, False
        self._later, self._progress = [], {}
        self._actor = Learner(method_of(described), described.seed, False,
                                   described.learner)

    @property
    def finished(self):
        """Tell whether it has done all its iterations."""
        return self._actor.finished

    def expect(self, described):
        """Remember what the recorded learner said of itself, for when so much was answered."""
        if described.turns < self._actor.turns and described.digest:
            raise MissingMessage(f'a digest after {described.turns} answers is in the bag only after '
                        f'{self._actor.turns} of them')
        self._later.append(described)

    def tell(self, answered):
        """
        Ask what was asked, and compare the answer with the recorded `Action`.

        One that was told before is passed over.

        Raises
        ------
        Differs: if it is another.

        """
        here = answered.run, step_id(answered)
        if self.last and self.last[0] == here[0] and here[1] <= self.last[1]:
            return  # said again, as it may be
        self._catch_up(answered)
        msg = self._answer(self._question(here), answered.advice)
        if repr(msg) != repr(answered):
            raise ReplayDifference(f'on topic action, in run {here[0]}, turn {here[1]}, was recorded '
                          f'{words(answered)}; a fresh learner says {words(msg)}')
        self._check_advice(answered, self._ear.states[here].state)
        self.same += 1
        self._went_on(here, self._ear.states[here])

    def is_heard_from_its_start(self, answered):
        """Tell whether there are all questions before the first `Action` that is in the bag."""
        return self.last is not None or not answered.turns or (
            answered.run, BEGIN) in self._ear.states

    def report_like(self, progress):
        """Return the `Progress` that this one said of the same iteration of a run, or None."""
        return self._progress.get((progress.run, progress.iteration))

    def end(self):
        """Ask the last question, which has no answer where it ended the learning."""
        due = [each for each in self._later if each.turns == self._actor.turns + 1]
        if not due or self.last is None:
            return
        self._infer(self.last[0], self._next())

    def _catch_up(self, answered):
        """Change by what was answered before this, and is not in the bag."""
        while self._actor.turns < answered.turns:
            self._infer(*self._following(answered.run))
            self.inferred += 1
        if self._actor.turns != answered.turns:
            raise ReplayDifference(f'on topic action, in run {answered.run}, turn {step_id(answered)}, was '
                          f'recorded {answered.turns} answers before; a fresh learner has given '
                          f'{self._actor.turns}')

    def _following(self, run):
        """Return run and turn of the question after the last one; the run may be another."""
        here = (run, BEGIN) if self.last is None else (self.last[0], self._next())
        if here not in self._ear.states and here[0] != run:
            return run, BEGIN
        return here

    def _next(self):
        """Return the turn that follows the last one."""
        episode, step = self.last[1]
        return (episode + 1, 0) if self._ended else (episode, step + 1)

    def _infer(self, run, here):
        """Change by a question whose answer is not in the bag."""
        asked = self._question((run, here))
        self._answer(asked, self._ear.advised.get((run, asked.state), [NO_ACTION])[-1])
        self._went_on((run, here), asked)

    def _question(self, here):
        if here not in self._ear.states:
            raise MissingMessage(f'the state of run {here[0]}, turn {here[1]}, is not in the bag')
        return self._ear.states[here]._replace(learner=ANYONE)

    def _check_advice(self, answered, state):
        heard = self._ear.advised.get((answered.run, state), ())
        if answered.advice == NO_ACTION or answered.advice in heard:
            return
        self.unheard += 1
        if heard:
            raise ReplayDifference(f'in run {answered.run}, turn {step_id(answered)}, the learner had the '
                          f'advice {answered.advice} in state {state}, and the bag has no such '
                          'recommendation')

    def _answer(self, asked, advice):
        """Return the `Action` to a question, None where there is none."""
        if self._actor.described is None or self._actor.described.run != asked.run:
            self._actor.attend(*self._ear.world_of(asked))
        before = self._actor.turns
        for _ in range(TRIES):
            outputs = self._actor.observe(asked)
            if self._actor.asked:
                outputs += self._actor.on_recommendation(
                    Recommendation(asked.run, asked.episode, asked.step, asked.state, advice))
            if self._actor.turns > before:
                break
            self._actor.look()
        for each in outputs:
            if type(each) is Progress:
                self._progress[each.run, each.iteration] = each
        return next((each for each in outputs if type(each) is Action), None)

    def _went_on(self, here, asked):
        """Change to the next turn, and check what the recorded learner said of itself there."""
        self.first, self.last = self.first or here, here
        self._ended = asked.terminated or asked.truncated
        self._actor.told.clear()
        self._ear.forget(*here)
        due = [each for each in self._later if each.turns == self._actor.turns]
        self._later = [each for each in self._later if each.turns > self._actor.turns]
        for each in due:
            self._change(each)  # its digest is of what the change made
            self._compare_digest(each)

    def _compare_digest(self, described):
        if not described.digest:
            return
        self.digest = self._actor.memory.digest()
        if self.digest != described.digest:
            raise ReplayDifference(f'on topic method, after {described.turns} answers, was recorded the '
                          f'digest {described.digest}; a fresh learner has {self.digest}')
        self.digests += 1

    def _change(self, described):
        method, now = method_of(described), asdict(self._actor.method)
        changes = {name: value for name, value in asdict(method).items() if value != now[name]}
        if changes:
            self._actor.change(changes)


def method_of(described):
    """
    Return the `LearnerConfig` of a `LearnerDescription`.

    Raises
    ------
    BagError: if it cannot be one.

    """
    try:
        return LearnerConfig(**json.loads(described.settings))
    except (ValueError, TypeError, ConfigError) as error:
        raise BagError(f'the settings of learner {described.learner} must be those of a method: '
                       f'{error}') from None


def words(msg):
    """Text of an `Action` without what is the same in every one, `nothing` for None."""
    if msg is None:
        return 'nothing'
    return (f'action {msg.action}, advice {msg.advice}, followed {msg.followed}, '
            f'confidence {msg.confidence!r}')


def misfit(answered, asked, world):
    """
    Return why an `Action` cannot be an answer to a question, None where it can.

    What can be told of a learner of which it is not known what it had learned.
    """
    ends = asked.terminated or asked.truncated
    if ends != (answered.action == NO_ACTION):
        return f'action {answered.action} where the episode {"ends" if ends else "goes on"}'
    if not ends and not (0 <= answered.action < 4
                         and world.available[asked.state, answered.action]):
        return f'action {answered.action}, which state {asked.state} does not have'
    if answered.followed and answered.action != answered.advice:
        return f'action {answered.action} is said to follow the advice {answered.advice}'
    return None


