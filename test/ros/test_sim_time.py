# SPDX-License-Identifier: Apache-2.0
"""Nodes with `use_sim_time`: without a /clock, with a slow one, and when it stops."""

import time

from node_processes import log_has, nodes
from pty_session import pty_session
import pytest
from rclpy.time import Time
from ros_client import ros_client
from rosgraph_msgs.msg import Clock
from waiting import wait_until

pytestmark = pytest.mark.usefixtures('domain')
SIM_TIME = ('-p', 'use_sim_time:=true')
WORLD = (*SIM_TIME, '-p', 'map:=bar_grid')
LEARNER = (*SIM_TIME, '-p', 'iterations:=0', '-p', 'remembers_advice:=false')
ALONE = (*LEARNER, '-p', 'method:=watkins')
MISSING = 'waits for /clock'


class SimClock:
    """Publishes /clock: ROS time that runs at a factor of steady time, from 100 s on."""

    def __init__(self, client, factor):
        self._start, self._factor = time.monotonic(), factor
        self._publisher = client.create_publisher(Clock, '/clock', 1)
        self._timer, self._client = client.create_timer(0.02, self.publish), client

    def publish(self):
        """Publish the time."""
        passed = self._factor * (time.monotonic() - self._start)
        now = Time(nanoseconds=round(1e9 * (100.0 + passed)))
        self._publisher.publish(Clock(clock=now.to_msg()))

    def end(self):
        """End as a simulator does."""
        self._client.destroy_timer(self._timer)
        self._client.destroy_publisher(self._publisher)


@pytest.mark.long
def test_a_paced_world_without_a_clock_waits_and_says_so(tmp_path):
    with ros_client() as client, nodes(
            tmp_path, grid_world=(*WORLD, '-p', 'rate:=10.0'), learner=ALONE) as running:
        for name in ('grid_world', 'learner'):
            client.until(lambda: client.statuses.get(name) == MISSING, f'{MISSING} of {name}')
            assert log_has(running[name], MISSING)()
        steps, reports = client.steps('grid_world'), len(client.health['grid_world'])
        client.until(lambda: len(client.health['grid_world']) >= reports + 3, 'health')
        assert client.steps('grid_world') == steps  # the pace waits, the health does not
        clock = SimClock(client, 1.0)
        client.until(lambda: client.statuses['grid_world'] == 'runs', 'clock')
        client.until(lambda: client.steps('grid_world') >= steps + 10, 'steps')
        clock.end()
        client.until(lambda: client.statuses['grid_world'] == MISSING, 'end of the clock')


@pytest.mark.long
def test_one_that_waits_for_more_names_it_all(tmp_path):
    with ros_client() as client, nodes(tmp_path, grid_world=WORLD):
        client.until(lambda: client.statuses.get('grid_world', '').startswith(
            f'{MISSING} and for an action'), 'status')


def test_a_timeout_of_advice_waits_for_the_clock(tmp_path):
    with ros_client() as client, nodes(tmp_path, grid_world=WORLD, learner=(
            *LEARNER, '-p', 'advice_timeout:=0.1')):
        client.until(lambda: MISSING in client.statuses.get('learner', ''), MISSING)
        assert client.steps('learner') == 0
        SimClock(client, 1.0)
        client.until(lambda: client.steps('learner') > 5, 'steps without advice')


@pytest.mark.long
def test_the_patience_with_a_person_waits_for_the_clock(tmp_path):
    with ros_client() as client, nodes(tmp_path, grid_world=WORLD, learner=LEARNER), \
            pty_session('--ros-args', *SIM_TIME, '-p', 'patience:=0.1') as session:
        client.create_timer(0.05, session.read)  # a full terminal stops the program
        client.until(lambda: client.statuses.get('mentor') == MISSING, MISSING)
        client.until(lambda: MISSING in session.page(), f'{MISSING} in the terminal')
        assert client.steps('learner') == 0
        SimClock(client, 1.0)
        client.until(lambda: client.steps('learner') > 5, 'steps without the person')


@pytest.mark.long
def test_the_viewer_logs_that_the_clock_is_missing(tmp_path):
    with nodes(tmp_path, grid_world=WORLD, viewer=SIM_TIME) as running:
        wait_until(log_has(running['viewer'], MISSING), MISSING)


def test_with_a_clock_at_a_tenth_of_real_time_a_rate_of_ten_is_one_step_a_second(tmp_path):
    with ros_client() as client:
        SimClock(client, 0.1)
        with nodes(tmp_path, grid_world=(*WORLD, '-p', 'rate:=10.0'), learner=ALONE):
            client.until(lambda: client.steps('grid_world') >= 2, 'steps')
            start, first = time.monotonic(), client.steps('grid_world')
            client.until(lambda: client.steps('grid_world') >= first + 5, 'five more steps')
            assert time.monotonic() - start > 3.5  # the health is a second late, at most
