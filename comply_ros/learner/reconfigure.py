# SPDX-License-Identifier: Apache-2.0
"""Other settings while a learner runs: what it has learned is converted, not lost."""

from dataclasses import replace
from typing import Any

import numpy as np

from comply_ros.learner.learner_config import CONFIG_FIELDS, ConfigError, field_text, LearnerConfig
from comply_ros.learner.learner_state import DISCARD, IN_POOL, initial_state, LearnerState
from comply_ros.world.mdp import World

# Fields whose change counts from now on, and their arrays.
IMMEDIATE = {'confidence': 'scheduled_confidence', 'temperature': 'temperature',
             'trust_rate': 'trust_rate'}
# Anew with another kind of trust.
MENTOR_FIELDS = ('guided_stage', 'best_return', 'advice_agreed', 'advice_seen', 'pool_size',
                 'pool_listen', 'pool_discard', 'advised', 'verdicts', 'followed',
                 'followed_mentor')


def changed_config(config: LearnerConfig, changes: dict[str, Any],
                   iterations_done: int) -> LearnerConfig:
    """
    Return the settings with other values in some fields; changes: values by field name.

    Raises
    ------
    ConfigError: for a value that is not allowed at all, or not while the learner runs.

    """
    iterations = changes.get('iterations', 0)
    if iterations != config.iterations and 0 < iterations <= iterations_done:
        raise ConfigError(f'iterations must be 0, or above the {iterations_done} that are done, '
                          f'got {iterations}')
    for name in ('replays', 'learns_model', 'planner'):
        before = getattr(config, name)
        if changes.get(name, before) != before:
            raise ConfigError(f'{name} must stay {field_text(before)} while a learner runs, '
                              f'since its arrays differ, got {field_text(changes[name])}')
    return replace(config, **changes)


def words_of_changes(changes: dict[str, Any], config: LearnerConfig) -> str:
    """
    Return a sentence about changes: name and value of each, and which have no effect.

    changes: values by name; those of fields are already in the settings.
    """
    words = ', '.join(f'{name} {value}' for name, value in changes.items())
    unused = [name for name in changes if name in CONFIG_FIELDS and not config.uses(name)]
    has = 'has' if len(unused) == 1 else 'have'
    without_effect = f'; while trust is {config.trust}, {", ".join(unused)} {has} no effect'
    return f'continues with {words}' + (without_effect if unused else '')


def changed_state(state: LearnerState, world: World, before: LearnerConfig,
                  after: LearnerConfig) -> LearnerState:
    """
    Return the state with which a learner continues under other settings.

    What was learned stays. A changed initial value counts for actions and states that were never
    tried or left; confidence, temperature and trust_rate count from now on. Another kind of trust
    starts again, and so do traces where the settings had none before.
    """
    n_mentors = len(state.pool_size)
    fresh = initial_state(world, after, n_mentors)
    changed = LearnerState(*(old.copy() if old.shape == new.shape else new
                             for old, new in zip(state, fresh)))
    untried = (changed.visits == 1.0) & (changed.q == before.initial_value)
    changed.q[untried] = after.initial_value
    for name, array in IMMEDIATE.items():
        if getattr(before, name) != getattr(after, name):
            getattr(changed, array)[0] = getattr(after, name)
    if before.trust != after.trust:
        for name in ('belief', *MENTOR_FIELDS):
            getattr(changed, name)[...] = getattr(fresh, name)
        return changed
    old = np.array((before.belief_listen, before.belief_discard))
    new = np.array((after.belief_listen, after.belief_discard))
    unknown = (np.tile(changed.departures == 1.0, n_mentors) & (changed.belief[:, IN_POOL] == 0.0)
               & (changed.belief[:, :DISCARD + 1] == old).all(axis=1))
    changed.belief[unknown, :DISCARD + 1] = new
    changed.pool_listen[:] += new[0] - old[0]
    changed.pool_discard[:] += new[1] - old[1]
    return changed
