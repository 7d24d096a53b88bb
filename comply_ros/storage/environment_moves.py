# SPDX-License-Identifier: Apache-2.0
"""An environment of Gymnasium that moves a world: its observations are numbered as states."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from math import isfinite, prod
from typing import Any

import numpy as np

from comply_ros.storage.gymnasium_worlds import one_line, step_limit_of, table_of_environment
from comply_ros.storage.user_files import shown
from comply_ros.world.grid import MapError
from comply_ros.world.spaces import Spaces
from comply_ros.world.table import MOST_STATES, Table

Limits = Sequence[tuple[float, float]]


class EnvironmentFault(RuntimeError):
    """An environment raised an exception while it was used; the message says which and when."""

    exit_code = 1


class StateNumbers:
    """
    Numbers the observations of an environment from 0.

    Parameters
    ----------
    space: Discrete, MultiDiscrete, Box, or a Tuple of such spaces.
    bins: of a Box: number of intervals in each dimension; one number is for all of them.
    limits: of a Box: (low, high) of each dimension; none: those of the space. Values beyond
        belong to the first or last interval.

    Raises
    ------
    MapError: for another space, or bins and limits that do not fit it.

    Attributes
    ----------
    count: number of states.

    """

    def __init__(self, space: Any, bins: Sequence[int] = (20,), limits: Limits = ()) -> None:
        kind = type(space).__name__
        if kind == 'Discrete':
            self._use(int(space.n), lambda seen: int(seen) - int(space.start))
        elif kind == 'MultiDiscrete':
            self._use_products([int(n) for n in np.ravel(space.nvec)],
                               lambda seen: (np.ravel(seen) - np.ravel(space.start)).tolist())
        elif kind == 'Tuple':
            parts = [StateNumbers(each, bins, limits) for each in space.spaces]
            self._use_products(
                [each.count for each in parts],
                lambda seen: [part.number(each) for part, each in zip(parts, seen, strict=True)])
        elif kind == 'Box':
            self._use_box(space, bins, limits)
        else:
            raise MapError('the observation space must be Discrete, MultiDiscrete, Box or a Tuple '
                           f'of such spaces, got {shown(space)}')

    def number(self, observation: Any) -> int:
        """Return the number of the state that an observation belongs to."""
        return self._number(observation)

    def _use(self, count: int, number: Callable[[Any], int]) -> None:
        if not 1 <= count <= MOST_STATES:
            raise MapError(f'the observation space must have 1 to {MOST_STATES} states, got '
                           + (f'{count}' if count < 10 ** 30 else 'far more')
                           + ': give fewer bins')
        self.count, self._number = count, number

    def _use_products(self, sizes: Sequence[int], digits: Callable[[Any], list[int]]) -> None:
        """Give every tuple of digits a number, the last digit fastest."""
        def number(observation: Any) -> int:
            total = 0
            for size, digit in zip(sizes, digits(observation), strict=True):
                total = total * size + digit
            return total
        self._use(prod(sizes), number)

    def _use_box(self, space: Any, bins: Sequence[int], limits: Limits) -> None:
        count = prod(space.shape)
        limits = limits or list(zip(np.ravel(space.low).tolist(), np.ravel(space.high).tolist()))
        sizes = list(bins) * (count if len(bins) == 1 else 1)
        for name, given in (('bins', sizes), ('limits', limits)):
            if len(given) != count:
                raise MapError(f'{name} must have one element for each of the {count} dimensions '
                               f'of the observation space, got {len(given)}')
        for k, (low, high) in enumerate(limits):
            if not (np.isfinite(low) and np.isfinite(high) and low < high):
                raise MapError('the observation space needs finite limits with the lower one '
                               f'first, got {low:g} to {high:g} in dimension {k}: give limits')
        if min(sizes) < 1:
            raise MapError(f'bins must be at least 1, got {min(sizes)}')
        low, high = np.array(limits).T
        scale, last = np.array(sizes) / (high - low), np.array(sizes) - 1

        def digits(observation: Any) -> list[int]:
            places = np.floor((np.ravel(observation) - low) * scale)
            if np.isnan(places).any():
                return [-1] * len(sizes)
            return np.clip(places, 0, last).astype(int).tolist()
        self._use_products(sizes, digits)


class EnvironmentMoves:
    """
    Moves a world by an environment. Its random numbers are seeded anew in each episode.

    So a node that was killed comes back by repeating the actions of one episode.

    Parameters
    ----------
    env: the environment.
    name: of it, for messages.
    source: the world that it is, see `environment_source`.
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


def environment_source(env: Any, numbers: StateNumbers,
                       use_table: bool = True) -> Table | Spaces:
    """
    Return the world that an environment is: with a table where it has one, else without a model.

    use_table: whether its table is used. One that is no map for `gymnasium_table` is not.

    Raises
    ------
    MapError: for actions that are not Discrete.

    """
    space = env.action_space
    if type(space).__name__ != 'Discrete':
        raise MapError(f'the action space must be Discrete, got {shown(space)}')
    if use_table:
        with suppress(MapError):
            return table_of_environment(env)
    return Spaces(numbers.count, tuple(map(str, range(int(space.n)))),
                  step_limit_of(env, numbers.count))
