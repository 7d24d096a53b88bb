# SPDX-License-Identifier: Apache-2.0
"""Which world and run a node follows, which step id comes next, and who else is there."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from math import isfinite
from typing import Any

from comply_ros.numerics.jit import plain_view
from comply_ros.protocol.message_validation import (
    rejected_run,
    validate_observation,
    validate_same_world,
)
from comply_ros.protocol.messages import (
    ANYONE,
    Ignored,
    Inactive,
    Notice,
    Outputs,
    Rejected,
    StateReward,
    step_id,
    StepId,
    WorldDescription,
)
from comply_ros.protocol.world_description import is_reset_of, with_hash, world_from_description
from comply_ros.world.mdp import Source, World

FIRST, BEFORE_FIRST = (1, 0), (0, -1)  # step ids
WORLD_GONE = 5  # ticks without a message of the world after which the node asks for it
WORLD_SILENT = 2  # ticks without one after which another world may be followed
RIVAL_MESSAGES = 2  # messages that the other world must have published meanwhile
RIVALS = 8  # other worlds that are remembered
OWNED_BY_OTHER = 20  # observations for another learner after which this one is inactive

Handler = Callable[[Any], Outputs]


class RunTracker:
    """
    Follows one world, the first it receives, and the order of its observations.

    Another world is followed only when this one is silent and that one publishes. A world that
    was reset names the run that it replaces and is followed at once. A world that was killed and
    comes back without a state has a new run, and is followed once the old one is silent; a second
    world that was started by mistake has another run too, but the first one is not silent.

    Parameters
    ----------
    on_new_run: called with True for a reset and False otherwise, when `description` and `world`
        are those of a new run. Returns outputs.
    sees_episode_ends: whether every end of an episode is published; if not, the next episode can
        start at any time.

    Attributes
    ----------
    description: of the run that is followed, None before the first.
    world: the world of that run, None before the first.
    world_changed: whether the world is another one than that of the run before.
    silent_ticks: ticks since the last message of the world; a message sets it to 0.
    answered: step id of the last observation that was answered.
    answered_state: its state.
    episode_ended: whether it ended an episode.
    expected: (run, episode, step) of the observation that comes next where nothing is out of the
        ordinary, None otherwise: one comparison lets the usual message pass.
    gap_allowed: whether observations may be missing before the next one, since the last entries
        of a journal can be lost with the power.
    inactive: whether another learner owns this run.
    left_to_others: observations in a row that were for another learner.
    late: step id of a late observation, if none of a later step came since.

    """

    def __init__(self, on_new_run: Callable[[bool], Outputs],
                 sees_episode_ends: bool = True) -> None:
        self._on_new_run, self._sees_episode_ends = on_new_run, sees_episode_ends
        self.description: WorldDescription | None = None
        self.world: World | None = None
        self.world_changed, self.silent_ticks = False, 0
        self._rivals: OrderedDict[int, WorldDescription] = OrderedDict()
        self._rival_messages: dict[int, int] = {}
        self._held: dict[Handler, tuple[Any, str]] = {}
        self.restart_order()

    def restart_order(self) -> None:
        """Expect the first observation of a run."""
        self.answered, self.answered_state, self.episode_ended = BEFORE_FIRST, 0, False
        self.expected: tuple[int, int, int] | None = None
        self.gap_allowed, self.inactive, self.left_to_others = False, False, 0
        self.late: StepId | None = None
        self._doubted: StateReward | None = None
        self._ticked, self._left = False, BEFORE_FIRST

    @property
    def run(self) -> int | None:
        """Number of the run that is followed, None before the first."""
        return self.description and self.description.run

    def state_dict(self) -> dict[str, Any]:
        """Return where it is in the order of its run, as values for JSON."""
        return {'answered': self.answered, 'answered_state': self.answered_state,
                'episode_ended': self.episode_ended}

    def load_state_dict(self, values: dict[str, Any]) -> None:
        """Continue from what `state_dict` returned; a gap may follow."""
        self.answered = tuple(values['answered'])
        self.answered_state, self.episode_ended = values['answered_state'], values['episode_ended']
        self.allow_gap()

    def waiting_for(self) -> str | None:
        """Text of what is missing where the world has been silent for long, or None."""
        if self.description is None:
            return 'a world: is a grid_world running?'
        if self.silent_ticks < WORLD_GONE:
            return None
        return (f'the next state of world {self.description.name!r}: is its grid_world running, '
                'and not paused?')

    def on_world(self, msg: WorldDescription) -> Outputs:
        """
        Follow a world, or remember it as a rival of the one that is followed; return outputs.

        Raises
        ------
        ValueError: if it does not describe a world.

        """
        current = self.description
        if current and msg.run == current.run:
            self.silent_ticks = 0
            return validate_same_world(msg, current)
        source = world_from_description(msg)
        if current is None or is_reset_of(msg, current):
            return self.follow(msg, source)
        if msg.run != current.replaces:  # else it came late
            self._rivals[msg.run] = msg
            if len(self._rivals) > RIVALS:
                self._rival_messages.pop(self._rivals.popitem(last=False)[0], None)
        return ()

    def tick(self) -> Outputs:
        """Once a second: follow another world if this one is silent; return outputs."""
        self._ticked = True
        self.silent_ticks += 1
        if self.silent_ticks < WORLD_SILENT:
            return ()
        for run, count in self._rival_messages.items():
            if count >= RIVAL_MESSAGES:
                rival = self._rivals[run]
                return self.follow(rival, world_from_description(rival))
        return ()

    def follow(self, description: WorldDescription, source: Source) -> Outputs:
        """Follow a run; return outputs, also of messages of it that came early."""
        is_reset = is_reset_of(description, self.description)
        self.description, self.silent_ticks = with_hash(description, source), 0
        self._rivals.clear()
        self._rival_messages.clear()
        held, self._held = self._held, {}
        self.restart_order()
        self.world_changed = self.world is None or self.world.source != source
        if self.world_changed:
            self.world = World(source)
            self._is_grid = self.world.model == 'grid'
            self._successor = plain_view(self.world.successor)
            self._terminal = plain_view(self.world.terminal)
            self._step_limit = self.world.step_limit
        return (*self._on_new_run(is_reset), *(
            output for handler, (msg, _) in held.items() for output in handler(msg)))

    def hold(self, handler: Handler, msg: Any, what: str) -> Outputs:
        """
        Hold a message of another run, in case its world comes later; return outputs.

        It is rejected when the world here continues.
        """
        self.expected = None
        if self.description and msg.run == self.description.replaces:
            return (Ignored('before a reset', f'ignored {what} of run {msg.run}, which ended '
                            'with a reset of its world'),)
        if msg.run in self._rivals:
            self._rival_messages[msg.run] = self._rival_messages.get(msg.run, 0) + 1
        before, self._held[handler] = self._held.get(handler), (msg, what)
        if before is None or before[0].run == msg.run or self.run is None:
            return ()
        return (rejected_run(before[0].run, self.run, what),)

    def continues(self) -> Outputs:
        """Note a message of the run that is followed; return `Rejected` for what was held."""
        self.silent_ticks = 0
        if not self._held:
            return ()
        held, self._held = self._held, {}
        self._rival_messages.clear()
        return tuple(rejected_run(msg.run, self.run, what) for msg, what in held.values())

    def answer(self, msg: StateReward) -> None:
        """Note that an observation is answered now."""
        run, episode, step, s, _, terminated, truncated, _ = msg
        self.answered, self.answered_state = (episode, step), s
        self.left_to_others, self.late, self.episode_ended = 0, None, terminated or truncated
        irregular = (self._held or self._doubted or self.gap_allowed or self.inactive
                     or self._left > self.answered)
        self.expected = None if irregular or self.episode_ended else (run, episode, step + 1)

    def allow_gap(self) -> None:
        """Accept a gap before the next observation: messages may have been lost."""
        self.gap_allowed, self.expected = True, None

    def repeated(self, msg: StateReward, number: int) -> None:
        """Note that the observation that was answered last, or waits, came again."""
        self._doubted = None
        if msg.learner in (ANYONE, number):
            self.left_to_others = 0

    def is_usual_step(self, msg: StateReward) -> bool:
        """Tell whether an observation with the expected step id is possible in this world."""
        last, successor = self.answered_state, self._successor
        _, _, step, s, reward, terminated, truncated, _ = msg
        if not self._is_grid:
            world = self.world
            return (world is not None and validate_observation(msg, world) is None
                    and world.leads(last, s))
        return (s >= 0  # -1 stands for the successor of an action that the state does not have
                and (successor[last, 0] == s or successor[last, 1] == s
                     or successor[last, 2] == s or successor[last, 3] == s)
                and terminated == self._terminal[s]
                and truncated == (step == self._step_limit and not terminated)
                and isfinite(reward))

    def too_late(self, step: StepId) -> Ignored:
        """Return `Ignored` for an observation of a step id before the last one."""
        self.late, self.expected = step, None
        return Ignored('state too late',
                       f'ignored a state of step id {step}: it came late, or twice')

    def leave_to_other(self, msg: StateReward, number: int) -> Outputs:
        """
        Leave an observation to another learner; return `Inactive` when that goes on for long.

        Observations that do not follow each other are no run that another learner owns.
        """
        here, before, self.expected = step_id(msg), self._left, None
        if here != before:
            goes_on = before < here and here[0] <= before[0] + 1
            self._left = here
            self.left_to_others = self.left_to_others + 1 if goes_on else 1
        if self.left_to_others < OWNED_BY_OTHER:
            return ()
        self.inactive = True
        return (Inactive(f'learner {msg.learner} came first and owns run {msg.run}: stop this '
                         f'learner, {number}, or give it a world of its own'),)

    def led_here_by_other(self, msg: StateReward) -> bool:
        """Tell whether another learner's answers led to this observation."""
        return self._left == step_id(msg) and msg.learner == ANYONE

    def check_order(self, msg: StateReward) -> Rejected | Ignored | Notice | None:
        """
        Check that an observation is the next one.

        Returns `Rejected` if it cannot be, `Ignored` if it may be once it is repeated, `Notice` if
        it is accepted after a gap, None if it is the next one. What only might be wrong is
        accepted when it is repeated: a first observation in the middle of a run and an unlikely
        move at once; a gap, or what follows observations for another learner, after a tick.
        """
        here, again = step_id(msg), self._doubted == msg
        self._doubted, self.expected = None, None
        joins = self.answered == BEFORE_FIRST
        if joins and (here == FIRST or again):
            return None
        if joins or self.left_to_others and here > self.answered and not self._is_next(here):
            if again and self._ticked:
                return None
            self._doubt(msg, again)
            return Ignored('joins late', f'joins a run at step id {here}: takes part when that '
                           'state is repeated')
        if self._is_next(here):
            self.gap_allowed = False
            if again or here[1] == 0 or self.world and self.world.leads(self.answered_state,
                                                                        msg.state):
                return None
            self._doubted = msg
            return Rejected('state out of reach', 'a state must be one move from the last one, '
                            f'{self.answered_state}, got {msg.state}: does this world move as it '
                            'is described?')
        if again and self.gap_allowed and self._ticked:
            self.gap_allowed = False
            return Notice(f'continues at step id {here} after {self.answered}: what lay between '
                          'was not received, or its journal has lost it')
        self._doubt(msg, again)
        return Rejected('step id out of order', 'a state must have the step id after '
                        f'{self.answered}, got {here}: is there another learner?')

    def _doubt(self, msg: StateReward, again: bool) -> None:
        self._doubted, self._ticked = msg, again and self._ticked

    def is_next_step(self, here: StepId) -> bool:
        """Tell whether a step id is one step after the one that was answered last."""
        episode, step = self.answered
        return here == (episode, step + 1)

    def _is_next(self, here: StepId) -> bool:
        if here == (self.answered[0] + 1, 0):
            return self.episode_ended or not self._sees_episode_ends
        return self.is_next_step(here) and not self.episode_ended
