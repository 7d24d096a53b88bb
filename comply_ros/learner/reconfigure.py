# SPDX-License-Identifier: Apache-2.0
"""A learner whose method changes while it learns: what becomes of what it has learned."""

from dataclasses import replace

import numpy as np

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.learner_state import (
    CONFIDENCE,
    DISCARD,
    IN_POOL,
    LearnerState,
    POOLED_DISCARD,
    POOLED_LISTEN,
    TEMPERATURE,
    TRUST_RATE,
)

NOW = {'confidence': CONFIDENCE, 'temperature': TEMPERATURE, 'trust_rate': TRUST_RATE}


def changed_method(method, changes, done):
    """
    Return the method with other values in some fields.

    changes: table of values by field. done: iterations that are done.

    Raises
    ------
    MethodError: for a value that cannot be at the start, or not any more.

    """
    iterations = changes.get('iterations', 0)
    if iterations != method.iterations and 0 < iterations <= done:
        raise ConfigError(f'iterations must be 0, or above the {done} that are done, '
                          f'got {iterations}')
    if changes.get('replays', method.replays) != method.replays:
        raise ConfigError(f'replays must stay {str(method.replays).lower()} while a learner runs: '
                          'what it remembers is of another kind, got '
                          f'{str(changes["replays"]).lower()}')
    return replace(method, **changes)


def changed_memory(memory, world, before, after):
    """
    Return the `LearnerState` with which a learner goes on by another method.

    What was learned stays. A first value that changes holds for what was never tried or left yet;
    confidence, temperature and trust_rate hold from now on. Trust of another kind begins anew, and
    so do traces, where the method had none.
    """
    fresh = LearnerState.fresh(world, after)
    arrays = {name: old.copy() if old.shape == new.shape else new for name, old, new in zip(
        memory.__dataclass_fields__, memory.arrays(), fresh.arrays())}
    changed = LearnerState(**arrays)
    count_untried = (changed.visits == 1.0) & (changed.q == before.initial_value)
    changed.q[count_untried] = after.initial_value
    for name, place in NOW.items():
        if getattr(before, name) != getattr(after, name):
            changed.schedule[place] = getattr(after, name)
    if before.trust != after.trust:
        changed.belief[...] = fresh.belief
        changed.schedule[TRUST_RATE + 1:] = fresh.schedule[TRUST_RATE + 1:]
    else:
        _change_first_belief(changed, before, after)
    return changed


def _change_first_belief(memory, before, after):
    """Change belief and pool where nothing was learned of the mentor yet."""
    old = np.array((before.belief_listen, before.belief_discard))
    new = np.array((after.belief_listen, after.belief_discard))
    unknown = ((memory.arrivals == 1.0) & (memory.belief[:, IN_POOL] == 0.0)
               & (memory.belief[:, :DISCARD + 1] == old).all(axis=1))
    memory.belief[unknown, :DISCARD + 1] = new
    memory.schedule[[POOLED_LISTEN, POOLED_DISCARD]] += new - old
