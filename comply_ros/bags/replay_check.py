# SPDX-License-Identifier: Apache-2.0
"""All that was recorded, told again to fresh learners; who was heard from its start is proven."""

from collections import deque

from comply_ros.bags.learner_replay import LearnerReplay, misfit, RecordedRun, ReplayDifference
from comply_ros.protocol.messages import step_id
from comply_ros.world.mdp import World

LAG = 1000  # messages that are read ahead: on two topics they are not recorded as they were said


class Unknown:
    """A learner of which it is not in the bag what it had learned before; counts what fits."""

    def __init__(self, number, ear):
        self.number, self.fits, self.first, self.last = number, 0, None, None
        self._ear, self._worlds = ear, {}

    def tell(self, answered):
        """Check that an answer fits its question; raises Differs if it does not."""
        here = answered.run, step_id(answered)
        self.first, self.last = self.first or here, here
        asked = self._ear.states.get(here)
        if asked is None:
            return
        if answered.run not in self._worlds:
            self._worlds[answered.run] = World(self._ear.world_of(answered)[1])
        problem = misfit(answered, asked, self._worlds[answered.run])
        if problem:
            raise ReplayDifference(f'on topic action, in run {here[0]}, turn {here[1]}, was recorded '
                          f'{problem}')
        self.fits += 1
        self._ear.forget(*here)


class ReplayCheck:
    """
    Hears a conversation in order, and holds each learner against a fresh one.

    Attributes
    ----------
    proven: the `LearnerReplay` of each learner that was heard from its start.
    unknown: the `Unknown` of each other, by number.

    """

    def __init__(self):
        self.proven, self.unknown = [], {}
        self._ear, self._waiting, self._now, self._reports = RecordedRun(), deque(), {}, []
        self._begun = []

    def hear(self, topic, msg):
        """
        Take what was said next.

        Raises
        ------
        Differs: at the first difference.

        """
        self._ear.hear(topic, msg)
        if topic == 'progress':
            self._reports.append(msg)
        self._waiting.append((topic, msg))
        if topic == 'method' and msg.turns and msg.learner in self._now:
            self._now[msg.learner].expect(msg)
        if len(self._waiting) > LAG:
            self._take(*self._waiting.popleft())

    def end(self):
        """Take what waits still; raises Differs."""
        while self._waiting:
            self._take(*self._waiting.popleft())
        for each in self.proven:
            each.end()
        for report in self._reports:
            self._compare(report)

    def _compare(self, report):
        """Return if a recorded `Progress` is one that a fresh learner says; raises Differs."""
        msg = [each.report_like(report) for each in self.proven]
        msg = [each for each in msg if each is not None]
        if msg and repr(report) not in [repr(each) for each in msg]:
            raise ReplayDifference(f'on topic progress, in run {report.run}, iteration {report.iteration}, '
                          f'was recorded {report}; a fresh learner says {msg[-1]}')

    def _take(self, topic, msg):
        if topic == 'method' and not msg.turns and not any(
                msg is each for each in self._begun):
            self._begin(msg)
        elif topic == 'action':
            self._teller(msg).tell(msg)

    def _teller(self, answered):
        """Return who is to be told an `Action`: a `LearnerReplay`, or an `Unknown`."""
        number = answered.learner
        if number not in self._now and number not in self.unknown:
            for topic, msg in self._waiting:  # on its own topic it may come a little later
                if topic == 'method' and msg.learner == number and not msg.turns:
                    self._begin(msg)
                    break
        told = self._now.get(number)
        if told and told.is_heard_from_its_start(answered):
            return told
        if told:
            self.proven.remove(self._now.pop(number))
        return self.unknown.setdefault(number, Unknown(number, self._ear))

    def _begin(self, described):
        self._begun.append(described)
        before = self._now.get(described.learner)
        if before and before.last is None:
            self.proven.remove(before)  # it had only found another world
        self._now[described.learner] = LearnerReplay(described, self._ear)
        self.proven.append(self._now[described.learner])
        for topic, msg in self._waiting:
            if topic == 'method' and msg.learner == described.learner and msg.turns:
                self._now[described.learner].expect(msg)
