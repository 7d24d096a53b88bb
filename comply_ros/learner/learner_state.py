# SPDX-License-Identifier: Apache-2.0
"""The arrays that a learner carries."""

from dataclasses import dataclass
import hashlib

import numpy as np

# schedule[...]
CONFIDENCE, TEMPERATURE, TRUST_RATE, STAGE, BEST_RETURN = range(5)
AGREED, MET, POOLED, POOLED_LISTEN, POOLED_DISCARD = range(5, 10)
LISTEN, DISCARD, IN_POOL = range(3)  # belief[s, ...]


@dataclass(frozen=True)
class LearnerState:
    """
    What a learner has learned; the order of the fields is the order of its digest.

    Attributes
    ----------
    q: `q[s, a]`, float64: action values; -inf where the cell has no such action.
    visits: `visits[s, a]`, float64: the c of the learning rate (2.26), from 1 upwards.
    belief: `belief[s, 0]` for listening, `belief[s, 1]` for discarding, float64: alpha and beta
    of (3.7), or the two values of (3.10); `belief[s, 2]`, 1 if it is in the pool of the prior.
    arrivals: `arrivals[s]`, float64: how often s was left, from 1 upwards.
    schedule: float64: the confidence p of (3.6), the temperature of (2.25), the rate of (4.2),
    how many times a jump start was shortened, the best mean return of an iteration; how often
    the advice was the best action, of how many times; of how many states the belief is pooled,
    and the sums over them.
    traces: `traces[s, a]`, float64: eligibility (2.20); no rows where the method has no traces.
    trail: int64: how many traces are above 0, then `4 s + a` of each.
    outcomes: `outcomes[s, a]` is the mean reward, the usual successor and its votes, float64; no
    rows where the method does not replay.

    """

    q: np.ndarray
    visits: np.ndarray
    belief: np.ndarray
    arrivals: np.ndarray
    schedule: np.ndarray
    traces: np.ndarray
    trail: np.ndarray
    outcomes: np.ndarray

    @classmethod
    def fresh(cls, world, method):
        """Return the memory of a learner that has seen nothing of the world yet."""
        states = len(world.terminal)
        traced = states if method.trace_decay > 0 or method.replays else 0
        first_belief = (method.belief_listen, method.belief_discard)
        return cls(
            q=np.where(world.available, method.initial_value, -np.inf),
            visits=np.ones((states, 4)),
            belief=np.tile(np.array((*first_belief, 0.0)), (states, 1)),
            arrivals=np.ones(states),
            schedule=np.array([method.confidence, method.temperature, method.trust_rate,
                               0.0, -np.inf, 1.0, 1.0, 1.0, *first_belief]),
            traces=np.zeros((traced, 4)),
            trail=np.zeros(1 + 4 * traced, dtype=np.int64),
            outcomes=np.zeros((states if method.replays else 0, 4, 3)))

    def arrays(self):
        """Return the arrays in the order of the fields, without copying them."""
        return tuple(getattr(self, name) for name in self.__dataclass_fields__)

    def views(self):
        """Return the same arrays as memoryviews: single elements come three times as fast."""
        return tuple(memoryview(array) for array in self.arrays())

    def digest(self):
        """SHA-256 (hex) over all arrays, in the order of the fields, little endian."""
        sha = hashlib.sha256()
        for array in self.arrays():
            sha.update(array.astype('<f8').tobytes())
        return sha.hexdigest()
