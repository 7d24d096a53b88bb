# SPDX-License-Identifier: Apache-2.0
"""The grid world in the conversation: an action in, the next state out."""

from collections import Counter, deque

from comply_ros.numerics.rng import random_streams, UniformRows
from comply_ros.protocol.messages import (
    ANYONE,
    describe,
    Episode,
    grid_from_description,
    Ignored,
    Inactive,
    NO_RUN,
    Notice,
    Rejected,
    REPORTS,
    StateReward,
    step_id,
)
from comply_ros.protocol.pause_gate import PauseGate
from comply_ros.protocol.validation import rejected_run, validate_confidence
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import first_state, taken_action, World

RELEASE = 3.0  # seconds without a sign of its learner after which a run takes any learner
REMARKS = 4  # times that another world is answered; one that is still there then is no ghost
OTHERS = 64  # other worlds that are told apart


class GridWorld:
    """
    Asks one question at a time: the current state. An answer to it brings the next.

    The first learner that answers keeps the run: others are refused. Of two worlds on the same
    topics the one that is answered goes on, or else the one that began first.

    Parameters
    ----------
    grid: the `Grid`.
    name: what to call it.
    run: number that tells this run from every other.
    seed: of starts and slips.
    began: when the run began, in seconds since 1970.

    Attributes
    ----------
    description: the `WorldDescription`.
    question: the `StateReward` that is open.
    signs: how often the learner gave a sign of life without an answer.
    told: the `Action` that was taken and is to be kept before the next question is said.
    begins: True when its state does not follow from what it was told, and is to be kept whole.
    aside: whether another world has these topics.
    reports: the last `Episode` said.
    pacing: the `PauseGate` of its questions.

    """

    def __init__(self, grid, name, run, seed, began=0.0):
        self._world, self._seed = World(grid), seed
        self._draws = UniformRows(random_streams(seed)[0], 1)
        self._limit, self._intended = grid.step_limit, float(grid.intended)
        self._successor = memoryview(self._world.successor)
        self._reward = memoryview(self._world.reward)
        self._slips = memoryview(self._world.slips)
        self._starts, self._terminal = grid.starts, self._world.terminal.tolist()
        self.description = describe(grid, name, run, began)
        self.told, self.begins, self.aside, self.signs = [], True, False, 0
        self.reports, self.pause_gate = deque(maxlen=REPORTS), PauseGate()
        self._total, self._learner, self._others = 0.0, ANYONE, Counter()
        self._signs = 0  # until the question that is open now
        self.question = self._begin(episode=1)

    @property
    def turns(self):
        """States that were said so far."""
        return self._draws.used

    def allow_gap(self):
        """Do nothing about a gap in what was heard: its question is open until it is answered."""

    def waiting_for(self):
        """Text of what this world needs before it can go on; None where it only paces itself."""
        if self.pause_gate.paused or self.pause_gate.held:
            return None
        why = ('its learner is there, and waits itself' if self.signs > self._signs
               else 'is a learner running, or has it finished?')
        return f'an action in episode {self.question.episode}, step {self.question.step}: {why}'

    def on_world(self, msg):
        """
        Return what is to be said about a world that speaks on the topics of this one.

        This one is said again: a world that is alive answers that, one that is gone does not.

        Raises
        ------
        ValueError: if it cannot be a world.

        """
        mine = self.description
        if msg.run in (mine.run, mine.replaces) or self.aside:
            return ()
        times = self._others[msg.run] + 1
        if times > REMARKS or len(self._others) >= OTHERS and times == 1:
            return ()
        grid_from_description(msg)
        self._others[msg.run] = times
        answered = step_id(self.question) != (1, 0)
        first = answered or (mine.began, mine.run) < (msg.began, msg.run)
        if first and (answered or times < REMARKS):
            return (Rejected('another world', f'run {msg.run} of another world speaks here too: '
                            'it is told to stand aside'), mine)
        if times == 1:
            return (mine,)
        self.aside = True
        return (Inactive(f'another world, {msg.name!r}, came first and keeps these topics for its '
                      f'run {msg.run}: end this one, or give it a namespace of its own'),)

    def on_action(self, msg):
        """
        Return the `StateReward` that follows (an `Episode` before it, if one ends).

        An answer to an earlier question is dropped; one that cannot be right is `Rejected`.
        """
        asked = self.question
        if self.aside:
            return ()
        problem = self._validate_sender(msg)
        if problem:
            return (problem,)
        if step_id(msg) < step_id(asked):
            self.signs += 1
            return (Ignored('action too late', f'dropped an action of turn {step_id(msg)}: it came '
                            'late, or twice'),)
        problem = self._validate_action(msg, asked)
        if problem:
            return (problem,)
        self._learner, self._signs = msg.learner, self.signs
        self.told.append(msg)
        return self.pause_gate.admit(self._go_on(msg.action))

    def reset(self, run, began):
        """
        Begin a new run, as at a fresh start; return what is to be said. A pause goes on.

        run: its number. began: now, in seconds since 1970.
        """
        before = self.description.run
        self.description = self.description._replace(run=run, began=began, replaces=before)
        self._draws = UniformRows(random_streams(self._seed)[0], 1)
        self.reports.clear()
        self._learner, self._others, self._signs = ANYONE, Counter(), self.signs
        self.question, self.begins = self._begin(episode=1), True
        return (Notice(f'begins anew: run {run} takes the place of run {before}'),
                self.description, *self.pause_gate.restart((self.question,)))

    def ask_again(self, silence):
        """
        Return the question again, which had no answer and no sign of the learner for so long.

        silence: in seconds. After a while any learner may answer, and the world is said again too.
        """
        if self.aside:
            return ()
        if silence < RELEASE:
            return (self.question,)
        self._learner = ANYONE
        self.question = self.question._replace(learner=ANYONE)
        return (self.description, self.question)

    def state(self):
        """Return all that it needs to go on later: facts that JSON can write, and no arrays."""
        return {'run': self.description.run, 'began': self.description.began,
                'replaces': self.description.replaces,
                'draws': self._draws.used, 'question': self.question, 'total': self._total,
                'learner': self._learner, 'reports': list(self.reports)}, {}

    def restore(self, facts, arrays, told):
        """Change into what a state was, then move again by what was told since."""
        self.description = self.description._replace(
            **{name: facts[name] for name in ('run', 'began', 'replaces')})
        self._draws = UniformRows(random_streams(self._seed)[0], 1)
        self._draws.skip_to(facts['draws'])
        self.question, self._total = StateReward(*facts['question']), facts['total']
        self._learner = facts['learner']
        self.reports.extend(Episode(*each) for each in facts['reports'])
        for each in told:
            self._learner = each.learner  # it may have changed, when the first one was gone
            self.on_action(each)
        self.told.clear()
        self.begins = False

    def recall(self):
        """Return what is to be said at the start: the world, all reports, and the question."""
        return (self.description, *self.reports, self.question)

    def _validate_sender(self, msg):
        """`Rejected`, or `Ignored`, for an action of another run or another learner, or None."""
        if msg.run == self.description.replaces != NO_RUN:
            return Ignored('before a reset', f'dropped an action of run {msg.run}, which ended '
                           'with a reset')
        if msg.run != self.question.run:
            return rejected_run(msg, self.question.run, 'an action')
        if msg.learner != self._learner != ANYONE:
            return Rejected('another learner', f'an action must come from learner {self._learner}, '
                           f'which keeps this run, got {msg.learner}: is there a second one?')
        return None

    def _validate_action(self, msg, asked):
        """`Rejected` for an `Action` that cannot be an answer to the question, or None."""
        if step_id(msg) > step_id(asked):
            return Rejected('answer to no question', f'an action must answer turn {step_id(asked)}, '
                           f'got {step_id(msg)}')
        if asked.terminated or asked.truncated:
            if msg.action != NO_ACTION:
                return Rejected('action after the end', 'the episode is over: the action must be '
                               f'{NO_ACTION}, got {msg.action}')
        elif not 0 <= msg.action < 4 or self._successor[asked.state, msg.action] < 0:
            return Rejected('action not available', 'an action must be one that the cell has, '
                           f'got {msg.action} in state {asked.state}')
        return validate_confidence(msg)

    def _go_on(self, action):
        """Change into the state after an answer; return what is to be said about it."""
        asked = self.question
        if asked.terminated or asked.truncated:
            self.question = self._begin(asked.episode + 1)
            return (self.question,)
        return self._move(action)

    def _begin(self, episode):
        self._total = 0.0
        u, = self._draws.row()
        return StateReward(self.description.run, episode, 0, first_state(u, self._starts), 0.0,
                           False, False, self._learner)

    def _move(self, action):
        run, episode, step, s, *_ = self.question
        u, = self._draws.row()
        taken = taken_action(s, action, u, self._intended, self._slips)
        reward, s2, step = self._reward[s, taken], self._successor[s, taken], step + 1
        self._total += reward
        terminated = self._terminal[s2]
        truncated = not terminated and step == self._limit
        self.question = StateReward(run, episode, step, s2, reward, terminated, truncated,
                                    self._learner)
        if not (terminated or truncated):
            return (self.question,)
        self.reports.append(Episode(run, episode, step, self._total, terminated, truncated))
        return (self.reports[-1], self.question)
