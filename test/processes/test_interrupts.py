# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C as a flag that is checked between two steps."""

import os
import signal
import subprocess
import sys

import pytest
from waiting import DEADLINE

from comply_ros.terminal.interrupts import check, interrupts


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_sets_the_flag_and_the_old_handler_is_restored(number):
    before = signal.getsignal(number)
    with interrupts() as stop:
        check(stop)
        os.kill(os.getpid(), number)
        assert stop.is_set()
        with pytest.raises(KeyboardInterrupt):
            check(stop)
    assert signal.getsignal(number) is before


def test_a_signal_during_the_handler_of_another_does_not_deadlock():
    code = """
import os, signal, threading
from comply_ros.terminal.interrupts import interrupts
def storm():
    for _ in range(3000):
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGTERM)
with interrupts() as stop:
    thread = threading.Thread(target=storm)
    thread.start()
    while thread.is_alive():
        pass
    print(stop.is_set())
"""
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          timeout=DEADLINE, check=True)
    assert done.stdout == 'True\n'
