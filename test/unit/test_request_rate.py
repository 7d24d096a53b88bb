# SPDX-License-Identifier: Apache-2.0
"""How long an address that does too much has to wait."""

import asyncio

import pytest

from comply_ros.dashboard.request_rate import MAX_DELAY, RateLimit, RequestRate


@pytest.fixture
def now():
    """Return the time of a clock, as a list of one number that may be changed."""
    return [100.0]


def test_one_more_is_free_after_some_seconds(now):
    limit = RateLimit(5, 2.0, lambda: now[0])
    for _ in range(5):
        assert limit.wait('a') == 0.0
        limit.add('a')
    assert limit.wait('a') == 2.0 and limit.wait('b') == 0.0
    now[0] += 2.0
    assert limit.wait('a') == 0.0
    limit.add('a')
    assert limit.wait('a') == 2.0


def delays_of(now, number):
    """Return whether each of some requests was admitted, and after how many seconds."""
    slept = []

    async def sleep(seconds):
        slept.append(seconds)
    rate = RequestRate(RateLimit(3, 0.5, lambda: now[0]), sleep)

    async def send_all():
        return [await rate.admits('a') for _ in range(number)]
    return asyncio.run(send_all()), slept


def test_requests_of_a_crowd_of_connections_wait_for_each_other(now):
    assert delays_of(now, 6) == ([True] * 6, [0.5, 1.0, 1.5])


def test_one_request_too_many_waits_before_it_is_rejected_and_delays_no_other(now):
    admitted, slept = delays_of(now, 16)
    assert admitted == [True] * 13 + [False] * 3
    assert slept[-4:] == [MAX_DELAY] * 4
