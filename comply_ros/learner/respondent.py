# SPDX-License-Identifier: Apache-2.0
"""What a learner answers to a question whose advice is known, and what it learns by the way."""

from collections import deque

from comply_ros.learner.student import Student
from comply_ros.learner.update_rules import DRAWS
from comply_ros.numerics.rng import random_streams, UniformRows
from comply_ros.protocol.messages import Action, Progress, REPORTS, StateReward, step_id
from comply_ros.world.grid import NO_ACTION


class Respondent:
    """
    A student with a voice: the same questions and advice give the same answers.

    Parameters
    ----------
    method: the `LearnerConfig`.
    seed: of its decisions.
    number: tells this learner from every other.

    Attributes
    ----------
    method: as given, or as it was changed.
    number: as given, or as it was in a state that was restored.
    student: the `Student`, None before there is a world.
    last: the `StateReward` that was answered last, None before.
    answer: the `Action` that it was answered with; None where the learning is over.
    advised: the last `Action` in a state that a mentor advises in. A mentor that watches waits
        for it, and can miss it: at a goal the next `Action` follows without a word of the mentor.
    reports: the last `Progress` said.

    """

    def __init__(self, method, seed, number):
        self.number, self.method, self._seed = number, method, seed
        self.student, self.reports = None, deque(maxlen=REPORTS)
        self._draw_anew()
        self.forget_the_run()

    def forget_the_run(self):
        """Change into one that has answered nothing yet; what was learned stays."""
        self.last, self.answer, self.advised = None, None, None
        self._action, self._advice = NO_ACTION, NO_ACTION

    def begin(self, world):
        """Begin to learn another world."""
        self.student = Student(world, self.method)

    def _draw_anew(self):
        self._draws = UniformRows(random_streams(self._seed)[1], DRAWS)

    def forget(self, world):
        """
        Change into one that has learned nothing yet; return what is to be said.

        It goes on in its run, but how it came to the question that is next is not known any more.
        """
        self._draw_anew()
        self.begin(world)
        self.reports.clear()
        self._action, self._advice = NO_ACTION, NO_ACTION
        return self._wake()

    def change(self, world, method):
        """Change into one that goes on by another method; return what is to be said."""
        self.method = method
        self.student.change(world, method)
        return () if self.student.finished else self._wake()

    def _wake(self):
        """Return the `Action` that lets the next episode begin, if this one was at rest."""
        if self.last is None or self.answer:
            return ()
        self.answer = self._at_the_end(self.last, self._advice)
        return (self.answer,)

    def _at_the_end(self, asked, advice):
        return Action(*asked[:3], NO_ACTION, False, 0.0, self.number, advice,
                      max(self.turns - 1, 0))

    @property
    def turns(self):
        """Questions that were answered so far."""
        return self._draws.used

    def respond(self, asked, advice):
        """Change the memory: choose, then learn. Return what is to be said."""
        s, u = asked.state, self._draws.row()
        a, p = NO_ACTION, 0.0
        if not asked.terminated:
            a, p = self.student.choose(s, advice, asked.step, u)
        self._learn_from(asked, a)
        self.student.record_confidence(advice, p)
        self.last, self._action, self._advice = asked, a, advice
        if asked.terminated or asked.truncated:
            return self._end_episode(asked, advice)
        followed = advice != NO_ACTION and u[0] < p
        self.answer = self.advised = Action(*asked[:3], a, followed, p, self.number,
                                            advice, self.turns - 1)
        return (self.answer,)

    def again(self, waits):
        """
        Return the answer to a question that is repeated.

        waits: whether it still waits for advice. Then it gives a sign of life, the last answer
            that a mentor may wait for.
        """
        msg = waits and self.advised or self.answer
        return (msg,) if msg else ()

    def _learn_from(self, asked, a):
        """Change the memory by the step that led here, if it is known where it began."""
        if asked.step == 0:
            self.student.begin_episode()
        elif (self.last is None or self._action == NO_ACTION
              or step_id(self.last) != (asked.episode, asked.step - 1)):
            self.student.lose_track()
        else:
            self.student.learn(self.last.state, self._action, asked.reward, asked.state, a,
                               asked.terminated, self._advice)

    def _end_episode(self, asked, advice):
        """Return the `Action` that lets the next episode begin, and the `Progress` if any."""
        self.answer = self._at_the_end(asked, advice)
        if not asked.terminated:
            self.advised = self.answer
        progress = self.student.end_episode()
        if progress is None:
            return (self.answer,)
        progress = progress._replace(run=asked.run)
        self.reports.append(progress)
        if self.student.finished:
            self.answer = None
            return (progress,)
        return (self.answer, progress)

    def state(self):
        """Return facts that JSON can write, and arrays by name."""
        student, arrays = self.student.state()
        return {'number': self.number, 'draws': self._draws.used, 'student': student,
                'last': self.last, 'action': self._action, 'advice': self._advice,
                'answer': self.answer, 'advised': self.advised,
                'reports': list(self.reports)}, arrays

    def restore(self, facts, arrays):
        """Change into what a state was, in the world that it was in."""
        self.number, self._action, self._advice = (
            facts[name] for name in ('number', 'action', 'advice'))
        self._draws.skip_to(facts['draws'])
        self.student.restore(facts['student'], arrays)
        self.last = facts['last'] and StateReward(*facts['last'])
        self.answer, self.advised = (
            facts[name] and Action(*facts[name]) for name in ('answer', 'advised'))
        self.reports.extend(Progress(*each) for each in facts['reports'])
