# SPDX-License-Identifier: Apache-2.0
"""The mentor as a state machine: observations in, recommendations out."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from comply_ros.mentor.advice_budget import AdviceBudget, UNLIMITED
from comply_ros.protocol.message_validation import validate_confidence, validate_observation
from comply_ros.protocol.messages import (
    Action,
    ANYONE,
    Ignored,
    Notice,
    Outputs,
    ReceivedAction,
    Recommendation,
    Rejected,
    StateReward,
    step_id,
    StepId,
    WorldDescription,
)
from comply_ros.protocol.run_tracker import BEFORE_FIRST, RunTracker
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

# The attributes of an `AdviceBudget` that change.
BUDGET_ARRAYS = ('advised', 'remaining', 'last_actions')


class Mentor:
    """
    Answers every observation with its policy's action; holds the last one until it has a policy.

    Parameters
    ----------
    budget: number of recommendations that it can give; 0 for no limit.
    mode: when it gives one; see `AdviceBudget`. Where it counts mistakes, it answers an
        observation only after it has received the learner's action for the one before.
    name: of this mentor; empty where it is the only one.

    Attributes
    ----------
    name: as given.
    tracker: the world and run that it takes part in.
    policy: list of actions by state, None until there is one for this world.
    watches: whether it needs the learner's actions.
    has_budget: whether what it recommends depends on what it received, so that it needs a state.
    step_count: number of observations that were answered.
    journal_entries, needs_checkpoint: as in `Learner`.

    """

    policy: list[int] | None

    def __init__(self, budget: int = UNLIMITED, mode: str = 'early', name: str = '') -> None:
        self.name = name
        self.tracker = RunTracker(self._start_run, sees_episode_ends=False)
        self.policy, self.step_count = None, 0
        self.has_budget = budget != UNLIMITED
        self.watches = self.has_budget and mode == 'mistakes'
        self.journal_entries: list[StateReward | ReceivedAction] = []
        self.needs_checkpoint = False
        self._budget_size, self._mode = budget, mode
        self._budget: AdviceBudget | None = None
        self._forget_run()

    @property
    def world(self) -> World | None:
        """The world of the run that it takes part in, None before the first."""
        return self.tracker.world

    def on_world(self, msg: WorldDescription) -> Outputs:
        """Return outputs for a world; raises ValueError if it does not describe one."""
        return self.tracker.on_world(msg)

    def tick(self) -> Outputs:
        """Return outputs that are due once a second."""
        self._ticks += 1
        return self.tracker.tick()

    def allow_gap(self) -> None:
        """Accept a gap before the next observation: messages may have been lost."""
        self.tracker.allow_gap()

    def waiting_for(self) -> str | None:
        """Text of what this mentor needs to continue; None where it has everything."""
        return self.tracker.waiting_for()

    def use(self, policy: NDArray[Any],
            saved: tuple[dict[str, Any], dict[str, NDArray[Any]], list[Any]] | None = None
            ) -> Outputs:
        """
        Advise by `policy[s]` from now on; return outputs for an observation that was held.

        saved: what `state_dict` returned before, and the journal since, or None.
        """
        self.policy = policy.tolist()
        self._advise_by(policy)
        self.needs_checkpoint = True
        if saved:
            self._load(*saved)
        return self.release_held()

    def release_held(self) -> Outputs:
        """Return outputs for the observation that came too early, if there is one."""
        held, self._held = self._held, None
        return self.observe(held) if held else ()

    def observe(self, msg: StateReward) -> Outputs:
        """Return the recommendation for a state; none where the episode is over."""
        tracker = self.tracker
        if msg.run != tracker.run:
            return tracker.hold(self.observe, msg, 'a state')
        rejected = tracker.continues()
        return (*rejected, *self._observe(msg)) if rejected else self._observe(msg)

    def _observe(self, msg: StateReward) -> Outputs:
        here = step_id(msg)
        if self.policy is None or self._must_see_action_before(here):
            if not self._held or here > step_id(self._held):
                self._held = msg
            return ()
        if self._held and here >= step_id(self._held):
            self._held = None
        assert self.world is not None
        problem = validate_observation(msg, self.world)
        if problem or msg.terminated:
            return (problem,) if problem else ()
        if self.watches:
            return self._observe_in_order(msg)
        return self._observe_on_budget(msg) if self.has_budget else self._advise(msg)

    def on_action(self, msg: Action) -> Outputs:
        """Remember the learner's action; return outputs for an observation that was held."""
        observed = self._observed
        if self._went_on_without_advice(msg):
            self._observed = None
            self.tracker.restart_order()
            return ()
        if observed is None or msg.run != self.tracker.run or step_id(msg) != step_id(observed) \
                or step_id(msg) == self._acted or not self._is_possible(msg, observed):
            return ()
        self._acted = step_id(msg)
        self.journal_entries.append(ReceivedAction(*msg[:9]))
        if msg.action != NO_ACTION and self._budget:
            self._budget.record_action(observed.state, msg.action)
        return self.release_held()

    def _went_on_without_advice(self, msg: Action) -> bool:
        """Tell whether the learner continued, from the last observation to the one held."""
        held, observed = self._held, self._observed
        if held is None or observed is None or msg.run != held.run \
                or not step_id(observed) < step_id(msg):
            return False
        return (step_id(msg) == (held.episode, held.step - 1)
                or held.step == 0 and self.tracker.gap_allowed and self._ticks > 1
                and step_id(msg) < step_id(held))

    def _is_possible(self, msg: Action, observed: StateReward) -> bool:
        """Tell whether the world accepts an action; it logs why not."""
        if observed.learner not in (ANYONE, msg.learner) or validate_confidence(msg):
            return False
        if observed.truncated:
            return msg.action == NO_ACTION
        return (self.world is not None and msg.action in range(self.world.n_actions)
                and bool(self.world.available[observed.state, msg.action]))

    def advice(self, state: int) -> int:
        """
        Return the action for a state: -1 for no advice, also where nobody can act.

        Raises
        ------
        ValueError: if the state is outside of the grid, or there is no policy yet.

        """
        if self.policy is None or self.world is None:
            raise ValueError('the mentor must have a world and a policy first, and has none yet')
        if not 0 <= state < len(self.policy):
            raise ValueError(f'a state must lie in [0, {len(self.policy) - 1}], got {state}')
        return self.policy[state] if self.world.free[state] else NO_ACTION

    def state_dict(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Return everything needed to continue later: values for JSON, and arrays by name."""
        values = {'run': self.tracker.run, 'observed': self._observed, 'acted': self._acted,
                  'answer': self._answer}
        return values, {name: getattr(self._budget, name) for name in BUDGET_ARRAYS}

    def _load(self, values: dict[str, Any], arrays: dict[str, NDArray[Any]],
              journal: list[Any]) -> None:
        """Continue from a checkpoint, then repeat its journal."""
        description = self.tracker.description
        assert description is not None
        if values['run'] != description.replaces:
            for name, array in arrays.items():
                getattr(self._budget, name)[...] = array
        self._answer = tuple(Recommendation(*each) for each in values['answer'])
        self._observed = values['observed'] and StateReward(*values['observed'])
        self._acted = values['acted'] and tuple(values['acted'])
        if self._observed:
            self.tracker.answer(self._observed)
        for entry in journal:
            if isinstance(entry, ReceivedAction):
                self._acted = step_id(entry)
                if entry.action != NO_ACTION and self._observed and self._budget:
                    self._budget.record_action(self._observed.state, entry.action)
            else:
                self._advise(entry)
        self.journal_entries.clear()
        self.tracker.allow_gap()
        self.needs_checkpoint = values['run'] != self.tracker.run
        if self.needs_checkpoint:
            held = self._held
            self._forget_run()
            self.tracker.restart_order()
            self._held = held

    def _start_run(self, is_reset: bool) -> Outputs:
        """Take part in a new run."""
        self._forget_run()
        if self.tracker.world_changed:
            self.policy = None
        elif is_reset and self._budget:  # as at a fresh start, with the whole budget
            self._advise_by(self._budget.policy)
        self.needs_checkpoint = self.policy is not None
        description = self.tracker.description
        assert description is not None
        return (Notice(f'follows world {description.name!r}, run {description.run}'),)

    def _advise_by(self, policy: NDArray[Any]) -> None:
        assert self.world is not None
        self._budget = AdviceBudget(self.world, policy, self._budget_size, self._mode)

    def _forget_run(self) -> None:
        self._observed: StateReward | None = None
        self._answer: Outputs = ()
        self._acted: StepId | None = None
        self._held: StateReward | None = None
        self._doubted: StateReward | None = None
        self._ticks = 0

    def _observe_in_order(self, msg: StateReward) -> Outputs:
        """Return the recommendation: the same for a repeated state, none for an older one."""
        if self._observed and step_id(msg) < step_id(self._observed):
            return (self.tracker.too_late(step_id(msg)),)
        if self._observed and step_id(msg) == step_id(self._observed):
            self._observed = self._observed._replace(learner=msg.learner)  # it may have changed
            return self._answer
        problem = self.tracker.check_order(msg)
        if isinstance(problem, (Rejected, Ignored)):
            return (problem,)
        return (problem, *self._advise(msg)) if problem else self._advise(msg)

    def _observe_on_budget(self, msg: StateReward) -> Outputs:
        """Return the recommendation; none for a state that nobody can be in now or later."""
        here = step_id(msg)
        newest = step_id(self._observed) if self._observed else BEFORE_FIRST
        if here < newest:
            return (self.tracker.too_late(here),)
        again, self._doubted = msg == self._doubted, msg
        if msg.episode > newest[0] + 1 and not again:
            return (Ignored('joins late', f'received step id {here} after {newest}: answers when '
                            'that state is repeated'),)
        return self._advise(msg)

    def _advise(self, msg: StateReward) -> Outputs:
        """Return the recommendation for a state, which may cost one of the budget."""
        budget = self._budget
        assert budget is not None
        remaining = budget.remaining[0]
        self.tracker.answer(msg)
        self.step_count += self._observed is None or step_id(msg) > step_id(self._observed)
        self._observed, self._ticks = msg, 0
        self._answer = (Recommendation(msg.run, msg.episode, msg.step, msg.state,
                                       budget.advise(msg.state), self.name),)
        if self.watches or budget.remaining[0] != remaining:
            self.journal_entries.append(msg)
        return self._answer

    def _must_see_action_before(self, here: StepId) -> bool:
        """Tell whether the action in the last state matters, and is not known yet."""
        return (self.watches and self._observed is not None and here > step_id(self._observed)
                and self._acted != step_id(self._observed))
