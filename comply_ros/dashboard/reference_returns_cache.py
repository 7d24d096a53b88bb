# SPDX-License-Identifier: Apache-2.0
"""Expected returns of the optimal policy and of the mentor, computed in the background."""

from concurrent.futures import Future
import time

import numpy as np
from numpy.typing import NDArray

from comply_ros.nodes.background_thread import in_background
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import ReferenceReturns

REST = 0.5  # seconds between two computations, so that painting does not keep a core busy


class ReferenceReturnsCache:
    """
    The expected returns of the optimal policy and of the mentor's policy, once computed.

    One computation at a time: while a policy is painted, only some versions are evaluated.
    """

    def __init__(self) -> None:
        self._world: World | None = None
        self._reference: ReferenceReturns | None = None
        self._policy: NDArray[np.int8] | None = None  # that `_mentor_return` belongs to
        self._mentor_return: float | None = None
        self._running: tuple[World, NDArray[np.int8] | None, Future] | None = None
        self._not_before = 0.0  # when the next computation may begin, by the steady clock

    def get(self, world: World | None,
            policy: NDArray[np.int8] | None) -> tuple[float | None, float | None]:
        """Return the (optimal, mentor's) expected return from the starts; None while unknown."""
        self._take_result()
        if world is not self._world:
            self._world, self._reference = world, None
            self._policy, self._mentor_return, self._not_before = None, None, 0.0
        if self._running is None and world is not None and time.monotonic() >= self._not_before:
            self._compute_missing(world, policy)
        optimal_return = self._reference.optimal_return if self._reference else None
        return optimal_return, self._mentor_return

    def _compute_missing(self, world: World, policy: NDArray[np.int8] | None) -> None:
        """Start to compute what is unknown, if anything is."""
        if self._reference is None:
            self._running = world, None, in_background(ReferenceReturns, world)
        elif policy is self._policy:
            return
        elif policy is not None and (policy != NO_ACTION).any():
            self._running = world, policy, in_background(self._reference.return_of, policy)
        else:
            self._policy, self._mentor_return = policy, None

    def _take_result(self) -> None:
        """Take the result of a finished computation, unless the world has changed since."""
        if self._running is None or not self._running[2].done():
            return
        world, policy, future = self._running
        self._running, self._not_before = None, time.monotonic() + REST
        if world is not self._world:
            return
        if policy is not None:
            self._policy, self._mentor_return = policy, future.result()
        elif future.exception():  # the values of this world do not converge: no references
            self._not_before = float('inf')
        else:
            self._reference, self._not_before = future.result(), 0.0
