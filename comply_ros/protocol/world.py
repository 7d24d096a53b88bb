# SPDX-License-Identifier: Apache-2.0
"""A world as a state machine: actions in, the next observations out."""

from __future__ import annotations

from collections import deque
from typing import Any

from comply_ros.numerics.jit import plain_view
from comply_ros.protocol.message_validation import rejected_run, validate_confidence
from comply_ros.protocol.messages import (
    Action,
    ANYONE,
    Episode,
    Ignored,
    Inactive,
    NO_RUN,
    Notice,
    Outputs,
    ReceivedAction,
    Rejected,
    REPORTS,
    StateReward,
    step_id,
    WorldDescription,
)
from comply_ros.protocol.pause_gate import PauseGate
from comply_ros.protocol.world_description import describe_world, world_from_description
from comply_ros.protocol.world_moves import ModelMoves, Moves
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import Source, World

RELEASE = 3.0  # seconds without a message of its learner after which a run takes any learner
ESTABLISHED = 3.0  # seconds after which a world has received those that were there before it
NEWER, NEWER_LOWER, OLDER, OLDER_LOWER = 2, 4, 6, 8  # see `_messages_until_inactive`
MOST_ANSWERS = 8  # messages of another world that are answered
OTHERS = 64  # other worlds that are told apart


