# SPDX-License-Identifier: Apache-2.0
"""What a training has learned: a policy to act by, values and beliefs to begin from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.learner.confidence import confidence_map, trusted_advice
from comply_ros.learner.learner_config import field_text, LearnerConfig
from comply_ros.learner.learner_state import (
    arranged_state,
    CHANGE,
    initial_state,
    LearnerState,
    ONE_MENTOR,
    PREDECESSORS,
)
from comply_ros.learner.reconfigure import changed_state
from comply_ros.mentor.policy_validation import PolicyError, validate_policy
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

Actions = NDArray[Any]  # of the `action_type` of the world

TRUSTED = 0.5  # a learner that does not explore follows advice of more confidence than this
# Schedules, and what belongs to an episode or waits: a learner that begins from others' values has
# its own.
STARTS_ANEW = ('scheduled_confidence', 'temperature', 'trust_rate', 'guided_stage', 'best_return',
               'traces', 'trail', 'queue', 'queued', 'workspace', 'priority', 'sampled',
               'followed_mentor')


class LearningError(ValueError):
    """A learning that cannot be used; the message names it, the rule and the value."""


class Learned(NamedTuple):
    """
    What a learner has learned in a world.

    Attributes
    ----------
    world: SHA-256 of the world.
    config: the settings that it learned with.
    state: its arrays.
    advice: `advice[s]` that it received, the newest one; -1 where none. Of several mentors in
        rows, `advice[m * n_states + s]`.
    policy: `policy[s]`, what it would do if it stopped exploring; -1 where any action is taken.
    confidence: `p[s]` at the first step of an episode, in the advice in the same rows.
    source: where it is from, for messages.
    mentors: their names; the only one may have none.

    """

    world: str
    config: LearnerConfig
    state: LearnerState
    advice: Actions
    policy: Actions
    confidence: NDArray[np.float64]
    source: str = 'a learner of this process'
    mentors: tuple[str, ...] = ONE_MENTOR

    def validate(self, world: World) -> None:
        """
        Return if this was learned in a world, with values that can be.

        Raises
        ------
        LearningError: otherwise.

        """
        if self.world != world.sha256:
            raise LearningError(f'{self.source} was learned in another world (hash '
                                f'{self.world[:12]!r}) than the one that is here (hash '
                                f'{world.sha256[:12]!r})')
        try:
            self._validate_arrays(world)
        except (PolicyError, LearningError) as error:
            raise LearningError(f'{self.source} must hold what was learned, but {error}') from None

    def _validate_arrays(self, world: World) -> None:
        count = len(self.mentors)
        for name, usual in initial_state(world, self.config, count)._asdict().items():
            _validate_type(name, getattr(self.state, name), usual)
        _validate_type('confidence', self.confidence, np.zeros(count * world.n_states))
        for name, rows in (('advice', count), ('policy', 1)):
            actions = np.zeros(rows * world.n_states, dtype=world.action_type)
            _validate_type(name, getattr(self, name), actions)
            for policy in getattr(self, name).reshape(rows, -1):
                validate_policy(policy, world)
        state, states = self.state, len(world.free)
        successor, modelled = state.outcomes[..., 1], state.model[..., 1:2]
        counts, before = state.model[..., :1], state.predecessors
        hits, trials, _, scale, *others = state.pooled if len(state.pooled) else np.zeros(4)
        for name, rule, holds in (
                ('q', '-inf where there is no such action, and finite elsewhere',
                 np.where(world.available, np.isfinite(state.q), state.q == -np.inf)),
                ('visits', 'finite and at least 1', _at_least(1.0, state.visits)),
                ('departures', 'finite and at least 1', _at_least(1.0, state.departures)),
                ('belief', 'finite', np.isfinite(state.belief)),
                ('half_difference', 'finite', np.isfinite(state.half_difference)),
                ('outcomes', 'finite, with states of the world',
                 np.isfinite(state.outcomes).all() and (successor >= -1.0).all()
                 and (successor < states).all()),
                ('model', 'finite, with whole counts of at least 0 and states of the world',
                 np.isfinite(state.model).all() and (counts >= 0).all()
                 and (modelled >= -1.0).all() and (modelled < states).all()
                 and (counts == np.floor(counts)).all()
                 and (modelled == np.floor(modelled)).all()),
                ('pooled', 'finite, with counts of at least 0 and at most as many hits as trials',
                 np.isfinite(state.pooled).all() and 0 <= hits <= trials and scale >= 0
                 and min(others, default=0) >= 0),
                ('reward_squares', 'finite and at least 0',
                 (state.reward_squares >= 0) & np.isfinite(state.reward_squares)),
                ('sample_squares', 'finite and at least 0',
                 (state.sample_squares >= 0) & np.isfinite(state.sample_squares)),
                ('value_changes', 'finite, with changes of at least 0',
                 np.isfinite(state.value_changes).all()
                 and (state.value_changes[:, CHANGE:] >= 0).all()),
                ('verdicts', '-1, 0 or 1', np.abs(state.verdicts) <= 1),
                ('prior_sizes', 'finite, and the one in use above 0',
                 np.isfinite(state.prior_sizes).all() and (state.prior_sizes[:1] > 0).all()),
                ('values', 'finite', np.isfinite(state.values)),
                ('potential', 'finite and at least 0',
                 (state.potential >= 0) & np.isfinite(state.potential)),
                ('advised', 'an action, or -1',
                 (state.advised >= NO_ACTION) & (state.advised < world.n_actions)),
                ('predecessors', 'a number of states, and states of the world',
                 (before >= 0).all() and (before[:, :1] <= PREDECESSORS).all()
                 and (before[:, 1:] < states).all()),
                ('pool_size', 'finite and at least 1', _at_least(1.0, state.pool_size)),
                ('pool_listen', 'finite', np.isfinite(state.pool_listen)),
                ('pool_discard', 'finite', np.isfinite(state.pool_discard)),
                ('advice_agreed', 'at least 1, and at most advice_seen',
                 _at_least(1.0, state.advice_agreed) & (state.advice_agreed <= state.advice_seen)),
                ('advice_seen', 'finite', np.isfinite(state.advice_seen)),
                ('followed', 'finite, with numbers of episodes of at least 0',
                 np.isfinite(state.followed).all() and (state.followed[..., :1] >= 0).all()),
                ('confidence', 'in [0, 1]', (self.confidence >= 0) & (self.confidence <= 1))):
            if not np.all(holds):
                raise LearningError(f'not all of {name} is {rule}')


def _validate_type(name: str, array: NDArray, usual: NDArray) -> None:
    if (array.shape, array.dtype) != (usual.shape, usual.dtype):
        raise LearningError(f'{name} must be {usual.dtype} of shape {usual.shape}, got '
                            f'{array.dtype} of shape {array.shape}')


def _at_least(least: float, array: NDArray) -> NDArray[np.bool_]:
    return (array >= least) & np.isfinite(array)


def learned_policy(config: LearnerConfig, state: LearnerState, advice: Actions,
                   confidence: NDArray[np.float64], world: World) -> Actions:
    """
    `policy[s]`: what a learner would do if it stopped exploring; -1 where it knows nothing.

    The advice where the confidence in it is above one half, else the best action of those that
    were tried. Trust that depends on the step of an episode is no trust in a state.

    Parameters
    ----------
    advice: `advice[s]` that it received, -1 where none; of several mentors in rows.
    confidence: `p[s]` in this advice.

    """
    advice, confidence = trusted_advice(config, state, advice, confidence)
    policy = np.full(world.n_states, NO_ACTION, dtype=world.action_type)
    left = np.flatnonzero((state.departures > 1.0) & world.free)  # in a large world, few
    tried = state.visits[left] > 1.0
    tried |= ~tried.any(axis=1, keepdims=True)  # with a visit_growth of 0, all count
    policy[left] = np.where(tried, state.q[left], -np.inf).argmax(axis=1)
    if config.trust != 'none' and not config.trusts_by_time():
        followed = world.free & (advice != NO_ACTION) & (confidence > TRUSTED)
        policy[followed] = advice[followed]
    return policy


def learned_by(config: LearnerConfig, state: LearnerState, advice: Actions, world: World,
               mentors: tuple[str, ...] = ONE_MENTOR) -> Learned:
    """Return what a learner has learned; its arrays are not copied. advice: as it received it."""
    confidence = confidence_map(config, state, advice)
    policy = learned_policy(config, state, advice, confidence, world)
    return Learned(world.sha256, config, state, advice, policy, confidence, mentors=mentors)


def begin_from(learned: Learned, world: World, config: LearnerConfig,
               mentors: Sequence[str] = ONE_MENTOR) -> LearnerState:
    """
    State of a learner that begins with the values and beliefs of another one.

    What was learned of a mentor counts for that with the same name.

    Schedules begin anew. With another kind of trust, the beliefs do so too.

    Raises
    ------
    LearningError: if it was learned in another world, or the settings need a model that it does
        not have.

    """
    learned.validate(world)
    for name in ('replays', 'learns_model', 'planner'):
        own, other = getattr(config, name), getattr(learned.config, name)
        if own != other and own not in (False, 'none'):
            raise LearningError(
                f'{learned.source} must be of a learner with {name} {field_text(own)}, as this '
                f'one is, got one with {name} {field_text(other)}')
    fresh = initial_state(world, config, len(mentors))
    state = changed_state(learned.state, world, learned.config, config)
    state = arranged_state(state, learned.mentors, mentors, fresh)
    return state._replace(**{name: getattr(fresh, name) for name in STARTS_ANEW})
