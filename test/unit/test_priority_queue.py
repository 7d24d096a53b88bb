# SPDX-License-Identifier: Apache-2.0
"""The queue of the planners: which state is first, whatever the order in which they came."""

import random

from tiny_worlds import Bench, room

from comply_ros.learner.priority_queue import pop, promote


def waiting(as_run, *priorities):
    """Return the state of a learner in which states wait; priorities: (state, priority)."""
    state = Bench(room(), planner='r_max').state
    for s, priority in priorities:
        as_run(promote)(s, priority, state)
    return state


def popped(as_run, state):
    """Return the states in the order in which they are popped, until none waits."""
    order = []
    while state.queue[0] > 0:
        order.append(int(as_run(pop)(state)))
    assert not state.queued.any() and not state.priority.any()
    return order


def test_the_state_with_the_highest_priority_is_first(as_run):
    state = waiting(as_run, (3, 0.5), (1, 2.0), (8, 1.0), (0, 4.0), (5, 3.0))
    assert popped(as_run, state) == [0, 5, 1, 8, 3]


def test_a_state_waits_once_with_the_highest_priority_that_it_was_given(as_run):
    state = waiting(as_run, (3, 0.5), (1, 1.0), (3, 2.0), (1, 0.1))
    assert (state.queue[0], state.priority[3], state.priority[1]) == (2, 2.0, 1.0)
    assert popped(as_run, state) == [3, 1]


def test_states_that_come_while_others_go_keep_their_order(as_run):
    chance = random.Random(2)
    state, model = waiting(as_run), {}
    for _ in range(200):
        s, priority = chance.randrange(9), chance.random()
        as_run(promote)(s, priority, state)
        model[s] = max(priority, model.get(s, 0.0))
        if chance.random() < 0.4:
            first = max(model, key=lambda each: model[each])
            assert as_run(pop)(state) == first
            del model[first]
    assert popped(as_run, state) == sorted(model, key=lambda each: -model[each])
