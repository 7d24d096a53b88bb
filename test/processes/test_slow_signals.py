# SPDX-License-Identifier: Apache-2.0
"""Signals whose handlers run late, as on a busy machine, while something waits with a timeout."""

import subprocess
import sys

import pytest
from waiting import DEADLINE

SLOW_SIGNAL = """
import signal, time
from comply_ros.terminal.interrupts import StopFlag
stop = StopFlag()
def handler(*_):
    time.sleep(1.0)
    stop.set()
signal.signal(signal.SIGALRM, handler)
signal.setitimer(signal.ITIMER_REAL, 0.02)
"""
PAGE = """
from comply_ros.dashboard.service_client import ServiceClient
client = ServiceClient(None)
{}
while not stop.is_set():
    client.send_pending(0.1)
"""
EXPERIMENT = """
from concurrent.futures import Future
from comply_ros.experiments.parallel_runs import completed, Executor
executor = Executor('one', lambda job: Future(), Future.result, max_pending=1)
{}
try:
    list(completed(executor, [(0, 0)], stop))
except KeyboardInterrupt:
    pass
"""


@pytest.mark.parametrize('waits', [PAGE, EXPERIMENT])
def test_what_waits_ends_where_the_handler_of_a_signal_runs_late(waits):
    subprocess.run([sys.executable, '-c', waits.format(SLOW_SIGNAL)], timeout=DEADLINE, check=True)
