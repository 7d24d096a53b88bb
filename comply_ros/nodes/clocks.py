# SPDX-License-Identifier: Apache-2.0
"""
The clocks of a node: ROS time for pacing where it is used, a steady clock for the rest.

What paces a lesson (`rate`, `patience`, `advice_timeout`) follows ROS time where `use_sim_time`
is set, and a steady clock otherwise. Everything else follows a steady clock. The system clock,
which can be set back, is for time stamps and file names only. A node that follows ROS time says
when there is no /clock.
"""

from collections.abc import Callable
import time

from rclpy.clock import Clock, ClockType, JumpHandle, JumpThreshold, ROSClock
from rclpy.node import Node
from rclpy.timer import Timer

STEADY_CLOCK = Clock(clock_type=ClockType.STEADY_TIME)


def steady_timer(node: Node, seconds: float, callback: Callable[[], None]) -> Timer:
    """Return a new timer that follows a steady clock, whatever `use_sim_time` says."""
    return node.create_timer(seconds, callback, clock=STEADY_CLOCK)


class PaceTimer:
    """
    Calls back every so many seconds of ROS time where `use_sim_time` is set, else steady time.

    It follows `use_sim_time` when that changes while the node runs. It runs until `destroy`.
    """

    def __init__(self, node: Node, seconds: float, callback: Callable[[], None]) -> None:
        self._node, self._seconds, self._callback = node, seconds, callback
        self._clock_changes = _on_clock_change(node, self._restart)
        self._timer = self._start()

    def destroy(self) -> None:
        """Stop for good."""
        self._clock_changes.unregister()
        self._node.destroy_timer(self._timer)

    def _restart(self) -> None:
        self._node.destroy_timer(self._timer)
        self._timer = self._start()

    def _start(self) -> Timer:
        return self._node.create_timer(self._seconds, self._callback,
                                       clock=_active_ros_clock(self._node) or STEADY_CLOCK)


class PaceClock:
    """
    Seconds of ROS time where `use_sim_time` is set, else of steady time; they never run back.

    Only the difference of two readings has a meaning. No time passes between two readings where
    ROS time starts, jumps back (a bag that is played again) or is turned on or off.
    """

    def __init__(self, node: Node) -> None:
        self._node, self._seconds = node, 0.0
        self._last = self._read()

    def seconds(self) -> float:
        """Return the seconds that have passed since this clock was made."""
        (last_source, before), (source, now) = self._last, self._read()
        self._last = source, now
        if source == last_source and before > 0.0:  # ROS time is 0 until the first /clock
            self._seconds += max(0.0, now - before)
        return self._seconds

    def _read(self) -> tuple[str, float]:
        ros_clock = _active_ros_clock(self._node)
        if ros_clock is None:
            return 'steady time', time.monotonic()
        return 'ROS time', ros_clock.now().nanoseconds / 1e9


class StampClock:
    """
    The clock for stamps of messages: ROS time where `use_sim_time` is set, else the system's.

    Which of them is noted when it changes: to ask rclpy for each message costs 3 microseconds.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._clock_changes = _on_clock_change(node, self._choose)
        self._choose()

    def nanoseconds(self) -> int:
        """Return the time now, in nanoseconds since 1970."""
        return self._ros_clock.now().nanoseconds if self._ros_clock else time.time_ns()

    def _choose(self) -> None:
        self._ros_clock = _active_ros_clock(self._node)


def waiting_for(node: Node, missing: str | None = None) -> str | None:
    """
    Return what a node waits for: /clock, where `use_sim_time` is set and nothing publishes it.

    missing: what else the node waits for.
    """
    clock = _active_ros_clock(node)
    is_silent = clock is not None and (  # before the first message, ROS time is 0
        clock.now().nanoseconds == 0
        or node.count_publishers(node.resolve_topic_name('/clock')) == 0)
    return ' and for '.join(filter(None, ('/clock' if is_silent else None, missing))) or None


def _active_ros_clock(node: Node) -> ROSClock | None:
    clock = node.get_clock()
    return clock if isinstance(clock, ROSClock) and clock.ros_time_is_active else None


def _on_clock_change(node: Node, callback: Callable[[], None]) -> JumpHandle:
    """Call back when ROS time was turned on or off, until the handle is unregistered."""
    return node.get_clock().create_jump_callback(
        JumpThreshold(min_forward=None, min_backward=None, on_clock_change=True),
        post_callback=lambda _: callback())
