# SPDX-License-Identifier: Apache-2.0
"""When a world publishes an unanswered observation again: after pauses that grow."""

from comply_ros.protocol.messages import StepId

# Seconds before it is repeated, at first and at most.
FIRST_PAUSE, LONGEST_PAUSE = 0.02, 5.0


class RepeatedObservation:
    """
    The observation of a world that no learner has answered yet.

    Times are in seconds of a clock that never runs back.
    """

    def __init__(self) -> None:
        self._step: StepId | None = None
        self._learner_messages, self._since = 0, 0.0
        self._pause, self._next = FIRST_PAUSE, 0.0

    def is_due(self, now: float, step: StepId, learner_messages: int, is_held: bool) -> bool:
        """
        Tell whether the observation is to be repeated now.

        step: of the observation that is the newest one.
        learner_messages: how many messages of its learner have come; those that answer an older
            observation do not put a repetition off, but show that the learner is alive.
        is_held: whether it must not be published now, as in a paused world.
        """
        if step != self._step or is_held:
            self._since, self._pause, self._next = now, FIRST_PAUSE, now + FIRST_PAUSE
        elif learner_messages != self._learner_messages:
            self._since, self._pause = now, FIRST_PAUSE
            self._next = min(self._next, now + FIRST_PAUSE)
        self._step, self._learner_messages = step, learner_messages
        return now >= self._next

    def silence(self, now: float) -> float:
        """Return for how many seconds its learner has been silent."""
        return now - self._since

    def repeated(self, now: float, is_released: bool) -> None:
        """Note that it was published again. is_released: from now on any learner may answer it."""
        self._pause = FIRST_PAUSE if is_released else min(2.0 * self._pause, LONGEST_PAUSE)
        self._next = now + self._pause
