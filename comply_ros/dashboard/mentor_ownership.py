# SPDX-License-Identifier: Apache-2.0
"""Who is the mentor on the page: a person, or somebody else who is watched."""

from collections.abc import Generator
from contextlib import contextmanager, ExitStack
import time

from comply_ros.dashboard.dashboard_node import DashboardNode
from comply_ros.dashboard.mentor_thread import MentorThread
from comply_ros.nodes.human_mentor import HumanMentorNode
from comply_ros.world.grid import NO_ACTION

DISCOVERY = 1.0  # seconds in which another mentor is found


class MentorSeat:
    """
    The human mentor of the page, by the parameter `teach`: `true`, `false` or `auto`.

    With `auto` there is one while no other mentor is heard; one who has painted or steers, or who
    has taken over, stays. `thread` is None while there is none.
    """

    def __init__(self, node: DashboardNode) -> None:
        self.thread: MentorThread | None = None
        self.has_taken_over = False
        self._node, self._running = node, ExitStack()
        self._alone_since = time.monotonic()

    @contextmanager
    def open(self) -> Generator[None]:
        """End the mentor, if there is one, with the block."""
        with self._running:
            self.update()
            yield

    def take_over(self) -> None:
        """Be a mentor beside the other one from the next update on; for any thread."""
        self.has_taken_over = True

    @property
    def can_take_over(self) -> bool:
        """Whether a person may be the mentor: not on a page that only watches."""
        return self._node.teach != 'false'

    def update(self) -> None:
        """Start or end the mentor where that is due; raises the error that ended it."""
        if self.thread and self.thread.error:
            raise self.thread.error
        wanted = self._is_wanted()
        if wanted and not self.thread:
            self.thread = MentorThread(HumanMentorNode())
            self._running.enter_context(self.thread.running())
        elif self.thread and not wanted:
            thread, self.thread = self.thread, None
            self._running.close()
            thread.mentor.destroy_node()
            self._node.get_logger().info('another mentor is heard: the page watches')

    def _is_wanted(self) -> bool:
        if self._node.teach != 'auto' or self.has_taken_over:
            return self._node.teach != 'false'
        if self.thread:
            return not self._node.other_mentors() or self._is_used()
        now = time.monotonic()
        if self._node.mentor_publishers():
            self._alone_since = now
        return now - self._alone_since >= DISCOVERY

    def _is_used(self) -> bool:
        """Whether a person has painted, or steers."""
        mentor = self.thread.mentor if self.thread else None
        if mentor is None or mentor.policy is None:
            return False
        return mentor.steering or bool((mentor.policy != NO_ACTION).any())
