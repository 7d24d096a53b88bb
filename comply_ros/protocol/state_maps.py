# SPDX-License-Identifier: Apache-2.0
"""Arrays over all states that are published in a run: of the learner, and of each mentor."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.mentor.policy_validation import PolicyError, validate_policy
from comply_ros.protocol.iteration_curve import IterationCurve
from comply_ros.protocol.mentor_topics import name_of_mentor
from comply_ros.world.mdp import World

# Topics with a value for each state, and the field and type of these values.
STATE_MAPS = {'trust': ('confidence', np.float32), 'policy': ('action', np.int16),
              'values': ('value', np.float64), 'mentor_policy': ('action', np.int16)}


class MentorReports(NamedTuple):
    """
    What is known of one mentor in a run, None where that is nothing; it never changes.

    Attributes
    ----------
    trust: `p[s]`, the learner's confidence in it. policy: `a[s]` that it published.
    confidence: with several mentors, the mean over the decisions of the last iteration that had
        its advice; nan where none had. curve: that of each iteration.

    """

    trust: NDArray[Any] | None = None
    policy: NDArray[Any] | None = None
    confidence: float | None = None
    curve: IterationCurve = IterationCurve()


NOTHING = MentorReports()
# The field of `MentorReports` for each map of a mentor.
OF_MENTOR = {'trust': 'trust', 'mentor_policy': 'policy'}


def validated_map(topic: str, mentor: str, array: NDArray[Any], world: World) -> NDArray[Any]:
    """
    Return an array of a topic in `STATE_MAPS` that is of a world.

    mentor: the name of the one that it is of or about.

    Raises
    ------
    ValueError: if it cannot be of this world.

    """
    name = name_of_mentor(topic, mentor) if topic != 'trust' else \
        f'trust in {mentor}' if mentor else topic
    if len(array) != world.n_states:
        raise ValueError(f'{name} must have the {world.n_states} states of the world, got '
                         f'{len(array)}')
    if topic == 'trust':
        wrong = ~((array >= 0.0) & (array <= 1.0))  # nan, too, is no confidence
        if wrong.any():
            raise ValueError(f'{name} must lie in [0, 1], got {array[wrong][0]}')
    elif topic == 'values':
        wrong = world.free & ~np.isfinite(array)
        if wrong.any():
            raise ValueError(f'{name} must be finite numbers, got {array[wrong][0]}')
    else:
        try:
            return validate_policy(array, world, clear_not_free=True)
        except PolicyError as error:
            raise ValueError(f'{name}: {error}') from None
    return array