class WorldMachine:
    """
    Publishes one observation at a time; an action for it brings the next.

    The first learner that answers owns the run; actions of others are rejected. Of two worlds on
    the same topics the one that was answered continues, or else the one that was there first.

    Parameters
    ----------
    source: the map.
    name: of the map.
    run: number that tells this run from every other.
    seed: of starts and slips.
    began: system time at the start of the run, in nanoseconds since 1970, for people to read.
    moves: how it moves; None: by its model.

    Raises
    ------
    MapError: for a world without a model, if it has no other way to move.

    Attributes
    ----------
    description: of the run.
    observation: the one that is open.
    learner_messages: messages of the learner that did not answer the open observation.
    journal_entries, needs_checkpoint: as in `Learner`.
    inactive: whether another world owns these topics.
    reports: the last reports of episodes that were published.
    pause_gate: holds the observations while the world is paused or paced.

    """

    def __init__(self, source: Source, name: str, run: int, seed: int, began: int = 0,
                 moves: Moves | None = None) -> None:
        self._world = World(source)
        self._moves = moves or ModelMoves(self._world, seed)
        self._available = plain_view(self._world.available)
        self.description = describe_world(source, name, run, began)
        self.journal_entries: list[ReceivedAction] = []
        self.needs_checkpoint, self.inactive, self.learner_messages = True, False, 0
        self.reports: deque[Episode] = deque(maxlen=REPORTS)
        self.pause_gate = PauseGate()
        self._return, self._learner = 0.0, ANYONE
        self._others: dict[int, tuple[int, bool]] = {}  # messages, and whether it came later
        self._messages_before = 0  # of the learner, when the open observation was published
        self.observation = self._start_episode(1)

    @property
    def step_count(self) -> int:
        """Number of observations so far."""
        return self._moves.used

    def allow_gap(self) -> None:
        """Do nothing: the observation stays open until it is answered."""

    def waiting_for(self) -> str | None:
        """Text of what this world needs to continue; None where it only paces itself."""
        if self.pause_gate.paused or self.pause_gate.held:
            return None
        why = ('its learner is there, and waits itself'
               if self.learner_messages > self._messages_before
               else 'is a learner running, or has it finished?')
        return f'an action in episode {self.observation.episode}, step ' \
               f'{self.observation.step}: {why}'

    def on_world(self, msg: WorldDescription, age: float) -> Outputs:
        """
        Return outputs for another world on the topics of this one.

        This world publishes its description again; a world that is alive answers that, one that
        is gone does not. After some answers one of the two becomes inactive
        (`_messages_until_inactive`). No system clock decides which of them came first.

        age: seconds since this world started, by a steady clock.

        Raises
        ------
        ValueError: if the message does not describe a world.

        """
        mine = self.description
        if msg.run in (mine.run, mine.replaces) or self.inactive:
            return ()
        count, came_later = self._others.get(msg.run, (0, age > ESTABLISHED))
        if count == MOST_ANSWERS or not count and len(self._others) >= OTHERS:
            return ()
        world_from_description(msg)
        self._others[msg.run] = count + 1, came_later
        most = self._messages_until_inactive(msg.run, came_later)
        if count + 1 < most:
            remark = Rejected('another world', f'run {msg.run} of another world is published here '
                              'too: it must become inactive')
            return (mine,) if most == NEWER else (remark, mine)
        self.inactive = True
        return (Inactive(f'another world, {msg.name!r}, came first and owns these topics for its '
                         f'run {msg.run}: stop this world, or give it a namespace of its own'),)

    def _messages_until_inactive(self, other_run: int, came_later: bool) -> int:
        """
        Return after how many messages of another world this one becomes inactive.

        Never, if it was answered. Else a world that was there before the other one waits longer
        than one that was not; of two worlds alike the lower number of a run waits longer. A world
        publishes one message and an answer to each of the other, so the one that waits longer
        stays: it waits for two more, since each may repeat its description meanwhile.
        """
        if step_id(self.observation) != (1, 0):
            return MOST_ANSWERS + 1
        lower = self.description.run < other_run
        if came_later:
            return OLDER_LOWER if lower else OLDER
        return NEWER_LOWER if lower else NEWER

    def on_action(self, msg: Action) -> Outputs:
        """
        Return the next observation (the report of an episode before it, if one ends).

        An action for an earlier observation is ignored; one that cannot be right is rejected.
        """
        if self.inactive:
            return ()
        observation = self.observation
        here, there = (msg.episode, msg.step), (observation.episode, observation.step)
        if here != there or msg.run != observation.run or msg.learner != self._learner:
            problem = self._validate_origin(msg)
            if problem:
                return (problem,)
            if here < there:
                self.learner_messages += 1
                return (Ignored('action too late', f'ignored an action for step id {here}: it '
                                'came late, or twice'),)
        problem = self._validate_action(msg, observation)
        if problem:
            return (problem,)
        self._learner, self._messages_before = msg.learner, self.learner_messages
        self.journal_entries.append(ReceivedAction(*msg[:9]))
        return self.pause_gate.admit(self._take(msg.action))

    def reset(self, run: int, began: int) -> Outputs:
        """
        Start a new run, as at a fresh start; return outputs. A pause continues.

        run: its number. began: system time, in nanoseconds since 1970.
        """
        before = self.description.run
        self.description = self.description._replace(run=run, began=began, replaces=before)
        self._moves.restart()
        self.reports.clear()
        self._learner, self._others = ANYONE, {}
        self._messages_before = self.learner_messages
        self.observation, self.needs_checkpoint = self._start_episode(1), True
        return (Notice(f'starts again: run {run} replaces run {before}'),
                self.description, *self.pause_gate.restart((self.observation,)))

    def repeat(self, silence: float) -> Outputs:
        """
        Return the open observation again.

        After a while any learner may answer, and the description is published again too.

        silence: seconds without an action and without a message of the learner.

        """
        if self.inactive:
            return ()
        if silence < RELEASE:
            return (self.observation,)
        self._learner = ANYONE
        self.observation = self.observation._replace(learner=ANYONE)
        return (self.description, self.observation)

    def state_dict(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return everything needed to continue later: values for JSON, and no arrays."""
        return {'run': self.description.run, 'began': self.description.began,
                'replaces': self.description.replaces, **self._moves.state_dict(),
                'observation': self.observation, 'return': self._return,
                'learner': self._learner, 'reports': list(self.reports)}, {}

    def load_state_dict(self, values: dict[str, Any], arrays: dict[str, Any],
                        journal: list[ReceivedAction]) -> None:
        """Continue from a checkpoint, then repeat the actions of its journal."""
        self.description = self.description._replace(
            **{name: values[name] for name in ('run', 'began', 'replaces')})
        self._moves.load_state_dict(values)
        self.observation, self._return = StateReward(*values['observation']), values['return']
        self._learner = values['learner']
        self.reports.extend(Episode(*each) for each in values['reports'])
        for entry in journal:
            self._learner = entry.learner  # it may have changed, when the first one was gone
            self.on_action(Action(*entry))
        self.journal_entries.clear()
        self.needs_checkpoint = False

    def last_outputs(self) -> Outputs:
        """Return what to publish at the start: the world, the reports, the open observation."""
        return (self.description, *self.reports, self.observation)

    def _validate_origin(self, msg: Action) -> Rejected | Ignored | None:
        """Return why an action cannot be of this run and its learner, or None."""
        if msg.run == self.description.replaces != NO_RUN:
            return Ignored('before a reset', f'ignored an action of run {msg.run}, which ended '
                           'with a reset')
        if msg.run != self.observation.run:
            return rejected_run(msg.run, self.observation.run, 'an action')
        if msg.learner != self._learner != ANYONE:
            return Rejected('another learner', f'an action must come from learner {self._learner},'
                            f' which owns this run, got {msg.learner}: is there a second one?')
        return None

    def _validate_action(self, msg: Action, observation: StateReward) -> Rejected | None:
        """Return why an action cannot be for the open observation, or None."""
        if step_id(msg) > step_id(observation):
            return Rejected('action without observation', 'an action must be for step id '
                            f'{step_id(observation)}, got {step_id(msg)}')
        if observation.terminated or observation.truncated:
            if msg.action != NO_ACTION:
                return Rejected('action after the end', 'the episode is over: the action must be '
                                f'{NO_ACTION}, got {msg.action}')
        elif not (0 <= msg.action < self._world.n_actions
                  and self._available[observation.state, msg.action]):
            return Rejected('action not available', 'an action must be one that the state has, '
                            f'got {msg.action} in state {observation.state}')
        return validate_confidence(msg)

    def _take(self, action: int) -> Outputs:
        """Move by an action, or start the next episode; return what to publish."""
        run, episode, step, s, _, terminated, truncated, _ = self.observation
        if terminated or truncated:
            self.observation = self._start_episode(episode + 1)
            return (self.observation,)
        reward, s2, terminated, truncated = self._moves.move(step, s, action)
        step += 1
        self._return += reward
        self.observation = StateReward(run, episode, step, s2, reward, terminated, truncated,
                                       self._learner)
        if not (terminated or truncated):
            return (self.observation,)
        self.reports.append(Episode(run, episode, step, self._return, terminated, truncated))
        return (self.reports[-1], self.observation)

    def _start_episode(self, episode: int) -> StateReward:
        self._return = 0.0
        return StateReward(self.description.run, episode, 0, self._moves.start(episode), 0.0,
                           False, False, self._learner)
