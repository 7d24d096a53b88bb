# SPDX-License-Identifier: Apache-2.0
"""A map with its mentor as an environment of Gymnasium, for learners of other libraries."""

from typing import Any

from gymnasium import Env
from gymnasium.spaces import Discrete
import numpy as np

from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.terminal.ansi_map import map_lines
from comply_ros.world.mdp import next_state, World

Information = dict[str, Any]
NO_STATE = -1  # before the first reset


class MapEnvironment(Env[np.int64, np.int64]):
    """
    The world of a map. Observations are its states, actions are numbered as in `World`.

    `info['advice']` is the mentor's action in the state, -1 for none; `info['action_mask'][a]`
    (int8) is 1 if the state has action a. An action that it does not have leaves the state as it
    is, and earns the reward of a step in a grid and 0 elsewhere.

    Parameters
    ----------
    map_name: of the package, or path of a file, as in `read_map`.
    profile: rewards of a map, as in `read_map`.
    mentor: as the option `--mentor` of `train`.
    mentor_seed: which one of the mentors of this kind.
    render_mode: `ansi`, for text with the robot `@` on the map, or None.

    Raises
    ------
    MapError, MentorError, PolicyError: for a map or mentor that does not exist.

    """

    metadata = {'render_modes': ['ansi']}

    def __init__(self, map_name: str = 'maze', profile: str = 'published', mentor: str = 'none',
                 mentor_seed: int = 0, render_mode: str | None = None) -> None:
        if render_mode not in (None, 'ansi'):
            raise ValueError(f'render_mode must be ansi or None, got {render_mode!r}')
        self.render_mode = render_mode
        self.world = World(read_map(map_name, profile))
        self.policy = mentor_policy(read_mentor_spec(mentor), self.world, mentor_seed)
        self.step_limit = self.world.step_limit
        self.observation_space = Discrete(self.world.n_states)
        self.action_space = Discrete(self.world.n_actions)
        self._arrays = self.world.arrays()
        self._state, self._step_count = NO_STATE, -1

    def reset(self, *, seed: int | None = None,
              options: Information | None = None) -> tuple[np.int64, Information]:
        """Start an episode; return its first state and the information on it."""
        super().reset(seed=seed)
        self._step_count = 0
        _, self._state, _, _ = next_state(-1, 0, 0, self.np_random.random(), self._arrays)
        return np.int64(self._state), self._information()

    def step(self, action: np.int64) -> tuple[np.int64, float, bool, bool, Information]:
        """Take an action; return state, reward, whether it ends there or is cut, information."""
        if self._step_count < 0:
            raise RuntimeError('an environment must be reset before its first step')
        if isinstance(action, bool) or not self.action_space.contains(action):
            raise ValueError(f'an action must lie in [0, {self.world.n_actions - 1}], '
                             f'got {action!r}')
        u, s, step = self.np_random.random(), self._state, self._step_count
        if self.world.available[s, action]:
            reward, self._state, terminated, over = next_state(
                step, s, int(action), u, self._arrays)
        else:
            reward = self.world.grid.step_reward if self.world.model == 'grid' else 0.0
            terminated, over = False, step + 1 == self.world.step_limit
        self._step_count = step + 1
        return (np.int64(self._state), float(reward), bool(terminated),
                bool(over and not terminated), self._information())

    def render(self) -> str | None:
        """Return the map with the robot as text; of a world without a grid, its state."""
        if self.render_mode is None:
            return None
        if self.world.model != 'grid':
            return f'state {self._state}'
        grid = self.world.grid
        return '\n'.join(map_lines(grid, self.policy, None, self._state, None,
                                   2 * grid.width, grid.height, has_color=False))

    def _information(self) -> Information:
        return {'advice': int(self.policy[self._state]),
                'action_mask': self.world.available[self._state].astype(np.int8)}
