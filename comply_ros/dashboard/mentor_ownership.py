# SPDX-License-Identifier: Apache-2.0
"""Who is the mentor on the page: a person, or somebody else who is watched."""

from collections.abc import Generator
from contextlib import contextmanager, ExitStack
import time

from rclpy.parameter import Parameter as RosParameter

from comply_ros.dashboard.dashboard_node import DashboardNode
from comply_ros.dashboard.mentor_thread import MentorThread
from comply_ros.dashboard.teaching_offer import learner_mentors, person_name
from comply_ros.nodes import topics
from comply_ros.nodes.human_mentor import HumanMentorNode
from comply_ros.nodes.lesson_parameters import mentor_node
from comply_ros.nodes.parameters import MENTOR_NAME
from comply_ros.world.grid import NO_ACTION

DISCOVERY = 1.0  # seconds in which another mentor is found


class MentorSeat:
    """
    The human mentor of the page, by the parameters `teach` and `name`.

    With `teach:=auto` there is one while no other mentor is heard, and where the learner has a
    mentor of the person's name that nobody else is; one who has painted or steers, or who has
    pressed the button, stays. `thread` is None while there is none.
    """

    def __init__(self, node: DashboardNode) -> None:
        self.thread: MentorThread | None = None
        self.has_taken_over = False
        self._node, self._running = node, ExitStack()
        self._opened = self._alone_since = time.monotonic()
        self._mentors: tuple[str, ...] = ()  # of the learner, also of one that starts a run

    @contextmanager
    def open(self) -> Generator[None]:
        """End the mentor, if there is one, with the block."""
        with self._running:
            self.update()
            yield

    def take_over(self) -> None:
        """Be a mentor beside the others from the next update on; for any thread."""
        self.has_taken_over = True

    @property
    def can_take_over(self) -> bool:
        """Whether a person may be the mentor: not on a page that only watches."""
        return self._node.teach != 'false'

    def update(self) -> None:
        """Start or end the mentor where that is due; raises the error that ended it."""
        if self.thread and self.thread.error:
            raise self.thread.error
        wanted = self._wanted_name()
        if self.thread and wanted != self._own_name:
            self._end()
            if wanted is None:
                self._node.get_logger().info('another mentor is heard: the page watches')
        if wanted is not None and not self.thread:
            self._start(wanted)

    @property
    def _own_name(self) -> str:
        """The name of the person; '' too while there is none."""
        return self.thread.mentor.machine.name if self.thread else ''

    def _start(self, name: str) -> None:
        """Be a mentor of this name, in a node of its own name where the page's was renamed too."""
        self.thread = MentorThread(HumanMentorNode(
            parameter_overrides=[RosParameter(MENTOR_NAME.name, value=name)],
            cli_args=['--ros-args', '-r', f'__node:={mentor_node(name)}']))
        self._running.enter_context(self.thread.running())

    def _end(self) -> None:
        thread, self.thread = self.thread, None
        self._running.close()
        thread.mentor.destroy_node()

    def _wanted_name(self) -> str | None:
        """Return the name under which a person is the mentor now, None while the page watches."""
        teach = self._node.teach
        if teach == 'false':
            return None
        if self.thread and (teach == 'true' or self.has_taken_over or self._is_used()):
            return self._own_name
        self._mentors = learner_mentors(self._node.page_state) or self._mentors
        others, given = self._names_of_others(), self._node.mentor_name
        stays = self.thread and (self._own_name in self._mentors or not any(self._mentors))
        name = self._own_name if stays else person_name(given, others, self._mentors)
        if self.has_taken_over:
            return name
        if teach == 'true':  # what it is called depends on others, which are found in a moment
            is_due = bool(given) or time.monotonic() - self._opened >= DISCOVERY
        else:
            is_due = self._is_free(name, others)
        return name if is_due else None

    def _is_free(self, name: str, others: list[str]) -> bool:
        """Whether the learner lacks the mentor of this name, and has for a moment."""
        if any(self._mentors):
            is_free = name in self._mentors and name not in others
        elif self.thread and '' in self._mentors and '' not in others:
            is_free = True  # the learner waits for the person, and would wait for ever
        else:
            is_free = not (self._node.other_mentors() if self.thread else others)
        now = time.monotonic()
        if not is_free:
            self._alone_since = now
        return is_free and (self.thread is not None or now - self._alone_since >= DISCOVERY)

    def _names_of_others(self) -> list[str]:
        """Return the names under which other mentors publish; '' for the topic without one."""
        def publishers(name: str) -> int:
            return self._node.count_publishers(
                topics.topic_of_mentor(topics.RECOMMENDATION, name).name)
        return [name for name in topics.mentors_found(self._node)
                if not self.thread or name != self._own_name or publishers(name) > 1]

    def _is_used(self) -> bool:
        """Whether a person has painted, or steers."""
        mentor = self.thread.mentor if self.thread else None
        if mentor is None or mentor.policy is None:
            return False
        return mentor.steering or bool((mentor.policy != NO_ACTION).any())
