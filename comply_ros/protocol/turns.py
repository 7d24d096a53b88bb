# SPDX-License-Identifier: Apache-2.0
"""Whose turn it is: which question was answered last, and which may be the next."""

from comply_ros.protocol.messages import ANYONE, Ignored, Inactive, Notice, Rejected, step_id

FIRST, NOT_YET = (1, 0), (0, -1)  # the first turn, and before it
OF_ANOTHER = 20  # turns of another learner after which this one is one too many


class Turns:
    """
    The order of the questions of one run, for who hears them.

    Parameters
    ----------
    sees_ends: whether it hears every end of an episode; if not, the next can begin at any time.

    Attributes
    ----------
    answered: turn of the last question that was answered, (episode, step).
    ended: whether that ended an episode.
    state: of that question.
    may_lack: whether questions may be missing before the next one: what was told last can be
        lost with a machine that loses power.
    aside: whether another learner has this run.
    left: questions in a row that were left to another learner.
    late: turn of a question long past, where no later one came since; None otherwise.

    """

    def __init__(self, sees_ends=True):
        self._sees_ends = sees_ends
        self.answered, self.ended, self.state = NOT_YET, False, None
        self.may_lack, self.aside, self.left, self.late = False, False, 0, None
        self._doubted, self._looked, self._left = None, False, NOT_YET

    def look(self):
        """Remember that a second went by: a question that is asked now is asked for long."""
        self._looked = True

    def take(self, asked):
        """Remember that a question is answered now."""
        self.answered, self.state, self.left, self.late = step_id(asked), asked.state, 0, None
        self.ended = asked.terminated or asked.truncated

    def repeat(self, msg, number):
        """Remember that the question that was answered, or is open, is asked again."""
        self._doubted = None
        if msg.learner in (ANYONE, number):
            self.left = 0

    def too_late(self, here):
        """Return `Ignored` for a question of a turn long past."""
        self.late = here
        return Ignored('state too late', f'dropped a state of turn {here}: it came late, or twice')

    def leave(self, msg, number):
        """
        Leave a question to another learner; return an `Inactive` when that goes on for long.

        Questions that do not follow each other are no run that another learner keeps.
        """
        here, before = step_id(msg), self._left
        if here != before:
            goes_on = before < here and here[0] <= before[0] + 1
            self._left, self.left = here, self.left + 1 if goes_on else 1
        if self.left < OF_ANOTHER:
            return ()
        self.aside = True
        return (Inactive(f'learner {msg.learner} came first and keeps run {msg.run}: end this one, '
                      f'{number}, or give it a world of its own'),)

    def remark(self, msg, world):
        """
        `Rejected` for a question that cannot be the next, a `Notice` for one after a gap, or None.

        What only might be wrong is taken when it is asked again: a first question in the middle
        of a run (`Ignored`) and an unlikely move at once, a gap, or what comes after questions
        to another learner, only after a `look`.
        """
        here, again, self._doubted = step_id(msg), self._doubted == msg, None
        begins = self.answered == NOT_YET
        if begins and (here == FIRST or again):
            return None
        if begins or self.left and here > self.answered and not self._is_next(here):
            if again and self._looked:
                return None
            self._doubted, self._looked = msg, again and self._looked
            return Ignored('joins late', f'joins a run in turn {here}: takes part as soon as that '
                           'is asked again')
        if self._is_next(here):
            self.may_lack = False
            return None if again or here[1] == 0 else self._remark_on_move(msg, world)
        if again and self.may_lack and self._looked:
            self.may_lack = False
            return Notice(f'goes on at turn {here} after {self.answered}: what lay between was '
                          'not heard, or its journal has lost it')
        self._doubted, self._looked = msg, again and self._looked
        return Rejected('question out of turn', f'a state must follow turn {self.answered}, '
                       f'got {here}: is there another learner?')

    def _is_next(self, here):
        """Tell whether a turn follows the last one that was answered."""
        episode, step = self.answered
        if here == (episode + 1, 0):
            return self.ended or not self._sees_ends
        return here == (episode, step + 1) and not self.ended

    def was_left(self, msg):
        """Tell whether another learner was asked this, so that another has led here."""
        return self._left == step_id(msg) and msg.learner == ANYONE

    def _remark_on_move(self, msg, world):
        if world.leads(self.state, msg.state):
            return None
        self._doubted = msg
        return Rejected('state out of reach', f'a state must be one move from the last, '
                       f'{self.state}, got {msg.state}: does this world move as it is described?')
