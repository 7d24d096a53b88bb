# SPDX-License-Identifier: Apache-2.0
"""An environment of Gymnasium that moves a world: it is reset and stepped instead of a model."""

from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.storage.gymnasium_table import close_environment, one_line, RGB_ARRAY
from comply_ros.storage.state_numbers import StateNumbers
from comply_ros.storage.text_and_yaml_files import shown
from comply_ros.world.state_action_spaces import Spaces
from comply_ros.world.transition_table import Table


class EnvironmentFault(RuntimeError):
    """An environment raised an exception while it was used; the message says which and when."""

    exit_code = 1


class PictureError(RuntimeError):
    """An environment that gives no picture; the message names it and what it gave instead."""


class EnvironmentMoves:
    """
    Moves a world by an environment. Its random numbers are seeded anew in each episode.

    So a node that was killed comes back by repeating the actions of one episode.

    Parameters
    ----------
    env: the environment.
    name: of it, for messages.
    source: the world that it is, see `EnvironmentWorld`.
    numbers: of its observations.
    seed: of all its episodes.

    Attributes
    ----------
    used: number of first states and steps so far.

    """

    def __init__(self, env: Any, name: str, source: Table | Spaces, numbers: StateNumbers,
                 seed: int) -> None:
        self._env, self._name, self._source, self._numbers = env, name, source, numbers
        self._seed, self.used = seed, 0
        self._episode, self._actions = 0, list[int]()

    def start(self, episode: int) -> int:
        """Reset the environment with a seed of its own for this episode."""
        self.used += 1
        self._episode, self._actions = episode, []
        return self._reset()

    def move(self, step: int, s: int, action: int) -> tuple[float, int, bool, bool]:
        """Take a step in the environment; the episode is also cut off at the world's limit."""
        self.used += 1
        self._actions.append(action)
        s2, reward, terminated, truncated = self._step(action)
        at_limit = step + 1 == self._source.step_limit
        if isinstance(self._source, Table):
            s2 = self._state_in_table(s, action, s2, terminated)
            truncated = truncated and at_limit
        return reward, s2, terminated, not terminated and (truncated or at_limit)

    def _state_in_table(self, s: int, action: int, s2: int, terminated: bool) -> int:
        """Return a successor as the table numbers it: an end may have a state of its own."""
        table = self._source
        assert isinstance(table, Table)
        if terminated and not table.terminal[s2]:
            s2 = table.n_states - 1
        pair = s * len(table.actions) + action
        if terminated != table.terminal[s2] or s2 not in table.successor[
                table.first[pair]:table.first[pair + 1]]:
            raise EnvironmentFault(
                f'environment {self._name!r} moved from state {s} to {s2} by action {action}, '
                'which its table P does not have: set use_table to false')
        return s2

    def restart(self) -> None:
        """Begin again with the first episode."""
        self.used = 0

    def close(self) -> None:
        """Close the environment, which is not used any more."""
        close_environment(self._env)

    def state_dict(self) -> dict[str, Any]:
        """Return the episode and its actions."""
        return {'observations': self.used, 'environment_episode': self._episode,
                'environment_actions': list(self._actions)}

    def load_state_dict(self, values: dict[str, Any]) -> None:
        """Repeat the actions of an episode."""
        self.used, self._episode = values['observations'], values['environment_episode']
        self._actions = list(values['environment_actions'])
        self._reset()
        for action in self._actions:
            self._step(action)

    @property
    def gives_pictures(self) -> bool:
        """Whether the environment was made so that it gives pictures."""
        return self._env.render_mode == RGB_ARRAY

    def picture(self) -> NDArray[np.uint8]:
        """
        Return `picture[row, column, colour]` of the environment as it is now.

        Raises
        ------
        PictureError: if it gives none.

        """
        try:
            picture = np.asarray(self._env.render())
        except Exception as error:  # noqa: BLE001 - its author raises what they like
            raise PictureError(f'environment {self._name!r} gives no pictures: '
                               + one_line(error)) from error
        if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3 \
                or not picture.size:
            raise PictureError(f'a picture of environment {self._name!r} must be of uint8 and the '
                               f'shape (height, width, 3), got {picture.dtype} of shape '
                               f'{picture.shape}')
        return picture

    def _reset(self) -> int:
        words = np.random.SeedSequence((self._seed, self._episode)).generate_state(1)
        try:
            observation, _ = self._env.reset(seed=int(words[0]))
            return self._number(observation)
        except Exception as error:  # noqa: BLE001 - its author raises what they like
            raise self._fault(error) from error

    def _step(self, action: int) -> tuple[int, float, bool, bool]:
        try:
            observation, reward, terminated, truncated, _ = self._env.step(
                action + int(self._env.action_space.start))
            if not isfinite(reward):
                raise ValueError(f'a reward must be a finite number, got {reward!r}')
            return self._number(observation), float(reward), bool(terminated), bool(truncated)
        except Exception as error:  # noqa: BLE001 - its author raises what they like
            raise self._fault(error) from error

    def _number(self, observation: Any) -> int:
        s = self._numbers.number(observation)
        if not 0 <= s < self._numbers.count:
            raise ValueError(f'an observation must lie in its space, got {shown(observation)}')
        return s

    def _fault(self, error: Exception) -> EnvironmentFault:
        return EnvironmentFault(
            f'environment {self._name!r} raised {type(error).__name__} in episode '
            f'{self._episode}, step {len(self._actions)}: {one_line(error)}')
