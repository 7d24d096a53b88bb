# SPDX-License-Identifier: Apache-2.0
"""Maps come as often as they cost little, by a clock of the test's own."""

import pytest

from comply_ros.nodes.publish_throttle import CostThrottle, TIMES


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
    assert CostThrottle(3600.0, clock).is_due()


def test_what_costs_nothing_comes_once_a_period(clock):
    throttle = CostThrottle(1.0, clock)
    assert throttle.start(clock.go, 0.0) == 0.0
    assert not throttle.is_due()
    clock.go(0.75)
    assert not throttle.is_due()
    clock.go(0.25)
    assert throttle.is_due()


def test_what_costs_much_is_put_off_for_many_times_as_long(clock):
    throttle = CostThrottle(1.0, clock)
    throttle.start(clock.go, 0.25)
    clock.go(2000.0)  # of a disk that was full: no cost of theirs
    throttle.go_on(clock.go, 0.25)
    assert throttle.is_due()
    throttle.start(clock.go, 0.25)
    throttle.go_on(clock.go, 0.25)
    clock.go(TIMES * 0.5 - 0.5 - 0.125)
    assert not throttle.is_due()
    clock.go(0.125)
    assert throttle.is_due()


def test_two_of_a_hundred_seconds_are_lost_at_most(clock):
    throttle, lost, begin = CostThrottle(0.0, clock), 0.0, clock.now
    for step in range(40_000):
        clock.go(0.001)
        if throttle.is_due():
            lost += throttle.start(clock.go, 0.01 + step % 7 * 0.02)
    assert 0.01 < lost / (clock.now - begin) < 0.02
