# SPDX-License-Identifier: Apache-2.0
"""The human mentor's node in a thread of its own, so that no page makes a robot wait."""

from collections.abc import Generator
from concurrent.futures import Future
from contextlib import contextmanager
from threading import Thread
from typing import Any

from rclpy.experimental import EventsExecutor

from comply_ros.nodes.human_mentor import HumanMentorNode


class MentorThread:
    """Spins a `HumanMentorNode` in a thread; `error` is the exception that ended it, or None."""

    def __init__(self, mentor: HumanMentorNode) -> None:
        self.mentor = mentor
        self.error: BaseException | None = None
        self.steering_page = ''  # id of the page that has switched steering on last
        self._stopping = False

    def call(self, name: str, *arguments: Any) -> Future:
        """Call a method of the mentor in its thread; return the `Future` of the result."""
        return self.mentor.do(lambda: getattr(self.mentor, name)(*arguments))

    def set_steering(self, steering: bool) -> Future:
        """Set whether a person steers; return the `Future` of it."""
        return self.mentor.do(lambda: setattr(self.mentor, 'steering', steering))

    @contextmanager
    def running(self) -> Generator[None]:
        """Spin the mentor while the block runs."""
        thread = Thread(target=self._spin, name='mentor', daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._stopping = True
            thread.join()
            self.mentor.leave()

    def _spin(self) -> None:
        executor = EventsExecutor()
        executor.add_node(self.mentor)
        try:
            while not self._stopping and not self.mentor.mistake:
                executor.spin_once(timeout_sec=0.1)
            self.error = self.mentor.mistake
        except Exception as error:  # noqa: BLE001 - the main thread raises it
            self.error = error
        finally:
            executor.shutdown()
