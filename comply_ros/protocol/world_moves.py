# SPDX-License-Identifier: Apache-2.0
"""How a world moves: by its model and its random numbers, or by a function that is given."""

from typing import Any, Protocol

import numpy as np

from comply_ros.numerics.jit import plain_fields, plain_view
from comply_ros.numerics.rng import random_streams, UniformRows
from comply_ros.world.grid import MapError
from comply_ros.world.mdp import drawn_outcome, first_state, taken_action, World, WorldArrays


class Moves(Protocol):
    """
    Starts episodes and takes steps; the same seed gives the same ones.

    used: number of first states and steps so far.
    """

    used: int

    def start(self, episode: int) -> int:
        """Start an episode, counted from 1; return its first state."""
        ...

    def move(self, step: int, s: int, action: int) -> tuple[float, int, bool, bool]:
        """
        Return reward, next state, and whether the episode ends there, or is cut off there.

        step: of the episode, from 0, in which the action is taken in state s.
        """
        ...

    def restart(self) -> None:
        """Begin again as at a fresh start, with the first episode."""
        ...

    def state_dict(self) -> dict[str, Any]:
        """Return what is needed to continue later, as values for JSON."""
        ...

    def load_state_dict(self, values: dict[str, Any]) -> None:
        """Continue from there."""
        ...


class ModelMoves:
    """
    Moves by the model of a world, `next_state`.

    Raises
    ------
    MapError: for a world without a model.

    """

    def __init__(self, world: World, seed: int) -> None:
        if world.model == 'none':
            raise MapError('a world that moves by actions must have a model, got one without')
        views: list[Any] = [plain_view(each) if isinstance(each, np.ndarray) else each
                            for each in world.arrays()]
        self._arrays, self._seed = plain_fields(WorldArrays(*views)), seed
        self._is_grid = world.model == 'grid'
        self.restart()

    @property
    def used(self) -> int:
        """Number of first states and steps so far."""
        return self._draws.used

    def restart(self) -> None:
        """Begin again with the first random number."""
        self._draws = UniformRows(random_streams(self._seed)[0], 1)

    def start(self, episode: int) -> int:
        """Return a first state."""
        u, = self._draws.row()
        return first_state(u, self._arrays.starts)

    def move(self, step: int, s: int, action: int) -> tuple[float, int, bool, bool]:
        """Return reward, next state, whether it is terminal, and whether that is the limit."""
        world = self._arrays
        u, = self._draws.row()
        if self._is_grid:
            taken = taken_action(s, action, u, world.intended, world.slips)
            reward, s2 = world.reward[s, taken], world.successor[s, taken]
        else:
            k = drawn_outcome(s, action, u, world.first, world.probability, world.actions)
            reward, s2 = world.outcome_reward[k], world.outcome[k]
        done = world.terminal[s2]
        return reward, s2, done, not done and step + 1 == world.step_limit

    def state_dict(self) -> dict[str, Any]:
        """Return the number of random numbers used."""
        return {'observations': self._draws.used}

    def load_state_dict(self, values: dict[str, Any]) -> None:
        """Continue after that number."""
        self.restart()
        self._draws.skip_to(values['observations'])
