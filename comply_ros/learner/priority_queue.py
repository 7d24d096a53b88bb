# SPDX-License-Identifier: Apache-2.0
"""The states that wait for a backup of a planner, the one with the highest priority first."""

from comply_ros.learner.learner_state import LearnerState
from comply_ros.numerics.jit import kernel


@kernel
def promote(s: int, priority: float, state: LearnerState) -> None:
    """
    Change the queue: state s waits with this priority, or a higher one that it has already.

    The queue is a binary heap: the state at place i, from 1, has at least the priority of those at
    the places 2 i and 2 i + 1.
    """
    queue, queued, priorities = state.queue, state.queued, state.priority
    place = queued[s]
    if place == 0:
        queue[0] += 1
        place = queue[0]
    elif priority <= priorities[s]:
        return
    priorities[s] = priority
    while place > 1 and priorities[queue[place // 2]] < priority:
        queue[place] = queue[place // 2]
        queued[queue[place]] = place
        place //= 2
    queue[place] = s
    queued[s] = place


@kernel
def pop(state: LearnerState) -> int:
    """Change the queue, which must not be empty: return its first state, which waits no more."""
    queue, queued, priorities = state.queue, state.queued, state.priority
    first, last, place = queue[1], queue[queue[0]], 1
    queue[0] -= 1
    count = queue[0]
    while 2 * place <= count:
        child = 2 * place
        if child < count and priorities[queue[child + 1]] > priorities[queue[child]]:
            child += 1
        if priorities[queue[child]] <= priorities[last]:
            break
        queue[place] = queue[child]
        queued[queue[place]] = place
        place = child
    queue[place] = last
    queued[last] = place
    queued[first], priorities[first] = 0, 0.0  # also where it was the last one
    return first
