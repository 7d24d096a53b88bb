# SPDX-License-Identifier: Apache-2.0
"""The advice of all mentors of a learner, and whom it waits for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.protocol.advice_buffer import AdviceBuffer
from comply_ros.protocol.messages import Outputs, Recommendation, step_id, StepId
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


class MentorAdvice:
    """
    An `AdviceBuffer` for each mentor, in their order.

    Parameters
    ----------
    names: of the mentors.
    run, newest: as `AdviceBuffer` takes them.

    Attributes
    ----------
    names: as given, and those that joined.
    absent: places of mentors that did not answer in time, and are not waited for until they do.
    silence: the advice of nobody.

    """

    def __init__(self, names: Sequence[str], run: int | None = None,
                 newest: StepId = (0, -1)) -> None:
        self.names = tuple(names)
        self.absent: set[int] = set()
        self._run, self._newest = run, newest
        self._buffers = [AdviceBuffer(run, newest) for _ in names]
        self._complete: dict[int, tuple[int, ...]] = {}  # by state, as far as it was asked for
        self.silence = len(self.names) * (NO_ACTION,)

    def add_mentor(self, name: str) -> None:
        """Wait for the advice of one mentor more from now on."""
        self.names, self.silence = (*self.names, name), (*self.silence, NO_ACTION)
        self._buffers.append(AdviceBuffer(self._run, self._newest))
        self._complete.clear()

    def forget(self) -> None:
        """Forget all advice; the observations stay known."""
        self._complete.clear()
        for buffer in self._buffers:
            buffer.forget()

    def add_observation(self, step: StepId, state: int) -> list[tuple[int, Recommendation]]:
        """Remember an observation; return what came before it, with the place of its mentor."""
        self._newest = step
        early = []
        for m, buffer in enumerate(self._buffers):
            msg = buffer.add_observation(step, state)
            if msg is not None:
                early.append((m, msg))
        return early

    def newest_advice(self, m: int, state: int) -> Recommendation | None:
        """Return the newest advice of mentor m in a state, None if there is none."""
        return self._buffers[m].newest_advice(state)

    def complete_advice(self, state: int, step: StepId | None) -> tuple[int, ...] | None:
        """
        Return the advice of each mentor in a state, or None where one is waited for.

        step: of the observation, for which advice of an earlier one does not count; None where it
            does.
        """
        complete = self._complete.get(state) if step is None else None
        if complete is not None:
            return complete
        advice = self.available_advice(state, step)
        if {m for m, action in enumerate(advice) if action is None} - self.absent:
            return None
        complete = tuple(NO_ACTION if each is None else each for each in advice)
        if step is None:
            self._complete[state] = complete
        return complete

    def available_advice(self, state: int, step: StepId | None) -> list[int | None]:
        """Return the advice of each mentor in a state that is there, None where there is none."""
        known = [buffer.newest_advice(state) for buffer in self._buffers]
        return [None if msg is None or step is not None and step_id(msg) != step else msg.action
                for msg in known]

    def add_same_advice(self, m: int, msg: Recommendation) -> bool:
        """Remember advice of mentor m if it is the newest one of its state once more."""
        return m not in self.absent and self._buffers[m].add_same_advice(msg)

    def add_advice(self, m: int, msg: Recommendation, world: World) -> tuple[bool, Outputs]:
        """Return whether advice of mentor m counts, and why not."""
        if m in self.absent:
            self.absent.remove(m)
            self._complete.clear()
        self._complete.pop(msg.state, None)
        return self._buffers[m].add_advice(msg, world)

    def restore_advice(self, m: int, msg: Recommendation) -> None:
        """Remember advice from a journal, which counted when it was received."""
        self._buffers[m].restore_advice(msg)
        self._complete.clear()

    def advice(self, before: NDArray[Any]) -> NDArray[Any]:
        """Return `advice[m * n_states + s]`: the newest action, where there is none as before."""
        rows = before.reshape(len(self._buffers), -1)
        return np.concatenate([buffer.advice(row) for buffer, row in zip(self._buffers, rows)])

    def arrays(self) -> dict[str, NDArray[np.int64]]:
        """Return, for each mentor, state, episode, step and action of every newest advice."""
        return {_array_name(m): buffer.array() for m, buffer in enumerate(self._buffers)}

    def load_arrays(self, arrays: dict[str, NDArray[np.int64]]) -> None:
        """Take over the advice that `arrays` returned."""
        for m, buffer in enumerate(self._buffers):
            buffer.load_array(arrays[_array_name(m)])
        self._complete.clear()


def _array_name(m: int) -> str:
    return f'advice_{m}' if m else 'advice'
