# SPDX-License-Identifier: Apache-2.0
"""World and mentor on one machine, the learner on another, and a cable that can be pulled."""

from contextlib import contextmanager
import subprocess
import sys
import time

from hosts import missing, two_hosts
from nodes import log_has, nodes, wait_until
import pytest
from test_nodes import digest_of, expected, LEARNER, MENTOR, SMALL  # noqa: F401

from comply_ros.nodes.processes import START

pytestmark = [pytest.mark.usefixtures('domain'),
              pytest.mark.skipif(bool(missing()), reason=missing() or 'all is here')]
RATE = ('-p', 'rate:=100.0')  # 572 steps: six seconds of learning
PULLED = 10.0  # seconds
IN_FLIGHT = 1.0  # seconds after which what was said before the pull has been heard and printed


@pytest.fixture
def across_machines(domain, monkeypatch):
    """Let nodes look for each other on the network, as the README says for two machines."""
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')


@contextmanager
def actions_heard(folder):
    """Print what is said on `action` to a file; give a function that counts it."""
    path = folder / 'action.yaml'
    with path.open('wb') as output:
        echo = subprocess.Popen(
            [sys.executable, '-c', START.format('topic'), 'echo', '--timeout', '30', 'action'],
            stdout=output, stderr=subprocess.STDOUT)
    try:
        yield lambda: path.read_text().count('---')
    finally:
        echo.terminate()
        echo.wait()


def test_a_lesson_goes_on_by_itself_after_the_cable_was_pulled(
        tmp_path, across_machines, expected):  # noqa: F811
    with two_hosts(tmp_path) as (here, there):
        with there.here(), nodes(tmp_path, learner=LEARNER) as far, \
                actions_heard(tmp_path) as count, \
                here.here(), nodes(tmp_path, grid_world=SMALL + RATE, mentor=MENTOR):
            wait_until(lambda: count() > 100, 'learning over the cable')
            there.pull_cable()
            time.sleep(IN_FLIGHT)
            before = count()
            time.sleep(PULLED - IN_FLIGHT)
            assert count() == before
            assert not log_has(far['learner'], 'finished')()
            there.plug_cable()
            wait_until(lambda: count() > before, 'learning after the cable is in again')
            assert digest_of(far['learner']) == expected
