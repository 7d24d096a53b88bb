# SPDX-License-Identifier: Apache-2.0
"""Maps come as often as they cost little: by a clock of the test's own."""

import pytest

from comply_ros.nodes.cost_throttle import CostThrottle, TIMES


class Clock:
    """A clock that goes when it is told to."""

    now = 100.0

    def __call__(self):
        """Return the seconds."""
        return self.now

    def go(self, seconds):
        """Go on by so many seconds, and return them."""
        self.now += seconds
        return seconds


@pytest.fixture
def clock():
    """Return a clock."""
    return Clock()


def test_the_first_is_due_at_once(clock):
    assert CostThrottle(3600.0, clock).over()


def test_what_costs_nothing_comes_once_a_period(clock):
    pauses = CostThrottle(1.0, clock)
    assert pauses.timed(clock.go, 0.0, begins=True) == 0.0
    assert not pauses.over()
    clock.go(0.75)
    assert not pauses.over()
    clock.go(0.25)
    assert pauses.over()


def test_what_costs_much_is_put_off_for_many_times_as_long(clock):
    pauses = CostThrottle(1.0, clock)
    pauses.timed(clock.go, 0.25, begins=True)
    clock.go(2000.0)  # of a disk that was full: no cost of theirs
    pauses.timed(clock.go, 0.25)
    assert pauses.over()
    pauses.timed(clock.go, 0.25, begins=True)
    pauses.timed(clock.go, 0.25)
    clock.go(TIMES * 0.5 - 0.5 - 0.125)
    assert not pauses.over()
    clock.go(0.125)
    assert pauses.over()


def test_two_of_a_hundred_seconds_are_lost_at_most(clock):
    pauses, lost, begin = CostThrottle(0.0, clock), 0.0, clock.now
    for step in range(40_000):
        clock.go(0.001)
        if pauses.over():
            lost += pauses.timed(clock.go, 0.01 + step % 7 * 0.02, begins=True)
    assert 0.01 < lost / (clock.now - begin) < 0.02
