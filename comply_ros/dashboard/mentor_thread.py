# SPDX-License-Identifier: Apache-2.0
"""The person's mentor node in a thread of its own, so that no page lets a robot wait."""

from contextlib import contextmanager
from threading import Thread

from rclpy.experimental import EventsExecutor

LOOK = 0.1  # seconds between looks at whether to end


class MentorThread:
    """
    Has a `HumanMentorNode` do what pages ask for, in the thread in which it lives.

    Attributes
    ----------
    mentor: the `HumanMentorNode`.
    mistake: an exception that ended its thread, None while all is well.

    """

    def __init__(self, mentor):
        self.mentor, self.mistake, self._ends = mentor, None, False

    @property
    def patience(self):
        """Seconds that the robot waits for a person who steers."""
        return self.mentor.get_parameter('patience').value

    def do(self, deed, *arguments):
        """Return the `Future` of a method of the mentor, by name; for any thread."""
        return self.mentor.do(lambda: getattr(self.mentor, deed)(*arguments))

    def take_the_wheel(self, wanted):
        """Steer by hand from now on, or not; return the `Future`; for any thread."""
        return self.mentor.do(lambda: setattr(self.mentor, 'steering', wanted))

    @contextmanager
    def running(self):
        """Spin the mentor in a thread while the block runs."""
        thread = Thread(target=self._spin, name='mentor', daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._ends = True
            thread.join()
            self.mentor.leave()

    def _spin(self):
        executor = EventsExecutor()
        executor.add_node(self.mentor)
        try:
            while not self._ends and not self.mentor.mistake:
                executor.spin_once(timeout_sec=LOOK)
            self.mistake = self.mentor.mistake
        except Exception as error:  # noqa: BLE001 - the main thread raises it
            self.mistake = error
        finally:
            executor.shutdown()
