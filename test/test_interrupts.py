# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C as a question between two steps."""

import os
import signal

import pytest

from comply_ros.session.interrupts import check, interrupts


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_sets_the_event_and_breaks_nothing(number):
    before = signal.getsignal(number)
    with interrupts() as stop:
        check(stop)
        os.kill(os.getpid(), number)
        assert stop.is_set()
        with pytest.raises(KeyboardInterrupt):
            check(stop)
    assert signal.getsignal(number) is before
