# SPDX-License-Identifier: Apache-2.0
"""Timers and clocks of a node with and without `use_sim_time`, which may change while it runs."""

import time

import pytest
import rclpy
from rclpy.clock import ClockType
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from waiting import DEADLINE

from comply_ros.nodes.clocks import PaceClock, PaceTimer, StampClock, steady_timer

pytestmark = pytest.mark.usefixtures('domain')


class NodeInTime(Node):
    """A node that publishes the ROS time that it follows, and counts the calls of its timers."""

    def __init__(self, context):
        super().__init__('clocks', context=context)
        self.executor_ = EventsExecutor(context=context)
        self.executor_.add_node(self)
        self._clock_publisher = self.create_publisher(Clock, '/clock', 1)
        self.ticks = []

    def use_sim_time(self, wanted):
        """Set the parameter as `ros2 param set` does."""
        self.set_parameters([Parameter('use_sim_time', value=wanted)])

    def set_ros_time(self, seconds):
        """Publish ROS time, until this node has received it."""
        message = Clock(clock=Time(nanoseconds=round(seconds * 1e9)).to_msg())

        def is_received():
            self._clock_publisher.publish(message)
            return abs(self.get_clock().now().nanoseconds / 1e9 - seconds) < 1e-6
        self.spin_until(is_received)

    def spin_until(self, condition):
        """Spin until the condition is true."""
        end = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < end
            self.executor_.spin_once(timeout_sec=0.01)

    def spin(self, seconds):
        """Spin for so many real seconds."""
        end = time.monotonic() + seconds
        self.spin_until(lambda: time.monotonic() > end)


@pytest.fixture
def node():
    """Return a node without `use_sim_time`."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = NodeInTime(context)
    yield node
    node.executor_.shutdown()  # else no other executor in this process hears anything
    node.destroy_node()
    rclpy.try_shutdown(context=context)


def test_a_steady_timer_runs_on_while_ros_time_stands_still(node):
    node.use_sim_time(True)
    node.set_ros_time(100.0)
    steady_timer(node, 0.01, lambda: node.ticks.append(1))
    node.spin_until(lambda: len(node.ticks) >= 5)


def test_without_use_sim_time_no_timer_of_ours_follows_the_system_clock(node):
    """Set back by an hour, it would stop such a timer for an hour."""
    steady_timer(node, 1.0, node.ticks.clear)
    PaceTimer(node, 1.0, node.ticks.clear)
    assert {timer.clock.clock_type for timer in node.timers} == {ClockType.STEADY_TIME}


def test_a_pace_timer_calls_back_by_ros_time_where_use_sim_time_is_set(node):
    node.use_sim_time(True)
    node.set_ros_time(100.0)
    PaceTimer(node, 5.0, lambda: node.ticks.append(1))
    node.set_ros_time(104.9)
    node.spin(0.1)
    assert node.ticks == []
    node.set_ros_time(105.1)
    node.spin_until(lambda: node.ticks == [1])
    node.set_ros_time(10.0)  # a bag is played again
    node.set_ros_time(15.1)
    node.spin_until(lambda: node.ticks == [1, 1])


def test_a_pace_timer_follows_a_change_of_use_sim_time(node):
    timer = PaceTimer(node, 0.02, lambda: node.ticks.append(1))
    node.spin_until(lambda: len(node.ticks) >= 3)
    node.use_sim_time(True)
    node.set_ros_time(100.0)
    node.spin(0.05)
    node.ticks.clear()
    node.spin(0.2)
    assert node.ticks == []
    node.use_sim_time(False)
    node.spin_until(lambda: len(node.ticks) >= 3)
    timer.destroy()
    node.ticks.clear()
    node.spin(0.1)
    assert node.ticks == []
    node.use_sim_time(True)
    assert [*node.timers] == []


def test_a_pace_clock_counts_steady_seconds_without_use_sim_time(node, monkeypatch):
    now = 1000.0
    monkeypatch.setattr(time, 'monotonic', lambda: now)
    monkeypatch.setattr(time, 'time', lambda: -now)  # the system clock is set back
    clock = PaceClock(node)
    now += 2.5
    assert clock.seconds() == 2.5
    now += 1.0
    assert clock.seconds() == 3.5


def test_a_pace_clock_counts_ros_time_that_passes_forward(node):
    node.use_sim_time(True)
    clock = PaceClock(node)
    node.set_ros_time(1_700_000_000.0)  # the first /clock is no time that has passed
    assert clock.seconds() == 0.0
    node.set_ros_time(1_700_000_002.0)
    assert clock.seconds() == pytest.approx(2.0)
    node.set_ros_time(1_600_000_000.0)
    assert clock.seconds() == pytest.approx(2.0)
    node.set_ros_time(1_600_000_001.0)
    assert clock.seconds() == pytest.approx(3.0)
    node.use_sim_time(False)
    assert clock.seconds() == pytest.approx(3.0)
    node.spin(0.1)
    assert clock.seconds() > 3.09


def test_stamps_follow_ros_time_while_use_sim_time_is_set(node):
    clock = StampClock(node)
    assert abs(clock.nanoseconds() - time.time_ns()) < 60e9
    node.use_sim_time(True)
    node.set_ros_time(100.25)
    assert clock.nanoseconds() == 100_250_000_000
    node.use_sim_time(False)
    assert abs(clock.nanoseconds() - time.time_ns()) < 60e9
